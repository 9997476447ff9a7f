"""Seams as rows of a CSV file, with a normal for every point."""

import csv
from pathlib import Path
from typing import Any

from nlpweld.cell.files import checked
from nlpweld.cell.seams import Polyline
from nlpweld.errors import CellError

HEADER = ["x_m", "y_m", "z_m", "nx", "ny", "nz"]


def polyline_from_csv(path: str | Path, *, points: int, source: str, closed: bool = False) -> Polyline:
    """Read a seam from a CSV file with columns x_m, y_m, z_m, nx, ny, nz in the workpiece frame C.

    Args:
        path: the file.
        points: number of seam points to make of it, in equal steps of arc length.
        source: where the numbers come from.
        closed: whether the seam leads back to the first row, which is then not repeated.

    Raises:
        CellError: the file cannot be read, its header is another, or a row is not six finite numbers; or the rows
            make no seam. One line names file, row and mend.
    """
    table = {"curve": "polyline", "file": str(path), "points": points, "closed": closed, "source": source}
    return checked(Polyline, with_rows(table, Path()), Path(path))


def with_rows(table: dict[str, Any], beside: Path) -> dict[str, Any]:
    """Return the table of a seam with ``file`` replaced by that file's rows, so that a cell holds its numbers.

    Args:
        table: a ``[seam]`` table; returned as it is when it names no file.
        beside: folder that a relative ``file`` is looked up in.

    Raises:
        CellError: see :func:`polyline_from_csv`.
    """
    if "file" not in table:
        return table
    rows = _rows(beside / str(table["file"]))
    kept = {key: value for key, value in table.items() if key != "file"}
    return {**kept, "vertices_m": tuple(r[:3] for r in rows), "normals": tuple(r[3:] for r in rows)}


def _rows(path: Path) -> list[tuple[float, ...]]:
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            lines = list(csv.reader(file))
    except OSError as error:
        raise CellError(f"{path}: cannot be read ({error.strerror}); check the path and its permissions") from None
    except (UnicodeDecodeError, csv.Error) as error:
        raise CellError(f"{path}: not a CSV file: {error}; mend it") from None
    header = [name.strip() for name in lines[0]] if lines else []
    if header != HEADER:
        raise CellError(f"{path}: line 1: header is '{','.join(header)}'; write '{','.join(HEADER)}'")
    return [_numbers(path, number, row) for number, row in enumerate(lines[1:], start=2) if row]


def _numbers(path: Path, number: int, row: list[str]) -> tuple[float, ...]:
    """Return one row as numbers; NaN and infinity are left to the model, which names them."""
    if len(row) != len(HEADER):
        raise CellError(f"{path}: line {number}: {len(row)} fields instead of {len(HEADER)}; mend the row")
    try:
        values = tuple(float(text) for text in row)
    except ValueError:
        raise CellError(
            f"{path}: line {number}: '{','.join(row)}' holds something else than numbers; mend it"
        ) from None
    return values
