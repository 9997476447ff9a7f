"""CONTRIBUTING.md says that a solver is one new file, and shows one: here it is put in place and run."""

import importlib
import re
import sys
from pathlib import Path

import numpy as np
import pytest

import nlpweld.solvers
from nlpweld.solvers import Budget, make_solver, presets, solver_names
from tests.solvers.toys import disc, optimum

GUIDE = Path(__file__).parents[2] / "CONTRIBUTING.md"


@pytest.fixture
def shown(tmp_path, monkeypatch):
    """The name of the guide's solver, its text saved as the guide says."""
    name, text = re.search(r"`nlpweld/solvers/(\w+)\.py`[^\n]*\n+```python\n(.*?)```", GUIDE.read_text(), re.S).groups()
    (tmp_path / f"{name}.py").write_text(text)
    monkeypatch.setattr(nlpweld.solvers, "__path__", [*nlpweld.solvers.__path__, str(tmp_path)])
    importlib.invalidate_caches()
    yield name
    sys.modules.pop(f"nlpweld.solvers.{name}", None)
    vars(nlpweld.solvers).pop(name, None)


def test_the_solver_of_the_guide_is_found_and_solves(shown):
    assert shown in solver_names()
    for preset in presets(shown):
        solver = make_solver(shown, preset)
        assert solver.unsuitable(disc()) is None
        outcome = solver.solve(disc(0.4), seed=0, budget=Budget())
        assert outcome.status == "SOLVED"
        assert np.linalg.norm(outcome.x - optimum(0.4)) < 0.1


def test_the_solver_of_the_guide_keeps_seeds_and_budget(shown):
    first, again, other = (make_solver(shown).solve(disc(), seed=s, budget=Budget(evaluations=130)) for s in (3, 3, 4))
    assert first.evaluations == 130
    assert np.array_equal(first.x, again.x)
    assert not np.array_equal(first.trace[0].x, other.trace[0].x)
    assert make_solver(shown).solve(disc(-0.5), seed=0, budget=Budget(evaluations=130)).status == "INFEASIBLE"
