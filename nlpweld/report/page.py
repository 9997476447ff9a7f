"""A study as one page that opens from a file: tables, figures, terms, and what was claimed but not verified."""

import base64
import json
from collections.abc import Callable, Iterable
from importlib import resources
from pathlib import Path
from typing import Any

import pandas as pd
from jinja2 import Environment, StrictUndefined

from nlpweld.plan import write_text
from nlpweld.records.model import Record
from nlpweld.report import tables
from nlpweld.report.plots import write_plots
from nlpweld.report.records import load_reference
from nlpweld.report.statistics import SHIFT_S, as_text
from nlpweld.report.study import Study

PAGE = "report.html"


def write_page(folder: str | Path, note: Callable[[str], None] | None = None) -> Path:
    """Write ``report.html`` of a study, with its figures inside, and return its path.

    Args:
        folder: the study's folder.
        note: called with one line for each figure left out, and why.

    Raises:
        OptionError: the folder holds no records.
        OutputError: stored data is broken, or the page cannot be written.
    """
    study = Study(Path(folder))
    pictures = [path for path in write_plots(folder, note) if path.suffix == ".png"]
    text = (resources.files("nlpweld.report") / "templates" / PAGE).read_text(encoding="utf-8")
    page = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True).from_string(text)
    figures = [(path.stem, base64.b64encode(path.read_bytes()).decode()) for path in pictures]
    return write_text(study.folder / PAGE, page.render(figures=figures, **facts(study)))


def facts(study: Study) -> dict[str, Any]:
    """Return what the page says, by the names its template has."""
    records = [record for _, record in study.records]
    statistics = study.statistics
    summary = tables.summary(study.runs, study.baselines, load_reference(study.folder))
    kinds = [(", ".join(problem), kind) for problem, kind in statistics.reference_kind.items()]
    return {
        "title": f"nlpweld: {study.folder.resolve().name}",
        "counts": _counts(study.runs),
        "summary": tables.as_text(summary),
        "statistics": as_text(statistics.solvers),
        "pairs": _pairs(statistics.pairs),
        "reference": kinds,
        "shift_s": SHIFT_S,
        "unverified": [_named(r) for r in records if r.status == "SOLVED" and not r.verified],
        "failures": [_named(r) for r in records if r.status == "FAILED"],
        "terms": list(terms(records)),
    }


def terms(records: list[Record]) -> Iterable[tuple[str, str]]:
    """Yield name and text of what a reader has to know of how runs were made."""
    yield "limits", _all(_limits(r) for r in records)
    yield "versions", _all(", ".join(f"{k} {v}" for k, v in r.versions.items()) for r in records)
    machines = (f"{m.system} {m.processor}, {m.cores} cores, Python {m.python}" for m in (r.machine for r in records))
    yield "machine", f"{_all(machines)}; every run in a process of its own, single-threaded"
    yield "options", _all(f"{r.solver}:{r.preset} {json.dumps(r.options, sort_keys=True)}" for r in records)
    yield "time", "build is what a solver or the exact model needs once for a cell; solve is the rest. Both count above"
    starts = "all draw their own starts from their seed; none is given another solver's answer"
    yield "warm starts", starts


def _limits(record: Record) -> str:
    limits = {"evaluations": record.budget.evaluations, "s": record.budget.time_s, "MB": record.limit_mb}
    told = [f"{value:g} {unit}" for unit, value in limits.items() if value is not None]
    return f"{record.solver}:{record.preset} {' or '.join(told) or 'none'}"


def _all(texts: Iterable[str]) -> str:
    return "; ".join(sorted(set(texts)))


def _named(record: Record) -> str:
    first = next(iter((record.report or {}).get("violations") or []), None)
    why = f"{first['constraint']} {first['robot'] or ''}".strip() if first else record.message
    return f"{record.cell}, {record.formulation}, {record.solver}:{record.preset}, seed {record.seed}: {why}"


def _counts(runs: pd.DataFrame) -> dict[str, int]:
    problems = len(runs[["cell", "formulation"]].drop_duplicates())
    status = runs["status"].value_counts()
    told = {"runs": len(runs), "problems": problems, "verified": int(runs["verified"].sum())}
    return told | {name.lower(): int(status.get(name, 0)) for name in ("SOLVED", "FAILED", "SKIPPED")}


def _pairs(pairs: pd.DataFrame) -> pd.DataFrame | None:
    if pairs.empty:
        return None
    counts = pairs[["a", "b", "pairs", "a_better", "b_better", "ties"]].astype(str)
    counts["median difference %"] = [f"{100 * d:+.4f}" if pd.notna(d) else "" for d in pairs["median_difference"]]
    for name, heading in (("p", "p"), ("p_corrected", "p corrected")):
        counts[heading] = [f"{p:.2g}" if pd.notna(p) else "" for p in pairs[name]]
    return counts
