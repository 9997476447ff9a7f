"""The command line: what people and programs read, and the exit status."""

import json

import pytest

from nlpweld.plan import load_plan

PAPER = ["--at", "0.023", "-0.266", "0.404"]


def test_evaluate_json_is_one_object_that_agrees_with_the_independent_prototype(call):
    code, out, _ = call("evaluate", "three_er16", *PAPER, "--json")
    found = json.loads(out)
    assert code == 0
    assert found["feasible"] is True
    assert found["violations"] == []
    expected = {  # figures of an independent prototype, good to 1e-6 absolute
        "mmr_mean": 0.284151,
        "mmr_min": 0.153509,
        "mmr_max": 0.353748,
        "m_tight_mean": 0.215940,
        "m_loose_mean": 0.423846,
    }
    for name, value in expected.items():
        assert found[name] == pytest.approx(value, abs=1e-6), name
    means = {"handler_1": 0.432087, "handler_2": 0.447137, "welder": 0.423846}
    assert found["manipulability_mean"] == pytest.approx(means, abs=1e-6)
    assert found["manipulability_min"]["handler_1"] == pytest.approx(0.123421, abs=1e-6)
    assert found["clearance_m"] == pytest.approx(0.0244, abs=5e-5)
    assert found["closest_pair"] == "handler_1.forearm - welder.torch_body"


def test_evaluate_gives_the_prototype_s_joint_vector(call):
    _, out, _ = call("evaluate", "three_er16", *PAPER, "--json")
    expected = {
        "handler_1": (137.690, 26.848, 6.920, -1.237, 79.488, -66.037),
        "handler_2": (49.560, 45.061, 24.204, -107.459, 64.536, -178.979),
        "welder": (-90.655, 14.161, 3.397, 0.318, 50.443, 179.190),
    }
    for name, joints in json.loads(out)["joints_start_deg"].items():
        assert joints == pytest.approx(expected[name], abs=6e-4), name


def test_the_optimum_of_the_points_alone_fails_between_them(call):
    code, out, _ = call("evaluate", "three_er16", "--at", 0, -0.1653, 0.4052, "--json")
    found = json.loads(out)
    assert code == 1
    assert {v["constraint"] for v in found["violations"]} == {"singularity"}
    assert min(found["singularity_min"].values()) == pytest.approx(0.1195, abs=1e-4)


def test_a_placement_out_of_reach_names_robot_and_point(call):
    code, out, err = call("evaluate", "three_er16", "--at", 2, 2, 2)
    assert (code, out) == (2, "")
    assert len(err.strip().splitlines()) == 1
    for part in ("three_er16", "out of reach of handler", "seam point"):
        assert part in err


def test_a_placement_out_of_reach_still_answers_in_json(call):
    code, out, err = call("evaluate", "three_er16", "--at", 0.6, 0.6, 1.2, "--json")
    found = json.loads(out)
    assert code == 2
    assert "out of reach" in err
    assert found["feasible"] is False
    assert found["mmr_mean"] is None
    assert [v["constraint"] for v in found["violations"]] == ["reach"]


def test_named_placement_points_and_reading_change_the_question(call):
    _, out, _ = call(
        "evaluate", "three_er16", "--placement", "paper", "--points", 24, "--reading", "sqrt_tight", "--json"
    )
    found = json.loads(out)
    assert (found["n_points"], found["reading"]) == (24, "sqrt_tight")
    assert found["at"] == [0.023, -0.266, 0.404]


def test_objective_over_the_seam_changes_the_question_and_leaves_the_other_fields(call):
    asked = ["evaluate", "robot_positioner", "--at", 0.0, -1.0, 0.5, "--points", 18, "--json"]
    plain, least, soft = (
        json.loads(call(*asked, *more)[1])
        for more in ([], ["--over-seam", "minimum"], ["--over-seam", "soft_minimum:8"])
    )
    assert (plain["over_seam"], plain["objective"]) == ("mean", plain["mmr_mean"])
    assert (least["over_seam"], least["objective"]) == ("minimum", plain["mmr_min"])
    assert (soft["over_seam"], soft["exponent"]) == ("soft_minimum", 8.0)
    assert plain["mmr_min"] < soft["objective"] < plain["mmr_mean"]
    assert least["mmr_mean"] == soft["mmr_mean"] == plain["mmr_mean"]


def test_solve_keeps_a_plan_that_verify_accepts(call, tmp_path):
    code, out, _ = call("solve", "three_er16", "--solver", "ga", "--evaluations", 2000, "--out", tmp_path, "--json")
    found = json.loads(out)
    assert code == 0
    assert found["verified"] is True
    assert found["evaluations"] <= 2000
    assert call("verify", found["plan"])[0] == 0
    assert load_plan(found["plan"]).placement_m.tolist() == found["placement"]


