"""A search in a file, so that what was interrupted goes on where it was: plain arrays, written whole or not at all."""

import tempfile
from dataclasses import fields
from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from nlpweld.errors import OutputError
from nlpweld.reference.tree import Tree


def save_tree(path: Path, tree: Tree, key: str) -> None:
    """Write a search.

    Args:
        path: of the file.
        tree: the search.
        key: all that decides how it goes on; only a search with the same key takes it up again.

    Raises:
        OutputError: the file cannot be written.
    """
    temporary = None
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile("wb", dir=path.parent, delete=False) as file:
            temporary = Path(file.name)
            np.savez(file, key=np.array(key), **{field.name: getattr(tree, field.name) for field in fields(Tree)})
        temporary.replace(path)
    except OSError as error:
        raise OutputError(f"{path}: cannot be written ({error.strerror}); choose another --out") from None
    finally:
        if temporary:
            temporary.unlink(missing_ok=True)


def load_tree(path: Path, key: str) -> Tree | None:
    """Return the search of a file, or None where there is none with this key that can be read."""
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as data:
            if str(data["key"]) != key:
                return None
            settled, boxes = float(data["settled"]), int(data["boxes"])
            return Tree(data["lower"], data["upper"], data["mode"], data["bound"], settled, boxes)
    except (OSError, ValueError, KeyError, EOFError, BadZipFile):
        return None
