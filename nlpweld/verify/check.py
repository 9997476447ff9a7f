"""``verify``: a plan in, a report out, and nothing believed."""

import math

import numpy as np

from nlpweld.errors import PlanError
from nlpweld.plan import Plan, joint_counts, wrong_freedom, wrong_points
from nlpweld.verify import rules
from nlpweld.verify.between import whole_motion
from nlpweld.verify.freedom import Offsets
from nlpweld.verify.measures import Measures, along_seam, least_along, measure
from nlpweld.verify.report import Report, Violation, worst_first
from nlpweld.verify.scene import Scene, joint_steps, look

LARGEST = 1e9  # [m] or [rad]; beyond it squares overflow and cosines mean nothing


def verify(plan: Plan) -> Report:
    """Compute everything about a plan again and hold it against its cell's exact levels, along the whole seam.

    Args:
        plan: joint paths and placement; its cell is the one inside it.

    Raises:
        PlanError: names or shapes of the plan contradict its cell.
        VerifierError: the geometry process hung or died twice.
    """
    _refuse_wrong_shapes(plan)
    infinite = _not_finite(plan)
    if infinite:
        return Report.without_plan(plan.cell, plan.placement, len(plan.s), infinite)
    paths = {name: np.asarray(plan.paths[name], dtype=float) for name in joint_counts(plan.cell)}
    s = np.asarray(plan.s, dtype=float)
    free = None if plan.freedom is None else Offsets(s, plan.cell.seam.closed, plan.freedom)
    motion = whole_motion(plan.cell, plan.placement, s, paths, free)
    scene = look(plan.cell, plan.placement, motion)
    at = scene.motion.at
    measures = measure(
        plan.cell,
        {name: w[at] for name, w in scene.w.items()},
        {name: J[at, :3] for name, J in scene.J.items()},
    )
    return _report(plan, scene, measures, worst_first(rules.violations(plan, scene)))


def refuse_wrong(plan: Plan) -> None:
    """Refuse a plan whose shapes contradict its cell, or that holds NaN or infinity.

    Raises:
        PlanError: says what.
    """
    _refuse_wrong_shapes(plan)
    infinite = _not_finite(plan)
    if infinite:
        raise PlanError(f"{infinite[0].robot or 'placement'}: {infinite[0].note}; solve again")


def _report(plan: Plan, scene: Scene, measures: Measures, violations: tuple[Violation, ...]) -> Report:
    at = scene.motion.at
    point, pair = _closest(scene.clearance_m[at])
    x, y, z = (float(v) for v in plan.placement_m)
    return Report(
        cell=plan.cell.name,
        at=(x, y, z),
        yaw_rad=float(plan.yaw_rad),
        n_points=len(plan.s),
        reading=plan.cell.objective.reading,
        over_seam=plan.cell.objective.over_seam,
        exponent=plan.cell.objective.exponent,
        objective=along_seam(plan.cell.objective, measures.mmr),
        mmr_mean=float(measures.mmr.mean()),
        mmr_min=float(measures.mmr.min()),
        mmr_max=float(measures.mmr.max()),
        mmr_min_along=least_along(plan.cell, scene.w, {name: J[:, :3] for name, J in scene.J.items()}),
        m_tight_mean=float(measures.m_tight.mean()),
        m_loose_mean=float(measures.m_loose.mean()),
        manipulability_mean={name: float(w[at].mean()) for name, w in scene.w.items()},
        manipulability_min={name: float(w[at].min()) for name, w in scene.w.items()},
        singularity_min={name: float(w.min()) for name, w in scene.w.items()},
        clearance_m=float(scene.clearance_m[at][point, pair]),
        clearance_along_m=float(scene.clearance_m.min()),
        closest_pair=scene.table.pair_labels[pair],
        closest_s=float(plan.s[point]),
        joint_margin_rad=min(float(m.min()) for m in scene.joint_margin.values()),
        joint_step_rad=max(float(steps.max()) for steps in joint_steps(plan).values()),
        closure_m=max(float(e[0].max()) for e in scene.closure.values()),
        closure_rad=max(float(e[1].max()) for e in scene.closure.values()),
        posture_rad=float(scene.off_upright.max()),
        samples=len(scene.motion.s),
        feasible=not violations,
        violations=violations,
        profile=_profile(plan, scene, measures),
    )


