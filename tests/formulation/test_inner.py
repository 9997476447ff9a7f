"""The exact inner answer against all paths there are, counted one by one over states judged apart."""

from dataclasses import replace
from functools import cache
from itertools import pairwise, product

import numpy as np
import pytest

from nlpweld.cell import Cell, load_cell
from nlpweld.formulation.batch import Batch, evaluator
from nlpweld.formulation.cycles import Chain, Links
from nlpweld.formulation.inner import Inner, best, inner, lattice, spread, start
from nlpweld.formulation.redundant import STEP_MARGIN_DEG, Redundant
from nlpweld.kinematics.ik import signs

HIGH, LOW, DUAL = (0.0, -0.166, 0.40), (0.0, -0.018, 0.258), (0.0, -1.2, 0.5)
CASES = {  # cell, placement, level, points, joint step [deg], grids [deg]; in each the step keeps better paths out
    "closed": ("three_er16", HIGH, "spin", 9, 120.0, [(-90, -60, 0, 45)]),
    "closed_yaw": ("three_er16", LOW, "spin_yaw", 6, 120.0, [(-90, -45, 105), (-50, 10, 40)]),
    "open_two_welders": ("dual_welder_positioner", DUAL, "spin", 5, 60.0, [(-135, -105, -75), (-105, 90, 135)]),
}
Case = tuple[Redundant, np.ndarray, dict[str, np.ndarray]]


def formed(name: str, level: str, points: int, step_deg: float, **tables: dict[str, object]) -> Redundant:
    data = load_cell(name).model_dump(mode="python", exclude_unset=True)
    for seam in (data["seam"], *data.get("other_seams", {}).values()):
        seam["points"] = points
    data["freedom"]["joint_step_deg"] = step_deg
    for table, fields in tables.items():
        data[table].update(fields)
    return Redundant(Batch(Cell.model_validate(data), "numpy"), level, 8)


@cache
def case(name: str) -> Case:
    cell, at, level, points, step_deg, grids = CASES[name]
    form = formed(cell, level, points, step_deg)
    return form, form.cell.coordinates(np.array(at)), dict(zip(form.names, map(np.radians, grids), strict=True))


@cache
def answer(name: str) -> Inner:
    found = inner(*case(name))
    assert found is not None
    return found


