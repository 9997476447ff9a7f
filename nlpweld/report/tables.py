"""The results table: one row for each cell, formulation, solver and preset, and one for each baseline."""

from pathlib import Path

import numpy as np
import pandas as pd
from rich.markup import escape
from rich.table import Table

from nlpweld.plan import write_bytes, write_text
from nlpweld.records.frames import AXES
from nlpweld.report.markup import latex, markdown
from nlpweld.report.records import load_reference, maximised
from nlpweld.report.statistics import as_text as statistics_as_text
from nlpweld.report.study import Study

GROUP = ["cell", "formulation", "solver", "preset"]
HEADINGS = {
    "runs": "runs", "claimed": "solved", "verified": "verified", "objective": "mean ± sd", "objective_best": "best",
    "share_percent": "% of best", "regret_percent": "regret %", "evaluations_median": "evals",
    "build_median_s": "build s", "solve_median_s": "solve s", "to_reference_mm": "to C mm",
}  # fmt: skip
FORMATS = {
    "runs": "{:.0f}", "claimed": "{:.0f}", "verified": "{:.0f}", "objective_best": "{:.5f}", "share_percent": "{:.2f}",
    "regret_percent": "{:z.3f}", "evaluations_median": "{:.0f}", "build_median_s": "{:.2f}", "solve_median_s": "{:.2f}",
    "to_reference_mm": "{:.1f}",
}  # fmt: skip
NARROW = {
    "verified": "veri-\nfied", "% of best": "% of\nbest", "regret %": "regret\n[%]",
    "evals": "evals\nmedian", "build s": "build\n[s]", "solve s": "solve\n[s]", "to C mm": "to C\n[mm]",
}  # fmt: skip
SMALLEST_SPREAD = 1e-5  # what five decimals can show
WIDE = 100  # columns of a screen that takes the whole summary
COUNTS = ("runs", "claimed", "verified", "failed")


def write_tables(folder: str | Path) -> pd.DataFrame:
    """Write the tables of a study and return the summary.

    Those are ``tables/summary`` and ``tables/statistics`` as CSV, LaTeX and Markdown, ``tables/pairs.csv``,
    ``tables/runs.csv``, and ``records.parquet`` with the same rows.

    Args:
        folder: the study's folder, with ``records/`` and perhaps ``baselines/`` below it.

    Raises:
        OptionError: the folder holds no records.
        OutputError: a record is broken, or the tables cannot be written.
    """
    study = Study(Path(folder))
    table = summary(study.runs, study.baselines, load_reference(folder))
    tables = study.folder / "tables"
    write_text(tables / "runs.csv", study.runs.to_csv(index=False))
    write_bytes(study.folder / "records.parquet", study.runs.to_parquet(index=False))
    write_text(tables / "pairs.csv", study.statistics.pairs.to_csv(index=False))
    for name, whole, shown in (
        ("summary", table, as_text(table)),
        ("statistics", study.statistics.solvers, statistics_as_text(study.statistics.solvers)),
    ):
        write_text(tables / f"{name}.csv", whole.to_csv(index=False))
        write_text(tables / f"{name}.tex", latex(shown))
        write_text(tables / f"{name}.md", markdown(shown))
    return table


def summary(runs: pd.DataFrame, baselines: pd.DataFrame, reference: pd.Series | None = None) -> pd.DataFrame:
    """Return the summary of runs and baselines.

    Mean, spread, best, share and distance are over verified runs alone; medians are over all runs that came to an
    end by themselves. ``share_percent`` is the mean as a share of the best verified objective in the same cell;
    ``objective_*`` are of what the row's runs maximise, which ``maximised`` says;
    ``to_reference_mm`` the distance of the row's best placement from the cell's first baseline (the paper's C). With a
    reference, ``regret_percent`` is by how much of it the mean falls short, and stands in place of the distance.

    Args:
        runs: as from :func:`nlpweld.records.frames.runs_frame`.
        baselines: as from :func:`nlpweld.report.records.load_baselines`.
        reference: as from :func:`nlpweld.report.records.load_reference`.
    """
    rows = [{**dict(zip(GROUP, key, strict=True)), **_solver_row(group)} for key, group in runs.groupby(GROUP)]
    rows += [_baseline_row(row) for _, row in baselines.iterrows()]
    table = pd.DataFrame(rows)
    best = table.groupby("cell")["objective_best"].transform("max")
    table["share_percent"] = 100 * table["objective_mean"] / best
    if reference is None or reference.empty:
        table["to_reference_mm"] = _distance_mm(table, baselines)
    else:
        best = reference.reindex(table["cell"]).to_numpy()
        table["regret_percent"] = (100 * (best - table["objective_mean"]) / best).round(9) + 0.0
    table = table.astype(dict.fromkeys(COUNTS, "Int64"))
    named = ("objective_mean" if name == "objective" else name for name in HEADINGS)
    order = [*GROUP, "maximised", *(name for name in named if name in table)]
    order.insert(order.index("objective_mean") + 1, "objective_std")
    order.insert(order.index("verified") + 1, "failed")
    return table.sort_values("cell", kind="stable")[[*order, *AXES]].reset_index(drop=True)


