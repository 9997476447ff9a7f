"""A headless Chromium with a page, what its pixels show, and where a camera puts points."""

import io
import os
import shutil
import tempfile

import numpy as np
import pytest
from matplotlib.image import imread

from nlpweld.view.picture import FLAGS

NEEDED = os.environ.get("NLPWELD_BROWSER") == "required"


def start():
    """Return a driver; skips where there is no browser, unless one is required."""
    try:
        from selenium import webdriver
        from selenium.webdriver.chrome.service import Service
    except ImportError:
        return _without("selenium is not installed")
    chromium, driver = (shutil.which(name) for name in ("chromium", "chromedriver"))
    if chromium is None or driver is None:
        return _without("no chromium with its chromedriver is installed")
    options = webdriver.ChromeOptions()
    options.binary_location = chromium
    profile = tempfile.mkdtemp(prefix="nlpweld-browser-")
    for flag in (*FLAGS, f"--user-data-dir={profile}", "--window-size=800,600"):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    started = webdriver.Chrome(options=options, service=Service(driver))
    started.profile = profile
    return started


def _without(reason):
    if NEEDED:
        pytest.fail(reason)
    pytest.skip(reason)


def pixels(driver) -> np.ndarray:
    """Return what is on the screen, shape (height, width, 3), in [0, 1]."""
    return imread(io.BytesIO(driver.get_screenshot_as_png()))[..., :3]


def coloured(image: np.ndarray, colour: tuple[int, int, int]) -> np.ndarray:
    """Return (column, row) of the middles of pixels that have a colour, shape (M, 2) [px]."""
    rows, columns = np.nonzero((np.abs(image - np.array(colour)) < 0.25).all(axis=-1))
    return np.column_stack([columns, rows]) + 0.5


def projected(camera: dict, pane: int, p_W: np.ndarray) -> np.ndarray:
    """Return where points (M, 3) in W are on the screen, shape (M, 2) [px]."""
    view, projection = (np.reshape(camera[name], (4, 4)).T for name in ("view", "projection"))
    clip = np.column_stack([p_W, np.ones(len(p_W))]) @ (projection @ view).T
    x, y = (clip[:, :2] / clip[:, 3:]).T
    box = camera["panes"][pane]
    return np.column_stack([box["left"] + (x + 1) / 2 * box["width"], box["top"] + (1 - y) / 2 * box["height"]])
