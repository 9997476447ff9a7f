"""The reduced form: coordinates of placement and bases are the variables, joints eliminated by inverse kinematics."""

from dataclasses import dataclass
from functools import partial

import numpy as np

from nlpweld.cell.cell import Cell
from nlpweld.cell.task import Positioner
from nlpweld.formulation.batch import CONSTRAINTS, Batch
from nlpweld.formulation.holder import held
from nlpweld.formulation.margins import with_margins
from nlpweld.formulation.nlp import Nlp, Relaxation
from nlpweld.formulation.paths import Limits, allowed, best_wrist, joint_paths, on_wrist, settle
from nlpweld.formulation.smooth import Gaps, near_gaps, relaxation
from nlpweld.formulation.stage import Stage
from nlpweld.formulation.tilting import tilted_path
from nlpweld.geometry.seam import seam_parameters
from nlpweld.kinematics.ik import WRIST, signs
from nlpweld.plan import Plan


@dataclass(frozen=True)
class OutOfReach:
    """Why a placement has no joint paths.

    Attributes:
        cell: the cell.
        station: name of the robot that cannot reach.
        point: the worst seam point.
    """

    cell: Cell
    station: str
    point: int


def reduced(cell: Cell, engine: str = "auto") -> Nlp:
    """Return the reduced form of a cell: variables are the free coordinates of its placement and layout [m; rad].

    Those are the origin of C in W for Pan et al. (the three genes), and where the positioner stands, (HD, FB), for
    Zhang et al.; then what the cell's layout frees of its robots' bases.

    Args:
        cell: the cell.
        engine: ``numpy``, ``numba``, ``c`` or ``auto``; for a handful of candidates NumPy is ready sooner.
    """
    batch = Batch(cell, engine)
    return Nlp(
        problem=cell.name,
        formulation="reduced",
        names=cell.variables,
        lower=cell.box[0],
        upper=cell.box[1],
        constraints=CONSTRAINTS,
        evaluate=batch.evaluate,
        unpack=Unpacker(batch),
        relax=Relaxer(batch),
        n_modes=len(batch.modes),
        widened=lambda extra: reduced(with_margins(cell, extra), engine),
        prepare=batch.prepare,
        screen=(lambda: batch.screening) if len(batch.modes) > 1 else None,
        rebuild=partial(reduced, cell, engine),
    )


@dataclass(frozen=True)
class Relaxer:
    """Builds the smooth side of a cell for Ipopt and its kin.

    Attributes:
        batch: the exact model; it tells which bodies can come near each other.
        within_m: bodies that never come nearer than this at any sample of the mode are left out.
        enough: samples that must count, else nothing is left out.
    """

    batch: Batch
    within_m: float = 0.2
    enough: int = 4

    def __call__(self, mode: int, whole: bool = False) -> Relaxation:
        """Return the relaxation on a mode's branches, with every distance if whole.

        What is left out is a guess from a sample; the exact model, which leaves nothing out, judges the answer.
        """
        batch = self.batch
        gaps = None if whole else self.near(mode)
        return relaxation(batch.stage, batch.modes[mode], gaps, batch.chosen_engine)

    def near(self, mode: int) -> Gaps | None:
        """Return the distances that matter where the mode keeps all else, or nearly so; None if that is too seldom."""
        X = self.batch.screening.at(mode)
        if len(X) < self.enough:
            return None
        return near_gaps(self.batch.stage, self.batch.modes[mode], X, self.batch.points, self.within_m)


@dataclass(frozen=True)
class Unpacker:
    """Turns a placement and a mode into joint paths.

    Attributes:
        batch: the exact model, which knows the modes.
        stage: graphs to use instead of the exact model's.
        points: data of the seam points for them, shape (k, N).
    """

    batch: Batch
    stage: Stage | None = None
    points: np.ndarray | None = None

    def __call__(self, x: np.ndarray, mode: int) -> Plan | OutOfReach:
        """Return the plan of placement x (d,) on a mode's branches, or who cannot reach which point."""
        cell, paths, branches = self.batch.cell, {}, {}
        closed = cell.seam.closed
        for k, station in enumerate(cell.stations):
            shoulder, elbow = self.batch.modes[mode][k]
            cos_sin, reach = self._solve(k, x, (shoulder, elbow))
            if reach.min() < 0.0:
                return OutOfReach(cell.laid_out(x), station.name, int(reach.argmin()))
            lanes = cos_sin[:, None, :]
            wrists = allowed(cell.configuration.wrist, WRIST)
            need = np.radians(cell.constraints.joint_margin_deg)
            wrist = wrists[best_wrist(Limits.of(station.robot, closed), lanes, wrists, need)[1][0]]
            q = settle(station.robot, on_wrist(station.robot, joint_paths(station.robot, lanes, closed), wrist), need)
            paths[station.name] = q[0, :, : lanes.shape[2]].T
            branches[station.name] = (shoulder, elbow, wrist)
        s, placement = seam_parameters(cell), cell.placement(x)
        if cell.positioner:
            paths[cell.positioner.name] = self._turned(cell.positioner, held(cell, s).q)
        return Plan(cell.laid_out(x), placement[:3], s, paths, branches, float(placement[3]))

    def _turned(self, positioner: Positioner, q: np.ndarray | None) -> np.ndarray:
        """Return the positioner's joints at the seam points, shape (N, n) [rad]."""
        assert q is not None
        if self.stage is None or self.stage.table is None or self.points is None:
            return q
        cos_sin = self.stage.table.map(self.points.shape[1])(self.points)[0]
        return tilted_path(positioner.robot, np.array(cos_sin), q)

    def _solve(self, k: int, x: np.ndarray, branch: tuple[str, str]) -> tuple[np.ndarray, np.ndarray]:
        """Return cosines and sines (12, N) and reach (N,) of station k by the CasADi graph itself."""
        points = self.batch.points if self.points is None else self.points
        n = points.shape[1]
        out = (
            (self.stage or self.batch.stage)
            .arms[k]
            .map(n)(np.repeat(np.reshape(x, (-1, 1)), n, axis=1), points, np.array([signs((*branch, "noflip"))] * n).T)
        )
        cos_sin = np.array(out[0]).reshape(6, n, 2).transpose(2, 0, 1).reshape(12, n)
        return cos_sin, np.array(out[3]).ravel()
