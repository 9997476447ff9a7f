"""Export on the command line: files, what is said of them, and bad input in one line that leaves nothing behind."""

import json

import pytest

from nlpweld.export import FORMATS, export_plan
from tests.export.timed import turned


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return turned().save(tmp_path_factory.mktemp("plans") / "timed.json")


def refused(ended) -> str:
    code, out, err = ended
    assert (code, out) == (2, "")
    assert len(err.strip().splitlines()) == 1
    return err


@pytest.mark.parametrize("format", FORMATS)
def test_files_are_those_of_the_function(call, tmp_path, path, format):
    code, out, _ = call("export", path, "--format", format, "--out", tmp_path / "new" / "out", "--json")
    told, made = json.loads(out), export_plan(turned(), format)
    assert code == 0
    assert (told["points"], told["duration_s"]) == (made.points, 21.5)
    assert 0 < told["deviation_deg"] < 0.01
    written = {file.name: file.read_text() for file in (tmp_path / "new" / "out").iterdir()}
    assert written == made.files
    assert told["files"] == [str(tmp_path / "new" / "out" / name) for name in made.files]


def test_people_are_told_points_time_and_deviation(call, tmp_path, path):
    code, out, _ = call("export", path, "--format", "csv", "--out", tmp_path, "--every", 0.5)
    assert code == 0
    assert out.splitlines()[0] == "csv: 44 points in 21.500 s"
    assert "stay within 0.7 deg of the plan" in out
    assert out.splitlines()[-1].strip() == str(tmp_path / "joints.csv")


def test_untimed_plan_is_told_how_to_time_it(call, tmp_path):
    untimed = turned().timed(None).save(tmp_path / "plan.json")
    err = refused(call("export", untimed, "--format", "csv", "--out", tmp_path / "out"))
    assert f"{untimed}: timeline: missing; time it first with 'nlpweld time PLAN --out FILE'" in err
    assert not (tmp_path / "out").exists()


def test_plan_of_another_version_is_refused(call, tmp_path):
    data = turned().to_json() | {"version": 2}
    (tmp_path / "plan.json").write_text(json.dumps(data))
    assert "version: 2 is not 1" in refused(
        call("export", tmp_path / "plan.json", "--format", "csv", "--out", tmp_path)
    )


def test_unknown_format_is_told_which_there_are(call, tmp_path, path):
    err = refused(call("export", path, "--format", "fanuc", "--out", tmp_path / "out"))
    assert "--format 'fanuc' is unknown. There are: csv, ros2, ros2-json, rapid, krl" in err


def test_files_that_exist_stay_as_they_are_unless_forced(call, tmp_path, path):
    """The second of two files is in the way: the first is not written either."""
    mine = tmp_path / "w1_robot_1.dat"
    mine.write_text("mine")
    err = refused(call("export", path, "--format", "krl", "--out", tmp_path))
    assert f"{mine}: exists; add --force" in err
    assert [file.name for file in tmp_path.iterdir()] == [mine.name]
    assert mine.read_text() == "mine"
    assert call("export", path, "--format", "krl", "--out", tmp_path, "--force")[0] == 0
    assert "DEFDAT" in mine.read_text()
    assert (tmp_path / "w1_robot_1.src").exists()


@pytest.mark.parametrize("every", ["0", "-1", "nan", "1e-9"])
def test_step_of_no_use_is_refused(call, tmp_path, path, every):
    err = refused(call("export", path, "--format", "csv", "--out", tmp_path / "out", f"--every={every}"))
    assert "--every" in err
    assert not (tmp_path / "out").exists()


def test_out_that_is_a_file_is_refused(call, tmp_path, path):
    (tmp_path / "out").write_text("mine")
    err = refused(call("export", path, "--format", "csv", "--out", tmp_path / "out"))
    assert "is a file, not a folder" in err
