"""The command that asks the verifier about a plan."""

import json as json_
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from nlpweld.cli.ask import busy
from nlpweld.errors import OptionError
from nlpweld.plan import load_plan


def verify(path: Path, json: bool, robust: bool = False, samples: int | None = None) -> int:
    """Print the report of a plan file, and that of its timeline where it is timed; 0 when all is feasible, 1 when not.

    Raises:
        PlanError: the file is no plan.
        MotionError: the plan is timed, but its cell has nothing to hold that against.
        OptionError: samples are asked for without errors, or the plan's cell states none.
    """
    from nlpweld.verify.check import verify as verify_
    from nlpweld.verify.robust import SAMPLES, verify_robust
    from nlpweld.verify.timing import verify_timing

    if samples is not None and not robust:
        raise OptionError("--samples: only errors of the set-up are sampled; add --robust")
    plan = load_plan(path)
    if robust:
        with progress_bar(quiet=json) as bar:
            job = bar.add_task("scenarios", total=None)

            def told(done: int, count: int) -> None:
                bar.update(job, completed=done, total=count)

            report = verify_robust(plan, SAMPLES if samples is None else samples, told=told)
    else:
        with busy("verifying", quiet=json):
            report = verify_(plan)
    timing = None
    if plan.timeline is not None:
        with busy("verifying the timeline", quiet=json):
            timing = verify_timing(plan)
    feasible = report.feasible and (timing is None or timing.feasible)
    if json:
        timed = {} if timing is None else {"timing": timing.to_json()}
        print(json_.dumps({**report.to_json(), **timed, "feasible": feasible}))
    else:
        print(report if timing is None else f"{report}\n{timing}")
    return 0 if feasible else 1


def progress_bar(quiet: bool = False) -> Progress:
    """Return a bar with count and times, on standard error."""
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
    return Progress(*columns, TimeElapsedColumn(), TimeRemainingColumn(), console=Console(stderr=True, quiet=quiet))
