"""How long a weld takes: the paper's placements and the optima, timed at several speeds of the torch.

    python experiments/timing.py --out results/timing

Plans are solved once and kept, timed, and every timed plan is checked by the verifier between its instants. At the
cell's own speed the weld is what it is wherever the work stands; the faster the torch could go, the more the joints
decide.
"""

import argparse
import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd
from common import arguments, rounded, told
from matplotlib import rc_context
from matplotlib.figure import Figure
from rich.console import Console
from rich.progress import Progress

from nlpweld.bench.answer import evaluate_plan, formulate, solve
from nlpweld.cell import load_cell
from nlpweld.errors import PlanError
from nlpweld.pareto.aims import AIMS, verified_value
from nlpweld.plan import Plan, load_plan, write_text
from nlpweld.report.style import GREY, RC, figure, look, name_axes
from nlpweld.timing import time_plan
from nlpweld.verify import TimingReport, verify, verify_timing

SPEEDS_M_S = (0.008, 0.03, 0.1, 0.3, 1.0)  # the first is that of the cells
OPTIMA = {"optimum": "reduced", "optimum, spin free": "redundant_spin"}
NAMED = {"three_er16": ("paper",), "dual_welder_positioner": tuple("ABCD"), "robot_positioner": ()}
PLANS = [(cell, name) for cell, named in NAMED.items() for name in (*named, *OPTIMA)]
DIGITS = {
    "objective": 5, "torch_mm_s": 0, "cycle_s": 3, "arc_on_s": 3, "off_seam_s": 3, "quickest_s": 3, "slower_percent": 1,
    "least_mm_s": 1, "used_percent": 1, "closure_um": 3, "blended_deg": 2, "turns": 0,
}  # fmt: skip


@dataclass(frozen=True)
class Case:
    """One plan to time: its cell, what it is called, and how it is found."""

    cell: str
    name: str

    def plan(self, folder: Path) -> Plan:
        """Return the plan, from the folder if it was found before for the cell as it is."""
        cell, path = load_cell(self.cell), folder / f"{self.cell}-{self.name.replace(', ', '-').replace(' ', '_')}.json"
        if path.exists():
            try:
                kept = load_plan(path)
                if kept.cell == cell:
                    return kept
            except PlanError:
                pass  # of another version: found again
        form = OPTIMA.get(self.name)
        if form is None:
            found, _ = evaluate_plan(formulate(cell, "reduced"), cell.coordinates(np.array(cell.placements[self.name])))
        else:
            found = solve(formulate(cell, form), "ipopt", seed=0).plan
        if found is None:
            raise PlanError(f"{self.cell}, {self.name}: no plan was found; see 'nlpweld evaluate'")
        found.save(path)
        return found


def at_speed(plan: Plan, speed_m_s: float) -> Plan:
    """Return the plan in a cell whose torches weld at a speed, which they reach as soon as before."""
    timing = plan.cell.timing
    assert timing is not None
    share = speed_m_s / timing.torch.speed_m_s
    torch = {name: share * value for name, value in timing.torch.model_dump().items()}
    return replace(plan, cell=plan.cell.with_(timing={"torch": torch}))


def rows(case: Case, plan: Plan, speeds: tuple[float, ...]) -> list[dict]:
    """Return one row for every speed of the torch."""
    report, found = verify(plan), []
    named = {"cell": case.cell, "plan": case.name, "objective": report.objective}
    quickest = {"quickest_s": verified_value(AIMS["quickest_s"], plan, report)}
    for speed in speeds:
        began = time.perf_counter()
        timed = time_plan(at_speed(plan, speed))
        taken = {"planning_s": time.perf_counter() - began}
        found.append(named | {"torch_mm_s": 1e3 * speed} | measured(verify_timing(timed)) | quickest | taken)
    return found


def measured(report: TimingReport) -> dict[str, object]:
    """Return what the verifier says of a timed plan, for a row."""
    slower = sum(stretch.end_s - stretch.begin_s for stretch in report.slowed)
    least = min((stretch.least_m_s for stretch in report.slowed), default=report.fastest_m_s)
    most = max(report.most, key=lambda use: use.used)
    return {
        "cycle_s": report.cycle_s,
        "arc_on_s": report.arc_on_s,
        "off_seam_s": report.cycle_s - report.arc_on_s,
        "slower_percent": 100 * slower / report.arc_on_s,
        "least_mm_s": 1e3 * least,
        "slowed_by": report.slowed[0].use.robot + "." + report.slowed[0].use.joint if report.slowed else "",
        "used_percent": 100 * most.used,
        "used_most": f"{most.robot}.{most.joint} {most.kind}",
        "closure_um": 1e6 * report.closure_m,
        "blended_deg": np.degrees(report.blended_rad),
        "turns": max((abs(turn) for turns in report.windings.values() for turn in turns), default=0),
        "verified": report.feasible,
    }


def draw(table: pd.DataFrame) -> Figure:
    """Draw times over the torch's speed, a panel for each cell."""
    cells = list(dict.fromkeys(table.cell))
    fig = figure(75.0, columns=2)
    panels = fig.subplots(1, len(cells), squeeze=False)[0]
    for axes, cell in zip(panels, cells, strict=True):
        own = table[table.cell == cell]
        for i, name in enumerate(dict.fromkeys(own.plan)):
            one = own[own.plan == name]
            axes.loglog(one.torch_mm_s, one.arc_on_s, marker="o", ms=3, label=name, **look(i))
        first = own.iloc[0]
        ideal = first.arc_on_s * first.torch_mm_s / np.array(sorted(set(own.torch_mm_s)))
        axes.loglog(sorted(set(own.torch_mm_s)), ideal, color=GREY, lw=0.8, ls=":", label="if nothing bound")
        name_axes(axes, "torch speed asked [mm/s]", "time on the seam [s]", cell)
        axes.legend(fontsize=6)
    return fig


def study(chosen: argparse.Namespace, console: Console) -> str:
    """Time every plan at every speed, write table and figure, and return the table."""
    cases = [Case(*one) for one in PLANS if one[0] in chosen.cells]
    found: list[dict] = []
    with Progress(console=console) as bar:
        job = bar.add_task("plans", total=len(cases))
        for case in cases:
            bar.update(job, description=f"{case.cell}, {case.name}")
            found += rows(case, case.plan(chosen.out / "plans"), SPEEDS_M_S[: chosen.speeds])
            bar.advance(job)
    table = pd.DataFrame(found)
    write_text(chosen.out / "tables" / "timing.csv", table.to_csv(index=False, float_format="%.6g"))
    text = rounded(table.drop(columns="planning_s"), DIGITS)
    write_text(chosen.out / "tables" / "timing.md", text)
    if not chosen.no_figures:
        (chosen.out / "figures").mkdir(parents=True, exist_ok=True)
        with rc_context(RC):
            draw(table).savefig(chosen.out / "figures" / "time_over_speed.png")
    return text


def main() -> int:
    """Run the study from the command line."""
    parser = arguments(__doc__, "results/timing")
    parser.add_argument("--cells", nargs="+", choices=list(NAMED), default=list(NAMED), help="which; all by default")
    parser.add_argument("--speeds", type=int, default=len(SPEEDS_M_S), help="how many, from the cells' own on")
    parser.add_argument("--no-figures", action="store_true", help="stop after the table")
    return told(parser, study)


if __name__ == "__main__":
    sys.exit(main())
