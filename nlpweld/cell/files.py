"""Files of the library and the user's own: found by name or path, read as TOML, checked against a model."""

import os
import tomllib
from importlib import resources
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError

from nlpweld.cell.checked import Checked
from nlpweld.cell.complaint import first_complaint, nearest
from nlpweld.errors import CellError

Model = TypeVar("Model", bound=Checked)
LIBRARY = Path(str(resources.files("nlpweld"))) / "library"


def library_names(kind: str) -> list[str]:
    """Return the built-in names of one kind, ``cells`` or ``robots``, sorted."""
    return sorted(path.stem for path in (LIBRARY / kind).glob("*.toml"))


def find(name_or_path: str | Path, kind: str, beside: Path | None = None) -> Path:
    """Return the file meant by a built-in name or a path; relative paths may also start beside a given file.

    Raises:
        CellError: neither a file nor a built-in name; lists the names there are.
    """
    text = str(name_or_path)
    names = library_names(kind)
    if text in names:
        return LIBRARY / kind / f"{text}.toml"
    for path in (Path(text), beside.parent / text if beside else Path(text)):
        if os.path.isfile(path):  # noqa: PTH113 - Path.is_file raises where a name is too long
            return path
    one = kind.removesuffix("s")
    raise CellError(f"{text}: no such file and no built-in {one} of that name; {nearest(text, names)}")


def read_toml(path: Path) -> dict[str, Any]:
    """Read one TOML file.

    Raises:
        CellError: the file cannot be read or is not TOML.
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise CellError(f"{path}: cannot be read ({error.strerror}); check the path and its permissions") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise CellError(f"{path}: not TOML: {error}; mend the syntax there") from None


def checked(model: type[Model], data: Any, path: Path, where: str = "") -> Model:
    """Build a model from plain data, strictly.

    Args:
        model: what to build.
        data: a table of the file.
        path: the file, for the message.
        where: which table of the file it is; empty for the whole.

    Raises:
        CellError: a field is missing, unknown, of the wrong kind, or contradicts another.
    """
    try:
        return model.model_validate(data)
    except ValidationError as error:
        raise CellError(f"{path}: {first_complaint(error, data, where)}") from None
