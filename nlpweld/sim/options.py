"""What a simulation takes for granted beyond the cell: masses, servos, numerics, and the levels it is held to.

No cell states these, so every default is *chosen*; its docstring says why. A report repeats all of them.
"""

from dataclasses import dataclass, field, replace

from nlpweld.errors import OptionError

LONGEST_STEP_S = 5e-3
FEED_FORWARD = ("none", "rates", "gravity", "torque")


@dataclass(frozen=True)
class Masses:
    """Where inertias come from: the volume of the cell's capsules and these densities.

    Attributes:
        robot_kg_m3: effective density of an arm's capsules, a positioner's too. With it an ER16 weighs 169 kg; 170 kg
            is taken for its catalogue weight (of low confidence).
        tool_kg_m3: of grippers and torches: solid aluminium, which makes 2.7 kg of the built-in cells' torch.
        work_kg_m3: of the workpiece: steel.
        wall_m: every capsule of the workpiece is a tube of this wall, closed by round caps, as far as its radius
            allows; where capsules overlap, metal counts twice. The tee of ``three_er16`` weighs 17.1 kg.
        joint_ball_m: radius of a ball of the arm's density at the frame of every link that carries no capsule: no
            link is without mass.
    """

    robot_kg_m3: float = 1350.0
    tool_kg_m3: float = 2700.0
    work_kg_m3: float = 7850.0
    wall_m: float = 0.005
    joint_ball_m: float = 0.06


@dataclass(frozen=True)
class Servos:
    """How joints are driven: ``torque = kp (q_d - q) + kv (q_d' - q') + feed-forward``.

    Attributes:
        frequency_hz: of every joint's loop on its own; ``kp = (2 pi f)^2 M_ii`` with the inertia about the joint in
            the plan's first posture, payload included. 10 Hz is what the lowest structural resonance of arms of this
            size allows.
        damping_ratio: ``kv = 2 ratio (2 pi f) M_ii``; 1 is critical.
        feed_forward: ``none`` (positions alone), ``rates`` (q_d' too), ``gravity`` (the weight of arm, tool and a
            carrier's even share of the workpiece besides), or ``torque`` (the whole inverse dynamics of arm and share
            at planned angles, rates and accelerations), as controllers do that know their payload.
        model_error: the feed-forward torque is too large by this share, as if all masses were known wrong by it.
        torque_limit_nm: of every joint, or None: no cell states any.
    """

    frequency_hz: float = 10.0
    damping_ratio: float = 1.0
    feed_forward: str = "torque"
    model_error: float = 0.0
    torque_limit_nm: float | None = None


@dataclass(frozen=True)
class Numerics:
    """How MuJoCo steps and how stiff its constraints are.

    Attributes:
        integrator: ``discrete`` solves constraints together with the servos' stiffness and damping; ``implicitfast``
            takes damping implicitly after the constraints, which lets grasps drift, and ``euler`` not at all.
        step_s: time step.
        weld_time_s: time constant of a grasp's weld constraint, at least two steps (MuJoCo's ``solref``).
        weld_ratio: damping ratio of it.
        weld_impedance: how nearly rigid a grasp is (``solimp``, the same at all distances). What a grasp gives under
            a load is in proportion to ``(1 - impedance) weld_time^2``.
        hz: how often the state is kept.
        clearance_hz: how often every pair's distance is measured, at kept instants.
    """

    integrator: str = "discrete"
    step_s: float = 1e-3
    weld_time_s: float = 2e-3
    weld_ratio: float = 1.0
    weld_impedance: float = 0.9999
    hz: float = 250.0
    clearance_hz: float = 10.0


@dataclass(frozen=True)
class Levels:
    """What a simulation must keep to hold.

    Attributes:
        torch_m: torch off the weld point on the part while it welds: half a wire's diameter or so is 1 mm, twice that
            is where seams are missed.
        grasp_m: drift of a grasp, and how far the plan itself may hold a carrier off its grasp.
        grasp_rad: the same as an angle.
        grasp_n: force at a grasp: about three times the weight of the tee, for a gripper on a 16 kg robot.
        grasp_nm: torque at a grasp.
    """

    torch_m: float = 2e-3
    grasp_m: float = 1e-3
    grasp_rad: float = 5e-3
    grasp_n: float = 500.0
    grasp_nm: float = 100.0


@dataclass(frozen=True)
class SimOptions:
    """Everything a simulation takes for granted."""

    masses: Masses = field(default_factory=Masses)
    servos: Servos = field(default_factory=Servos)
    numerics: Numerics = field(default_factory=Numerics)
    levels: Levels = field(default_factory=Levels)


def chosen(hz: float | None = None, step_ms: float | None = None) -> SimOptions:
    """Return the defaults but for what is given; grasps stay as stiff as the time step allows.

    Args:
        hz: how often the state is kept [1/s].
        step_ms: time step [ms].

    Raises:
        OptionError: a value is not one that a simulation can have.
    """
    plain = Numerics()
    step_s = plain.step_s if step_ms is None else 1e-3 * step_ms
    if not 0 < step_s <= LONGEST_STEP_S:
        raise OptionError(f"--step-ms {step_ms:g} is not above 0 and at most {1e3 * LONGEST_STEP_S:g}")
    kept = plain.hz if hz is None else hz
    if not 0 < kept <= 1 / step_s:
        raise OptionError(f"--hz {kept:g} is not above 0 and at most one per step, {1 / step_s:g}")
    return SimOptions(numerics=replace(plain, step_s=step_s, weld_time_s=2 * step_s, hz=kept))
