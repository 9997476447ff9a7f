"""Which engine runs the graphs: NumPy always, Numba where the ``fast`` extra is installed.

Engine ``c`` is NumPy with derivatives compiled by the system's C compiler, for whoever has one but not Numba; it
pays when a cell is solved many times, for compiling takes ten seconds.
"""

from importlib.util import find_spec

from nlpweld.errors import OptionError, missing

ENGINES = ("auto", "numpy", "numba", "c")


def chosen_engine(name: str) -> str:
    """Return ``numpy``, ``numba`` or ``c`` for the name of an engine; ``auto`` takes Numba where it is installed.

    Raises:
        OptionError: no such engine, or Numba is not installed.
    """
    if name not in ENGINES:
        raise OptionError(f"engine '{name}' is unknown; there are: {', '.join(ENGINES)}")
    installed = find_spec("numba") is not None
    if name == "numba" and not installed:
        raise missing("engine 'numba'", "fast")
    if name == "auto":
        return "numba" if installed else "numpy"
    return name
