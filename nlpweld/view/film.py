"""The frames of a plan: where everything is and what the verifier measures there, at moments close to each other."""

from dataclasses import dataclass

import numpy as np

from nlpweld.errors import PlanError
from nlpweld.plan import Plan, joint_counts
from nlpweld.verify import reference as ref
from nlpweld.verify.between import Motion, whole_motion
from nlpweld.verify.bodies import all_ends
from nlpweld.verify.freedom import Offsets
from nlpweld.verify.measures import team_along
from nlpweld.verify.scene import look

FRAMES = 480  # kept of a plan
INSTANTS = 500  # looked at of each phase of a timed one, the short and fast ones too
STILL = 0.2  # share of the frames that is spread evenly over the cursor; the rest where bodies turn or gain speed


@dataclass(frozen=True, eq=False)
class Film:
    """K frames of a plan; dictionaries are by name of station or positioner.

    Attributes:
        plan: the plan.
        timed: whether the cursor is time.
        x: the cursor, increasing, shape (K,): time [s], or the seam parameter.
        s: seam parameter, shape (K,); along a closed seam up to one turn on.
        welding: whether the torches weld, shape (K,).
        poses: T_W_L of all links (``robot.link0``...), T_W_E (``robot.tcp``) and T_W_C (``workpiece``) by name, each of
            shape (K, 4, 4).
        joints: angles in DH direction, each of shape (K, n) [rad].
        w: manipulability by station, each of shape (K,) [m^3].
        team: the cell's reading of all robots' manipulability, shape (K,).
        clearance_m: least distance of all pairs, shape (K,).
        pair: which one it is, index into ``pair_labels``, shape (K,).
        pair_labels: the pairs that are ever the nearest.
        worst: index of the frame at which a measure is least: ``w.<station>`` and ``team`` while welding,
            ``clearance`` ever.
    """

    plan: Plan
    timed: bool
    x: np.ndarray
    s: np.ndarray
    welding: np.ndarray
    poses: dict[str, np.ndarray]
    joints: dict[str, np.ndarray]
    w: dict[str, np.ndarray]
    team: np.ndarray
    clearance_m: np.ndarray
    pair: np.ndarray
    pair_labels: list[str]
    worst: dict[str, int]


def film(plan: Plan, timed: bool, frames: int = FRAMES) -> Film:
    """Return frames of a plan, those at which a measure is least or a phase ends among them.

    The workpiece is drawn where the weld asks for it and robots where their joints put them, so that a chain that is
    open is seen to be.

    Args:
        plan: the plan.
        timed: over its timeline, which it must then have; else along the seam, at the verifier's own samples.
        frames: about how many to keep.

    Raises:
        PlanError: the plan holds NaN or infinity.
        VerifierError: the geometry process hung or died twice.
    """
    if not all(np.isfinite(path).all() for path in plan.paths.values()) or not np.isfinite(plan.placement).all():
        raise PlanError("paths: hold NaN or infinity, so there is nothing to draw; see 'nlpweld verify'")
    cell, (x, motion) = plan.cell, _over_time(plan) if timed else _along_seam(plan)
    scene = look(cell, plan.placement, motion)
    turned = motion.q[cell.positioner.name] if cell.positioner else None
    T_W_C = ref.workpiece_pose(cell, plan.placement, motion.s, turned, motion.free)
    tcps = {st.name: ref.tcp_pose(st, scene.links[st.name]) for st in cell.stations}
    team = team_along(cell, scene.w, {name: J[:, :3] for name, J in scene.J.items()})
    clearance, pair = scene.clearance_m.min(axis=1), scene.clearance_m.argmin(axis=1)
    welding = _welding(plan, x) if timed else np.ones(len(x), dtype=bool)
    least = {name: _least(w, welding) for name, w in {**_named("w", scene.w), "team": team}.items()}
    least["clearance"] = int(clearance.argmin())
    ends_s = [until for _, until in plan.timeline.phases] if timed and plan.timeline else []
    held = [*least.values(), *np.searchsorted(x, ends_s)]
    keep = _spread(x, all_ends(cell, T_W_C, scene.links, tcps), frames, held)
    met, pair = np.unique(pair[keep], return_inverse=True)
    labels = scene.table.pair_labels
    poses = {f"{name}.link{i}": T[keep, i] for name, T in scene.links.items() for i in range(T.shape[1])}
    poses |= {f"{name}.tcp": T[keep] for name, T in tcps.items()} | {"workpiece": T_W_C[keep]}
    return Film(
        plan=plan,
        timed=timed,
        x=x[keep],
        s=motion.s[keep],
        welding=welding[keep],
        poses=poses,
        joints={name: motion.q[name][keep] for name in joint_counts(cell)},
        w={name: w[keep] for name, w in scene.w.items()},
        team=np.where(welding, team, np.nan)[keep],
        clearance_m=clearance[keep],
        pair=pair,
        pair_labels=[labels[i] for i in met],
        worst={name: int(np.searchsorted(keep, i)) for name, i in least.items()},
    )


