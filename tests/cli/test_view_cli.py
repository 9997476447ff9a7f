"""``nlpweld view``: one line for bad input, and a page for a plan."""

import pytest

from nlpweld.cell import load_cell
from tests.verify.welders import plan


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    cell = load_cell("robot_positioner").with_(seam={"points": 18})
    return plan(cell, (0.0, -1.0)).save(tmp_path_factory.mktemp("plans") / "nominal.json")


def test_view_writes_a_page_and_overwrites_it_only_when_told(call, file, tmp_path):
    page = tmp_path / "pages" / "a.html"
    code, out, err = call("view", file, file, "--html", page)
    assert code == 0
    assert str(page) in out
    text = page.read_text()
    assert "nominal (1)" in text
    code, out, err = call("view", file, "--html", page)
    assert (code, out, len(err.strip().splitlines())) == (2, "", 1)
    assert "add --force" in err
    code, _, _ = call("view", file, "--html", page, "--force")
    assert code == 0
    assert len(page.read_text()) < len(text)


def test_view_refuses_what_is_no_plan_of_this_version(call, file, tmp_path):
    old = tmp_path / "old.json"
    old.write_text(file.read_text().replace('"version": 1', '"version": 0', 1))
    for given, told in ((old, "version: 0 is not 1"), (tmp_path / "none.json", "cannot be read")):
        code, out, err = call("view", given, "--html", tmp_path / "a.html")
        assert (code, out, len(err.strip().splitlines())) == (2, "", 1)
        assert told in err
    assert not (tmp_path / "a.html").exists()


def test_view_without_its_extra_says_how_to_get_it(call, file, tmp_path, monkeypatch):
    monkeypatch.setattr("nlpweld.view.bundle.find_spec", lambda name: None)
    code, out, err = call("view", file, "--html", tmp_path / "a.html")
    assert (code, out, len(err.strip().splitlines())) == (2, "", 1)
    assert "pip install 'nlpweld[view]'" in err
