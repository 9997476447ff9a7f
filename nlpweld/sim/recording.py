"""What a simulation keeps: states at instants, forces at the grasps, contacts, distances."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from nlpweld.cell import Cell
from nlpweld.sim.mj import mujoco
from nlpweld.sim.model import handlers, joint_total
from nlpweld.sim.options import SimOptions
from nlpweld.verify.bodies import WORKPIECE

FAR_M = 10.0  # distances are not told beyond it


@dataclass
class Contact:
    """Two bodies that touched without a break.

    Attributes:
        pair: their names.
        from_s: when it began.
        until_s: when it ended.
        depth_m: deepest penetration.
        deepest_s: when that was.
    """

    pair: str
    from_s: float
    until_s: float
    depth_m: float
    deepest_s: float


@dataclass(eq=False)
class Recording:
    """What a simulation kept, at K instants.

    Attributes:
        t_s: the instants, shape (K,).
        q: joint angles, shape (K, n) [rad].
        torque_nm: of the servos, shape (K, n).
        tcp: T_W_E of every station in order, shape (K, S, 4, 4).
        work: T_W_C, shape (K, 4, 4).
        wrench: what each carrier exerts on the workpiece at its grasp, in W: force, then torque, shape (K, G, 6)
            [N; N m].
        clearance_m: least distance of any pair, shape (K,); negative is penetration, NaN where it was not measured.
        clearance_pair: which pair that was, of ``pairs``, shape (K,).
        pairs: names of the pairs that may not touch.
        contacts: all, in the order they began.
        diverged_s: when MuJoCo gave up, or None.
    """

    t_s: np.ndarray
    q: np.ndarray
    torque_nm: np.ndarray
    tcp: np.ndarray
    work: np.ndarray
    wrench: np.ndarray
    clearance_m: np.ndarray
    clearance_pair: np.ndarray
    pairs: tuple[str, ...]
    contacts: list[Contact] = field(default_factory=list)
    diverged_s: float | None = None

    @property
    def kept(self) -> dict[str, np.ndarray]:
        """The arrays over the instants by name."""
        names = ("t_s", "q", "torque_nm", "tcp", "work", "wrench", "clearance_m", "clearance_pair")
        return {name: getattr(self, name) for name in names}


class Keeper:
    """What is kept of a run, written as it goes."""

    def __init__(self, cell: Cell, model: Any, t_s: np.ndarray, options: SimOptions) -> None:
        """Make room.

        Args:
            cell: the cell.
            model: what is simulated.
            t_s: instants of all steps, shape (N,).
            options: how often to keep states and to measure distances.
        """
        mj, numerics = mujoco(), options.numerics
        self.model, self.n, self.count = model, joint_total(cell), 0
        self.step_s, self.limit_nm = numerics.step_s, options.servos.torque_limit_nm
        self.every = max(1, round(1 / (numerics.hz * numerics.step_s)))
        self.measure_every = max(1, round(numerics.hz / numerics.clearance_hz))
        self.tcps = [model.site(f"{station.name}.tcp").id for station in cell.stations]
        self.grasps = [model.site(f"{station.name}.grasp").id for station in handlers(cell)]
        self.work, self.weld = model.body(WORKPIECE).id, int(mj.mjtConstraint.mjCNSTR_EQUALITY)
        self.kp, self.kv = model.actuator_gainprm[:, 0], -model.actuator_biasprm[:, 2]
        self.open: dict[str, Contact] = {}
        K, n = -(-len(t_s) // self.every), self.n
        self.to = Recording(
            t_s=np.zeros(K),
            q=np.zeros((K, n)),
            torque_nm=np.zeros((K, n)),
            tcp=np.tile(np.eye(4), (K, len(self.tcps), 1, 1)),
            work=np.tile(np.eye(4), (K, 1, 1)),
            wrench=np.zeros((K, len(self.grasps), 6)),
            clearance_m=np.full(K, np.nan),
            clearance_pair=np.zeros(K, dtype=int),
            pairs=tuple(self._pair(a, b) for a, b in zip(model.pair_geom1, model.pair_geom2, strict=True)),
        )

    def keep(self, k: int, t_s: float, q: np.ndarray, data: Any) -> None:
        """Keep step k, after it: the joints as they were before it, the rest as the step has left it."""
        if data.ncon:
            self._touch(t_s, data)
        if k % self.every == 0:
            self._state(t_s, q, data)
            if self.count % self.measure_every == 0:
                self._clearance(data)
            self.count += 1

    def recording(self, diverged_s: float | None) -> Recording:
        """Return what was kept."""
        for name, x in self.to.kept.items():
            setattr(self.to, name, x[: self.count])
        self.to.diverged_s = diverged_s
        return self.to

    def _state(self, t_s: float, q: np.ndarray, data: Any) -> None:
        i, to = self.count, self.to
        to.t_s[i], to.q[i], to.torque_nm[i] = t_s, q, self._torque(data)
        to.tcp[i, :, :3, :3] = data.site_xmat[self.tcps].reshape(-1, 3, 3)
        to.tcp[i, :, :3, 3] = data.site_xpos[self.tcps]
        to.work[i, :3, :3] = data.xmat[self.work].reshape(3, 3)
        to.work[i, :3, 3] = data.xpos[self.work]
        for g, site in enumerate(self.grasps):
            to.wrench[i, g] = self._wrench(data, g, data.site_xpos[site])

    def _torque(self, data: Any) -> np.ndarray:
        """Return what the servos give at the step's end, where the discrete integrator takes them, shape (n,) [N m]."""
        if self.model.opt.integrator != mujoco().mjtIntegrator.mjINT_DISCRETE:
            return data.actuator_force
        n = self.n
        torque = self.kp * (data.ctrl - data.qpos[:n]) - self.kv * data.qvel[:n]
        return torque if self.limit_nm is None else np.clip(torque, -self.limit_nm, self.limit_nm)

    def _wrench(self, data: Any, weld: int, grasp_m: np.ndarray) -> np.ndarray:
        """Return force and torque (6,) of one weld on the free workpiece at a point, in W.

        The rows of the constraint, as the workpiece's six coordinates see them, are a force in W and a torque in C
        about C's origin; that holds however MuJoCo scales the rows.
        """
        rows = (data.efc_type[: data.nefc] == self.weld) & (data.efc_id[: data.nefc] == weld)
        J = data.efc_J.reshape(data.nefc, -1)[rows, self.n : self.n + 6]
        felt = J.T @ data.efc_force[rows]
        arm = grasp_m - data.xpos[self.work]
        return np.append(felt[:3], data.xmat[self.work].reshape(3, 3) @ felt[3:] - np.cross(arm, felt[:3]))

    def _touch(self, t_s: float, data: Any) -> None:
        """Lengthen or begin the contacts there are."""
        for contact in data.contact[: data.ncon]:
            pair, depth = self._pair(*contact.geom), float(-contact.dist)
            known = self.open.get(pair)
            if known is None or t_s - known.until_s > 1.5 * self.step_s:
                self.open[pair] = known = Contact(pair, t_s, t_s, depth, t_s)
                self.to.contacts.append(known)
            known.until_s = t_s
            if depth > known.depth_m:
                known.depth_m, known.deepest_s = depth, t_s

    def _clearance(self, data: Any) -> None:
        apart = pair_distances(self.model, data)
        if len(apart):
            self.to.clearance_pair[self.count] = apart.argmin()
            self.to.clearance_m[self.count] = apart.min()

    def _pair(self, one: int, other: int) -> str:
        return f"{self.model.geom(one).name} - {self.model.geom(other).name}"


def pair_distances(model: Any, data: Any) -> np.ndarray:
    """Return the distance of every contact pair of a model in a state, shape (P,) [m]; negative is penetration."""
    measure = mujoco().mj_geomDistance
    pairs = zip(model.pair_geom1, model.pair_geom2, strict=True)
    return np.array([measure(model, data, a, b, FAR_M, None) for a, b in pairs])
