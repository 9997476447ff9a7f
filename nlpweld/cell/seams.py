"""Seams beside the saddle: lines and arcs put end to end, and rows of points with normals.

Errors raised here become one line of :class:`~nlpweld.errors.CellError` when a file is loaded; pieces and vertices
count from 1.
"""

from typing import Annotated, Literal

import numpy as np
from pydantic import Field, StrictBool, model_validator

from nlpweld.cell.checked import Checked, Finite, Sourced, Vector
from nlpweld.cell.track import ACROSS, JOINED_M, SHORTEST_M, Track, arc, line, refuse_turning_back

Count = Annotated[int, Field(strict=True, ge=2, le=100_000)]


class Line(Checked):
    """A straight piece from where the one before ends to a point in C."""

    kind: Literal["line"]
    to_m: Vector


class Arc(Checked):
    """A circular piece from where the one before ends, turned right-hand about an axis through a centre in C."""

    kind: Literal["arc"]
    centre_m: Vector
    axis: Vector
    angle_deg: Finite


Piece = Annotated[Line | Arc, Field(discriminator="kind")]


class Composite(Sourced):
    """Lines and arcs put end to end, points in equal steps of arc length (the U seam of Zhang et al., Fig. 7).

    The weld normal is ``side x tangent``, leaned by ``lean_deg`` towards ``side``, turning about the tangent. On an
    arc about +side that is, without a lean, the Frenet normal, towards the centre.

    Attributes:
        points: number of seam points; an open seam has one at either end, a closed one does not repeat the first.
        start_m: where the first piece starts, in C.
        pieces: the lines and arcs in order.
        side: direction in C across the seam, of any length, nowhere along it.
        lean_deg: 0 in the plane of a planar seam with ``side`` across that plane; +-90 along it.
        closed: whether the last piece ends where the first starts.
    """

    curve: Literal["composite"]
    points: Count
    start_m: Vector
    pieces: Annotated[tuple[Piece, ...], Field(min_length=1)]
    side: Vector
    lean_deg: Finite = 0.0
    closed: StrictBool = False

    @model_validator(mode="after")
    def _pieces_make_a_seam(self) -> "Composite":
        if self.closed and self.points < 3:
            raise ValueError("points is below 3; a closed seam needs three")
        track = self.track
        refuse_turning_back(track, self.closed, "piece")
        gap = float(np.linalg.norm(track.ends()[0][-1] - track.start[0]))
        if self.closed and gap > JOINED_M:
            raise ValueError(
                f"closed, but piece {len(self.pieces)} ends {gap:.3g} m away from start_m; "
                "join them or set closed = false"
            )
        return self

    @model_validator(mode="after")
    def _side_is_across_the_seam(self) -> "Composite":
        if not any(self.side):
            raise ValueError("side is zero; give a direction across the seam")
        along = self.track.least_sine(self.across) < ACROSS
        if along.any():
            raise ValueError(
                f"side is parallel to the tangent of piece {int(np.flatnonzero(along)[0]) + 1}, "
                "so that the normal has no direction; choose one across the seam"
            )
        return self

    @property
    def across(self) -> np.ndarray:
        """Unit vector of ``side``, shape (3,)."""
        return np.array(self.side) / np.linalg.norm(self.side)

    @property
    def track(self) -> Track:
        """The pieces as numbers, in C.

        Raises:
            ValueError: a piece has no length, or does not join the one before.
        """
        at, rows = np.array(self.start_m), []
        for number, piece in enumerate(self.pieces, start=1):
            try:
                rows.append(_row(piece, at))
            except ValueError as error:
                raise ValueError(f"piece {number}: {error}") from None
            at = np.array(piece.to_m) if isinstance(piece, Line) else _track(rows[-1:]).ends()[0][0]
        return _track(rows)

    def beside(self, offset_m: float, lean_deg: float | None = None) -> "Composite":
        """Return the same seam moved along ``side``, e.g. the one on the other edge of a wall or trough.

        Args:
            offset_m: how far along +side [m].
            lean_deg: lean of the normal there; that of this seam by default [deg].

        Raises:
            pydantic.ValidationError: a number is not finite.
        """
        data = self.model_dump(exclude_unset=True)
        data["start_m"] = self._moved(self.start_m, offset_m)
        for piece in data["pieces"]:
            field = "to_m" if piece["kind"] == "line" else "centre_m"
            piece[field] = self._moved(piece[field], offset_m)
        return Composite.model_validate(data if lean_deg is None else {**data, "lean_deg": lean_deg})

    def _moved(self, point: Vector, offset_m: float) -> tuple[float, ...]:
        return tuple((np.array(point) + offset_m * self.across).tolist())


