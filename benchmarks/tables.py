"""The measured rows as text."""

import pandas as pd

from benchmarks import candidates, contenders, parts

TIMES = {"times_naive": "x naive", "times_naive_early": "x naive_early", "times_peers": "x peers"}


def markdown(rows: pd.DataFrame, about: dict, instructions: int) -> str:
    """Return all results as one Markdown document."""
    pieces = [
        "# Speed",
        f"{about['processor']}, {about['cores']} cores, "
        f"{'held to one core' if about['held_to_one_core'] else 'not held to one core'}; Python {about['python']}. "
        "One process, contenders in turn, medians over rounds. Ratios are taken within a round; only they count. "
        "Cell `three_er16`, every clearance, 72 seam points.",
        "\n".join(f"- `{name}`: {what}" for name, what in contenders.WHAT.items()),
        "## Whole candidates",
        *(piece for kind, what in candidates.SETS.items() for piece in _candidates(rows, kind, what)),
        f"The share of the peak counts {instructions} arithmetic instructions a seam point, each as one multiply-add "
        f"at {about['peak_multiply_adds_per_s'] / 1e9:.1f} G/s ({about['peak_measured_by']}). The engines find most "
        "distances unneeded and so count for more than they compute. Divisions and square roots take longer, and "
        "unwrapping is not counted.",
        "## Parts",
        *(piece for part, what in parts.WHAT.items() for piece in _parts(rows, part, what)),
        *_others(rows),
    ]
    return "\n\n".join(pieces) + "\n"


def _candidates(rows: pd.DataFrame, kind: str, what: str) -> list[str]:
    found = rows[(rows.section == "candidate") & (rows.what == kind)]
    lines = ["| contender | candidates/s | ms | " + " | ".join(TIMES.values()) + " | share of peak |"]
    lines.append("|---|" + "---:|" * (len(TIMES) + 3))
    for _, row in found.iterrows():
        cells = [row.contender, f"{row.per_s:,.4g}", f"{row.median_s * 1e3:.4g}", *_times(row), _share(row)]
        lines.append("| " + " | ".join(cells) + " |")
    return [f"**{kind}**: {what}", "\n".join(lines)]


def _parts(rows: pd.DataFrame, part: str, what: str) -> list[str]:
    found = rows[(rows.section == "part") & (rows.what == part)]
    bound = found.bound_s.iloc[0] * 1e9
    lines = ["| contender | ns | x naive | x peers | share of peak |", "|---|---:|---:|---:|---:|"]
    for _, row in found.iterrows():
        cells = [row.contender, f"{row.median_s * 1e9:,.0f}", _times(row)[0], _times(row)[2], _share(row)]
        lines.append("| " + " | ".join(cells) + " |")
    return [f"**{part}**: {what}; bound {bound:.1f} ns", "\n".join(lines)]


def _others(rows: pd.DataFrame) -> list[str]:
    """Return tables of solvers and cold starts."""
    pieces = []
    for section, title in (("solver", "Solvers"), ("start", "Cold starts")):
        found = rows[rows.section == section]
        if len(found):
            lines = ["| what | who | median s | note |", "|---|---|---:|---|"]
            lines += [f"| {r.what} | {r.contender} | {r.median_s:.4g} | {r.note} |" for _, r in found.iterrows()]
            pieces += [f"## {title}", "\n".join(lines)]
    return pieces


def _times(row: pd.Series) -> list[str]:
    return ["" if pd.isna(row[name]) else f"{row[name]:,.4g}" for name in TIMES]


def _share(row: pd.Series) -> str:
    return "" if pd.isna(row.share_of_peak) else f"{row.share_of_peak:.1%}"
