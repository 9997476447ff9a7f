"""Timed plans played in MuJoCo: the paper's C, the optimum, the positioners; what tuning takes; chains left open.

    python experiments/simulation.py --out results/simulation

Plans are timed first, or read from the folder of ``--timed`` where it holds ``NAME.json``. Everything is simulated
again each time, in some minutes.
"""

import argparse
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from common import arguments, told
from rich.console import Console

from nlpweld.bench.progress import StudyProgress
from nlpweld.cell import load_cell
from nlpweld.errors import PlanError
from nlpweld.plan import Plan, load_plan, write_bytes, write_text
from nlpweld.report import markup
from nlpweld.report.simulation import write_simulation
from nlpweld.sim.options import Numerics, Servos, SimOptions
from nlpweld.sim.report import SimReport
from nlpweld.sim.simulate import Simulation, simulate

RESULTS = Path(__file__).parents[1] / "results"
PLANS = {
    "three_er16_C": "paper/plans/paper.json",
    "three_er16_best": "paper/plans/optimum.json",
    "single": "positioner/plans/reference-robot_positioner.json",
    "dual": "positioner/plans/reference-dual_welder_positioner.json",
}
TUNED = "three_er16_best"
TUNING = {
    "as it is": SimOptions(),
    "positions alone": SimOptions(servos=Servos(feed_forward="none")),
    "and rates": SimOptions(servos=Servos(feed_forward="rates")),
    "and gravity": SimOptions(servos=Servos(feed_forward="gravity")),
    "masses known 10 % too large": SimOptions(servos=Servos(model_error=0.1)),
    "servos of 5 Hz, masses 10 %": SimOptions(servos=Servos(frequency_hz=5.0, model_error=0.1)),
    "servos of 20 Hz, masses 10 %": SimOptions(servos=Servos(frequency_hz=20.0, model_error=0.1)),
    "integrator implicitfast": SimOptions(numerics=Numerics(integrator="implicitfast")),
    "implicitfast, 0.5 ms": SimOptions(numerics=Numerics(integrator="implicitfast", step_s=5e-4, weld_time_s=1e-3)),
    "integrator euler": SimOptions(numerics=Numerics(integrator="euler")),
    "time step 0.5 ms": SimOptions(numerics=Numerics(step_s=5e-4, weld_time_s=1e-3)),
    "time step 2 ms": SimOptions(numerics=Numerics(step_s=2e-3, weld_time_s=4e-3)),
    "welds of 20 ms": SimOptions(numerics=Numerics(weld_time_s=0.02)),
    "welds of impedance 0.95": SimOptions(numerics=Numerics(weld_impedance=0.95)),
    "MuJoCo's own welds": SimOptions(numerics=Numerics(weld_time_s=0.02, weld_impedance=0.95)),
}
OPENED, OPENED_RAD = "handler_2", (1e-4, 3e-4, 1e-3, 3e-3)
SPAN_S, RAMP_S = (8.0, 12.0), (9.0, 11.0)  # what is played of a chain left open, and while what it opens
THIN = 10  # kept rows of a stored time series


def timed(name: str, folder: Path | None) -> Plan:
    """Return a plan with its time axis, from a folder of timed plans or timed here.

    Raises:
        PlanError: the stored plan is not of the cell as it is now.
    """
    if folder is not None and (folder / f"{name}.json").exists():
        return load_plan(folder / f"{name}.json")
    from nlpweld.timing import time_plan

    plan = load_plan(RESULTS / PLANS[name])
    cell = load_cell(plan.cell.name)  # speeds may be younger than the plan
    if cell.content_hash != plan.cell.content_hash:
        raise PlanError(f"{RESULTS / PLANS[name]}: is of another {cell.name}; make it again")
    plan = replace(plan, cell=cell)
    return plan.timed(time_plan(plan).timeline)


def opened(plan: Plan, name: str, by_rad: float) -> Plan:
    """Return a plan in which one carrier turns its first joint away smoothly, and stays there."""
    assert plan.timeline is not None
    track = plan.timeline.tracks[name]
    begin, end = RAMP_S
    x = np.clip((plan.timeline.t_s - begin) / (end - begin), 0.0, 1.0)[:, None]
    on, per_s, h = np.eye(1, track.q.shape[1]) * by_rad, 1 / (end - begin), x * (1 - x)
    ramps = (x**3 * (10 - 15 * x + 6 * x**2), 30 * h**2 * per_s, 60 * h * (1 - 2 * x) * per_s**2)
    moved = (a + on * r for a, r in zip((track.q, track.rate, track.acceleration), ramps, strict=True))
    tracks = plan.timeline.tracks | {name: type(track)(*moved)}
    return plan.timed(replace(plan.timeline, tracks=tracks))