def _closest(clearance_m: np.ndarray) -> tuple[int, int]:
    """Return point and pair of the least clearance (N, pairs); of equals within a nanometre, the first on the seam."""
    point, pair = np.argwhere(clearance_m <= clearance_m.min() + 1e-9)[0]
    return int(point), int(pair)


def _profile(plan: Plan, scene: Scene, measures: Measures) -> dict[str, np.ndarray]:
    """Return the arrays over the N points."""
    at = scene.motion.at
    profile = {
        "s": np.asarray(plan.s, dtype=float),
        "mmr": measures.mmr,
        "m_tight": measures.m_tight,
        "m_loose": measures.m_loose,
        "common_volume": measures.common_volume,
        "clearance_m": scene.clearance_m[at].min(axis=1),
    }
    profile |= {f"manipulability.{name}": w[at] for name, w in scene.w.items()}
    profile |= {f"ratio.{name}": r for name, r in measures.ratio.items()}
    return profile | {f"joint_margin_rad.{name}": m[at].min(axis=(1, 2)) for name, m in scene.joint_margin.items()}


def _refuse_wrong_shapes(plan: Plan) -> None:
    if np.shape(plan.placement_m) != (3,):
        raise PlanError(f"placement_m: shape {np.shape(plan.placement_m)}, not (3,); give x, y and z")
    if np.shape(plan.yaw_rad) != ():
        raise PlanError(f"yaw_rad: shape {np.shape(plan.yaw_rad)}, not a number")
    wrong = wrong_points(plan.cell, plan.s)
    if wrong:
        raise PlanError(f"s: {wrong}; take seam_parameters(cell)")
    counts = joint_counts(plan.cell)
    if set(plan.paths) != set(counts):
        raise PlanError(f"paths: for {sorted(plan.paths)}, but the cell has {sorted(counts)}; give one for each")
    for name, joints in counts.items():
        shape, want = np.shape(plan.paths[name]), (len(plan.s), joints)
        if shape != want:
            raise PlanError(f"paths.{name}: shape {shape}, not {want}; solve again")
    _refuse_wrong_freedom(plan)


def _refuse_wrong_freedom(plan: Plan) -> None:
    freedom = plan.freedom or {}
    wrong = wrong_freedom(plan.cell, freedom)
    if wrong:
        raise PlanError(f"freedom{wrong}")
    for name, offsets in freedom.items():
        if np.shape(offsets) != (len(plan.s),):
            raise PlanError(f"freedom.{name}: shape {np.shape(offsets)}, not {(len(plan.s),)}; solve again")


def _not_finite(plan: Plan) -> list[Violation]:
    """Return what holds NaN or infinity: no comparison with it can be believed."""
    found, nan = [], math.nan
    if not (np.abs(plan.placement) < LARGEST).all():
        found.append(Violation("finite", None, None, nan, nan, note="the placement holds NaN or infinity, or nearly"))
    for name, path in plan.paths.items():
        bad = np.argwhere(~(np.abs(path) < LARGEST))
        if len(bad):
            point, joint, s = int(bad[0][0]), f"J{bad[0][1] + 1}", float(plan.s[bad[0][0]])
            text = "the path holds NaN or infinity, or nearly"
            found.append(Violation("finite", name, point, nan, nan, s=s, joint=joint, note=text))
    for name, offsets in (plan.freedom or {}).items():
        beyond = np.flatnonzero(~(np.abs(offsets) < LARGEST))
        if len(beyond):
            kind, robot = rules.angle_of(name)
            text = "the free angle holds NaN or infinity, or nearly"
            point, s = int(beyond[0]), float(plan.s[beyond[0]])
            found.append(Violation("finite", robot, point, nan, nan, s=s, joint=kind, note=text))
    return found
