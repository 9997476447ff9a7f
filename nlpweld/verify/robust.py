"""A plan under errors of the cell's set-up: each scenario checked like a plan of its own, on paths closed anew."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from nlpweld.cell import Cell
from nlpweld.cell.uncertainty import Scenario, samples, vertices
from nlpweld.plan import Plan
from nlpweld.verify.between import closed_near
from nlpweld.verify.check import verify
from nlpweld.verify.freedom import Offsets
from nlpweld.verify.report import Report, Violation, worst_first
from nlpweld.verify.worst_case import Worst, WorstCase

SAMPLES = 16
SEED = 1


def verify_robust(
    plan: Plan, extra: int = SAMPLES, seed: int = SEED, told: Callable[[int, int], None] | None = None
) -> Report:
    """Return the report of a plan as it stands, with its worst over the errors that its cell states.

    The robots are told where work and bases really are: in every scenario the plan's paths are closed anew, each
    point from the plan's own configuration, so on the same branch, wrist and turn. Every level holds, or the plan is
    not feasible; what fails says in which scenario.

    Args:
        plan: joint paths and placement, as if nothing were off.
        extra: scenarios drawn at random from the whole box of errors, besides its vertices; these are no proof.
        seed: of the draw.
        told: called with the number of scenarios done and to do.

    Raises:
        OptionError: the cell states no errors.
        PlanError: names or shapes of the plan contradict its cell.
        VerifierError: the geometry process hung or died twice.
    """
    at_vertices, drawn = vertices(plan.cell), samples(plan.cell, extra, seed)
    scenarios = (*at_vertices, *drawn)
    nominal = verify(plan)
    if not nominal.samples:
        return nominal
    reports = [nominal]
    for k, scenario in enumerate(scenarios[1:], start=1):
        if told:
            told(k, len(scenarios))
        reports.append(verify(closed_anew(plan, scenario)))
    labels = [scenario.label for scenario in scenarios]
    broken = [_in(v, label) for report, label in zip(reports[1:], labels[1:], strict=True) for v in report.violations]
    violations = worst_first([*nominal.violations, *broken])
    found = WorstCase(
        scenarios=len(reports),
        vertices=len(at_vertices),
        samples=len(drawn),
        feasible=sum(report.feasible for report in reports),
        mmr_mean=Worst.of([r.mmr_mean for r in reports], labels),
        singularity=Worst.of([min(r.singularity_min.values()) for r in reports], labels),
        clearance_m=Worst.of([r.clearance_along_m for r in reports], labels),
        joint_margin_rad=Worst.of([r.joint_margin_rad for r in reports], labels),
    )
    return replace(nominal, feasible=not violations, violations=violations, worst_case=found)


def closed_anew(plan: Plan, scenario: Scenario) -> Plan:
    """Return the plan for a cell set up otherwise; where a chain does not close, the nearest there is."""
    cell = set_up(plan.cell, scenario)
    placement, s = plan.placement + scenario.placement, np.asarray(plan.s, dtype=float)
    free = None if plan.freedom is None else Offsets(s, cell.seam.closed, plan.freedom)
    start = {name: np.asarray(q, dtype=float) for name, q in plan.paths.items()}
    paths, _ = closed_near(cell, placement, s, start, free)
    return replace(plan, cell=cell, placement_m=placement[:3], yaw_rad=float(placement[3]), paths=paths)


def set_up(cell: Cell, scenario: Scenario) -> Cell:
    """Return the cell with its bases where they are, and a search box grown by the placement's error.

    The box is what the placement as stated is held to.
    """
    stations = []
    for station, error in zip(cell.stations, scenario.bases, strict=True):
        roll, pitch, yaw = station.base_rpy_deg
        base = {
            "base_position_m": tuple(np.add(station.base_position_m, error[:3])),
            "base_rpy_deg": (roll, pitch, yaw + float(np.degrees(error[3]))),
        }
        stations.append(station.model_copy(update=base))
    slack = 2 * np.abs(scenario.placement)
    lower, upper = cell.search.bounds + np.array([-slack, slack])
    box = {
        "lower_m": tuple(lower[:3]),
        "upper_m": tuple(upper[:3]),
        "yaw_deg": (float(np.degrees(lower[3])), float(np.degrees(upper[3]))),
    }
    search = cell.search.model_copy(update=box)
    return cell.model_copy(update={"stations": tuple(stations), "search": search})


def _in(violation: Violation, scenario: str) -> Violation:
    """Return a violation that says in which scenario it is."""
    return replace(violation, note="; ".join(part for part in (violation.note, f"with {scenario}") if part))
