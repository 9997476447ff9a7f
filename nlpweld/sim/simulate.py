"""Simulating a timed plan, and what is kept of it on disk."""

import json
import time
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import pandas as pd

from nlpweld.plan import Plan, write_bytes, write_text
from nlpweld.sim.measure import series
from nlpweld.sim.options import SimOptions
from nlpweld.sim.play import Stage, Told, play, stage
from nlpweld.sim.report import SimReport
from nlpweld.sim.summary import summarise

REPORT, SERIES, MODEL = "report.json", "series.parquet", "cell.xml"


@dataclass(frozen=True, eq=False)
class Simulation:
    """A simulated plan.

    Attributes:
        report: what was found.
        series: one row for each kept instant, of :func:`~nlpweld.sim.measure.series`.
        mjcf: the model, for any tool that reads MJCF.
    """

    report: SimReport
    series: pd.DataFrame
    mjcf: str

    def save(self, folder: Path) -> list[Path]:
        """Write report, series and model into a folder and return the files.

        Raises:
            OutputError: a file cannot be written.
        """
        table = BytesIO()
        self.series.to_parquet(table, index=False)
        return [
            write_text(folder / REPORT, json.dumps(self.report.to_json(), indent=1) + "\n"),
            write_bytes(folder / SERIES, table.getvalue()),
            write_text(folder / MODEL, self.mjcf),
        ]


def simulate(
    plan: Plan,
    options: SimOptions | None = None,
    span_s: tuple[float | None, float | None] = (None, None),
    told: Told | None = None,
) -> Simulation:
    """Play a timed plan in MuJoCo and say how it went.

    Args:
        plan: a timed plan.
        options: masses, servos, numerics and levels; the defaults are documented there.
        span_s: first and last instant of the timeline; None is its end.
        told: called now and then with steps done and steps in all.

    Raises:
        OptionError: MuJoCo is missing, an option is not one of those there are, or the span is outside the timeline.
        PlanError: the plan is not timed.
    """
    options = options or SimOptions()
    return run(plan, stage(plan, options, span_s), options, told)


def run(plan: Plan, set_up: Stage, options: SimOptions, told: Told | None = None) -> Simulation:
    """Do what :func:`simulate` does with a model that is ready.

    Args:
        plan: the timed plan.
        set_up: of :func:`~nlpweld.sim.play.stage`.
        options: those it was made with.
        told: as there.
    """
    began = time.perf_counter()
    kept = play(plan, set_up, options, told)
    wall_s = time.perf_counter() - began
    table = series(plan, kept)
    return Simulation(summarise(plan, kept, table, options, wall_s), table, set_up.spec.to_xml())
