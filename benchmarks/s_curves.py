"""How fast S-curves are planned, beside ruckig: ``python -m benchmarks.s_curves``.

Writes results/speed/s_curves.json. Both plan the same moves from rest to rest, on one core; ruckig one at a time, from
Python, once with its inputs set for every move and once without, which is its own work alone.
"""

import argparse
import json
from typing import Any

import numpy as np
import ruckig

from benchmarks.ratios import OUT
from benchmarks.timing import Job, interleaved, one_core, ratio
from nlpweld.motion import Limits, s_curve

OURS, THEIRS, BARE = "nlpweld", "ruckig", "ruckig_calculation_alone"


def moves(count: int, seed: int = 0) -> tuple[np.ndarray, Limits]:
    """Return random displacements and limits over orders of magnitude, so that every case of a move occurs."""
    rng = np.random.default_rng(seed)
    spread = [10 ** rng.uniform(low, low + 3, count) for low in (-2, -2, -1, 0)]
    return spread[0] * rng.choice([-1.0, 1.0], count), Limits(*spread[1:])


def by_ruckig(displacement: np.ndarray, limits: Limits) -> np.ndarray:
    """Return the durations that ruckig finds, shape (m,) [s]."""
    planner, asked, found = ruckig.Ruckig(1), ruckig.InputParameter(1), ruckig.Trajectory(1)
    durations = np.empty(len(displacement))
    rows = zip(displacement, limits.velocity, limits.acceleration, limits.jerk, strict=True)
    for k, (length, velocity, acceleration, jerk) in enumerate(rows):
        asked.target_position = [length]
        asked.max_velocity, asked.max_acceleration, asked.max_jerk = [velocity], [acceleration], [jerk]
        planner.calculate(asked, found)
        durations[k] = found.duration
    return durations


def calculation_alone(count: int) -> None:
    """Let ruckig plan one move again and again."""
    planner, asked, found = ruckig.Ruckig(1), ruckig.InputParameter(1), ruckig.Trajectory(1)
    asked.target_position, asked.max_velocity, asked.max_acceleration, asked.max_jerk = [1.0], [1.0], [2.0], [9.0]
    for _ in range(count):
        planner.calculate(asked, found)


def measured(ours: int, theirs: int, rounds: int) -> dict[str, Any]:
    """Return moves a second, ratios, and how far apart the durations are."""
    many, few = moves(ours), moves(theirs)
    jobs = [
        Job(OURS, lambda: s_curve(*many), ours),
        Job(THEIRS, lambda: by_ruckig(*few), theirs),
        Job(BARE, lambda: calculation_alone(theirs), theirs),
    ]
    taken = interleaved(jobs, rounds)
    apart = np.abs(by_ruckig(*few) / s_curve(*few).duration_s - 1).max()
    found: dict[str, Any] = {f"{name}_moves_per_s": 1 / np.median(seconds) for name, seconds in taken.items()}
    found |= {f"times_{name}": ratio(taken[name], taken[OURS]) for name in (THEIRS, BARE)}
    return found | {"duration_apart": float(apart), "moves_compared": theirs}


def main() -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--moves", type=int, default=1_000_000, help="planned at a time")
    parser.add_argument("--rounds", type=int, default=7)
    chosen = parser.parse_args()
    alone = one_core()
    found = measured(chosen.moves, min(chosen.moves, 100_000), chosen.rounds) | {"one_core": alone}
    text = json.dumps(found, indent=1)
    (OUT / "s_curves.json").write_text(text + "\n", encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
