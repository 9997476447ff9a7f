"""Stored records as data frames: one row a run, one row a step of a trace, one row an answer held on the way."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from nlpweld.errors import OptionError, OutputError
from nlpweld.records.files import read_record, record_files
from nlpweld.records.model import Record

AXES = ("x_m", "y_m", "z_m")
HEAD = ("cell", "formulation", "solver", "preset", "seed")
PLAIN = (*HEAD, "status", "message")
NUMBERS = ("claimed_objective", "evaluations", "build_s", "solve_s", "wall_s", "variables")
MEASURES = (
    "mmr_mean", "mmr_min", "mmr_max", "mmr_min_along", "m_tight_mean", "m_loose_mean",
    "clearance_m", "joint_margin_rad", "joint_step_rad", "closure_m", "closure_rad",
)  # fmt: skip
PER_ROBOT = ("manipulability_mean", "manipulability_min", "singularity_min")
DECISIVE = ("cell_hash", "options", "budget")  # runs that differ in one of these do not belong in one row of a table


def study_records(folder: str | Path, traces: bool = True) -> list[tuple[Path, Record]]:
    """Return the files and records of a study, with their traces or, sooner, without.

    Raises:
        OptionError: the folder holds no records.
        OutputError: a record is broken, of another version, or was made under other terms than its neighbours.
    """
    folder = Path(folder)
    records = [(path, read_record(path, traces)) for path in record_files(folder)]
    if not records:
        raise OptionError(f"{folder}: holds no records; make some with 'nlpweld compare CELL --out {folder}'")
    _refuse_mixture(records)
    return records


def runs_frame(records: Iterable[Record], **columns: list[Any]) -> pd.DataFrame:
    """Return one row a run, sorted by cell, formulation, solver, preset and seed; further columns go with the records.

    ``verified`` is the verifier's word; ``claimed`` says whether the solver called itself done. Lengths are in m,
    angles in rad, times in s, manipulability of a robot in m^3 (columns like ``singularity_min_welder_m3``).
    ``spent_s`` is the time of build and solve, or of the whole process where they are not known, ``limit_s`` its limit.
    """
    table = pd.DataFrame([row(record) for record in records]).assign(**columns)
    return table.sort_values(list(HEAD), kind="stable").reset_index(drop=True)


def traces_frame(records: Iterable[Record]) -> pd.DataFrame:
    """Return every step of every run: time_s, evaluations, best, mean, spread_m and the point x_m, y_m, z_m.

    ``step`` counts from 1; ``best`` is NaN until a run has a feasible point.
    """
    parts = [_trace(record) for record in records if record.trace.time_s]
    columns = [*HEAD, "verified", "step", "time_s", "evaluations", "best", "mean", "spread_m", *AXES]
    return pd.concat(parts, ignore_index=True)[columns] if parts else pd.DataFrame(columns=columns)


def answers_frame(records: Iterable[Record]) -> pd.DataFrame:
    """Return every answer a run held and the verifier confirmed: time_s, evaluations, objective."""
    rows = [
        (*(getattr(record, name) for name in HEAD), held.time_s, held.evaluations, held.objective)
        for record in records
        for held in record.answers
        if held.verified
    ]
    return pd.DataFrame(rows, columns=[*HEAD, "time_s", "evaluations", "objective"])


def contestants(table: pd.DataFrame) -> pd.Series:
    """Return what the solver of each row is called: its name, and its preset where that is not the default."""
    preset = table["preset"].where(table["preset"] != "default", "")
    return table["solver"] + preset.map(lambda name: f":{name}" if name else "")


def row(record: Record) -> dict[str, Any]:
    """Return a run as one flat row; see :func:`runs_frame`."""
    numbers = {name: _number(getattr(record, name)) for name in NUMBERS}
    known = record.build_s is not None and record.solve_s is not None
    numbers["spent_s"] = numbers["build_s"] + numbers["solve_s"] if known else numbers["wall_s"]
    numbers["limit_s"] = _number(record.budget.time_s)
    placement = record.placement or {}
    place = {name: _number(placement.get(name)) for name in AXES} | {k: _number(v) for k, v in placement.items()}
    place |= {f"{robot}.{axis}": value for robot, at in record.layout.items() for axis, value in at.items()}
    head = {name: getattr(record, name) for name in PLAIN}
    told = {"claimed": record.status == "SOLVED", "verified": verified(record)}
    return head | told | numbers | place | report_row(record.report)


def verified(record: Record) -> bool:
    """Return the verifier's word, which needs a report that agrees."""
    return record.verified and (record.report or {}).get("feasible") is True


def report_row(report: dict[str, Any] | None) -> dict[str, Any]:
    """Return a report's numbers in one flat row."""
    report = report or {}
    flat: dict[str, Any] = {"feasible": report.get("feasible") is True, "reading": report.get("reading")}
    flat |= {"over_seam": report.get("over_seam", "mean"), "exponent": _number(report.get("exponent"))}
    flat["objective"] = _number(report.get("objective", report.get("mmr_mean")))  # older reports know the mean alone
    flat |= {name: _number(report.get(name)) for name in MEASURES}
    for name in PER_ROBOT:
        flat |= {f"{name}_{robot}_m3": _number(value) for robot, value in (report.get(name) or {}).items()}
    first = next(iter(report.get("violations") or []), None)
    flat["violated"] = " ".join(str(first[k]) for k in ("constraint", "robot") if first[k]) if first else ""
    return flat


def _trace(record: Record) -> pd.DataFrame:
    trace, steps = record.trace, len(record.trace.time_s)
    place = {name: np.array(trace.placement.get(name, [np.nan] * steps)) for name in AXES}
    columns = {name: np.array(getattr(trace, name), dtype=float) for name in ("time_s", "best", "mean")}
    columns |= {"evaluations": np.array(trace.evaluations), "spread_m": np.array(trace.spread, dtype=float), **place}
    head = {name: getattr(record, name) for name in HEAD} | {"verified": verified(record)}
    return pd.DataFrame({**columns, "step": np.arange(1, steps + 1)}).assign(**head)


def _refuse_mixture(records: list[tuple[Path, Record]]) -> None:
    """Refuse runs that would share a row of the table although they answered different questions.

    Raises:
        OutputError: names the record that differs from its neighbours.
    """
    first: dict[tuple[str, str], tuple[Path, Any]] = {}
    for path, record in records:
        group = "/".join(str(getattr(record, name)) for name in HEAD[:4])
        for name in DECISIVE:
            where = (record.cell, name) if name == "cell_hash" else (group, name)
            known, value = first.setdefault(where, (path, getattr(record, name)))
            if value != getattr(record, name):
                raise OutputError(f"{path}: {name}: differs from {known.name} of {group}; remove one and run again")


def _number(value: Any) -> float:
    return float(value) if isinstance(value, int | float) else float(np.nan)
