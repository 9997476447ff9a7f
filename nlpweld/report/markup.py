"""Tables of text as LaTeX and Markdown."""

import pandas as pd

LATEX = {
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "±": r"$\pm$",
    "<": r"$<$",
    "–": "--",
    "∞": r"$\infty$",
} | {c: f"\\{c}" for c in "&%$#_{}"}


def latex(text: pd.DataFrame) -> str:
    """Return a table as a LaTeX tabular with booktabs rules, the first two columns to the left."""
    escaped = text.map(_escaped)
    escaped.columns = [_escaped(name) for name in text.columns]
    style = escaped.style.hide(axis="index")
    return style.to_latex(hrules=True, column_format="ll" + "r" * (len(text.columns) - 2))


def markdown(text: pd.DataFrame) -> str:
    """Return a table as Markdown, the first two columns to the left."""
    cells = text.map(lambda value: str(value).replace("|", "\\|"))
    lines = [cells.columns, ["---", "---", *["---:"] * (len(cells.columns) - 2)], *cells.to_numpy()]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def _escaped(text: object) -> str:
    return "".join(LATEX.get(c, c) for c in str(text))
