"""three.js, out of the installed meshcat: its built file holds the library and its orbit controls for a browser."""

from importlib.util import find_spec
from pathlib import Path

from nlpweld.errors import OptionError, missing

BUILT = Path("viewer") / "dist" / "main.min.js"  # exports MeshCat.THREE and MeshCat.Viewer


def bundle() -> tuple[str, str]:
    """Return the text of the built file, and of the licences it is under.

    The package is not imported: its server is not needed.

    Raises:
        OptionError: meshcat is not installed, or holds no such file.
    """
    spec = find_spec("meshcat")
    if spec is None or not spec.submodule_search_locations:
        raise missing("view: meshcat, whose three.js draws the page,", "view")
    path = Path(spec.submodule_search_locations[0]) / BUILT
    licences = path.with_name(f"{path.name}.LICENSE.txt")
    try:
        return path.read_text(encoding="utf-8"), licences.read_text(encoding="utf-8")
    except OSError:
        mend = "pip install --force-reinstall 'nlpweld[view]'"
        raise OptionError(f"view: this meshcat has no {BUILT.as_posix()}; mend it with: {mend}") from None
