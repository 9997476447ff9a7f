"""The page in a browser: it plays without complaint, and its pixels are where the plan says."""

import shutil
import time
from collections.abc import Callable

import numpy as np
import pytest
from matplotlib.image import imread

from nlpweld.geometry.seam import weld_frames
from nlpweld.plan import Plan
from nlpweld.verify import reference as ref
from nlpweld.view import save_picture, write_view
from tests.kinematics.helpers import link_frames
from tests.verify.conftest import AT, march

from . import browser
from .conftest import APPROACH_S, RETREAT_S, WELD_S, timed

COLOURS = {
    "#ff0000": (1, 0, 0), "#00ff00": (0, 1, 0), "#0000ff": (0, 0, 1),
    "#ffff00": (1, 1, 0), "#ff00ff": (1, 0, 1), "#00ffff": (0, 1, 1),
}  # fmt: skip
WHITE = (1, 1, 1)
PRESS = "document.dispatchEvent(new KeyboardEvent('keydown', {key: arguments[0]})); return nlpweld.state"
LOOK = "[...document.querySelectorAll('#views button')].find((b) => b.textContent === arguments[0]).click()"


@pytest.fixture(scope="module")
def plans(plan) -> list[Plan]:
    """Two placements; the second torch takes longer to come."""
    return [timed(plan), timed(march(plan.cell, AT + np.array([0.0, 0.05, 0.0])), approach_s=2 * APPROACH_S)]


@pytest.fixture(scope="module")
def page(plans, tmp_path_factory):
    """One browser with the page open; every test sets what it needs."""
    driver = browser.start()
    path = write_view(plans, tmp_path_factory.mktemp("view") / "two.html", names=["C", "moved"])
    driver.get(f"{path.as_uri()}#shadows=off&look=dark")
    yield driver
    driver.quit()
    shutil.rmtree(driver.profile, ignore_errors=True)


def ended(page, limit_s: float = 30.0) -> bool:
    until = time.monotonic() + limit_s
    while time.monotonic() < until:
        if not page.execute_script("return nlpweld.state.playing"):
            return True
        time.sleep(0.1)
    return False


def ends(plan: Plan, t: float) -> dict[tuple[str, str], np.ndarray]:
    """Return in W where every body of every robot begins and ends at an instant, by kinematics of the tests' own."""
    found = {}
    for station in plan.cell.stations:
        T_W_L = ref.base_pose(station) @ link_frames(station.robot, plan.timeline.at(np.array([t]))[station.name])[:, 0]
        frames = {f"link{i}": T for i, T in enumerate(T_W_L)} | {"tcp": T_W_L[-1] @ ref.tool_pose(station)}
        for body in (*station.robot.bodies, *station.tool.bodies):
            for name, end in (("start", body.start), ("end", body.end)):
                found[f"{station.name}.{body.name}", name] = (frames[end.frame] @ np.array([*end.at_m, 1.0]))[:3]
    return found


def points(plan: Plan, t: float) -> dict[tuple[str, str], np.ndarray]:
    """Return in W the elbow and the end of the tool of every robot at an instant."""
    tips = {(f"{st.name}.{st.tool.bodies[-1].name}", "end") for st in plan.cell.stations}
    return {
        key: p_W
        for key, p_W in ends(plan, t).items()
        if key in tips or (key[0].endswith("forearm") and key[1] == "start")
    }


def pixels_off(page, plans: list[Plan], t: float, ask: Callable) -> list[float]:
    """Return how far, in pixels, what is drawn of some points is from where the page's camera would see them."""
    page.execute_script("nlpweld.seek(arguments[0])", t)
    camera, image = page.execute_script("return nlpweld.camera()"), browser.pixels(page)
    off = []
    for pane, plan in enumerate(plans):
        box = camera["panes"][pane]
        for p_W, colour in zip(ask(plan, t).values(), COLOURS.values(), strict=False):
            seen = browser.coloured(image, colour)
            seen = seen[(seen[:, 0] > box["left"]) & (seen[:, 0] < box["left"] + box["width"])]
            assert len(seen) > 4, (t, pane, colour)
            off.append(np.linalg.norm(seen.mean(axis=0) - browser.projected(camera, pane, p_W[None])[0]))
    return off


def marks(plans: list[Plan], ask: Callable) -> list[dict]:
    """Return what the page is told to draw alone: balls of a colour each at the same points."""
    return [
        {"plan": pane, "body": body, "end": end, "radius": 0.03, "colour": colour}
        for pane, plan in enumerate(plans)
        for (body, end), colour in zip(ask(plan, 0.0), COLOURS, strict=False)
    ]


