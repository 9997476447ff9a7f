"""A cell as an MJCF model: chains, floor, the workpiece between its carriers or on its table, servos, contact pairs."""

from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from nlpweld.cell import Body, Cell, Grasp, Station
from nlpweld.plan import joint_counts
from nlpweld.sim.chain import Pose, add_bodies, add_capsule, add_chain, shell
from nlpweld.sim.mj import mujoco
from nlpweld.sim.options import Masses, Numerics, SimOptions
from nlpweld.verify.bodies import FLOOR, WORKPIECE, body_table

SHARE = "share"  # of the workpiece on a carrier of the controllers' model


@dataclass(frozen=True)
class Gains:
    """Of every joint's servo, stations' joints in order and then the positioner's, each of shape (n,).

    Attributes:
        kp: [N m/rad].
        kv: [N m s/rad].
    """

    kp: np.ndarray
    kv: np.ndarray


@dataclass(frozen=True)
class Contacts:
    """Pairs of geoms between which there are contacts, by name: ``owner.body``, or ``floor``."""

    pairs: tuple[tuple[str, str], ...]


def joint_total(cell: Cell) -> int:
    """Return how many joints stations and positioner have; they are the first of a model's coordinates, in order."""
    return sum(joint_counts(cell).values())


def handlers(cell: Cell) -> list[Station]:
    """Return the stations that carry the workpiece."""
    return [station for station in cell.stations if isinstance(station.coupling, Grasp)]


def open_model(cell: Cell, placement: np.ndarray, masses: Masses) -> Any:
    """Return what the controllers know: every chain by itself, each carrier with its even share of the workpiece.

    It has no floor, contact, joint stop or constraint, so that its inverse dynamics are those of the arms.

    Args:
        cell: the cell.
        placement: of {P} in W, shape (4,) [m; rad].
        masses: densities.
    """
    spec = _chains(cell, placement, masses)
    for station in handlers(cell):
        flange = spec.body(f"{station.name}.link{len(station.robot.joints)}")
        T_F_C = _tool(station) @ _grasp(station).inverse
        share = flange.add_body(name=f"{station.name}.{SHARE}", **T_F_C.mjcf)
        _fill_work(share, cell, masses, f"{station.name}.{SHARE}", 1 / len(handlers(cell)))
    for joint in spec.joints:
        joint.limited = 0
    return spec.compile()


def cell_spec(
    cell: Cell, placement: np.ndarray, options: SimOptions, gains: Gains | None = None, contacts: Contacts | None = None
) -> Any:
    """Return the model to be simulated as an ``MjSpec``.

    Its first coordinates are the joints in the order of :func:`joint_total`; a workpiece that is carried comes last,
    a free body welded to each carrier at its TCP.

    Args:
        cell: the cell.
        placement: of {P} in W, shape (4,) [m; rad].
        options: masses and numerics.
        gains: of the servos; without them there are none.
        contacts: pairs; without them there are none.
    """
    spec = _chains(cell, placement, options.masses)
    _set_numerics(spec, options.numerics)
    spec.worldbody.add_geom(name=FLOOR, type=mujoco().mjtGeom.mjGEOM_PLANE, size=[5, 5, 0.1], contype=0, conaffinity=0)
    if cell.positioner is None:
        _add_free_work(spec, cell, options)
    if gains is not None:
        _add_servos(spec, cell, gains, options.servos.torque_limit_nm)
    for one, other in contacts.pairs if contacts else ():
        spec.add_pair(geomname1=one, geomname2=other)
    return spec


def contact_pairs(cell: Cell, model: Any, data: Any) -> Contacts:
    """Return the pairs that may not touch.

    Those are the verifier's, bodies of different owners and the floor; and bodies of one arm that are apart in the
    given state and no neighbours along the arm, for rounded covers overlap at the joints.

    Args:
        cell: the cell.
        model: of :func:`cell_spec`.
        data: its state in the plan's first posture, forward kinematics done.
    """
    mj, table = mujoco(), body_table(cell)
    between = [(table.label[i], table.label[j]) for i, j in table.pairs]
    floor = [(table.label[i], FLOOR) for i in table.above_floor]
    own = []
    for name, bodies in _owners(cell).items():
        for (i, one), (k, other) in combinations(enumerate(bodies), 2):
            labels = (f"{name}.{one.name}", f"{name}.{other.name}")
            a, b = (model.geom(label).id for label in labels)
            if k > i + 1 and not _same_link(model, a, b) and mj.mj_geomDistance(model, data, a, b, 10.0, None) > 0:
                own.append(labels)
    return Contacts((*between, *floor, *own))


def _owners(cell: Cell) -> dict[str, tuple[Body, ...]]:
    bodies = {station.name: station.bodies for station in cell.stations}
    return bodies | ({cell.positioner.name: cell.positioner.robot.bodies} if cell.positioner else {})


