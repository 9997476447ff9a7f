"""What a page holds: the verifier's numbers, nothing from elsewhere, and what a plan breaks."""

import base64
import dataclasses
import json
from html.parser import HTMLParser

import numpy as np
import pytest

from nlpweld.errors import OptionError, OutputError, PlanError
from nlpweld.verify import reference as ref
from nlpweld.verify import verify
from nlpweld.view import picture, write_view
from nlpweld.view.content import TOLD, content
from nlpweld.view.film import film
from nlpweld.view.page import as_json, called, page

from .conftest import APPROACH_S, WELD_S, timed

LIBRARY = ("/* three */", "MIT")


class Reader(HTMLParser):
    """Collects what a page asks for from elsewhere, and its data."""

    def __init__(self, text):
        super().__init__()
        self.elsewhere, self.open, self.data, self.scripts = [], None, "", 0
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        facts = dict(attributes)
        self.elsewhere += [v for k, v in facts.items() if k in ("src", "href")] + [tag] * (tag in ("link", "iframe"))
        self.scripts += tag == "script"
        self.open = facts.get("id")

    def handle_data(self, data):
        self.data += data if self.open == "data" else ""

    def handle_endtag(self, tag):
        self.open = None


def unpacked(packed):
    return np.frombuffer(base64.b64decode(packed["f32"]), dtype="<f4").reshape(packed["shape"])


@pytest.fixture(scope="module")
def report(plan):
    return verify(plan)


def test_the_film_holds_the_worst_that_the_verifier_finds(plan, report):
    shown = film(plan, timed=False, frames=60)
    assert len(shown.x) < 80
    assert (np.diff(shown.x) > 0).all()
    assert (shown.x[0], shown.x[-1]) == (0.0, 1.0)
    assert shown.clearance_m[shown.worst["clearance"]] == report.clearance_along_m == shown.clearance_m.min()
    assert shown.team[shown.worst["team"]] == report.mmr_min_along
    for name, least in report.singularity_min.items():
        assert shown.w[name][shown.worst[f"w.{name}"]] == least


def test_frames_are_close_enough_to_go_linearly_between_them(plan):
    for one, over_time in ((plan, False), (timed(plan), True)):
        coarse, fine = film(one, over_time), film(one, over_time, frames=2000)
        for name, T in fine.poses.items():
            for i in range(3):
                between = np.interp(fine.x, coarse.x, coarse.poses[name][:, i, 3])
                assert np.abs(between - T[:, i, 3]).max() < 5e-4, name


def test_a_timed_film_goes_over_time_and_counts_the_worst_while_welding(plan):
    line = timed(plan).timeline
    shown = film(timed(plan), timed=True, frames=30)
    assert (shown.x[0], shown.x[-1]) == (0.0, line.duration_s)
    assert np.isin([until for _, until in line.phases], shown.x).all()
    during = (shown.x >= APPROACH_S) & (shown.x <= APPROACH_S + WELD_S)
    assert (shown.welding == during).all()
    assert (np.isfinite(shown.team) == during).all()
    np.testing.assert_array_equal(shown.s, line.s_at(shown.x))
    q = line.at(shown.x)["welder"]
    np.testing.assert_allclose(shown.joints["welder"], q, rtol=0, atol=1e-12)
    welder = plan.cell.stations[2]
    T_W_E = ref.tcp_pose(welder, ref.link_poses(welder, q))
    np.testing.assert_allclose(shown.poses["welder.tcp"], T_W_E, rtol=0, atol=1e-12)


def test_the_page_is_whole_in_itself_and_small(plan, tmp_path):
    other = timed(plan)
    cell = plan.cell.model_copy(update={"title": "a </script><script>alert(1)</script> & <b>"})
    path = write_view([dataclasses.replace(plan, cell=cell), other], tmp_path / "out" / "a.html", names=["C", "timed"])
    assert path.stat().st_size < 5e6
    text = path.read_text()
    read = Reader(text)
    assert read.elsewhere == []
    assert read.scripts == 5  # data, three.js and three of our own
    data = json.loads(read.data)
    assert data["plans"][0]["title"] == cell.title
    assert data["timed"] is False
    assert data["timeline_left_out"] == ["timed"]
    assert "Copyright 2010-2021 Three.js Authors" in text


