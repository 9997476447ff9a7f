"""Commands that ask one question of one cell: evaluate, solve, verify."""

import json as json_
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import ValidationError
from rich.console import Console

from nlpweld.cell import OVER_SEAM, READINGS, Cell, load_cell
from nlpweld.errors import OptionError, OutputError
from nlpweld.plan import Plan

if TYPE_CHECKING:
    from nlpweld.bench.task import Task


@dataclass(frozen=True)
class Question:
    """What a run is to answer, as typed."""

    cell: Cell
    solver: str
    formulation: str
    seed: int
    time_limit_s: float | None
    evaluations: int | None


@dataclass(frozen=True)
class Goal:
    """What is to be maximised, as typed; None leaves it to the cell.

    Attributes:
        reading: how the robots' manipulabilities make one number.
        over_seam: how those of the seam's points do; ``soft_minimum`` may be followed by a colon and its exponent.
    """

    reading: str | None
    over_seam: str | None

    def asked_of(self, cell: Cell) -> Cell:
        """Return the cell with this for its objective.

        Raises:
            OptionError: no such reading, no such objective over the seam, or one that does not suit the cell.
        """
        fields: dict[str, Any] = {}
        if self.reading is not None:
            if self.reading not in READINGS:
                raise OptionError(f"--reading '{self.reading}' is unknown. There are: {', '.join(READINGS)}")
            fields["reading"] = self.reading
        if self.over_seam is not None:
            kind, _, exponent = self.over_seam.partition(":")
            if kind not in OVER_SEAM:
                raise OptionError(f"--over-seam '{kind}' is unknown. There are: {', '.join(OVER_SEAM)}")
            fields |= {"over_seam": kind, "exponent": _exponent(exponent) if exponent else None}
            if isinstance(cell.objective.source, dict):
                others = {name: text for name, text in cell.objective.source.items() if name != "exponent"}
                fields["source"] = others | ({"exponent": "command line"} if exponent else {})
        try:
            return cell.with_(objective=fields) if fields else cell
        except ValidationError as error:
            raise OptionError(f"{cell.name}: {_first_line(error)}") from None


