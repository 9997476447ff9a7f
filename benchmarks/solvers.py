"""One Ipopt solve against one genetic algorithm of 5,000 evaluations, on the same engine, seed by seed."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from benchmarks.contenders import ENGINES, missing
from nlpweld.cell import Cell
from nlpweld.formulation.batch import Batch
from nlpweld.formulation.nlp import Nlp
from nlpweld.formulation.reduced import Relaxer, reduced
from nlpweld.solvers import Budget, Outcome, make_solver

BUDGETS = {"ipopt": Budget(), "ga": Budget(evaluations=5000)}


def rows(cell: Cell, seeds: Iterable[int]) -> list[dict]:
    """Return one row per engine and solver, and one with the ratio of their medians; none without seeds."""
    seeds = list(seeds)
    engines = {name: kind for name, kind in ENGINES.items() if not missing(name)} if seeds else {}
    return [row for name, kind in engines.items() for row in _engine_rows(cell, name, kind, seeds)]


def problem(cell: Cell, kind: str) -> Nlp:
    """Return the reduced form with exact model and derivatives on one engine."""
    batch = Batch(cell, engine=kind)
    return replace(reduced(cell), evaluate=batch.evaluate, relax=Relaxer(batch))


def _engine_rows(cell: Cell, name: str, kind: str, seeds: list[int]) -> list[dict]:
    nlp = problem(cell, kind)
    nlp.evaluate(nlp.starts(0, 64))  # compiled before the clock starts
    outcomes: dict[str, list[Outcome]] = {solver: [] for solver in BUDGETS}
    for seed in seeds:
        for solver, budget in BUDGETS.items():
            outcomes[solver].append(make_solver(solver).solve(nlp, seed=seed, budget=budget))
    best = max(o.objective for of in outcomes.values() for o in of if o.status == "SOLVED")
    found = [_row(name, solver, of, best) for solver, of in outcomes.items()]
    medians = [row["median_s"] for row in found]
    share = f"{medians[0] / medians[1]:.3g} x the time of the genetic algorithm, build apart"
    found[0]["note"] = f"{share}; {found[0]['note']}"
    return found


def _row(name: str, solver: str, outcomes: list[Outcome], best: float) -> dict:
    near = sum(o.status == "SOLVED" and o.objective > best * (1 - 1e-3) for o in outcomes)
    note = (
        f"{near} of {len(outcomes)} within 0.1 % of {best:.5f}; "
        f"build {max(o.build_s for o in outcomes):.2g} s at most; "
        f"{np.median([o.evaluations for o in outcomes]):.0f} evaluations"
    )
    times = [o.solve_s for o in outcomes]
    row = {"section": "solver", "what": solver, "contender": name, "unit": "solve", "median_s": float(np.median(times))}
    return row | {"fastest_s": min(times), "slowest_s": max(times), "per_s": 1 / float(np.median(times)), "note": note}