def numbers(report: SimReport) -> dict[str, object]:
    """Return the row of a report; where the simulation diverged its numbers mean nothing and are left out."""
    torches, grasps = report.torches.values(), report.grasps.values()

    def most(peaks: list[float]) -> float:
        return max(peaks, default=np.nan)

    row = {
        "torch_mm": 1e3 * most([t.seam_m.value for t in torches]),
        "torch_rms_mm": 1e3 * most([t.seam_rms_m for t in torches]),
        "drift_um": 1e6 * most([g.drift_m.value for g in grasps]),
        "drift_urad": 1e6 * most([g.drift_rad.value for g in grasps]),
        "gap_um": 1e6 * most([g.gap_m.value for g in grasps]),
        "force_n": most([g.force_n.value for g in grasps]),
        "torque_nm": most([g.torque_nm.value for g in grasps]),
        "internal_n": np.nan if report.squeeze_n is None else abs(report.squeeze_n.value),
        "servo_mrad": 1e3 * max(max(errors) for errors in report.servo_error_rad.values()),
        "clearance_mm": 1e3 * report.clearance_m,
        "contacts": float(len(report.contacts)),
    }
    if any(complaint.what == "diverged" for complaint in report.complaints):
        row = dict.fromkeys(row, np.nan)
    return {
        **row,
        "holds": report.holds,
        "complains_of": ", ".join(dict.fromkeys(f"{c.what} {c.who}".strip() for c in report.complaints)),
    }


def markdown(table: pd.DataFrame) -> str:
    """Return a table as Markdown, numbers with three digits and blank where there is none."""
    return markup.markdown(table.map(lambda v: f"{v:.3g}" if isinstance(v, float) else str(v)).replace("nan", ""))


def study(folder: Path, timed_folder: Path | None, console: Console) -> dict[str, pd.DataFrame]:
    """Simulate everything and return the tables; tables, figures and data go to the folder."""
    with StudyProgress(console) as watch:
        bar = watch.bar.add_task("simulations", total=len(PLANS) + len(TUNING) + len(OPENED_RAD))

        def run(what: str, plan: Plan, *how: object) -> Simulation:
            watch.bar.update(bar, description=what)
            made = simulate(plan, *how)  # type: ignore[arg-type]
            watch.bar.advance(bar)
            return made

        plans = {name: timed(name, timed_folder) for name in PLANS}
        tables = {
            "plans": _plans(folder, plans, run),
            "tuning": _rows("what", {what: run(what, plans[TUNED], how).report for what, how in TUNING.items()}),
            "opened": _opened(plans[TUNED], run),
        }
    for name, table in tables.items():
        write_text(folder / "tables" / f"{name}.csv", table.to_csv(index=False, float_format="%.6g"))
        write_text(folder / "tables" / f"{name}.md", markdown(table))
    return tables


def _plans(folder: Path, plans: dict[str, Plan], run: Callable[..., Simulation]) -> pd.DataFrame:
    """Simulate whole plans, keep reports and thin time series, and draw them."""
    reports = {}
    for name, plan in plans.items():
        made = run(name, plan)
        reports[name] = made.report
        write_text(folder / "data" / f"{name}.txt", f"{made.report}\n")
        write_bytes(folder / "data" / f"{name}.parquet", made.series[::THIN].to_parquet(index=False))
        write_simulation(folder / "data" / f"{name}.parquet", folder / "figures", name)
    table = _rows("plan", reports)
    cycles = [plan.timeline.duration_s for plan in plans.values() if plan.timeline]
    table.insert(1, "cycle_s", cycles)
    return table


def _opened(plan: Plan, run: Callable[..., Simulation]) -> pd.DataFrame:
    """Simulate chains that one carrier leaves open by more and more."""
    made = {
        f"{OPENED} J1 by {1e3 * by:g} mrad": run("opened", opened(plan, OPENED, by), None, SPAN_S).report
        for by in OPENED_RAD
    }
    return _rows("what", made)


def _rows(heading: str, reports: dict[str, SimReport]) -> pd.DataFrame:
    return pd.DataFrame([{heading: name, **numbers(report)} for name, report in reports.items()])


def main() -> int:
    """Run the study from the command line."""
    parser = arguments(__doc__, "results/simulation")
    parser.add_argument("--timed", type=Path, help="folder of timed plans")

    def tables(chosen: argparse.Namespace, console: Console) -> str:
        return "\n".join(map(markdown, study(chosen.out, chosen.timed, console).values()))

    return told(parser, tables)


if __name__ == "__main__":
    sys.exit(main())
