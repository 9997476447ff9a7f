"""The stored runs of a study as data frames: one row a run, one row a step of a run's trace, one row a baseline."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from nlpweld.errors import OptionError, OutputError

FORMAT = "nlpweld-record"
VERSION = 2  # the newest version of a record that is understood here
AXES = ("x_m", "y_m", "z_m")
PLAIN = ("cell", "formulation", "solver", "preset", "seed", "status", "message")
NUMBERS = ("claimed_objective", "evaluations", "build_s", "solve_s", "wall_s")
MEASURES = (
    "mmr_mean", "mmr_min", "mmr_max", "m_tight_mean", "m_loose_mean",
    "clearance_m", "joint_margin_rad", "closure_m", "closure_rad",
)  # fmt: skip
PER_ROBOT = ("manipulability_mean", "manipulability_min", "singularity_min")
DECISIVE = ("cell_hash", "options", "budget")  # runs that differ in one of these do not belong in one row of a table


def load_records(folder: str | Path) -> pd.DataFrame:
    """Return the runs of a study, one row each, sorted by cell, formulation, solver, preset and seed.

    ``verified`` is the verifier's word; ``claimed`` says whether the solver called itself done. Lengths are in m,
    angles in rad, times in s, manipulability of a robot in m^3 (columns like ``singularity_min_welder_m3``).

    Args:
        folder: the study's folder, with ``records/`` below it.

    Raises:
        OptionError: the folder holds no records.
        OutputError: a record is broken, is newer than this nlpweld, or was made under other terms than its neighbours.
    """
    folder = Path(folder)
    paths = sorted((folder / "records").rglob("*.json"))
    if not paths:
        raise OptionError(f"{folder}: holds no records; make some with 'nlpweld compare CELL --out {folder}'")
    records = [(path, read_record(path)) for path in paths]
    _refuse_mixture(records)
    rows = [{**_row(path, record), "file": path.relative_to(folder).as_posix()} for path, record in records]
    table = pd.DataFrame(rows)
    return table.sort_values(list(PLAIN[:5])).reset_index(drop=True)


def load_traces(folder: str | Path) -> pd.DataFrame:
    """Return every step of every run: time_s, evaluations, best, mean, spread_m and the point x_m, y_m, z_m.

    ``step`` counts from 1; ``best`` is NaN until a run has a feasible point.

    Raises:
        OptionError: the folder holds no records.
        OutputError: a record is broken.
    """
    folder = Path(folder)
    rows = []
    for path in sorted((folder / "records").rglob("*.json")):
        record = read_record(path)
        head = {name: record[name] for name in PLAIN[:5]} | {"verified": _verified(record)}
        rows += [{**head, **_step(path, i, step)} for i, step in enumerate(record.get("trace") or [], start=1)]
    columns = [*PLAIN[:5], "verified", "step", "time_s", "evaluations", "best", "mean", "spread_m", *AXES]
    return pd.DataFrame(rows, columns=columns)


def load_baselines(folder: str | Path) -> pd.DataFrame:
    """Return the placements of a study that no solver found, e.g. the paper's own, one row each; may be empty.

    Raises:
        OutputError: a baseline is broken.
    """
    rows = []
    for path in sorted((Path(folder) / "baselines").glob("*.json")):
        data = read_json(path)
        try:
            at = dict(zip(AXES, map(float, data["placement"]), strict=True))
            rows.append({"name": str(data["name"]), "cell": str(data["cell"]), **at, **_report(path, data["report"])})
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise OutputError(f"{path}: not a baseline ({_what(error)}); write it again") from None
    return pd.DataFrame(rows, columns=None if rows else ["name", "cell", *AXES, "feasible", *MEASURES])


def load_reference(folder: str | Path) -> pd.Series:
    """Return the best objective that sampling found in each cell, by cell, of a study that has ``data/reference.csv``.

    Raises:
        OutputError: the file is broken.
    """
    path = Path(folder) / "data" / "reference.csv"
    if not path.is_file():
        return pd.Series(dtype=float)
    try:
        return pd.read_csv(path).set_index("cell")["mmr_mean"].astype(float)
    except (OSError, ValueError, KeyError) as error:
        raise OutputError(f"{path}: not a table of references ({_what(error)}); make it again") from None


def read_record(path: Path) -> dict[str, Any]:
    """Read one record.

    Raises:
        OutputError: not JSON, not a record, or newer than this nlpweld.
    """
    record = read_json(path)
    if not isinstance(record, dict) or record.get("format") != FORMAT:
        raise OutputError(f"{path}: format: not a record; remove it, or run it again")
    version = record.get("version")
    if not isinstance(version, int) or version > VERSION:
        raise OutputError(f"{path}: version: {version!r} is newer than {VERSION}; update nlpweld, or run it again")
    absent = [name for name in (*PLAIN[:6], "verified") if name not in record]
    if absent:
        raise OutputError(f"{path}: {absent[0]}: missing; remove the record and run it again")
    return record


def read_json(path: Path) -> Any:
    """Read a JSON file.

    Raises:
        OutputError: it cannot be read or is not JSON.
    """
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise OutputError(f"{path}: cannot be read ({error.strerror}); check its permissions") from None
    except ValueError as error:
        raise OutputError(f"{path}: not JSON ({error}); remove it and run it again") from None


def _row(path: Path, record: dict[str, Any]) -> dict[str, Any]:
    row = {name: record.get(name) for name in PLAIN}
    row |= {"claimed": record["status"] == "SOLVED", "verified": _verified(record)}
    placement = record.get("placement") or {}
    row |= {name: _number(record.get(name)) for name in NUMBERS} | {name: _number(placement.get(name)) for name in AXES}
    return row | _report(path, record.get("report"))


def _verified(record: dict[str, Any]) -> bool:
    """Return the verifier's word, which needs a report that agrees."""
    report = record.get("report") or {}
    return record["verified"] is True and report.get("feasible") is True