def format_summary(table: pd.DataFrame, width: int = 100) -> Table:
    """Return the summary as a rich table with a section for each cell.

    Args:
        table: as from :func:`summary`.
        width: columns of the screen; below 100 the best MMR and the build time are left out, and what is maximised
            stands beside the cell's name, which fits 80.
    """
    text = _as_text(table)
    cells = table["cell"].astype(str)
    if width < WIDE:
        text = text.drop(columns=["best", "build s"])
        if "maximised" in text:
            cells += ": " + text.pop("maximised")
    shown = Table(box=None, padding=(0, 1, 0, 0), pad_edge=False, header_style="bold")
    for name in text.columns:
        left = name in ("solver", "maximised")
        shown.add_column(
            escape(NARROW.get(name, name.replace(" mean ±", "\nmean ±"))),
            justify="left" if left else "right",
            overflow="fold",
            no_wrap=not left,
        )
    previous = None
    for cell, values in zip(cells, text.to_numpy(), strict=True):
        if cell != previous:
            shown.add_row(escape(cell), style="bold cyan")
        shown.add_row(escape(f"  {values[0]}"), *values[1:])
        previous = cell
    return shown


def as_text(table: pd.DataFrame) -> pd.DataFrame:
    """Return the summary as strings under the headings people read, the cell first."""
    text = _as_text(table)
    text.insert(0, "cell", table["cell"].astype(str))
    return text


def _solver_row(group: pd.DataFrame) -> dict[str, object]:
    good = group[group["verified"] & group["objective"].notna()]
    ended = group[~group["status"].isin(["FAILED", "SKIPPED"])]
    row: dict[str, object] = {
        "runs": len(group),
        "claimed": int(group["claimed"].sum()),
        "verified": len(good),
        "failed": int((group["status"] == "FAILED").sum()),
        "maximised": maximised(_told(group).iloc[0]),
        "objective_mean": good["objective"].mean(),
        "objective_std": good["objective"].std(),
        "objective_best": good["objective"].max(),
        "evaluations_median": ended["evaluations"].median(),
        "build_median_s": ended["build_s"].median(),
        "solve_median_s": ended["solve_s"].median(),
    }
    best = good.loc[good["objective"].idxmax()] if len(good) else None
    return row | {axis: np.nan if best is None else best[axis] for axis in AXES}


def _told(runs: pd.DataFrame) -> pd.DataFrame:
    """Return the runs whose report says what they maximise, or all if none does."""
    return runs[runs["reading"].notna()] if runs["reading"].notna().any() else runs


def _baseline_row(baseline: pd.Series) -> dict[str, object]:
    """Return a baseline's row; its objective counts only if the verifier found it feasible."""
    value = baseline["objective"] if baseline["feasible"] else np.nan
    row = {"cell": baseline["cell"], "formulation": "", "solver": baseline["name"], "preset": ""}
    row |= {"maximised": maximised(baseline), "verified": int(baseline["feasible"])}
    row |= {"objective_mean": value, "objective_best": value}
    return row | {axis: baseline[axis] for axis in AXES}


def _distance_mm(table: pd.DataFrame, baselines: pd.DataFrame) -> np.ndarray:
    """Return the distance of each row's best placement from the first baseline of its cell [mm], NaN without one."""
    first = baselines.drop_duplicates("cell").set_index("cell")[list(AXES)].astype(float)
    reference = first.reindex(table["cell"]).to_numpy()
    return 1e3 * np.linalg.norm(table[list(AXES)].to_numpy(dtype=float) - reference, axis=1)


def _as_text(table: pd.DataFrame) -> pd.DataFrame:
    """Return the summary as strings under the headings people read, blank where there is nothing to say."""
    text = pd.DataFrame(index=table.index)
    text["solver"] = [_label(row, table["formulation"]) for _, row in table.iterrows()]
    several = table["maximised"].nunique() > 1
    for name, heading in HEADINGS.items():
        if name == "objective":
            if several:
                text["maximised"] = table["maximised"]
            text[f"{'' if several else table['maximised'].iloc[0] + ' '}{heading}"] = _mean_and_spread(table)
        elif name in table:
            text[heading] = [_shown(v, FORMATS[name]) for v in table[name]]
    return text


def _label(row: pd.Series, formulations: pd.Series) -> str:
    """Return ``solver``, ``solver:preset``, and the formulation where the table has several."""
    label = row["solver"] if row["preset"] in ("", "default") else f"{row['solver']}:{row['preset']}"
    several = formulations[formulations != ""].nunique() > 1
    return f"{label} ({row['formulation']})" if several and row["formulation"] else label


def _mean_and_spread(table: pd.DataFrame) -> list[str]:
    pairs = zip(table["objective_mean"], table["objective_std"], strict=True)
    return [_shown(m, "{:.5f}") + _spread(s) for m, s in pairs]


def _spread(std: float) -> str:
    if pd.isna(std):
        return ""
    return f" ± {std:.5f}" if std >= SMALLEST_SPREAD else " ± <1e-5"


def _shown(value: float, form: str) -> str:
    return "" if pd.isna(value) else form.format(value)
