"""A picture of a page, by a Chromium that runs without a window."""

import os
import shutil
import subprocess
import tempfile
from pathlib import Path
from urllib.parse import urlencode

from nlpweld.errors import OptionError, OutputError
from nlpweld.plan import write_bytes

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
FLAGS = (
    "--headless", "--no-sandbox", "--disable-quic", "--no-first-run", "--hide-scrollbars", "--disable-sync",
    "--disable-background-networking", "--disable-component-update",
    "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
)  # fmt: skip
LIMIT_S = 120.0


def browser() -> str:
    """Return the path of a Chromium: what ``NLPWELD_CHROMIUM`` names, or the first that is found.

    Raises:
        OptionError: there is none.
    """
    named = os.environ.get("NLPWELD_CHROMIUM")
    found = next((path for name in (named, *BROWSERS) if name and (path := shutil.which(name))), None)
    if found is None:
        raise OptionError("view: no Chromium is found to take the picture; install one, or name it in NLPWELD_CHROMIUM")
    return found


def save_picture(
    page: str | Path, path: str | Path, at: float = 0.4, size: tuple[int, int] = (1600, 900), look: str = "light"
) -> Path:
    """Save a PNG of a page written by :func:`~nlpweld.view.page.write_view`, and return its path.

    Args:
        page: the page.
        path: of the picture.
        at: where the cursor stands, as a share of the whole.
        size: width and height [px].
        look: ``light`` or ``dark``.

    Raises:
        OptionError: there is no Chromium.
        OutputError: the picture cannot be taken or written.
    """
    address = f"{Path(page).resolve().as_uri()}#{urlencode({'at': at, 'look': look})}"
    with tempfile.TemporaryDirectory() as folder:
        taken = Path(folder) / "taken.png"
        asked = (f"--screenshot={taken}", f"--window-size={size[0]},{size[1]}", "--virtual-time-budget=1000")
        command = [browser(), *FLAGS, f"--user-data-dir={folder}/profile", *asked, address]
        try:
            subprocess.run(command, timeout=LIMIT_S, check=True, capture_output=True)
            data = taken.read_bytes()
        except (OSError, subprocess.SubprocessError) as error:
            raise OutputError(f"{path}: the picture could not be taken ({type(error).__name__}); see {page}") from None
    return write_bytes(path, data)
