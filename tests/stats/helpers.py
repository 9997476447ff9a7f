"""Small studies made by hand."""

import numpy as np
import pandas as pd

REFERENCE = pd.Series({("cell", "reduced"): 2.0})


def run(solver: str, seed: int, objective: float | None, spent_s: float = 10.0, evaluations: int = 100) -> dict:
    return {
        "cell": "cell", "formulation": "reduced", "solver": solver, "preset": "default", "seed": seed,
        "label": solver, "verified": objective is not None, "objective": np.nan if objective is None else objective,
        "spent_s": spent_s, "evaluations": evaluations,
    }  # fmt: skip


def answer(solver: str, seed: int, time_s: float, objective: float, evaluations: int = 10) -> dict:
    head = {"cell": "cell", "formulation": "reduced", "solver": solver, "preset": "default", "seed": seed}
    return head | {"time_s": time_s, "objective": objective, "evaluations": evaluations}


def table(*rows: dict) -> pd.DataFrame:
    return pd.DataFrame(rows)
