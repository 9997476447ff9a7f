"""Stages of a cycle against the motions themselves: who is where when, limits, and a cycle that is continuous."""

import numpy as np
import pytest

from nlpweld.palletising import PalletTask, load_pallet_task
from nlpweld.palletising.calibration import limits_of
from nlpweld.palletising.curves import AXES, at, motions, over_height, velocities
from nlpweld.palletising.cycle import after, before, legs, ways
from nlpweld.palletising.optimum import optimum

BOXES = (0, 15, 20, 22)


@pytest.fixture(scope="module")
def task() -> PalletTask:
    return load_pallet_task()


@pytest.fixture(scope="module")
def best(task: PalletTask) -> np.ndarray:
    return optimum(legs(task), task.cycle.z_a_m).z_max_m


@pytest.mark.parametrize("box", BOXES)
def test_b_passes_p1_and_p2_when_the_stages_say(task: PalletTask, best: np.ndarray, box: int) -> None:
    leg = legs(task).of(box)
    for z in (best[box], best[box] + 0.2, float(leg.lowest_m)):
        stages, moves = after(leg, np.array([z])), motions(task, box, "after", z)
        t_1, end = stages.up_s, stages.total_s
        height = leg.z_0 + at(moves, "B", np.concatenate([t_1, end - stages.down_s, end, [end[0] + 1.0]]))
        np.testing.assert_allclose(height, [leg.z_1, leg.z_2, leg.z_3, leg.z_3], atol=1e-12)
        for axis in "ACD":
            way = at(moves, axis, np.concatenate([t_1, end - stages.down_s]))
            assert way[0] == 0.0
            target = ways(task)
            wanted = {"A": target.swing_deg, "C": target.reach_m, "D": target.wrist_deg}[axis][box]
            assert way[1] == pytest.approx(wanted, abs=1e-9)


@pytest.mark.parametrize("cycle", ["before", "after"])
def test_no_axis_leaves_its_limits_and_positions_do_not_jump(task: PalletTask, best: np.ndarray, cycle) -> None:
    bounds = limits_of(task).reshape(4, 3)
    for box in BOXES:
        moves = motions(task, box, cycle, best[box])
        t = np.linspace(0.0, 3.0, 3001)
        for axis, limit in zip(AXES, bounds, strict=True):
            values = [at(moves, axis, t, derivative) for derivative in range(4)]
            for value, most in zip(values[1:], limit, strict=True):
                assert np.abs(value).max() <= most * (1 + 1e-12)
            assert np.abs(np.diff(values[0])).max() <= limit[0] * 1.001e-3


def test_the_cycle_before_is_the_sum_of_three_moves(task: PalletTask) -> None:
    for box in BOXES:
        moves = motions(task, box, "before", 2.0)
        ends = max(float(np.squeeze(m.start_s + m.curve.duration_s)) for m in moves)
        assert ends == pytest.approx(before(legs(task)).total_s[box], rel=1e-13)
        heights = at(moves, "B", np.array([ends]))
        assert heights[0] == pytest.approx(np.diff(task.heights_m[[0, 3], box])[0], abs=1e-12)


def test_axes_by_themselves_take_their_own_time_and_the_total_stays(task: PalletTask, best: np.ndarray) -> None:
    alone = task.with_(cycle={"synchronised": False})
    times = {
        name: {m.axis: float(np.squeeze(m.curve.duration_s)) for m in motions(t, 0, "after", best[0])}
        for name, t in (("together", task), ("alone", alone))
    }
    assert times["together"]["A"] == pytest.approx(times["together"]["C"])
    assert times["alone"]["C"] == pytest.approx(ways(task).reach_s[0])
    assert optimum(legs(alone), 2.0).time_s.sum() == optimum(legs(task), 2.0).time_s.sum()


def test_curves_are_tables_of_the_same_numbers(task: PalletTask, best: np.ndarray) -> None:
    stages = over_height(task, 15, 201)
    assert stages.total_s.min() == pytest.approx(optimum(legs(task), 2.0).time_s[15], abs=1e-3)
    np.testing.assert_allclose(stages.total_s, stages.up_s + stages.across_s + stages.down_s)
    assert (np.diff(stages.lift_s) > 0).all()
    assert (np.diff(stages.up_s) <= 1e-12).all()
    table = velocities(task, 15, best[15], 2001)
    for cycle in ("before", "after"):
        own = table[table.cycle == cycle]
        risen = np.trapezoid(own.B_m_s, own.t_s)
        assert risen == pytest.approx(task.heights_m[3, 15] - task.heights_m[0, 15], abs=1e-5)