def test_verify_says_no_with_status_one(call, tmp_path):
    call("evaluate", "three_er16", "--at", 0, -0.1653, 0.4052, "--out", tmp_path / "plan.json")
    code, out, _ = call("verify", tmp_path / "plan.json")
    assert code == 1
    assert "NOT feasible" in out


def test_cells_and_show_tell_what_is_built_in_and_where_numbers_come_from(call):
    code, out, _ = call("cells", "--json")
    assert code == 0
    assert "three_er16" in json.loads(out)["cells"]
    code, out, _ = call("show", "three_er16")
    assert code == 0
    for told in ("main_radius_m", "paper, section 4", "er16_1600"):
        assert told in "".join(out.split("\n"))


def test_compare_tables_and_plots_from_stored_records(call, tmp_path):
    study = tmp_path / "study"
    arguments = ["--solvers", "random_search,ga:paper", "--seeds", 2, "--evaluations", 400, "--points", 18]
    code, out, _ = call("compare", "three_er16", *arguments, "--out", study)
    assert code in (0, 1)
    assert "random_search" in out
    code, out, _ = call("compare", "three_er16", *arguments, "--out", study, "--json")
    assert json.loads(out)["runs"] == 4
    assert call("tables", study)[0] == 0
    code, out, _ = call("plots", study)
    assert code == 0
    assert ".png" in out


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["evaluate", "three_er61", *PAPER], "three_er16"),
        (["evaluate", "three_er16"], "--at"),
        (["evaluate", "three_er16", "--at", "0", "x", "0"], "--at"),
        (["evaluate", "three_er16", "--at", "nan", "0", "0"], "NaN"),
        (["evaluate", "three_er16", "--at", "0", "0"], "--at"),
        (["evaluate", "three_er16", "--placement", "nowhere"], "paper"),
        (["evaluate", "three_er16", *PAPER, "--branches", "back"], "front"),
        (["evaluate", "three_er16", *PAPER, "--reading", "median"], "harmonic"),
        (["evaluate", "three_er16", *PAPER, "--over-seam", "median"], "soft_minimum"),
        (["evaluate", "three_er16", *PAPER, "--over-seam", "soft_minimum"], "exponent"),
        (["evaluate", "three_er16", *PAPER, "--over-seam", "minimum:3"], "exponent"),
        (["evaluate", "three_er16", *PAPER, "--over-seam", "soft_minimum:much"], "much"),
        (["evaluate", "robot_positioner", *PAPER, "--reading", "paper"], "product, mean"),
        (["evaluate", "three_er16", *PAPER, "--points", "0"], "--points"),
        (["solve", "three_er16", "--solver", "gaa"], "'ga'"),
        (["solve", "three_er16", "--formulation", "ful"], "reduced"),
        (["solve", "three_er16", "--seed", "-1"], "--seed"),
        (["solve", "three_er16", "--out", "{tmp}/file/deep"], "file"),
        (["evaluate", "three_er16", *PAPER, "--out", "{tmp}/file/plan.json"], "file"),
        (["compare", "three_er16", "--solvers", "ga:papr", "--out", "{tmp}/s"], "paper"),
        (["compare", "three_er16", "--out", "{tmp}/file/s"], "file"),
        (["verify", "{tmp}/none.json"], "none.json"),
        (["verify", "{tmp}/file"], "file"),
        (["tables", "{tmp}/empty"], "empty"),
        (["plots", "{tmp}/empty"], "empty"),
        (["frobnicate"], "frobnicate"),
    ],
)
def test_bad_input_is_one_line_and_status_two(call, tmp_path, arguments, told):
    (tmp_path / "file").write_text("in the way")
    (tmp_path / "empty").mkdir()
    before = sorted(p.name for p in tmp_path.rglob("*"))
    code, out, err = call(*[a.format(tmp=tmp_path) for a in arguments])
    assert code == 2
    assert out == ""
    assert len(err.strip().splitlines()) == 1
    assert told in err
    assert sorted(p.name for p in tmp_path.rglob("*")) == before


def test_a_robot_with_an_offset_wrist_is_told_from_the_cell_file(call, tmp_path):
    from nlpweld.cell.files import LIBRARY

    robot = (LIBRARY / "robots" / "er16_1600.toml").read_text()
    offset = robot.replace("{ a_m = 0.0, d_m = 0.0, alpha_deg = -90.0", "{ a_m = 0.0, d_m = 0.05, alpha_deg = -90.0")
    assert offset != robot
    (tmp_path / "offset.toml").write_text(offset)
    cell = (LIBRARY / "cells" / "three_er16.toml").read_text()
    (tmp_path / "odd.toml").write_text(cell.replace('robot = "er16_1600"', 'robot = "offset.toml"', 1))
    code, out, err = call("evaluate", tmp_path / "odd.toml", *PAPER)
    assert (code, out) == (2, "")
    for part in ("odd", "handler_1", "joints.5.d_m", "not spherical"):
        assert part in err
