"""The write-up, as it is and as a copy in which something is planted."""

import json
import os
import shutil
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
import typst

sys.path.insert(0, str(Path(__file__).parents[2] / "paper"))

import build

Ask = Callable[..., list]


@pytest.fixture(scope="session")
def ask() -> Ask:
    """Return what finds elements of the set text below a root."""

    def find(selector: str, root: Path = build.ROOT, field: str | None = None, **told: str) -> list:
        source, said = str(root / build.MAIN), build.inputs(root, **told)
        kept = {"root": str(root), "ignore_system_fonts": True, "sys_inputs": said}
        return json.loads(typst.query(source, selector, field=field, **kept))

    return find


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """A root like the repository's, whose text and list of results can be spoiled."""
    shutil.copytree(build.ROOT / "paper", tmp_path / "paper")
    shutil.copytree(build.ROOT / "results", tmp_path / "results", copy_function=os.symlink, ignore=_records)
    for name in ("nlpweld", "experiments", "CITATION.cff"):
        (tmp_path / name).symlink_to(build.ROOT / name)
    return tmp_path


def _records(folder: str, names: list[str]) -> list[str]:
    return [name for name in names if name.startswith("records")]


@pytest.fixture
def plant(copy: Path) -> Callable[[str, str], Path]:
    """Return what appends text to a file of the copy's paper/ and returns the copy's root."""

    def append(name: str, text: str) -> Path:
        path = copy / "paper" / name
        path.write_text(path.read_text("utf-8") + "\n" + text + "\n", "utf-8")
        return copy

    return append
