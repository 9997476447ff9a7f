"""The folder of a study: one JSON record per task, written whole or not at all, skipped when its key matches."""

import json
from pathlib import Path
from typing import Any

from nlpweld.bench.task import RECORD_VERSION, Task
from nlpweld.errors import OutputError
from nlpweld.plan import write_text


def record_path(folder: Path, task: Task) -> Path:
    """Return where the record of a task lives."""
    return folder / "records" / f"{task.place}.json"


def known_record(folder: Path, task: Task) -> dict[str, Any] | None:
    """Return the stored record of this very task, or None when there is none with its key."""
    path = record_path(folder, task)
    if not path.is_file():
        return None
    try:
        record = json.loads(path.read_text(encoding="utf-8"))
    except ValueError:
        return None
    same = isinstance(record, dict) and record.get("key") == task.key and record.get("version") == RECORD_VERSION
    return record if same and record.get("status") != "FAILED" else None


def write_record(folder: Path, task: Task, record: dict[str, Any]) -> Path:
    """Write the record of a task.

    Raises:
        OutputError: the file cannot be written.
    """
    return write_text(record_path(folder, task), json.dumps(record, indent=1) + "\n")


def ready(folder: Path) -> None:
    """Make sure that records can be written below a folder.

    Raises:
        OutputError: they cannot; says why.
    """
    probe = folder / "records" / ".probe"
    write_text(probe, "")
    try:
        probe.unlink()
    except OSError as error:
        raise OutputError(f"{folder}: cannot be written ({error.strerror}); choose another --out") from None
