"""``verify``: a plan in, a report out, and nothing believed."""

import math

import numpy as np

from nlpweld.errors import PlanError
from nlpweld.plan import Plan
from nlpweld.verify import rules
from nlpweld.verify.between import whole_motion
from nlpweld.verify.measures import Measures, measure
from nlpweld.verify.report import Report, Violation, worst_first
from nlpweld.verify.scene import Scene, look

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
        return Report.without_plan(plan.cell, plan.placement_m, len(plan.s), infinite)
    c = np.asarray(plan.placement_m, dtype=float)
    paths = {st.name: np.asarray(plan.paths[st.name], dtype=float) for st in plan.cell.stations}
    scene = look(plan.cell, c, whole_motion(plan.cell, c, np.asarray(plan.s, dtype=float), paths))
    at = scene.motion.at
    measures = measure(
        plan.cell,
        {name: w[at] for name, w in scene.w.items()},
        {name: J[at, :3] for name, J in scene.J.items()},
    )
    return _report(plan, scene, measures, worst_first(rules.violations(plan, scene)))


def _report(plan: Plan, scene: Scene, measures: Measures, violations: tuple[Violation, ...]) -> Report:
    at = scene.motion.at
    point, pair = _closest(scene.clearance_m[at])
    x, y, z = (float(v) for v in plan.placement_m)
    return Report(
        cell=plan.cell.name,
        at=(x, y, z),
        n_points=len(plan.s),
        reading=plan.cell.objective.reading,
        mmr_mean=float(measures.mmr.mean()),
        mmr_min=float(measures.mmr.min()),
        mmr_max=float(measures.mmr.max()),
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
        closure_m=max(float(e[0].max()) for e in scene.closure.values()),
        closure_rad=max(float(e[1].max()) for e in scene.closure.values()),
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
    n = len(plan.s)
    if np.ndim(plan.s) != 1 or n < 3 or not (np.diff(plan.s) > 0).all() or plan.s[0] < 0 or plan.s[-1] >= 1:
        raise PlanError("s: not at least three increasing numbers in [0, 1); take seam_parameters(cell)")
    names = [station.name for station in plan.cell.stations]
    if set(plan.paths) != set(names):
        raise PlanError(f"paths: for {sorted(plan.paths)}, but the cell has {sorted(names)}; give one for each robot")
    for station in plan.cell.stations:
        shape, want = np.shape(plan.paths[station.name]), (n, len(station.robot.joints))
        if shape != want:
            raise PlanError(f"paths.{station.name}: shape {shape}, not {want}; solve again")


def _not_finite(plan: Plan) -> list[Violation]:
    """Return what holds NaN or infinity: no comparison with it can be believed."""
    found, nan = [], math.nan
    if not (np.abs(plan.placement_m) < LARGEST).all():
        found.append(Violation("finite", None, None, nan, nan, note="the placement holds NaN or infinity, or nearly"))
    for name, path in plan.paths.items():
        bad = np.argwhere(~(np.abs(path) < LARGEST))
        if len(bad):
            point, joint, s = int(bad[0][0]), f"J{bad[0][1] + 1}", float(plan.s[bad[0][0]])
            text = "the path holds NaN or infinity, or nearly"
            found.append(Violation("finite", name, point, nan, nan, s=s, joint=joint, note=text))
    return found
