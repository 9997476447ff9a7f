"""Records made by hand."""

from typing import Any

from nlpweld.records.files import write_record
from nlpweld.records.frames import AXES
from nlpweld.records.model import Record

ROBOTS = ("handler_1", "handler_2", "welder")
MACHINE = {"system": "Linux", "processor": "x86_64", "python": "3.11", "cores": 2}


def report(mmr: float, feasible: bool = True, violations: tuple = ()) -> dict[str, Any]:
    each = dict.fromkeys(ROBOTS, 0.4)
    names = ("mmr_min", "mmr_max", "m_tight_mean", "m_loose_mean", "clearance_m", "joint_margin_rad")
    return {
        "reading": "paper", "mmr_mean": mmr, **dict.fromkeys(names, 0.1), "closure_m": 1e-15, "closure_rad": 1e-15,
        "manipulability_mean": each, "manipulability_min": each, "singularity_min": each,
        "feasible": feasible, "violations": list(violations),
    }  # fmt: skip


def trace(mmr: float, at: tuple[float, ...], steps: int = 8) -> dict[str, Any]:
    counts = range(1, steps + 1)
    return {
        "time_s": [float(k) for k in counts], "evaluations": [50 * k for k in counts],
        "best": [None if k == 1 else mmr - 0.1 / k for k in counts], "mean": [mmr - 0.2 / k for k in counts],
        "spread": [1.0 / k for k in counts],
        "placement": {name: [a + 0.3 / k for k in counts] for name, a in zip(AXES, at, strict=True)},
    }  # fmt: skip


def record(
    solver: str = "ga",
    seed: int = 0,
    mmr: float = 0.29,
    verified: bool = True,
    at: tuple[float, ...] = (0.0, -0.166, 0.404),
    status: str = "SOLVED",
    **other: Any,
) -> Record:
    held = {"time_s": 2.5 + seed, "evaluations": 400, "claimed": mmr, "objective": mmr, "verified": verified}
    whole = {
        "key": "k", "cell": "three_er16", "cell_hash": "h", "formulation": "reduced", "solver": solver,
        "preset": "default", "options": {}, "budget": {}, "seed": seed, "versions": {"nlpweld": "0.1.0"},
        "machine": MACHINE, "status": status, "message": "", "verified": verified, "variables": 3,
        "placement": dict(zip(AXES, at, strict=True)), "claimed_objective": mmr, "evaluations": 400, "build_s": 0.5,
        "solve_s": 2.0 + seed, "wall_s": 4.0, "trace": trace(mmr, at), "answers": [held],
        "report": report(mmr, verified),
    }  # fmt: skip
    return Record.model_validate(whole | other)


def place(folder, made: Record):
    return (
        folder / "records" / made.cell / made.formulation / f"{made.solver}-{made.preset}" / f"seed{made.seed:03d}.json"
    )


def store(folder, **facts):
    made = record(**facts)
    return write_record(place(folder, made), made)
