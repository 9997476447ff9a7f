"""What the runs of a study say of its solvers, as tables."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd

from nlpweld.records.frames import contestants
from nlpweld.stats import PROBLEM, RUN, SOLVER
from nlpweld.stats.anytime import anytime
from nlpweld.stats.intervals import ert, ert_interval, interval, share_interval, shifted_geometric_mean
from nlpweld.stats.pairs import paired
from nlpweld.stats.profiles import data_profile, ecdf, performance_profile, work_table
from nlpweld.stats.targets import GAPS, hits, regrets

STATED, BEST = "stated reference", "best verified of this study"
SHIFT_S = 1.0  # of shifted geometric means
GROUP = [*PROBLEM, *SOLVER]


HEADINGS = {
    "success_share": ("verified", "{:.2f}"), "correct_share": ("correct of solved", "{:.2f}"),
    "objective_mean": ("objective, mean", "{:.5f}"), "regret_median_percent": ("regret %, median", "{:z.4f}"),
    "sgm_s": ("s, sgm", "{:.2f}"),
} | {f"ert_{100 * gap:g}_percent_s": (f"ERT to {100 * gap:g} % [s]", "{:.3g}") for gap in GAPS}  # fmt: skip


@dataclass(frozen=True)
class Statistics:
    """Statistics of a study.

    Attributes:
        runs: one row a run (:func:`~nlpweld.records.frames.runs_frame`).
        answers: one row a confirmed answer (:func:`~nlpweld.records.frames.answers_frame`).
        stated: objective of the reference optimum of cells that have one.
    """

    runs: pd.DataFrame
    answers: pd.DataFrame
    stated: pd.Series

    @cached_property
    def reference(self) -> pd.Series:
        """What regret is counted from, by (cell, formulation).

        The stated optimum, which holds for the paper's formulation, or else the best answer verified in this study,
        which flatters whoever found it; :attr:`reference_kind` says which it is.
        """
        good = self.runs[self.runs["verified"]]
        best = good.groupby(PROBLEM)["objective"].max()
        stated = {(cell, "reduced"): value for cell, value in self.stated.items()}
        index = best.index.union(pd.MultiIndex.from_tuples(stated, names=PROBLEM)) if stated else best.index
        return pd.Series(stated, index=index, dtype=float).fillna(best.reindex(index))

    @cached_property
    def reference_kind(self) -> dict[tuple[str, str], str]:
        """Where each reference comes from."""
        return {
            (cell, formulation): STATED if formulation == "reduced" and cell in self.stated else BEST
            for cell, formulation in self.reference.index
        }

    @cached_property
    def judged(self) -> pd.DataFrame:
        """Runs with ``objective``, ``regret`` and the ``label`` of their solver."""
        runs = self.runs.copy()
        runs["label"] = contestants(runs)
        return runs.assign(regret=regrets(runs, self.reference))

    @cached_property
    def hits(self) -> pd.DataFrame:
        """When each run first reached each target, with the solver's ``label``."""
        found = hits(self.judged, self.answers, self.reference, GAPS)
        return found.merge(self.judged[[*RUN, "label"]], on=RUN)

    @cached_property
    def solvers(self) -> pd.DataFrame:
        """One row for each problem and solver; see :meth:`_solver` for the columns."""
        own = dict(iter(self.hits.groupby(GROUP)))
        groups = self.judged.groupby(GROUP)
        return pd.DataFrame(
            [dict(zip(GROUP, key, strict=True)) | self._solver(runs, own.get(key)) for key, runs in groups]
        )

    def _solver(self, runs: pd.DataFrame, hit: pd.DataFrame | None) -> dict[str, Any]:
        """Return counts, shares, quality and times of one solver on one problem.

        ``success_share`` is verified runs of all, ``correct_share`` verified of those the solver called solved; both
        with Wilson's interval. ``objective_mean`` is over verified runs. ``sgm_s`` is the shifted geometric mean of
        build and solve, a run without a verified answer counting as its limit, or the longest run where there is none.
        ``ert_*_s`` is the expected running time to a verified answer within a gap of the reference.
        """
        good, claimed = runs[runs["verified"]], int(runs["claimed"].sum())
        correct = int((runs["claimed"] & runs["verified"]).sum())
        limit = runs["limit_s"].fillna(runs["spent_s"].max())
        row: dict[str, Any] = {"runs": len(runs), "solved": claimed, "verified": len(good)}
        row |= _ranged("success_share", len(good) / len(runs), share_interval(len(good), len(runs)))
        row |= _ranged("correct_share", correct / claimed if claimed else np.nan, share_interval(correct, claimed))
        row |= _ranged("objective_mean", good["objective"].mean(), interval(good["objective"].to_numpy()))
        row["regret_median_percent"] = 100 * good["regret"].median()
        row["regret_worst_percent"] = 100 * good["regret"].max()
        row["sgm_s"] = shifted_geometric_mean(runs["spent_s"].where(runs["verified"], limit).to_numpy(), SHIFT_S)
        row |= {"build_median_s": runs["build_s"].median(), "solve_median_s": runs["solve_s"].median()}
        for gap in GAPS:
            name = f"ert_{100 * gap:g}_percent_s"
            at = hit[hit["gap"] == gap] if hit is not None else None
            if at is None or at.empty:
                row |= _ranged(name, np.nan, (np.nan, np.nan))
            else:
                times, reached = at["time_s"].to_numpy(), at["reached"].to_numpy(dtype=bool)
                row |= _ranged(name, float(ert(times, reached)), ert_interval(times, reached))
        return row

    @cached_property
    def pairs(self) -> pd.DataFrame:
        """Every two solvers over the same problems and seeds."""
        return paired(self.judged[self.judged["status"] != "SKIPPED"])

    @cached_property
    def times(self) -> pd.DataFrame:
        """Time of each solver to each target of what all solvers tried; empty where that is nothing."""
        return work_table(self.hits, "time_s")

    @cached_property
    def performance(self) -> pd.DataFrame:
        """Performance profiles of time to each target."""
        return performance_profile(self.times)

    @cached_property
    def data(self) -> pd.DataFrame:
        """Data profiles of evaluations to each target."""
        work = work_table(self.hits, "evaluations")
        variables = self.judged.groupby(PROBLEM)["variables"].max()
        count = pd.Series([variables[key[:2]] for key in work.index], index=work.index, dtype=float)
        return data_profile(work, count)

    @cached_property
    def reached(self) -> pd.DataFrame:
        """Share of all runs and targets reached within a time."""
        return ecdf(self.hits)

    @cached_property
    def anytime(self) -> pd.DataFrame:
        """Quartiles of regret of the best verified answer held at a time."""
        return anytime(self.judged, self.answers, self.reference)


def _ranged(name: str, value: float, ends: tuple[float, float]) -> dict[str, float]:
    return {name: value, f"{name}_low": ends[0], f"{name}_high": ends[1]}


def as_text(table: pd.DataFrame) -> pd.DataFrame:
    """Return the table of solvers as strings: value and, where there is one, its 95 % interval."""
    text = pd.DataFrame({"problem": table["cell"] + ", " + table["formulation"], "solver": contestants(table)})
    text["runs"] = table["runs"].astype(str)
    for name, (heading, form) in HEADINGS.items():
        text[heading] = [_told(row, name, form) for _, row in table.iterrows()]
    return text


def _told(row: pd.Series, name: str, form: str) -> str:
    low, high = row.get(f"{name}_low", np.nan), row.get(f"{name}_high", np.nan)
    if pd.isna(row[name]):
        return ""
    interval_ = "" if pd.isna(low) or low == high else f" ({_shown(low, form)}–{_shown(high, form)})"
    return _shown(row[name], form) + interval_


def _shown(value: float, form: str) -> str:
    return "∞" if np.isinf(value) else form.format(value)