def _along_seam(plan: Plan) -> tuple[np.ndarray, Motion]:
    """Return the verifier's motion through the plan's points, over the seam parameter."""
    motion = whole_motion(plan.cell, plan.placement, plan.s, plan.paths, _offsets(plan))
    return motion.s, motion


def _over_time(plan: Plan) -> tuple[np.ndarray, Motion]:
    """Return the motion of a plan's timeline, over time; ends of phases are among the instants."""
    line = plan.timeline
    assert line is not None
    t = np.unique(np.concatenate([np.linspace(*line.span_s(name), INSTANTS) for name, _ in line.phases]))
    s = line.s_at(t)
    point = np.clip(np.searchsorted(plan.s, s, side="right") - 1, 0, len(plan.s) - 1)
    return t, Motion(s, line.at(t), np.array([0]), point, free=_offsets(plan))


def _offsets(plan: Plan) -> Offsets | None:
    return None if plan.freedom is None else Offsets(plan.s, plan.cell.seam.closed, plan.freedom)


def _welding(plan: Plan, t: np.ndarray) -> np.ndarray:
    assert plan.timeline is not None
    begin, end = plan.timeline.span_s("weld")
    return (t >= begin) & (t <= end)


def _named(kind: str, values: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {f"{kind}.{name}": value for name, value in values.items()}


def _least(values: np.ndarray, among: np.ndarray) -> int:
    """Return the index of the least value among some, or of the least of all where there are none."""
    return int(np.where(among | ~among.any(), values, np.inf).argmin())


def _spread(x: np.ndarray, ends: np.ndarray, count: int, keep: list[int]) -> np.ndarray:
    """Return indices of frames, ascending, dense where going linearly between them would err most.

    A chord errs by an eighth of the second derivative times its length squared, so lengths follow its square root.

    Args:
        x: the cursor, shape (K,).
        ends: body ends, shape (K, B, 2, 3) [m].
        count: about how many.
        keep: indices that must be among them.
    """
    h = np.diff(x)
    rate = np.diff(ends, axis=0) / h[:, None, None, None]
    bend = np.linalg.norm(np.diff(rate, axis=0), axis=-1).max(axis=(1, 2)) / ((h[1:] + h[:-1]) / 2)
    step = h * np.sqrt(np.maximum(np.append(bend[:1], bend), np.append(bend, bend[-1:])))
    step = STILL * h / (x[-1] - x[0]) + (1 - STILL) * step / max(float(step.sum()), 1e-9)
    along = np.append(0.0, np.cumsum(step))
    chosen = np.searchsorted(along, np.linspace(0.0, along[-1], count)).clip(0, len(x) - 1)
    return np.unique(np.concatenate([chosen, keep, [0, len(x) - 1]]).astype(int))