def _report(path: Path, report: dict[str, Any] | None) -> dict[str, Any]:
    """Return a report's numbers in one flat row."""
    report = report or {}
    row: dict[str, Any] = {"feasible": report.get("feasible") is True, "reading": report.get("reading")}
    row |= {name: _number(report.get(name)) for name in MEASURES}
    try:
        for name in PER_ROBOT:
            row |= {f"{name}_{robot}_m3": _number(value) for robot, value in (report.get(name) or {}).items()}
        first = next(iter(report.get("violations") or []), None)
        row["violated"] = " ".join(str(first[k]) for k in ("constraint", "robot") if first[k]) if first else ""
    except (AttributeError, KeyError, TypeError) as error:
        raise OutputError(f"{path}: report: {_what(error)}; remove the record and run it again") from None
    return row


def _step(path: Path, index: int, step: dict[str, Any]) -> dict[str, Any]:
    try:
        numbers = {name: _number(step[name]) for name in ("time_s", "evaluations", "best", "mean")}
        place = step["placement"] if "placement" in step else dict(zip(AXES, step["x"], strict=False))  # version 1
        at = {name: _number(place.get(name)) for name in AXES}
        return {"step": index, **numbers, "spread_m": _number(step["spread"]), **at}
    except (KeyError, TypeError, ValueError) as error:
        raise OutputError(f"{path}: trace: {_what(error)}; remove the record and run it again") from None


def _refuse_mixture(records: list[tuple[Path, dict[str, Any]]]) -> None:
    """Refuse runs that would share a row of the table although they answered different questions.

    Raises:
        OutputError: names the record that differs from its neighbours.
    """
    first: dict[tuple[str, str], tuple[Path, Any]] = {}
    for path, record in records:
        group = "/".join(str(record[name]) for name in PLAIN[:4])
        for name in DECISIVE:
            where = (record["cell"], name) if name == "cell_hash" else (group, name)
            known, value = first.setdefault(where, (path, record.get(name)))
            if value != record.get(name):
                raise OutputError(f"{path}: {name}: differs from {known.name} of {group}; remove one and run again")


def _number(value: Any) -> float:
    return float(value) if isinstance(value, int | float) else float(np.nan)


def _what(error: Exception) -> str:
    return f"missing {error}" if isinstance(error, KeyError) else str(error)
