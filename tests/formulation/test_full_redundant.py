"""The redundant form in full space: closed chains, bounded joint steps, sparse derivatives, warm starts from plans."""

from functools import cache

import numpy as np
import pytest

from nlpweld.bench.answer import FORMULATIONS, formulate
from nlpweld.cell import Cell, load_cell
from nlpweld.errors import OptionError
from nlpweld.formulation import full_redundant as module
from nlpweld.formulation.batch import Batch
from nlpweld.formulation.freedom import LEVELS
from nlpweld.formulation.full import full_start
from nlpweld.formulation.full_redundant import FULL_REDUNDANT, FullRedundant, full_redundant
from nlpweld.formulation.inner import best, lattice
from nlpweld.formulation.nlp import Relaxation
from nlpweld.formulation.redundant import Redundant
from nlpweld.formulation.smooth import STEP_WEIGHT, Gaps
from nlpweld.plan import Plan
from nlpweld.solvers import Budget, make_solver
from nlpweld.verify import verify

from .helpers import PAPER
from .test_full import directions, taylor
from .test_tilting import with_limits

AT = {"three_er16": PAPER, "dual_welder_positioner": [0.2, -1.4], "robot_positioner": [0.0, -1.0]}
TABLES = ("dual_welder_positioner", "robot_positioner")  # they tilt the weld
TILT = "spin_yaw_tilt"


