"""Solvers, one file each; a file's name is the solver's name, and adding one is adding its file.

Files of your own may stay in folders of your own, named by the environment variable NLPWELD_SOLVERS.
"""

import difflib
import importlib
import os
import pkgutil
from dataclasses import fields, is_dataclass
from typing import Any

from nlpweld.errors import OptionError
from nlpweld.solvers.base import Budget, Outcome, Solver

__path__ += filter(None, os.environ.get("NLPWELD_SOLVERS", "").split(os.pathsep))
HELPERS = {"base", "homotopy", "nlpsol", "population", "scalar", "slopes", "starts", "worker"}

__all__ = ["Budget", "Outcome", "Solver", "make_solver", "presets", "solver_names"]


def solver_names() -> list[str]:
    """Return the names of all solvers there are, sorted."""
    return sorted(m.name for m in pkgutil.iter_modules(__path__) if m.name not in HELPERS)


def presets(name: str) -> dict[str, dict[str, Any]]:
    """Return the named option sets of a solver.

    Raises:
        OptionError: no solver of that name.
    """
    return _solver_class(name).PRESETS


def make_solver(name: str, preset: str = "default", **options: Any) -> Solver:
    """Return a solver with a preset's options, some of them replaced.

    Args:
        name: a solver's name.
        preset: one of its presets.
        options: fields of the solver's dataclass.

    Raises:
        OptionError: no such solver, preset or option; the message lists those there are.
    """
    cls = _solver_class(name)
    _known(preset, cls.PRESETS, f"solver '{name}': preset")
    chosen = {**cls.PRESETS[preset], **options}
    kinds = {f.name: type(f.default) for f in fields(cls)}
    for option, value in chosen.items():
        _known(option, kinds, f"solver '{name}': option")
        kind = kinds[option]
        if type(value) is not kind and not (kind is float and type(value) is int):
            raise OptionError(f"solver '{name}': option '{option}' wants {kind.__name__}, got {value!r}; mend it")
    return cls(**chosen)


def _solver_class(name: str) -> Any:
    _known(name, solver_names(), "solver")
    module = importlib.import_module(f"{__name__}.{name}")
    own = (c for c in vars(module).values() if is_dataclass(c) and getattr(c, "__module__", "") == module.__name__)
    return next(c for c in own if hasattr(c, "solve"))


def _known(name: str, names: Any, what: str) -> None:
    if name not in names:
        close = difflib.get_close_matches(name, list(names), n=1)
        hint = f"did you mean '{close[0]}'? " if close else ""
        raise OptionError(f"{what} '{name}' is unknown; {hint}there are: {', '.join(sorted(names))}")
