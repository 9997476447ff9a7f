"""nlpweld: where the workpiece goes and how every robot moves, for robots that weld one part together.

A cell file goes in, a verified plan and a row of a results table come out. The names below are the public
interface; they load what they need when first used, so that importing nlpweld is quick.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from nlpweld.bench.answer import Answer, evaluate, formulate, solve
    from nlpweld.bench.compare import compare
    from nlpweld.cell import Cell, load_cell, load_positioner, load_robot
    from nlpweld.errors import NlpweldError
    from nlpweld.export import export_plan
    from nlpweld.formulation.full import full, full_start
    from nlpweld.formulation.full_redundant import full_redundant
    from nlpweld.formulation.reduced import reduced
    from nlpweld.formulation.redundant import redundant
    from nlpweld.formulation.robust import robust
    from nlpweld.palletising import load_pallet_task, palletize
    from nlpweld.plan import Plan, load_plan
    from nlpweld.solvers import Budget, solver_names
    from nlpweld.timing import time_plan
    from nlpweld.verify import Report, TimingReport, verify_robust, verify_timing
    from nlpweld.verify import verify as verify_plan

__version__ = "0.1.0"

_HOMES = {
    "Answer": "bench.answer",
    "Budget": "solvers",
    "Cell": "cell",
    "NlpweldError": "errors",
    "Plan": "plan",
    "Report": "verify",
    "TimingReport": "verify",
    "compare": "bench.compare",
    "evaluate": "bench.answer",
    "export_plan": "export",
    "formulate": "bench.answer",
    "full": "formulation.full",
    "full_redundant": "formulation.full_redundant",
    "full_start": "formulation.full",
    "load_cell": "cell",
    "load_pallet_task": "palletising",
    "load_plan": "plan",
    "load_positioner": "cell",
    "load_robot": "cell",
    "palletize": "palletising",
    "reduced": "formulation.reduced",
    "redundant": "formulation.redundant",
    "robust": "formulation.robust",
    "solve": "bench.answer",
    "solver_names": "solvers",
    "time_plan": "timing",
    "verify_plan": "verify",
    "verify_robust": "verify",
    "verify_timing": "verify",
}

__all__ = [
    "Answer",
    "Budget",
    "Cell",
    "NlpweldError",
    "Plan",
    "Report",
    "TimingReport",
    "compare",
    "evaluate",
    "export_plan",
    "formulate",
    "full",
    "full_redundant",
    "full_start",
    "load_cell",
    "load_pallet_task",
    "load_plan",
    "load_positioner",
    "load_robot",
    "palletize",
    "reduced",
    "redundant",
    "robust",
    "solve",
    "solver_names",
    "time_plan",
    "verify_plan",
    "verify_robust",
    "verify_timing",
]


def __getattr__(name: str) -> Any:
    """Load a public name from its home on first use (PEP 562)."""
    if name not in _HOMES:
        raise AttributeError(f"module 'nlpweld' has no attribute '{name}'")
    home = importlib.import_module(f"nlpweld.{_HOMES[name]}")
    # the package nlpweld.verify keeps its own name, so its function goes by another here
    value = getattr(home, "verify" if name == "verify_plan" else name)
    globals()[name] = value
    return value
