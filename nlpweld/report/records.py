"""What stands beside the records of a study: baselines and references; and what a run maximises, in words."""

import json
from pathlib import Path
from typing import Any

import pandas as pd

from nlpweld.errors import OutputError
from nlpweld.records.frames import AXES, MEASURES, report_row


def maximised(row: pd.Series) -> str:
    """Return in words what a run or baseline maximises: the robots' measure, and what of it over the seam."""
    reading, over = row.get("reading"), row.get("over_seam", "mean")
    names = {"paper": "MMR", "product": "product of w", "mean": "mean of w"}
    what = names.get(reading, f"MMR ({reading})") if isinstance(reading, str) else "MMR"
    if over == "minimum":
        return f"least {what}"
    return f"soft least {what} (p = {row['exponent']:g})" if over == "soft_minimum" else what


def load_baselines(folder: str | Path) -> pd.DataFrame:
    """Return the placements of a study that no solver found, e.g. the paper's own, one row each; may be empty.

    Raises:
        OutputError: a baseline is broken.
    """
    rows = []
    for path in sorted((Path(folder) / "baselines").glob("*.json")):
        data = read_json(path)
        try:
            at = dict(zip(AXES, map(float, data["placement"]), strict=True))
            rows.append({"name": str(data["name"]), "cell": str(data["cell"]), **at, **report_row(data["report"])})
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise OutputError(f"{path}: not a baseline ({_what(error)}); write it again") from None
    return pd.DataFrame(rows, columns=None if rows else ["name", "cell", *AXES, "feasible", "objective", *MEASURES])


def load_reference(folder: str | Path) -> pd.Series:
    """Return the best objective that sampling found in each cell, by cell, of a study that has ``data/reference.csv``.

    Raises:
        OutputError: the file is broken.
    """
    path = Path(folder) / "data" / "reference.csv"
    if not path.is_file():
        return pd.Series(dtype=float)
    try:
        return pd.read_csv(path).set_index("cell")["mmr_mean"].astype(float)
    except (OSError, ValueError, KeyError) as error:
        raise OutputError(f"{path}: not a table of references ({_what(error)}); make it again") from None


def read_json(path: Path) -> Any:
    """Read a JSON file.

    Raises:
        OutputError: it cannot be read or is not JSON.
    """
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise OutputError(f"{path}: cannot be read ({error.strerror}); check its permissions") from None
    except ValueError as error:
        raise OutputError(f"{path}: not JSON ({error}); remove it and run it again") from None


def _what(error: Exception) -> str:
    return f"missing {error}" if isinstance(error, KeyError) else str(error)
