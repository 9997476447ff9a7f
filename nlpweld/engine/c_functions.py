"""CasADi functions as machine code, where the system has a C compiler; kept on disk by content."""

import hashlib
import os
import shutil
import subprocess
from pathlib import Path

import casadi as ca

from nlpweld.engine.numba_kernels import cache_folder
from nlpweld.errors import OptionError

FLAGS = ("-O1", "-march=native", "-shared", "-fPIC")  # -O2 takes twice as long to compile and runs 5 % faster


def c_compiler() -> str | None:
    """Return the system's C compiler: ``CC``, ``cc`` or ``gcc``, whichever is found first."""
    found = (shutil.which(name) for name in (os.environ.get("CC"), "cc", "gcc") if name)
    return next((path for path in found if path), None)


def compiled(functions: list[ca.Function]) -> list[ca.Function]:
    """Return functions compiled from C; the library is built once for their content and kept in the cache folder.

    Raises:
        OptionError: there is no C compiler, or it fails; says what it said.
    """
    generator = ca.CodeGenerator("functions.c")
    for function in functions:
        generator.add(function)
    text = generator.dump()
    library = cache_folder() / f"nlpweld_c_{hashlib.sha256(text.encode()).hexdigest()[:16]}.so"
    if not library.is_file():
        _build(text, library)
    return [ca.external(function.name(), str(library)) for function in functions]


def _build(text: str, library: Path) -> None:
    compiler = c_compiler()
    if compiler is None:
        raise OptionError("engine 'c' needs a C compiler, and none is found; set CC, or choose another engine")
    library.parent.mkdir(parents=True, exist_ok=True)
    part = library.with_suffix(f".{os.getpid()}.part")
    command = [compiler, *FLAGS, "-x", "c", "-", "-o", str(part), "-lm"]
    done = subprocess.run(command, input=text, capture_output=True, text=True, check=False)
    if done.returncode:
        last = (done.stderr.strip().splitlines() or ["no message"])[-1]
        raise OptionError(f"engine 'c': {compiler} failed: {last}; choose another engine")
    part.replace(library)
