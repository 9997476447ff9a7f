"""What the studies share: the command line, the bar, and one order of work."""

import argparse
import sys
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

import numpy as np
import pandas as pd
from rich.console import Console

from nlpweld.bench.engines import Local
from nlpweld.bench.progress import StudyProgress
from nlpweld.bench.run import run
from nlpweld.bench.study import load_study
from nlpweld.errors import NlpweldError
from nlpweld.records.model import Record
from nlpweld.report.markup import markdown
from nlpweld.report.tables import format_summary

STUDIES = Path(__file__).parent / "studies"
Step = tuple[str, Callable[[], object]]
Study = Callable[[argparse.Namespace, Console], pd.DataFrame]


def solved(study: str, folder: Path, workers: int, watch: StudyProgress) -> list[Record]:
    """Run what the folder of a study does not hold yet and return all its records."""
    return run(load_study(STUDIES / f"{study}.toml"), folder, Local(workers), watch)


def work(steps: Iterable[Step], watch: StudyProgress, name: str) -> None:
    """Take steps one after the other, with a bar of their own."""
    todo = list(steps)
    bar = watch.bar.add_task(name, total=len(todo))
    for what, do in todo:
        watch.bar.update(bar, description=what)
        do()
        watch.bar.advance(bar)
    watch.bar.update(bar, description=name)


def rounded(table: pd.DataFrame, digits: Mapping[str, int]) -> str:
    """Return a table in Markdown, numbers of the named columns with so many digits, blank where there is none."""
    shown = table.astype(object).where(table.notna(), "")
    for name, places in digits.items():
        shown[name] = [f"{v:z.{places}f}" if np.isfinite(v) else "" for v in table[name].astype(float)]
    return markdown(shown)


def arguments(doc: str, out: str) -> argparse.ArgumentParser:
    """Return a parser with the options that every study has."""
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path(out), help="folder of the study")
    return parser


def told(parser: argparse.ArgumentParser, study: Callable[[argparse.Namespace, Console], str]) -> int:
    """Run a study and print what it returns: 0 when done, 2 when it cannot be."""
    options, console = parser.parse_args(), Console(stderr=True)
    try:
        print(study(options, console))
    except NlpweldError as error:
        console.print(f"error: {error}", markup=False, highlight=False)
        return 2
    return 0


def main(study: Study, doc: str, out: str) -> int:
    """Run a study from the command line: 0 when done, 2 when it cannot be."""
    parser = arguments(doc, out)
    parser.add_argument("--workers", type=int, default=2, help="runs at once")
    parser.add_argument("--quick", action="store_true", help="few seeds, coarse grids: to see that it works")
    parser.add_argument("--no-figures", action="store_true", help="stop after data and tables")
    options = parser.parse_args()
    console = Console(width=None if sys.stdout.isatty() else 100)
    try:
        table = study(options, console)
    except NlpweldError as error:
        print(error, file=sys.stderr)
        return 2
    console.print(format_summary(table, console.width))
    console.print(f"tables, figures, plans and records: {options.out}")
    return 0