def test_the_page_plays_to_the_end_without_complaint(page, plans):
    shown = page.execute_script("return document.body.textContent")
    for told in ("Shown over time", "handler 1", "welder", "clearance", "approach", "nearest"):
        assert told in shown, told
    duration = plans[1].timeline.duration_s
    assert page.execute_script("return nlpweld.span") == pytest.approx([0.0, duration])
    page.execute_script("nlpweld.setSpeed(20); document.getElementById('play').click()")
    assert ended(page)
    assert page.execute_script("return nlpweld.state.x") == pytest.approx(duration)
    assert page.execute_script("return document.getElementById('scrub').value") == "1"
    assert "retreat" in page.execute_script("return document.getElementById('panes').textContent")
    assert [line for line in page.get_log("browser") if line["level"] == "SEVERE"] == []


def test_keys_and_clicks_move_the_one_cursor(page, plans):
    assert page.execute_script(PRESS, "End")["x"] == pytest.approx(plans[1].timeline.duration_s)
    assert page.execute_script(PRESS, "Home")["x"] == 0.0
    assert page.execute_script(PRESS, "ArrowRight")["x"] == pytest.approx(plans[1].timeline.duration_s / 100)
    assert page.execute_script(PRESS, " ")["playing"]
    assert not page.execute_script(PRESS, " ")["playing"]
    page.find_element("css selector", "#plots svg").click()  # in its middle, the labels on the left taken off
    assert 0.4 < page.execute_script("return nlpweld.state.x / nlpweld.span[1]") < 0.5
    least = page.find_element("css selector", ".chip .least")
    page.execute_script("arguments[0].click()", least)
    at = page.execute_script("return nlpweld.state.x")
    assert f"at {at:.2f} s" in least.get_attribute("textContent")
    assert APPROACH_S <= at <= APPROACH_S + WELD_S


def test_robots_are_drawn_where_the_plans_say(page, plans):
    page.execute_script(LOOK, "overview")
    page.execute_script("nlpweld.flatten(arguments[0])", marks(plans, points))
    instants = (0.37 * APPROACH_S, APPROACH_S + 0.61 * WELD_S, APPROACH_S + WELD_S + 0.7 * RETREAT_S)
    off = [d for t in instants for d in pixels_off(page, plans, t, points)]
    assert len(off) == 36
    assert max(off) < 0.6  # px


def test_every_body_begins_and_ends_where_its_links_are(page, plans):
    t = APPROACH_S + 0.2 * WELD_S
    page.execute_script(LOOK, "overview")
    for k in range(5):  # of one robot at a time only one body, as ends of neighbours hide each other
        chosen = {f"{st.name}.{(*st.robot.bodies, *st.tool.bodies)[k].name}" for st in plans[0].cell.stations}

        def ask(plan: Plan, t: float, chosen: set[str] = chosen) -> dict[tuple[str, str], np.ndarray]:
            return {key: p_W for key, p_W in ends(plan, t).items() if key[0] in chosen}

        page.execute_script("nlpweld.flatten(arguments[0])", marks(plans[:1], ask))
        off = pixels_off(page, plans[:1], t, ask)
        assert len(off) == 6
        assert max(off) < 1.5, chosen  # px; a ball that another one hides in part is seen a pixel off; 5 cm are ten


def test_the_weld_grows_behind_the_torch(page, plans):
    plan, t = plans[0], APPROACH_S + 0.4 * WELD_S
    page.execute_script(LOOK, "weld")
    page.execute_script("nlpweld.flatten([{plan: 0, seam: 'main', colour: '#ffffff'}]); nlpweld.seek(arguments[0])", t)
    camera, seen = page.execute_script("return nlpweld.camera()"), browser.coloured(browser.pixels(page), WHITE)
    box = camera["panes"][0]
    inside = (seen[:, 1] > box["top"]) & (seen[:, 1] < box["top"] + box["height"]) & (seen[:, 0] < box["width"])
    seen = seen[inside]
    s = np.linspace(0.0, plan.timeline.s_at(np.array([t]))[0], 100)
    T_W_C = ref.workpiece_pose(plan.cell, plan.placement, s[-1:])[0]
    asked = browser.projected(camera, 0, weld_frames(plan.cell, s).p_C @ T_W_C[:3, :3].T + T_W_C[:3, 3])
    apart = np.linalg.norm(asked[:, None] - seen, axis=-1)
    assert apart.min(axis=1).max() < 2.0  # every welded point is seen
    assert apart.min(axis=0).max() < 2.5  # and nothing else: the bead is 6 mm thick, some 2 px


def test_a_picture_is_of_the_page_at_its_cursor_and_look(page, tmp_path):
    simple = tmp_path / "simple.html"
    script = (
        "const asked = location.hash; document.body.style.background = asked === '#at=0.5&look=dark' ? '#f00' : '#00f'"
    )
    simple.write_text(f"<body><script>{script}</script></body>")
    taken = imread(save_picture(simple, tmp_path / "new" / "a.png", at=0.5, size=(400, 300), look="dark"))
    assert taken.shape[:2] == (300, 400)
    assert (taken[..., :3] == (1, 0, 0)).all()
