"""What a palletising task takes, box by box: before, after in closed form, and after by a solver."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd

from nlpweld.errors import OptionError
from nlpweld.palletising.cycle import after, before, legs, ways
from nlpweld.palletising.nlp import height_nlp
from nlpweld.palletising.optimum import CASES, optimum
from nlpweld.palletising.task import PalletTask
from nlpweld.solvers import Budget, Solver

Told = Callable[[int], object]  # is called with the number of every box that a solver is done with


@dataclass(frozen=True, eq=False)
class Palletised:
    """A task with its times.

    Attributes:
        task: what is palletised.
        boxes: one row a box: box and layer (from 1, from below), x_m, y_m, z_m, swing_deg, reach_m, wrist_deg and the
            times swing_s, reach_s, wrist_s of A, C and D on one leg; before_s, after_s (closed form), z_max_m, z_most_m
            (the lowest and highest best height) and case. Of a solver also solver_z_m, solver_s, regret_s,
            evaluations and solve_s. before_s, after_s, solver_s and regret_s are of the whole cycle, with its way
            back where the task has one.
    """

    task: PalletTask
    boxes: pd.DataFrame

    @cached_property
    def totals_s(self) -> dict[str, float]:
        """Sums over the boxes [s]: before, after, and solver where there is one."""
        names = {"before": "before_s", "after": "after_s", "solver": "solver_s"}
        return {name: float(self.boxes[column].sum()) for name, column in names.items() if column in self.boxes}

    @property
    def saving_percent(self) -> float:
        """What the cycle after saves of the one before, in closed form [%]."""
        return 100 * (1 - self.totals_s["after"] / self.totals_s["before"])

    @property
    def layers(self) -> pd.DataFrame:
        """One row a layer: sums of the boxes' times, and the range of their best heights."""
        sums = [name for name in ("before_s", "after_s", "solver_s", "regret_s") if name in self.boxes]
        heights = {"z_max_m": "min", "z_most_m": "max"}
        return self.boxes.groupby("layer").agg({"box": "size"} | dict.fromkeys(sums, "sum") | heights).reset_index()


def palletize(
    task: PalletTask,
    solver: Solver | None = None,
    seed: int = 0,
    budget: Budget | None = None,
    told: Told | None = None,
) -> Palletised:
    """Time a task in closed form, and by a solver for comparison.

    Args:
        task: what is palletised.
        solver: from :func:`nlpweld.solvers.make_solver`; None for the closed form alone.
        seed: of the solver.
        budget: of the solver, for every box.
        told: hears of every box that the solver is done with.

    Raises:
        OptionError: the solver cannot take the problem, or there is nothing to search.
    """
    way, leg, places = ways(task), legs(task), task.places_m
    best = optimum(leg, task.cycle.z_a_m)
    count, per_layer = len(places), len(task.stack.layer)
    names = ("swing_deg", "reach_m", "wrist_deg", "swing_s", "reach_s", "wrist_s")
    columns: dict[str, Any] = {"box": np.arange(count) + 1, "layer": np.arange(count) // per_layer + 1}
    columns |= dict(zip(("x_m", "y_m", "z_m"), places.T, strict=False)) | {name: getattr(way, name) for name in names}
    columns |= {"before_s": task.legs * before(leg).total_s, "after_s": task.legs * best.time_s}
    columns |= {"z_max_m": best.z_max_m, "z_most_m": best.z_most_m, "case": [CASES[case] for case in best.case]}
    boxes = pd.DataFrame(columns)
    if solver is not None:
        for box in range(count):
            height_nlp(task, box)  # one that leaves nothing to search is refused before any is solved
        rows = [solved(task, box, solver, seed, budget, told) for box in range(count)]
        boxes = boxes.join(pd.DataFrame(rows))
        boxes["regret_s"] = boxes.solver_s - boxes.after_s
    return Palletised(task, boxes)


def solved(
    task: PalletTask,
    box: int,
    solver: Solver,
    seed: int = 0,
    budget: Budget | None = None,
    told: Told | None = None,
) -> dict[str, float]:
    """Return what a solver finds for one box: its height, the time of the whole cycle there, and what it took.

    Raises:
        OptionError: the solver cannot take the problem, or there is nothing to search.
    """
    nlp = height_nlp(task, box)
    reason = solver.unsuitable(nlp)
    if reason:
        raise OptionError(f"{task.name}: this solver cannot take it: {reason}")
    outcome = solver.solve(nlp, seed=seed, budget=budget or Budget())
    if told:
        told(box)
    z = np.array([np.nan]) if outcome.x is None else outcome.x
    time_s = np.nan if outcome.x is None else float(after(legs(task).of(box), z).total_s[0])
    cost = {"evaluations": outcome.evaluations, "solve_s": outcome.build_s + outcome.solve_s}
    return {"solver_z_m": float(z[0]), "solver_s": task.legs * time_s, **cost}