@pytest.fixture(autouse=True)
def few_gaps(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let relaxations look at one distance of each two owners: differentiating all takes seconds."""

    def few(form: Redundant, mode: int) -> Gaps:
        return Gaps(dict.fromkeys(form.stage.meetings, (0,)), ((0,),) * len(form.stage.shapes))

    monkeypatch.setattr(Redundant, "near", few)


def coarse(name: str, points: int, step_deg: float) -> Cell:
    data = load_cell(name).model_dump(mode="python", exclude_unset=True)
    for seam in (data["seam"], *data.get("other_seams", {}).values()):
        seam["points"] = points
    data["freedom"]["joint_step_deg"] = step_deg
    return Cell.model_validate(data)


@cache
def formed(name: str, level: str, points: int = 12, step_deg: float = 150.0) -> FullRedundant:
    return of(coarse(name, points, step_deg), level)


def of(cell: Cell, level: str = TILT) -> FullRedundant:
    batch = Batch(cell, "numpy")
    return FullRedundant(batch, Redundant(batch, level, controls=5))


def on_splines(form: FullRedundant, size: float = 0.02) -> np.ndarray:
    """Return variables of the form with joints eliminated: small random angles at a feasible placement."""
    coding, x = form.splines.coding, np.array(AT[form.cell.name])
    z = coding.constant(x[None], np.zeros((1, len(coding.angles))))[0]
    z[len(x) :] += size * np.random.default_rng(1).uniform(-1, 1, len(z) - len(x))
    return z


def planned(form: FullRedundant) -> Plan:
    plan = form.splines.unpack(on_splines(form), 0)
    assert isinstance(plan, Plan)
    return plan


def missed(form: FullRedundant, z: np.ndarray) -> dict[str, float]:
    found = form.evaluate(z[None]).violation[0]
    return {name: float(value) for name, value in zip(form.constraints, found, strict=True) if value > 0}


@pytest.mark.parametrize(("name", "level"), [(name, level) for name in AT for level in LEVELS])
def test_redundant_answer_is_closed_feasible_and_as_good_in_full_space(name: str, level: str) -> None:
    form = formed(name, level)
    z, known = full_start(planned(form), level), form.splines.evaluate(on_splines(form)[None])
    lower, upper = form.bounds
    assert len(z) == len(lower) == len(form.names)
    assert ((lower <= z) & (z <= upper)).all()
    assert np.abs(np.array(form.relax(0, False).equalities.value(z))).max() < 1e-8
    assert form.evaluate(z[None]).objective == pytest.approx(known.objective, rel=1e-12)
    assert known.total[0] == 0.0
    assert missed(form, z) == {}


@pytest.mark.parametrize("name", ["three_er16", "robot_positioner"])
def test_plan_of_variables_of_a_plan_is_that_plan(name: str) -> None:
    form = formed(name, TILT)
    plan = planned(form)
    again = form.unpack(full_start(plan, TILT), 0)
    assert again.placement == pytest.approx(plan.placement, abs=0)
    assert again.branches == plan.branches
    for ours, theirs in ((again.paths, plan.paths), (again.freedom, plan.freedom)):
        assert list(ours) == list(theirs)
        for key, path in theirs.items():
            assert ours[key] == pytest.approx(path, abs=1e-12)


def test_angle_off_its_plan_opens_the_chain_by_as_much() -> None:
    form = formed("three_er16", "spin_yaw")
    z = full_start(planned(form), "spin_yaw")
    z[form.names.index("spin.welder[7]_rad")] += 0.01
    assert missed(form, z) == {"closure": pytest.approx(0.01, abs=2e-7)}


@pytest.mark.parametrize("name", TABLES)
def test_table_off_its_tilt_opens_the_chain_by_as_much(name: str) -> None:
    form = formed(name, TILT)
    z = full_start(planned(form), TILT)
    for joint, off in ((1, 0.01), (2, -0.01), (2, np.pi)):  # whose sine is none
        turned = z.copy()
        turned[form.names.index(f"positioner.J{joint}[7]_rad")] += off
        assert missed(form, turned)["closure"] == pytest.approx(abs(off), abs=2e-7)
        errors = np.array(form.relax(0, False).equalities.value(turned)).reshape(12, -1)
        assert errors.shape[1] == 6 * len(form.cell.stations) + 2
        assert errors[7, joint - 3] == pytest.approx(np.sin(off), abs=1e-9)


@pytest.mark.parametrize("name", TABLES)
def test_table_of_a_start_stands_as_its_tilt_asks(name: str) -> None:
    form = formed(name, TILT)
    plan = planned(form)
    z = form.start(np.array(AT[name]), 0, np.array(list(plan.freedom.values())))
    table = [i for i, n in enumerate(form.names) if n.startswith("positioner.")]
    assert np.reshape(z[table], (12, 2)) == pytest.approx(plan.paths["positioner"], abs=1e-12)
    assert np.abs(plan.paths["positioner"] - form.splines.untilted).max() > 0.005
    assert missed(form, z) == {}


def test_limits_of_the_table_count_as_the_redundant_form_counts_them() -> None:
    """A degree about -90 where it stands untilted."""
    form = of(with_limits(coarse("dual_welder_positioner", 12, 150.0), 0, -90.5, -89.5))
    known = form.splines.evaluate(on_splines(form)[None]).violation[0, 1]
    z, (lower, upper) = full_start(planned(form), TILT), form.bounds
    first = [i for i, name in enumerate(form.names) if name.startswith("positioner.J1")]
    assert known > 0
    assert missed(form, z) == {"joint_limit": pytest.approx(known, abs=1e-9)}
    assert np.degrees([lower[first], upper[first]]) == pytest.approx(np.tile([[-90.4], [-89.6]], 12), abs=1e-6)
    beyond = np.maximum(lower[first] - z[first], z[first] - upper[first]).max()
    assert beyond == pytest.approx(known * np.pi, abs=1e-8)


def test_bounds_of_the_table_and_the_exact_model_keep_its_way_back_too() -> None:
    """It turns from 180 to -150 degrees at the last point, and on to -180."""
    form = of(with_limits(coarse("robot_positioner", 12, 150.0), 1, -180.05, 360.0))
    coding = form.splines.coding
    z = form.start(np.array(AT["robot_positioner"]), 0, np.zeros((len(coding.angles), 12)))
    below = form.bounds[0] - z
    first = form.names.index("positioner.J2[0]_rad")
    assert missed(form, z) == {"joint_limit": pytest.approx(0.05 / 180, abs=1e-9)}
    assert below[first] == pytest.approx(np.radians(0.05), abs=1e-8)
    assert (np.delete(below, first) < 0.0).all()


def test_plan_that_turns_what_the_form_does_not_free_is_refused() -> None:
    plan = planned(formed("three_er16", "spin_yaw"))
    with pytest.raises(OptionError, match="turns yaw"):
        full_start(plan, "spin")
    assert len(full_start(plan.with_freedom(None), "spin")) == 3 + 12 * 19


@pytest.mark.parametrize("name", ["three_er16", *TABLES])
def test_joint_steps_too_long_are_told_as_the_redundant_form_does(name: str) -> None:
    """On the trough it is the table's that is longest, once it is free to tilt."""
    told = []
    for level in ("spin_yaw", TILT):
        form = formed(name, level, 12, 5.0)
        told.append(form.splines.evaluate(on_splines(form)[None]).violation[0, -1])
        assert told[-1] > 0
        assert missed(form, full_start(planned(form), level)) == {"joint_step": pytest.approx(told[-1], abs=1e-9)}
    if name == "dual_welder_positioner":
        assert told[1] > told[0] + 0.05


def test_a_joint_step_too_long_is_told_on_the_way_back_too() -> None:
    form = formed("three_er16", "spin", 12, 150.0)
    z = full_start(planned(form), "spin")
    z[3:] = np.tile(z[3:22], 12)
    z[[form.names.index(f"welder.J6[{j}]_rad") for j in range(12)]] += np.radians(155.0) * np.arange(12) / 11
    assert missed(form, z)["joint_step"] == pytest.approx(5.05 / 180.0, abs=1e-9)


@pytest.mark.parametrize(
    ("name", "level"), [("three_er16", "spin"), ("dual_welder_positioner", "spin"), ("robot_positioner", TILT)]
)
def test_relaxation_on_closed_chains_is_that_of_the_form_with_joints_eliminated(name: str, level: str) -> None:
    form = formed(name, level, 12, 5.0)
    z = full_start(planned(form), level)
    known, ours = form.splines.relax(0, False), form.relax(0, True)
    assert float(ours.value(z, 1e3)) > 0.1  # steps count
    assert float(ours.value(z, 1e3)) == pytest.approx(float(known.value(on_splines(form), 1e3)), abs=1e-9)
    turned = z.copy()
    turned[form.names.index(f"{form.cell.stations[0].name}.J6[3]_rad")] += 2 * np.pi
    assert float(ours.value(turned, 1e3)) == pytest.approx(float(ours.value(z, 1e3)), abs=1e-9)


@cache
def stepping(name: str) -> tuple[Relaxation, np.ndarray]:
    """Return a relaxation in which joint steps count, the table's too, and variables."""
    form = formed(name, TILT, 12, {"three_er16": 90.0, "dual_welder_positioner": 20.0}[name])
    return form.relax(0, False), full_start(planned(form), TILT)


def test_steps_of_the_table_count() -> None:
    """What is too long turns the table and nothing else: five steps round the trough's arc."""
    form = formed("dual_welder_positioner", TILT, 12, 20.0)
    steps = np.abs(np.diff(planned(form).paths["positioner"][:, 1]))
    too_long = (np.cos(form.bound) - np.cos(steps)) / (1 - np.cos(form.bound))
    z, relaxation = full_start(planned(form), TILT), form.relax(0, False)
    lax = formed("dual_welder_positioner", TILT, 12, 150.0).relax(0, False)
    counted = float(relaxation.value(z, 1e4)) - float(lax.value(z, 1e4))
    assert (too_long > 0).sum() == 5
    assert counted == pytest.approx(STEP_WEIGHT * np.maximum(0, too_long).sum(), rel=1e-3)


@pytest.mark.parametrize("name", ["three_er16", "dual_welder_positioner"])
def test_gradient_and_hessian_of_the_value_leave_second_and_third_order(name: str) -> None:
    relaxation, z = stepping(name)
    gradient, hessian = np.array(relaxation.gradient(z, 20.0)).ravel(), np.array(relaxation.hessian(z, 20.0))
    assert np.abs(hessian - hessian.T).max() < 1e-12
    for d in directions(len(z)):
        first, second = gradient @ d, d @ hessian @ d
        assert taylor(lambda at: float(relaxation.value(at, 20.0)), z, d, first) == pytest.approx(2.0, abs=0.15)
        assert taylor(lambda at: float(relaxation.value(at, 20.0)), z, d, first, second) > 2.7


@pytest.mark.parametrize("name", ["three_er16", "dual_welder_positioner"])
def test_lagrangian_with_steps_leaves_second_and_third_order(name: str) -> None:
    relaxation, z = stepping(name)
    same = relaxation.equalities
    weights = np.random.default_rng(42).normal(size=same.value.numel_out(0))
    first_order = 2.0 * np.array(relaxation.gradient(z, 20.0)).ravel() + weights @ np.array(same.jacobian(z))
    upper = np.array(same.hessian(z, 20.0, 2.0, weights))
    hessian = upper + np.triu(upper, 1).T

    def lagrangian(at: np.ndarray) -> float:
        return 2.0 * float(relaxation.value(at, 20.0)) + float(weights @ np.array(same.value(at)).ravel())

    for d in directions(len(z)):
        assert taylor(lagrangian, z, d, first_order @ d) == pytest.approx(2.0, abs=0.15)
        assert taylor(lagrangian, z, d, first_order @ d, d @ hessian @ d) > 2.7


def test_every_seam_point_adds_the_same_number_of_nonzeros() -> None:
    counts = []
    for points in (10, 20, 40):
        same = formed("three_er16", "spin", points).relax(0, False).equalities
        counts.append((same.jacobian.nnz_out(0), same.hessian.nnz_out(0)))
    a, b, c = np.array(counts)
    assert (c - b == 2 * (b - a)).all()
    own, d = 19, 3
    assert (b - a <= 10 * np.array([18 * (own + d), own * (own + 1) // 2 + d * own + 18])).all()


def test_starts_lead_with_the_best_paths_on_a_grid(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "SCOUTS", 32)
    form = formed("robot_positioner", "spin", 18, 60.0)
    starts = form.starts(3, 4)
    x = starts[:, :2]
    values = [found.value if (found := best(lattice(form.splines), at, 0, True)) else -np.inf for at in x]
    assert values == sorted(values, reverse=True)
    assert form.evaluate(starts[:1]).objective[0] == pytest.approx(values[0], rel=1e-9)
    assert missed(form, starts[0]) == {}
    assert (form.starts(4, 4) != starts).any()


def test_warm_start_is_the_only_one_and_stays_with_wider_margins() -> None:
    nlp, z = full_redundant(coarse("three_er16", 12, 150.0), "numpy", "spin"), np.zeros(3 + 19 * 12)
    wider = nlp.started(z).widened({"singularity": 0.0, "clearance": 0.001, "joint_limit": 0.0})
    for problem in (nlp.started(z), wider):
        assert problem.starts(0, 5) == pytest.approx(np.clip(z, nlp.lower, nlp.upper)[None], abs=1e-2)


def test_ipopt_betters_its_starts_cold_and_from_a_plan_and_is_verified_along_the_seam() -> None:
    form = formed("robot_positioner", "spin", 36, 30.0)
    nlp, ipopt = form.nlp("full_spin", lambda extra: nlp, lambda: nlp), make_solver("ipopt", "full")
    plan = planned(form)
    cold = ipopt.solve(nlp, seed=0, budget=Budget())
    warm = ipopt.solve(nlp.started(full_start(plan, "spin")), seed=0, budget=Budget())
    assert (warm.status, cold.status) == ("SOLVED", "SOLVED")
    assert cold.objective > nlp.evaluate(nlp.starts(0, 1)).objective[0] + 1e-5
    assert warm.objective > form.splines.evaluate(on_splines(form)[None]).objective[0] + 1e-2
    report = verify(form.unpack(cold.x, cold.mode))
    assert report.feasible
    assert report.mmr_mean == pytest.approx(cold.objective, abs=1e-4)


def test_ipopt_tilts_a_weld_on_its_table_and_is_verified_along_the_seam() -> None:
    form = formed("robot_positioner", TILT, 36, 30.0)
    nlp = form.nlp("full_redundant", lambda extra: nlp, lambda: nlp)
    found = make_solver("ipopt", "full").solve(nlp, seed=0, budget=Budget())
    plan = form.unpack(found.x, found.mode)
    report = verify(plan)
    assert found.status == "SOLVED"
    assert found.objective > nlp.evaluate(nlp.starts(0, 1)).objective[0] + 1e-3
    assert report.feasible
    assert report.mmr_mean == pytest.approx(found.objective, abs=1e-4)
    assert np.abs(plan.paths["positioner"] - form.splines.untilted).max() > 0.05


def test_formulations_are_known_by_name() -> None:
    for level, name in FULL_REDUNDANT.items():
        nlp = formulate(coarse("three_er16", 12, 150.0), name, "numpy")
        assert nlp.formulation == name
        assert len(nlp.names) == 3 + 12 * (18 + {"spin": 1, "spin_yaw": 2, "spin_yaw_tilt": 4}[level])
    assert set(FULL_REDUNDANT.values()) <= set(FORMULATIONS)
