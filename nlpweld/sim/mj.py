"""MuJoCo, asked for where it is needed: it comes with the extra ``sim``."""

import importlib
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from nlpweld.errors import missing


def mujoco() -> Any:
    """Return the module.

    Raises:
        OptionError: it is not installed.
    """
    try:
        return importlib.import_module("mujoco")
    except ImportError:
        raise missing("MuJoCo", "sim") from None


@contextmanager
def without_log() -> Iterator[None]:
    """Keep MuJoCo from printing its warnings and writing them to a file where the program was started."""
    mj = mujoco()
    before = mj.get_mju_user_warning()
    mj.set_mju_user_warning(lambda text: None)
    try:
        yield
    finally:
        mj.set_mju_user_warning(before)