def judged_states(form: Redundant, x: np.ndarray, grids: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Return objectives (N, G), -inf where infeasible, and phases (N, G, joints) of states judged one by one."""
    states = np.array(list(product(*grids.values())))
    N, judge = form.data.shape[1], evaluator("numpy", form.cell, form.stage, form.data, form.batch.arm_branches)
    worth, phases = np.full((N, len(states)), -np.inf), []
    for j, (g, u) in product(range(N), enumerate(states)):
        point = np.concatenate([form.data[:, j], u])[:, None]
        found = judge.at(point).evaluate(x[None])
        worth[j, g] = found.objective[0] if found.feasible[0] else -np.inf
        arms = zip(form.stage.grips, form.batch.modes[0], strict=True)
        cos_sin = [np.array(grip(x, point, signs((*branch, "noflip")))[0]) for grip, branch in arms]
        phases.append(np.concatenate([a[:, 0] + 1j * a[:, 1] for a in cos_sin]))
    return worth, np.array(phases).reshape(N, len(states), -1)


def best_of_all(form: Redundant, worth: np.ndarray, phases: np.ndarray, bounded: bool) -> float:
    """Return the greatest mean of all paths, those with longer joint steps left out if bounded."""
    N, G = worth.shape
    paths = np.indices((G,) * N, dtype=np.int8).reshape(N, -1)
    total = sum(worth[j][paths[j]] for j in range(N))
    ahead = list(pairwise(range(N))) + ([(N - 1, 0)] if form.cell.seam.closed else [])
    for i, j in ahead if bounded else []:
        steps = np.abs(np.angle(phases[j][None] * phases[i][:, None].conj())).max(axis=2)
        total = np.where(steps[paths[i], paths[j]] <= form.bound - np.radians(STEP_MARGIN_DEG), total, -np.inf)
    return float(total.max()) / N


@pytest.mark.parametrize("name", CASES)
def test_inner_is_the_best_of_all_paths_on_the_grid(name: str) -> None:
    form, x, grids = case(name)
    worth, phases = judged_states(form, x, grids)
    found = answer(name)
    assert found.value == pytest.approx(best_of_all(form, worth, phases, bounded=True), rel=1e-12)
    assert found.value < 0.9999 * best_of_all(form, worth, phases, bounded=False)
    assert found.states.tolist() == np.isfinite(worth).sum(axis=1).tolist()
    assert found.states.min() < worth.shape[1] or name == "open_two_welders"


@pytest.mark.parametrize("name", CASES)
def test_the_redundant_forms_exact_model_says_the_same_of_the_answer(name: str) -> None:
    (form, x, grids), found = case(name), answer(name)
    said = lattice(form, grids).judged(x, np.array(list(found.angles.values())))
    assert said.objective[0] == pytest.approx(found.value, rel=1e-12)
    assert said.feasible[0]
    assert found.holds
    assert all(np.isin(found.angles[angle], grid).all() for angle, grid in grids.items())


@pytest.mark.parametrize("closed", [True, False])
def test_chains_against_all_their_paths(closed: bool, rng: np.random.Generator) -> None:
    cut, none = 0, 0
    for _ in range(100):
        counts = rng.integers(2, 5, 5)
        values = [rng.normal(size=n) for n in counts]
        ahead = [*pairwise(range(5)), (4, 0)][: 5 if closed else 4]
        masks = [rng.uniform(size=(counts[i], counts[j])) < 0.4 for i, j in ahead]
        chain = Chain(values, [Links.of(*np.nonzero(mask)) for mask in masks], [np.arange(n)[:, None] for n in counts])
        linked = list(zip(masks, ahead, strict=True))
        paths = [p for p in product(*map(range, counts)) if all(mask[p[i], p[j]] for mask, (i, j) in linked)]
        totals = [sum(v[i] for v, i in zip(values, p, strict=True)) for p in paths]
        found = chain.best()
        none += not paths
        assert (found is None) == (not paths)
        if found is not None:
            assert found[0] == pytest.approx(max(totals), rel=1e-12)
            assert tuple(found[1]) == paths[int(np.argmax(totals))]
            cut += closed and Chain(values, chain.links[:4], chain.places).best()[0] > found[0] + 1e-9
    assert none > 2
    assert cut > 10 or not closed


def test_steps_of_the_plan_keep_the_bound_that_a_laxer_one_breaks() -> None:
    form, x, grids = case("closed")
    lax = formed("three_er16", "spin", 9, 179.9)
    longest = []
    for one in (form, lax):
        angles = np.array(list(inner(one, x, grids).angles.values()))
        grip, n = one.stage.grips[2], form.data.shape[1]
        sign = np.tile(np.reshape(signs(("front", "up", "noflip")), (3, 1)), n)
        a = np.array(grip.map(n)(np.tile(x[:, None], n), np.vstack([one.data, angles]), sign)[0])
        phase = a[:, ::2] + 1j * a[:, 1::2]
        longest.append(np.abs(np.angle(np.roll(phase, -1, axis=1) * phase.conj())).max())
    assert longest[0] <= form.bound < longest[1]


def test_without_a_feasible_path_there_is_none() -> None:
    _, x, grids = case("closed")
    floor = formed("three_er16", "spin", 9, 120.0, constraints={"singularity_floor_m3": 1.0})
    assert inner(floor, x, grids) is None
    still = formed("three_er16", "spin", 9, 10.0)  # every point has states, but none leads to the next
    assert inner(still, x, grids) is None


def limited(k: int, joint: int, lower_deg: float, upper_deg: float, wrist: str = "any") -> Redundant:
    """Return the form of the closed case with other limits of one joint of station k."""
    data = case("closed")[0].cell.model_dump(mode="json", exclude_unset=True)
    data["stations"][k]["robot"]["joints"][joint] |= {"lower_deg": lower_deg, "upper_deg": upper_deg}
    data["configuration"]["wrist"] = wrist
    del data["timing"]  # the welder could not wait at its home
    return Redundant(Batch(Cell.model_validate(data), "numpy"), "spin", 8)


def test_one_kind_of_wrist_alone_inside_the_limits_is_found_and_no_other() -> None:
    _, x, grids = case("closed")
    found = inner(limited(2, 4, -130.0, 5.0), x, grids)
    assert found.value == pytest.approx(answer("closed").value, rel=1e-12)
    assert found.holds
    alone = [inner(limited(2, 4, -130.0, 5.0, wrist), x, grids) for wrist in ("flip", "noflip")]
    assert sorted(one is not None for one in alone) == [False, True]


def test_where_wrists_keep_different_states_either_is_tried_alone() -> None:
    _, x, grids = case("closed")
    alone = [inner(limited(2, 3, -20.0, 210.0, wrist), x, grids).value for wrist in ("noflip", "flip")]
    either = inner(limited(2, 3, -20.0, 210.0), x, grids)
    assert alone[0] < 0.95 * alone[1]
    assert either.value == alone[1]
    assert either.holds


def test_a_joint_that_has_to_wind_is_judged_afterwards_where_it_may_turn_once_and_else_beforehand() -> None:
    _, x, grids = case("closed")  # the handlers turn the work once, with joint 4
    found = inner(limited(0, 3, -180.15, 180.15), x, grids)
    assert found.value == pytest.approx(answer("closed").value, rel=1e-12)
    assert not found.holds
    assert inner(limited(0, 3, -180.0, 180.0), x, grids) is None


def test_of_all_modes_the_best_is_taken() -> None:
    free = formed("robot_positioner", "spin", 12, 60.0, configuration={"shoulder": "any", "elbow": "any"})
    states = lattice(free, {"spin.robot_1": spread(-np.pi, np.pi, 12)})
    x = free.cell.coordinates(np.array((0.0, -1.0, 0.5)))
    each = [best(states, x, mode) for mode in range(4)]
    values = [-np.inf if found is None else found.value for found in each]
    whole = best(states, x)
    assert whole.mode == int(np.argmax(values))
    assert whole.value == max(values)
    assert np.isfinite(values).sum() > 1


def test_a_banded_path_does_not_run_across_half_a_turn() -> None:
    form = formed("three_er16", "spin", 24, 60.0)
    states, x = lattice(form, {"spin.welder": spread(-np.pi, np.pi, 24)}), np.array(HIGH)
    jumps, misfits = [], []
    for banded in (False, True):
        found = best(states, x, banded=banded)
        path = found.angles["spin.welder"]
        jumps.append(np.abs(np.diff(path, append=path[0])).max())
        misfits.append(start(form, found).misfit["spin.welder"])
    assert jumps[1] <= np.pi < jumps[0]
    assert misfits[1] < 0.5 < misfits[0]


@pytest.mark.parametrize("name", ["closed_yaw", "open_two_welders"])
def test_a_start_decodes_back_within_its_misfit(name: str) -> None:
    (form, _, _), found = case(name), answer(name)
    N, closed = form.data.shape[1], form.cell.seam.closed
    s = np.arange(N) / (N if closed else N - 1)
    smooth = {angle: 0.4 * np.cos(2 * np.pi * s) + k for k, angle in enumerate(found.angles)}
    turned = {angle: path + 2 * np.pi for angle, path in smooth.items()}  # out of the bands, which a turn brings back
    assert start(form, replace(found, angles=turned)).z == pytest.approx(start(form, replace(found, angles=smooth)).z)
    for angles in (found.angles, smooth):
        begun = start(form, replace(found, angles=angles))
        x, decoded = form.coding.decode(begun.z)
        assert x == pytest.approx(found.x)
        assert form.coding.bounds[0] == pytest.approx(np.minimum(begun.z, form.coding.bounds[0]))
        for back, (angle, path) in zip(decoded, angles.items(), strict=True):
            assert np.abs(back - path).max() == pytest.approx(begun.misfit[angle], abs=1e-12)
    assert max(begun.misfit.values()) < 0.02


def test_an_angle_that_winds_round_a_closed_seam_has_no_spline() -> None:
    form, found = case("closed")[0], answer("closed")
    wound = np.mod(np.arange(9) * 2 * np.pi / 9, 2 * np.pi)
    begun = start(form, replace(found, angles={"spin.welder": wound}))
    assert begun.z is None
    assert begun.turns == {"spin.welder": 1}


def test_default_grids_are_inside_the_bands_and_no_value_comes_twice() -> None:
    form = case("closed_yaw")[0]
    spin, yaw = lattice(form).grids
    assert len(spin) == len(yaw) == 36
    assert len(np.unique(np.round(np.exp(1j * spin), 9))) == 36
    assert np.isclose(spin, 0.0).any()
    assert spread(-0.3, 0.2, 6) == pytest.approx([-0.3, -0.2, -0.1, 0.0, 0.1, 0.2])