class Polyline(Sourced):
    """Straight pieces between given points in C, each with a normal; seam points in equal steps of arc length.

    Normals are interpolated along a piece and made orthogonal to it; at a corner the piece that starts there decides.

    Attributes:
        points: number of seam points; an open seam has one at either end, a closed one does not repeat the first.
        vertices_m: the points; a closed seam does not repeat the first.
        normals: a direction of any length for each point, not along the seam.
        closed: whether a last piece leads back to the first point.
    """

    curve: Literal["polyline"]
    points: Count
    vertices_m: Annotated[tuple[Vector, ...], Field(min_length=2)]
    normals: tuple[Vector, ...]
    closed: StrictBool = False

    @model_validator(mode="after")
    def _points_make_a_seam(self) -> "Polyline":
        if len(self.normals) != len(self.vertices_m):
            raise ValueError(f"normals: {len(self.normals)} for {len(self.vertices_m)} vertices_m; give one for each")
        if self.closed and min(self.points, len(self.vertices_m)) < 3:
            raise ValueError("points or vertices_m is below 3; a closed seam needs three of both")
        _refuse_duplicates(np.array(self.vertices_m), self.closed)
        refuse_turning_back(self.track, self.closed, "piece from vertex")
        self._refuse_bad_normals()
        return self

    @property
    def track(self) -> Track:
        """The pieces between the points as numbers, in C."""
        start, end = self._both_ends(np.array(self.vertices_m))
        length = np.linalg.norm(end - start, axis=-1)
        zero = np.zeros_like(length)
        return Track(start, (end - start) / length[:, None], np.zeros_like(start), length, zero)

    @property
    def piece_normals(self) -> tuple[np.ndarray, np.ndarray]:
        """Normals at the start and at the end of each piece, across it, not of unit length, shapes (K, 3)."""
        given = np.array(self.normals)
        unit = given / np.linalg.norm(given, axis=-1, keepdims=True)
        t = self.track.tangent
        start, end = (n - np.sum(n * t, axis=-1, keepdims=True) * t for n in self._both_ends(unit))
        return start, end

    def _both_ends(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return what belongs to the start and to the end of each piece, shapes (K, 3)."""
        return (rows, np.roll(rows, -1, axis=0)) if self.closed else (rows[:-1], rows[1:])

    def _refuse_bad_normals(self) -> None:
        zero = ~np.any(self.normals, axis=-1)
        if zero.any():
            raise ValueError(f"normal of vertex {int(np.flatnonzero(zero)[0]) + 1} is zero; give a direction")
        start, end = self.piece_normals
        for at, across in (("start", start), ("end", end)):
            short = np.linalg.norm(across, axis=-1) < ACROSS
            if short.any():
                piece = int(np.flatnonzero(short)[0]) + 1
                raise ValueError(
                    f"normal at the {at} of the piece from vertex {piece} is parallel to the tangent; tilt it out"
                )
        flips = np.sum(start * end, axis=-1) < 0
        if flips.any():
            raise ValueError(
                f"normal turns by more than 90 deg along the piece from vertex {int(np.flatnonzero(flips)[0]) + 1}; "
                "give more points there or mend its sign"
            )


def _row(piece: Line | Arc, at: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, float, float]:
    if isinstance(piece, Line):
        return line(at, np.array(piece.to_m))
    return arc(at, np.array(piece.centre_m), np.array(piece.axis), float(np.radians(piece.angle_deg)))


def _track(rows: list[tuple[np.ndarray, np.ndarray, np.ndarray, float, float]]) -> Track:
    start, tangent, inward, length, curvature = (np.array(column) for column in zip(*rows, strict=True))
    return Track(start, tangent, inward, length, curvature)


def _refuse_duplicates(vertices: np.ndarray, closed: bool) -> None:
    following = np.roll(vertices, -1, axis=0)
    same = np.linalg.norm(following - vertices, axis=-1) < SHORTEST_M
    same[-1] &= closed
    if same.any():
        i = int(np.flatnonzero(same)[0])
        what = f"vertex {(i + 1) % len(same) + 1} is where vertex {i + 1} is"
        raise ValueError(f"{what}; leave one out, and do not repeat the first point of a closed seam")
