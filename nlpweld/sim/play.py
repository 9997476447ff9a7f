"""Playing a timed plan: the model is stepped through it, and what happens is kept."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from nlpweld.errors import OptionError
from nlpweld.plan import Plan
from nlpweld.sim.control import control_signal, servo_gains
from nlpweld.sim.mj import mujoco, without_log
from nlpweld.sim.model import cell_spec, contact_pairs, joint_total, open_model
from nlpweld.sim.options import SimOptions
from nlpweld.sim.planned import carried_work, planned
from nlpweld.sim.recording import Keeper, Recording

Told = Callable[[int, int], None]
TOLD_EVERY = 500  # steps
MOST_STEPS = 2_000_000  # whose commands take a third of a gigabyte for 18 joints


@dataclass(frozen=True, eq=False)
class Stage:
    """A plan's model, ready to be stepped.

    Attributes:
        spec: the model as MJCF.
        model: compiled.
        data: its state at the first instant.
        t_s: instants of all steps, shape (N,).
        control: what the servos are told at each, shape (N, n) [rad].
    """

    spec: Any
    model: Any
    data: Any
    t_s: np.ndarray
    control: np.ndarray


def stage(plan: Plan, options: SimOptions, span_s: tuple[float | None, float | None] = (None, None)) -> Stage:
    """Build the model of a timed plan and put it where the plan is at the first instant, moving as planned.

    Args:
        plan: a timed plan.
        options: what is taken for granted.
        span_s: first and last instant of the timeline; None is its end.

    Raises:
        OptionError: MuJoCo is missing, or the span is not within the timeline, shorter than a step or of too many.
        PlanError: the plan is not timed.
    """
    timeline, cell = plan.needed_timeline, plan.cell
    begin = 0.0 if span_s[0] is None else span_s[0]
    end = timeline.duration_s if span_s[1] is None else span_s[1]
    if not 0.0 <= begin < end <= timeline.duration_s:
        raise OptionError(f"from {begin:g} to {end:g} s is not within the plan's 0 to {timeline.duration_s:g} s")
    step = options.numerics.step_s
    steps = (end - begin) / step
    if not 1 - 1e-9 <= steps <= MOST_STEPS:
        few = f"{1e3 * (end - begin):g} ms are {steps:,.3g} steps of {1e3 * step:g} ms"
        raise OptionError(f"{few}; a simulation takes 1 to {MOST_STEPS:,}, see --from, --to and --step-ms")
    t_s = begin + step * np.arange(int(np.floor(steps + 1e-9)) + 1)
    controllers = open_model(cell, plan.placement, options.masses)
    gains = servo_gains(cell, controllers, planned(cell, timeline, t_s[:1])[0], options.servos)
    bare = cell_spec(cell, plan.placement, options).compile()
    pairs = contact_pairs(cell, bare, _put(bare, plan, begin))
    spec = cell_spec(cell, plan.placement, options, gains, pairs)
    model = spec.compile()
    ahead = step if options.numerics.integrator == "discrete" else 0.0  # it reads servos at the end of the step
    control = control_signal(cell, timeline, t_s + ahead, controllers, gains, options.servos)
    return Stage(spec, model, _put(model, plan, begin), t_s, control)


def play(plan: Plan, set_up: Stage, options: SimOptions, told: Told | None = None) -> Recording:
    """Step a model through its plan and return what happened.

    Args:
        plan: the plan it was made of.
        set_up: its model.
        options: what is taken for granted.
        told: called now and then with steps done and steps in all.
    """
    mj, model, data, n = mujoco(), set_up.model, set_up.data, joint_total(plan.cell)
    keeper = Keeper(plan.cell, model, set_up.t_s, options)
    given_up = (mj.mjtWarning.mjWARN_BADQACC, mj.mjtWarning.mjWARN_BADQPOS, mj.mjtWarning.mjWARN_BADQVEL)
    with without_log():
        for k, t_s in enumerate(set_up.t_s):
            q = data.qpos[:n].copy()
            data.ctrl[:] = set_up.control[k]
            mj.mj_step(model, data)  # leaves positions and forces as they were at t_s, and the state one step on
            gone = any(data.warning[kind].number for kind in given_up)
            if k == 0 or not gone:
                keeper.keep(k, float(t_s), q, data)
            if gone:
                return keeper.recording(float(t_s))
            if told and (k + 1) % TOLD_EVERY == 0:
                told(k + 1, len(set_up.t_s))
    return keeper.recording(None)


def _put(model: Any, plan: Plan, t_s: float) -> Any:
    """Return data with the plan's state at an instant, forward kinematics done."""
    mj, cell, timeline = mujoco(), plan.cell, plan.timeline
    assert timeline is not None
    n, data, h = joint_total(cell), mujoco().MjData(model), model.opt.timestep
    instants = np.clip([t_s - h, t_s, t_s + h], 0.0, timeline.duration_s)
    states = np.zeros((3, model.nq))
    states[:, :n] = planned(cell, timeline, instants)
    if cell.positioner is None:
        work = carried_work(plan, instants)
        states[:, n : n + 3] = work[:, :3, 3]
        states[:, n + 3 :] = Rotation.from_matrix(work[:, :3, :3]).as_quat(scalar_first=True)
    mj.mj_differentiatePos(model, data.qvel, instants[2] - instants[0], states[0], states[2])
    data.qvel[:n] = planned(cell, timeline, instants[1:2], 1)[0]
    data.qpos[:] = states[1]
    mj.mj_forward(model, data)
    return data
