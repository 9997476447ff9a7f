"""Commands that run studies, and make tables and figures of what they left."""

import json as json_
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console

from nlpweld.cli.ask import writable

if TYPE_CHECKING:
    import pandas as pd

    from nlpweld.bench.task import Task


def compare(
    tasks: "list[Task]",
    out: Path,
    workers: int = 1,
    scheduler: str | None = None,
    again: bool = False,
    json: bool = False,
) -> int:
    """Run tasks, keep the records, print the table; 0 when at least one answer is verified."""
    from nlpweld.bench.engines import engine_of
    from nlpweld.bench.progress import StudyProgress
    from nlpweld.bench.run import run
    from nlpweld.report.tables import write_tables

    writable(out)
    engine = engine_of(workers, scheduler)
    with StudyProgress(quiet=json) as watch:
        records = run(tasks, out, engine, watch, again)
    summary = write_tables(out)
    verified = sum(record.verified for record in records)
    if json:
        print(json_.dumps({"out": str(out), "runs": len(records), "verified": verified}))
    else:
        _print_summary(summary)
        print(f"records and tables: {out}")
    return 0 if verified else 1


def tables(folder: Path, json: bool) -> None:
    """Write and print the summary of a folder of records."""
    from nlpweld.report.tables import write_tables

    summary = write_tables(folder)
    if json:
        print(summary.to_json(orient="records"))
    else:
        _print_summary(summary)


def _print_summary(summary: "pd.DataFrame") -> None:
    from nlpweld.report.tables import format_summary

    console = Console()
    console.print(format_summary(summary, console.width))


def plots(folder: Path, json: bool) -> None:
    """Draw the figures of a folder of records."""
    from nlpweld.report.plots import write_plots

    left_out: list[str] = []
    paths = write_plots(folder, note=left_out.append)
    if json:
        print(json_.dumps({"figures": [str(path) for path in paths]}))
    else:
        print("\n".join(str(path) for path in paths))
        if left_out:
            print(f"{len(left_out)} more need data this folder does not hold, e.g. {left_out[0]}")


def report(folder: Path, json: bool) -> None:
    """Write the page of a folder of records."""
    from nlpweld.report.page import write_page

    path = write_page(folder)
    print(json_.dumps({"page": str(path)}) if json else path)
