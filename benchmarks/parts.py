"""Kinematics, inverse and clearance alone: jobs to time, each for whoever has such a part."""

from collections.abc import Callable
from dataclasses import dataclass

import casadi as ca
import numpy as np

from benchmarks import graphs, naive
from benchmarks.contenders import ENGINES, missing
from benchmarks.peak import instructions
from benchmarks.timing import Job
from nlpweld.cell import Cell
from nlpweld.engine.numpy_kernels import numpy_kernel

WHAT = {
    "fk_jacobian_det": "TCP pose, geometric Jacobian and |det J| of one configuration of one robot",
    "inverse": "all 8 branches of one pose of one robot",
    "clearance": "111 capsule pairs and 15 heights of one configuration of the cell",
}
LANES = (16, 72)  # candidates by points a kernel is given: fits the cache
FEW = 72  # configurations of contenders that loop


@dataclass(frozen=True)
class Part:
    """One part, ready to time.

    Attributes:
        name: key of ``WHAT``.
        jobs: one per contender; a unit of work is one configuration.
        instructions: arithmetic instructions of the graph for one configuration.
    """

    name: str
    jobs: list[Job]
    instructions: int


@dataclass(frozen=True)
class Samples:
    """Real configurations: joints and poses of the first station, and body ends, at the seam of a feasible placement.

    Attributes:
        arms: numbers of the stations.
        q: joints of every station, shape (stations, N, 6) [rad].
        poses: flange poses of the first station in its base frame, (4, 4) each.
        ends: body ends, shape (N, B, 2, 3) [m].
        x: the placement, shape (3,) [m].
    """

    arms: list[naive.Arm]
    q: np.ndarray
    poses: list[np.ndarray]
    ends: np.ndarray
    x: np.ndarray


def samples(cell: Cell) -> Samples:
    """Return the configurations at the paper's placement."""
    loop, x = naive.Naive(cell), np.array(cell.placements["paper"])
    q = np.array(loop.joint_paths(x))
    poses = [naive.flange_pose(loop.arms[0], x, *point) for point in loop.seam]
    ends = np.array(
        [loop.ends(x, j, [naive.links(a, p[j]) for a, p in zip(loop.arms, q, strict=True)]) for j in range(FEW)]
    )
    return Samples(loop.arms, q, poses, ends, x)


def parts(cell: Cell) -> list[Part]:
    """Return all parts with their jobs; contenders that are not installed are left out."""
    here = samples(cell)
    return [_jacobian(cell, here), _inverse(cell, here), _clearance(cell, here)]


def _jacobian(cell: Cell, here: Samples) -> Part:
    graph = graphs.jacobian_graph(cell.stations[0])
    theta = here.q[0] + np.array(here.arms[0].dh)[:, 3]
    jobs = [Job("naive", lambda: [_naive_jacobian(here.arms[0], q) for q in here.q[0]], FEW)]
    if not missing("peers"):
        from benchmarks.peers import jacobian_job

        jobs.append(Job("peers", jacobian_job(here.arms[0], here.q[0]), FEW))
    return Part(
        "fk_jacobian_det", jobs + _ours([(graph, np.vstack([np.cos(theta).T, np.sin(theta).T]))]), instructions(graph)
    )


def _naive_jacobian(arm: naive.Arm, q: np.ndarray) -> float:
    return abs(np.linalg.det(naive.jacobian(naive.links(arm, q))))


def _inverse(cell: Cell, here: Samples) -> Part:
    graph, arm = graphs.inverse_graph(cell.stations[0]), here.arms[0]
    jobs = [Job("naive", lambda: [naive.inverse(arm.dh, T, *b) for T in here.poses for b in naive.BRANCHES], FEW)]
    if not missing("peers"):
        from benchmarks.peers import inverse_job

        jobs.append(Job("peers", inverse_job(arm, here.poses), FEW))
    T = np.array(here.poses)
    inputs = np.vstack([T[:, :3, :3].transpose(2, 1, 0).reshape(9, -1), T[:, :3, 3].T])
    return Part("inverse", jobs + _ours([(graph, inputs)]), instructions(graph))


def _clearance(cell: Cell, here: Samples) -> Part:
    loop = naive.Naive(cell)
    jobs = [Job("naive", lambda: [loop.least_distance(ends) for ends in here.ends], FEW)]
    if not missing("peers"):
        from benchmarks.peers import clearance_job

        jobs.append(Job("peers", clearance_job(cell, here.x, list(here.q)), FEW))
    work = [
        (graph, graphs.clearance_sources(here.ends, bodies))
        for graph, bodies in graphs.clearance_graphs(cell, naive.body_lengths(cell))
    ]
    return Part("clearance", jobs + _ours(work), sum(instructions(graph) for graph, _ in work))


def _ours(work: list[tuple[ca.Function, np.ndarray]]) -> list[Job]:
    """Return jobs for the virtual machine and both engines, from graphs and inputs (rows, FEW)."""
    jobs = [Job("casadi_vm", _all([_mapped(graph, x) for graph, x in work]), FEW)]
    count = LANES[0] * LANES[1]
    for name, kind in ENGINES.items():
        if not missing(name):
            jobs.append(Job(name, _all([_kernel(kind, graph, x) for graph, x in work]), count))
    return jobs


def _mapped(graph: ca.Function, x: np.ndarray) -> Callable[[], object]:
    mapped, dm = graph.map(x.shape[1]), ca.DM(x)
    return lambda: mapped(dm)


def _kernel(kind: str, graph: ca.Function, x: np.ndarray) -> Callable[[], object]:
    kernel = _lowered(kind)(graph, ("lane",))
    lanes = np.ascontiguousarray(np.broadcast_to(x[:, None, :], (len(x), *LANES)))
    given = lanes if kind == "numba" else list(lanes)
    return lambda: kernel(given)


def _lowered(kind: str) -> Callable[[ca.Function, tuple[str, ...]], Callable]:
    if kind == "numpy":
        return numpy_kernel
    from nlpweld.engine.numba_kernels import numba_kernel

    return numba_kernel


def _all(runs: list[Callable[[], object]]) -> Callable[[], object]:
    return lambda: [run() for run in runs]