def _same_link(model: Any, one: int, other: int) -> bool:
    return bool(model.geom_bodyid[one] == model.geom_bodyid[other])


def _chains(cell: Cell, placement: np.ndarray, masses: Masses) -> Any:
    """Return a spec with every chain, the workpiece on the positioner's table where there is one."""
    spec = mujoco().MjSpec()
    spec.modelname = cell.name
    spec.compiler.degree = False
    ball = (masses.joint_ball_m, masses.robot_kg_m3)
    for station in cell.stations:
        base, tool, robot = Pose.of(station.base_position_m, station.base_rpy_deg), _tool(station), station.robot
        links = add_chain(spec.worldbody, base, robot, station.name, ball)
        add_bodies(links, robot, robot.bodies, tool, station.name, masses.robot_kg_m3)
        add_bodies(links, robot, station.tool.bodies, tool, station.name, masses.tool_kg_m3)
        links[-1].add_site(name=f"{station.name}.tcp", **tool.mjcf)
    if cell.positioner is not None:
        _add_positioner(spec, cell, placement, masses)
    return spec


def _add_positioner(spec: Any, cell: Cell, placement: np.ndarray, masses: Masses) -> None:
    held = cell.positioner
    assert held is not None
    x, y, z, yaw = placement
    base = Pose.of((x, y, z), (0.0, 0.0, np.degrees(yaw))) @ Pose.of(held.base_position_m, held.base_rpy_deg)
    links = add_chain(spec.worldbody, base, held.robot, held.name, (masses.joint_ball_m, masses.robot_kg_m3))
    add_bodies(links, held.robot, held.robot.bodies, Pose.of((0.0, 0.0, 0.0)), held.name, masses.robot_kg_m3)
    work = links[-1].add_body(name=WORKPIECE, **Pose.of(held.mount_position_m, held.mount_rpy_deg).mjcf)
    _fill_work(work, cell, masses, WORKPIECE)


def _add_free_work(spec: Any, cell: Cell, options: SimOptions) -> None:
    """Add the workpiece as a free body and weld it to each carrier, the TCP to its grasp."""
    mj, numerics = mujoco(), options.numerics
    work = spec.worldbody.add_body(name=WORKPIECE)
    work.add_freejoint()
    _fill_work(work, cell, options.masses, WORKPIECE)
    for station in handlers(cell):
        site = work.add_site(name=f"{station.name}.grasp", **_grasp(station).mjcf)
        spec.add_equality(
            name=f"{station.name}.weld",
            type=mj.mjtEq.mjEQ_WELD,
            objtype=mj.mjtObj.mjOBJ_SITE,
            name1=f"{station.name}.tcp",
            name2=site.name,
            solref=[numerics.weld_time_s, numerics.weld_ratio],
            solimp=[numerics.weld_impedance, numerics.weld_impedance, 1e-3, 0.5, 2],
        )


def _fill_work(body: Any, cell: Cell, masses: Masses, name: str, share: float = 1.0) -> None:
    """Add the workpiece's capsules to a body whose frame is C, with a share of their mass."""
    for capsule in cell.workpiece.bodies:
        inertia = shell(capsule, masses.wall_m, share * masses.work_kg_m3)
        ends = (np.array(capsule.start_m), np.array(capsule.end_m))
        add_capsule(body, f"{name}.{capsule.name}", *ends, capsule.radius_m, **inertia)


def _add_servos(spec: Any, cell: Cell, gains: Gains, limit_nm: float | None) -> None:
    mj = mujoco()
    names = [f"{name}.J{k + 1}" for name, count in joint_counts(cell).items() for k in range(count)]
    for name, kp, kv in zip(names, gains.kp, gains.kv, strict=True):
        servo = spec.add_actuator(name=name, trntype=mj.mjtTrn.mjTRN_JOINT, target=name)
        servo.set_to_position(float(kp), float(kv))
        servo.ctrllimited = 0
        if limit_nm is not None:
            servo.forcelimited, servo.forcerange = 1, [-limit_nm, limit_nm]


def _set_numerics(spec: Any, numerics: Numerics) -> None:
    mj, option = mujoco(), spec.option
    option.timestep = numerics.step_s
    option.integrator = getattr(mj.mjtIntegrator, f"mjINT_{numerics.integrator.upper()}")
    option.jacobian = mj.mjtJacobian.mjJAC_DENSE
    option.disableflags |= int(mj.mjtDisableBit.mjDSBL_AUTORESET)


def _tool(station: Station) -> Pose:
    return Pose.of(station.tool.translation_m, station.tool.rpy_deg)


def _grasp(station: Station) -> Pose:
    assert isinstance(station.coupling, Grasp)
    return Pose.from_matrix(station.coupling.T_C_E)
