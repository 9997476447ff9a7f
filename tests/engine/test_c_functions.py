"""Functions compiled from C are the functions, compiled once."""

import casadi as ca
import numpy as np
import pytest

from nlpweld.engine import c_functions
from nlpweld.engine.c_functions import c_compiler, compiled
from nlpweld.errors import OptionError

needs_compiler = pytest.mark.skipif(c_compiler() is None, reason="no C compiler here")
x, p = ca.MX.sym("x", 2), ca.MX.sym("p")
FUNCTIONS = [
    ca.Function("value", [x, p], [p * ca.sumsqr(x) + ca.exp(x[0])]),
    ca.Function("gradient", [x, p], [2 * p * x + ca.vertcat(ca.exp(x[0]), 0)]),
]


@needs_compiler
def test_compiled_functions_give_the_same_numbers(tmp_path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NLPWELD_CACHE", str(tmp_path))
    for ours, theirs in zip(compiled(FUNCTIONS), FUNCTIONS, strict=True):
        got, want = (np.array(f([0.3, -1.2], 7.0)) for f in (ours, theirs))
        assert got == pytest.approx(want, rel=1e-14)
    assert [path.suffix for path in tmp_path.iterdir()] == [".so"]


@needs_compiler
def test_a_known_content_is_not_compiled_again(tmp_path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NLPWELD_CACHE", str(tmp_path))
    compiled(FUNCTIONS)
    monkeypatch.setattr(c_functions, "c_compiler", lambda: None)
    assert float(compiled(FUNCTIONS)[0]([1.0, 1.0], 1.0)) == pytest.approx(2.0 + np.e)
    with pytest.raises(OptionError, match="set CC"):
        compiled(FUNCTIONS[:1])


def test_a_compiler_that_fails_is_quoted(tmp_path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NLPWELD_CACHE", str(tmp_path))
    monkeypatch.setattr(c_functions, "c_compiler", lambda: "false")
    with pytest.raises(OptionError, match="engine 'c': false failed: no message"):
        compiled(FUNCTIONS)
    assert not list(tmp_path.iterdir())
