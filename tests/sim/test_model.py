"""The MJCF model against the verifier's kinematics, and what it weighs."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from nlpweld.cell import End, load_cell
from nlpweld.cell.files import library_names
from nlpweld.errors import CellError
from nlpweld.plan import joint_counts
from nlpweld.sim.chain import fixed_in
from nlpweld.sim.model import Contacts, cell_spec, contact_pairs, joint_total, open_model
from nlpweld.sim.options import Masses, SimOptions
from nlpweld.sim.recording import pair_distances
from nlpweld.verify import reference as ref
from nlpweld.verify.bodies import all_ends, body_table, floor_distances
from nlpweld.verify.exact import pair_distances as exact_distances
from nlpweld.verify.exact import shared

mujoco = pytest.importorskip("mujoco", reason="the extra 'sim' is not installed")

PLACEMENT = np.array([0.1, -0.3, 0.55, 0.2])


def posed(cell, rng, contacts=None):
    """Return model, data and joints by name in a random posture; a carried workpiece at the placement."""
    model = cell_spec(cell, PLACEMENT, SimOptions(), contacts=contacts).compile()
    data, n = mujoco.MjData(model), joint_total(cell)
    data.qpos[:n] = rng.uniform(-3, 3, n)
    if cell.positioner is None:
        work = ref.workpiece_pose(cell, PLACEMENT, np.array([0.3]))[0]
        data.qpos[n:] = [*work[:3, 3], *Rotation.from_matrix(work[:3, :3]).as_quat(scalar_first=True)]
    mujoco.mj_forward(model, data)
    cuts = np.cumsum(list(joint_counts(cell).values()))[:-1]
    q = {name: part[None] for name, part in zip(joint_counts(cell), np.split(data.qpos[:n], cuts), strict=True)}
    return model, data, q


def poses(cell, q):
    """Return links, TCPs and the workpiece as the verifier has them."""
    links = {s.name: ref.link_poses(s, q[s.name]) for s in cell.stations}
    tcps = {s.name: ref.tcp_pose(s, links[s.name]) for s in cell.stations}
    table = None
    if cell.positioner is not None:
        table = q[cell.positioner.name]
        links[cell.positioner.name] = ref.positioner_links(cell, PLACEMENT, table)
    return links, tcps, ref.workpiece_pose(cell, PLACEMENT, np.array([0.3]), table)


@pytest.mark.parametrize("name", library_names("cells"))
def test_forward_kinematics_agree_to_a_nanometre(name, rng) -> None:
    cell = load_cell(name)
    for _ in range(3):
        _, data, q = posed(cell, rng)
        links, tcps, work = poses(cell, q)
        for owner, T in links.items():
            for k in range(T.shape[1]):
                body = data.body(f"{owner}.link{k}")
                assert np.abs(body.xpos - T[0, k, :3, 3]).max() < 1e-9
                assert np.abs(body.xmat.reshape(3, 3) - T[0, k, :3, :3]).max() < 1e-9
        for owner, T in tcps.items():
            site = data.site(f"{owner}.tcp")
            assert np.abs(site.xpos - T[0, :3, 3]).max() < 1e-9
            assert np.abs(site.xmat.reshape(3, 3) - T[0, :3, :3]).max() < 1e-9
        assert np.abs(data.body("workpiece").xpos - work[0, :3, 3]).max() < 1e-9
        assert np.abs(data.body("workpiece").xmat.reshape(3, 3) - work[0, :3, :3]).max() < 1e-9


@pytest.mark.parametrize("name", library_names("cells"))
def test_distances_agree_with_the_verifiers(name, rng) -> None:
    cell, table = load_cell(name), body_table(load_cell(name))
    between = [(table.label[i], table.label[j]) for i, j in table.pairs]
    contacts = Contacts((*between, *((table.label[i], "floor") for i in table.above_floor)))
    for _ in range(3):
        model, data, q = posed(cell, rng, contacts)
        links, tcps, work = poses(cell, q)
        ends = all_ends(cell, work, links, tcps)
        pairs = exact_distances(shared(), ends, table.radius_m, table.pairs)
        wanted = dict(zip(table.pair_labels, np.hstack([pairs[0], floor_distances(table, ends)[0]]), strict=True))
        found = pair_distances(model, data)
        names = [[model.geom(g).name for g in geoms] for geoms in zip(model.pair_geom1, model.pair_geom2, strict=True)]
        assert len(names) == len(wanted) == len(contacts.pairs)
        for (a, b), apart in zip(names, found, strict=True):
            want = wanted.get(f"{a} - {b}", wanted.get(f"{b} - {a}"))
            assert apart == pytest.approx(want, abs=1e-9)


def test_an_er16_and_the_tee_weigh_what_is_stated(cell) -> None:
    model = cell_spec(cell, PLACEMENT, SimOptions()).compile()
    torch = Masses().tool_kg_m3 * sum(volume(cell.stations[2], b) for b in ("torch_body", "nozzle"))
    assert torch == pytest.approx(2.7, abs=0.05)
    assert model.body("welder.link0").subtreemass[0] - torch == pytest.approx(169, abs=0.5)
    assert model.body("workpiece").subtreemass[0] == pytest.approx(17.1, abs=0.1)


def volume(station, name) -> float:
    body = next(b for b in station.tool.bodies if b.name == name)
    links = ref.link_poses(station, np.zeros((1, 6)))
    start, end = ref.body_ends(station, links, ref.tcp_pose(station, links))[0, station.bodies.index(body)]
    r = body.radius_m
    return np.pi * r**2 * (np.linalg.norm(end - start) + 4 / 3 * r)


def test_controllers_carry_the_workpiece_in_even_shares(cell) -> None:
    whole = cell_spec(cell, PLACEMENT, SimOptions()).compile()
    known = open_model(cell, PLACEMENT, Masses())
    shares = [known.body(f"{name}.share").subtreemass[0] for name in ("handler_1", "handler_2")]
    assert shares == pytest.approx([whole.body("workpiece").subtreemass[0] / 2] * 2)


def test_what_may_touch_and_neighbours_are_no_contact_pairs(cell, rng) -> None:
    model, data, _ = posed(cell, rng)
    pairs = {frozenset(pair) for pair in contact_pairs(cell, model, data).pairs}
    assert frozenset(("handler_1.gripper", "workpiece.main_pipe")) not in pairs
    assert frozenset(("handler_1.gripper", "workpiece.branch")) in pairs
    assert frozenset(("welder.upper_arm", "welder.forearm")) not in pairs
    assert frozenset(("welder.forearm", "welder.torch_body")) not in pairs  # the wrist is between, and they overlap
    assert frozenset(("welder.base_column", "welder.nozzle")) in pairs
    assert frozenset(("welder.nozzle", "floor")) in pairs
    assert frozenset(("welder.base_column", "floor")) not in pairs


def test_neighbours_that_are_apart_are_no_pair_either(cell, rng) -> None:
    station = cell.stations[0]
    far = station.tool.bodies[0].model_copy(
        update={"start": End(frame="link6", at_m=(0.0, 0.0, 0.3)), "end": End(frame="link6", at_m=(0.0, 0.0, 0.4))}
    )
    station = station.model_copy(update={"tool": station.tool.model_copy(update={"bodies": (far,)})})
    cell = cell.model_copy(update={"stations": (station, *cell.stations[1:])})
    model, data, _ = posed(cell, rng)
    pairs = contact_pairs(cell, model, data).pairs
    assert ("handler_1.wrist", "handler_1.gripper") not in pairs
    assert ("handler_1.forearm", "handler_1.gripper") in pairs


def test_tools_hang_on_the_flange_and_arms_on_the_first_link_they_can(cell) -> None:
    model = cell_spec(cell, PLACEMENT, SimOptions()).compile()

    def body_of(geom):
        return model.body(model.geom(geom).bodyid[0]).name

    assert body_of("handler_1.gripper") == "handler_1.link6"
    assert body_of("welder.upper_arm") == "welder.link2"
    assert body_of("welder.wrist") == "welder.link5"


def test_a_body_that_is_rigid_to_no_link_is_refused(cell) -> None:
    robot = cell.stations[0].robot
    torn = robot.bodies[1].model_copy(update={"end": End(frame="link6", at_m=(0.1, 0.0, 0.0))})
    with pytest.raises(CellError, match="'upper_arm' is rigid to no link"):
        fixed_in(robot, torn)
