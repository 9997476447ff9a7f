"""The child process of one task: a task as JSON on standard input, its record as JSON on standard output."""

import json
import sys

from nlpweld.bench.task import Task, run_task


def main() -> None:
    """Run the one task and print its record."""
    record = run_task(Task.from_json(json.load(sys.stdin)))
    json.dump(record, sys.stdout)


if __name__ == "__main__":
    main()