def _exponent(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise OptionError(f"--over-seam: exponent '{text}' is not a number; give e.g. soft_minimum:8") from None


def _first_line(error: ValidationError) -> str:
    return str(error.errors()[0]["msg"]).removeprefix("Value error, ")


def variant(name: str, branches: str | None, goal: Goal, points: int | None) -> Cell:
    """Load a cell and apply the options that change it.

    Raises:
        CellError: the cell cannot be loaded.
        OptionError: an option's value is not one of those there are.
    """
    from nlpweld.bench.answer import with_branches

    cell = with_branches(load_cell(name), branches)
    cell = goal.asked_of(cell)
    if points is not None:
        try:
            cell = cell.with_(seam={"points": points})
        except ValidationError as error:
            raise OptionError(f"--points {points}: {error.errors()[0]['msg'].lower()}") from None
    return cell


def tasks(
    cells: list[Cell],
    solvers: str,
    formulations: str,
    seeds: int,
    limits: tuple[int | None, float | None],
    memory_mb: int | None,
) -> "list[Task]":
    """Return the runs asked for by options; limits are evaluations and time [s].

    Raises:
        OptionError: an unknown solver, preset or formulation.
    """
    from nlpweld.bench.answer import known_formulation
    from nlpweld.bench.run import grid
    from nlpweld.solvers import Budget

    forms = [known_formulation(name) for name in formulations.split(",")]
    return grid(cells, solvers.split(","), range(seeds), forms, Budget(*limits), limit_mb=memory_mb)


def tasks_of(path: Path) -> "list[Task]":
    """Return the runs of a study file.

    Raises:
        CellError: the file, or a cell of it, cannot be used.
    """
    from nlpweld.bench.study import load_study

    return load_study(path)


def evaluate(
    cell: Cell,
    at: tuple[float, float, float] | None,
    placement: str | None,
    out: Path | None,
    json: bool,
    robust: bool = False,
) -> int:
    """Print the report of one placement; 0 when feasible, 1 when not.

    Raises:
        OptionError: a robot cannot reach the seam there, so there is nothing to measure, or the cell states no errors
            to be robust against.
    """
    from nlpweld.bench.answer import coordinates, evaluate_plan, formulate

    where = _where(cell, at, placement)
    x = coordinates(cell, where)
    if out is not None:
        writable_file(out)
    nlp = formulate(cell, "robust" if robust else "reduced", engine="numpy")
    with busy(f"evaluating {cell.name}", quiet=json):
        plan, report = evaluate_plan(nlp, x)
    if plan is not None and out is not None:
        plan.save(out)
    if json:
        print(json_.dumps({**report.to_json(), **_start(plan)}))
    if plan is None:
        blame = report.violations[0]
        raise OptionError(
            f"{cell.name}: placement ({', '.join(f'{c:g}' for c in where)}) is out of reach of {blame.robot} "
            f"at seam point {blame.point}; choose one nearer to its base"
        )
    if not json:
        print(report)
        if out is not None:
            print(f"plan: {out}")
    return 0 if report.feasible else 1


def solve(asked: Question, out: Path | None, json: bool) -> int:
    """Solve, verify and print; 0 when verified, 1 when not."""
    from nlpweld.bench.answer import formulate
    from nlpweld.bench.answer import solve as solve_
    from nlpweld.solvers import Budget

    if out is not None:
        writable(out)
    _tell_drift(asked.cell)
    name, _, preset = asked.solver.partition(":")
    nlp = formulate(asked.cell, asked.formulation)
    with busy(f"{asked.solver} on {asked.cell.name}, seed {asked.seed}", quiet=json) as tell:

        def counted(X: np.ndarray, inner: Any = nlp.evaluate) -> Any:
            tell(len(X))
            return inner(X)

        budget = Budget(asked.evaluations, asked.time_limit_s)
        watched = replace(nlp, evaluate=counted)
        answer = solve_(watched, name, seed=asked.seed, budget=budget, preset=preset or "default")
    x = None if answer.outcome.x is None else answer.outcome.x[: len(asked.cell.variables)]  # it may go on with joints
    layout = {} if x is None else asked.cell.layout(x)
    keep = answer.plan if answer.outcome.status != "INFEASIBLE" else None  # a near miss is reported, not planned
    plan_path = keep.save(out / "plan.json") if keep is not None and out is not None else None
    outcome, report = answer.outcome, answer.report
    facts = {
        "solver": asked.solver,
        "formulation": asked.formulation,
        "seed": asked.seed,
        "status": outcome.status,
        "message": outcome.message,
        "placement": None if x is None else _placement(asked.cell, x),
        "layout": layout,
        "evaluations": outcome.evaluations,
        "build_s": round(outcome.build_s, 4),
        "solve_s": round(outcome.solve_s, 4),
        "verified": answer.verified,
        "plan": plan_path and str(plan_path),
    }
    if json:
        print(json_.dumps({**(report.to_json() if report else {"cell": asked.cell.name}), **facts}))
    else:
        print(f"{asked.solver}, seed {asked.seed}: {outcome.status} ({outcome.message})")
        print(f"  {outcome.evaluations} evaluations, build {outcome.build_s:.2f} s, solve {outcome.solve_s:.2f} s")
        print(report or "no answer to verify")
        for robot, base in layout.items():
            x_m, y_m, yaw_rad = base.values()
            print(f"  {robot} stands at ({x_m:.4f}, {y_m:.4f}) m, turned by {np.degrees(yaw_rad) + 0.0:.2f} deg")
        if keep is None:
            print("no plan: nothing feasible was found; above is the nearest miss")
        else:
            print(f"plan: {plan_path}" if plan_path else "add --out DIR to keep the plan")
    return 0 if answer.verified else 1


def writable(folder: Path) -> None:
    """Refuse a folder in which nothing can be written, before any work is done.

    Raises:
        OutputError: names the folder or the file in the way.
    """
    existing = next(p for p in (folder, *folder.absolute().parents) if p.exists())
    if not existing.is_dir():
        raise OutputError(f"{existing}: is a file, not a folder; choose another --out")
    if not os.access(existing, os.W_OK | os.X_OK):
        raise OutputError(f"{existing}: cannot be written (permission denied); choose another --out")


def writable_file(file: Path) -> None:
    """Refuse a file that cannot be written, before any work is done.

    Raises:
        OutputError: it is a folder, or its own folder cannot be written.
    """
    if file.is_dir():
        raise OutputError(f"{file}: is a folder, not a file; choose another name")
    writable(file.parent)


def _where(cell: Cell, at: tuple[float, float, float] | None, placement: str | None) -> tuple[float, float, float]:
    if (at is None) == (placement is None):
        raise OptionError("give either --at X Y Z or --placement NAME")
    if at is not None:
        return at
    if placement not in cell.placements:
        raise OptionError(
            f"--placement '{placement}' is not in the cell. There are: {', '.join(cell.placements) or 'none'}"
        )
    return cell.placements[placement]


def _placement(cell: Cell, x: np.ndarray) -> list[float]:
    """Return x, y, z [m], and yaw [rad] where it is free."""
    whole = cell.placement(x).tolist()
    return whole if "yaw_rad" in cell.variables else whole[:3]


def _tell_drift(cell: Cell) -> None:
    """Say on standard error along which axes an answer is one of many."""
    if cell.drift:
        axes = ", ".join(cell.drift)
        print(f"note: bases and placement may move together along {axes}; hold one base there", file=sys.stderr)


def _start(plan: Plan | None) -> dict[str, Any]:
    """Return branches and, as principal values, the joint angles (DH) at the first seam point, for JSON."""
    if plan is None:
        return {"branches": None, "joints_start_deg": None}
    start = {name: (180 - (180 - np.degrees(q[0])) % 360).tolist() for name, q in plan.paths.items()}
    return {"branches": plan.branches, "joints_start_deg": start}


@contextmanager
def busy(what: str, quiet: bool) -> Iterator[Any]:
    """Show on standard error that work is going on, with the count of candidates told."""
    console, count = Console(stderr=True, quiet=quiet), 0
    with console.status(what) as status:

        def tell(more: int) -> None:
            nonlocal count
            count += more
            status.update(f"{what}: {count:,} candidates")

        yield tell