def test_data_are_the_film_s_to_seven_digits_and_bodies_hang_on_frames_there_are(turned_plan):
    shown = film(turned_plan, timed=False, frames=40)
    told = json.loads(as_json(content("A", shown, verify(turned_plan))))
    poses = unpacked(told["poses"])
    for i, name in enumerate(told["frames"]):
        np.testing.assert_allclose(poses[:, i], shown.poses[name][:, :3], rtol=0, atol=3e-7)
    ends = [
        k[end] for owner in [*told["robots"], told["workpiece"]] for k in owner["bodies"] for end in ("start", "end")
    ]
    assert {end["frame"] for end in ends} <= set(told["frames"])
    assert [robot["role"] for robot in told["robots"]] == ["welds", "welds", "turns"]
    assert [seam["name"] for seam in told["seams"]] == list(turned_plan.cell.seams)


def test_a_robot_without_bodies_is_drawn_as_sticks_along_its_chain(plan):
    bare = [st.model_copy(update={"robot": st.robot.model_copy(update={"bodies": ()})}) for st in plan.cell.stations]
    shown = []
    for cell in (plan.cell, plan.cell.model_copy(update={"stations": tuple(bare)})):
        one = dataclasses.replace(plan, cell=cell)
        told = content("C", film(one, timed=False, frames=20), verify(one))
        shown.append([len(robot["sticks"]) for robot in told["robots"]])
    assert shown == [[1, 1, 1], [6, 6, 6]]  # the tool's end alone; and all links but that of no length in the wrist


def test_a_plan_that_fails_says_what_and_where(plan):
    spoiled = dataclasses.replace(plan, placement_m=plan.placement_m + np.array([0.0, 0.0, 0.02]))
    read = Reader(page([spoiled], ["off"], LIBRARY, frames=20))
    told, found = json.loads(read.data)["plans"][0]["verdict"], verify(spoiled).violations
    assert told["feasible"] is False
    assert told["violations"] == [str(v) for v in found[:TOLD]]
    assert told["more"] == len(found) - TOLD
    assert any("closure" in line for line in told["violations"])


def test_bad_input_is_told(plan, tmp_path, monkeypatch):
    path = tmp_path / "a.html"
    path.write_text("mine")
    with pytest.raises(OutputError, match="add --force"):
        write_view([plan], path)
    with pytest.raises(OptionError, match="3 plans; give one, or two"):
        write_view([plan] * 3, tmp_path / "b.html")
    with pytest.raises(OptionError, match="give one each"):
        write_view([plan], tmp_path / "b.html", names=["a", "b"])
    broken = dataclasses.replace(plan, paths={**plan.paths, "welder": np.full_like(plan.paths["welder"], np.nan)})
    with pytest.raises(PlanError, match="NaN"):
        write_view([broken], tmp_path / "b.html")
    monkeypatch.setattr("nlpweld.view.bundle.find_spec", lambda name: None)
    with pytest.raises(OptionError, match=r"pip install 'nlpweld\[view\]'"):
        write_view([plan], path, force=True)
    assert path.read_text() == "mine"
    monkeypatch.setattr(picture.shutil, "which", lambda name: None)
    with pytest.raises(OptionError, match="NLPWELD_CHROMIUM"):
        picture.save_picture(path, tmp_path / "a.png")


def test_plans_are_called_by_what_tells_them_apart(plan):
    assert called(["study/plan.json", "b/optimum.json"]) == ["study", "optimum"]
    assert called(["a/x.json", "b/x.json"]) == ["x (1)", "x (2)"]
    assert called([plan]) == ["plan"]
