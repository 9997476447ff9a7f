"""Study files: what they ask for, and what is wrong with them."""

from pathlib import Path

import pytest

from nlpweld.bench.study import changed, load_study
from nlpweld.cell import load_cell
from nlpweld.errors import CellError, OptionError

STUDIES = Path(__file__).parents[2] / "experiments" / "studies"
HEAD = 'title = "a study"\n[[runs]]\n'


def study(tmp_path, text):
    path = tmp_path / "study.toml"
    path.write_text(HEAD + text)
    return path


def test_every_combination_becomes_a_task(tmp_path):
    text = 'cells = ["three_er16", "robot_positioner"]\nsolvers = ["ga:paper", "ipopt"]\nseeds = 3\nevaluations = 9'
    tasks = load_study(study(tmp_path, text))
    assert len({task.place for task in tasks}) == len(tasks) == 12
    assert {task.budget.evaluations for task in tasks} == {9}
    assert tasks[0].place == "three_er16/reduced/ga-paper/seed000"


def test_fields_of_a_cell_are_varied_and_named_in_the_label(tmp_path):
    text = 'cells = ["three_er16"]\nsolvers = ["ga"]\nseeds = [4]\n'
    text += 'vary = { "seam.points" = [18, 36], "stations.welder.tool.translation_m.2" = [0.3] }\n'
    tasks = load_study(study(tmp_path, text))
    assert [t.label for t in tasks] == ["three_er16-points-18-2-0.3", "three_er16-points-36-2-0.3"]
    assert [t.cell.seam.points for t in tasks] == [18, 36]
    assert {t.cell.stations[2].tool.translation_m[2] for t in tasks} == {0.3}
    assert {t.seed for t in tasks} == {4}


def test_options_of_a_solver_get_a_name(tmp_path):
    text = 'cells = ["three_er16"]\nlabel = "mine"\nset = { "seam.points" = 20 }\n'
    text += 'solvers = [{ solver = "ga", variant = "many", options = { population = 200 } }]\n'
    [task] = load_study(study(tmp_path, text))
    assert task.place == "mine/reduced/ga-many/seed000"
    assert task.chosen["population"] == 200
    assert task.cell.seam.points == 20


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ('cells = ["three_er61"]\nsolvers = ["ga"]', "runs.1: three_er61: no such file"),
        ('cells = ["three_er16"]\nsolvers = ["gaa"]', "did you mean 'ga'"),
        ('cells = ["three_er16"]\nsolvers = ["ga:papper"]', "preset 'papper' is unknown"),
        ('cells = ["three_er16"]\nsolvers = [{ solver = "ga", options = { popl = 3 }, variant = "x" }]', "'popl'"),
        ('cells = ["three_er16"]\nsolvers = [{ solver = "ga", options = { population = 3 } }]', "without a variant"),
        ('cells = ["three_er16"]\nsolvers = ["ga"]\nformulations = ["reducd"]', "formulation 'reducd'"),
        ('cells = ["three_er16"]\nsolvers = ["ga"]\nvary = { "seam.pionts" = [3] }', "seam.pionts: unknown field"),
        ('cells = ["three_er16"]\nsolvers = ["ga"]\nvary = { "stations.weldr.tool" = [3] }', "did you mean 'welder'"),
        ('cells = ["three_er16"]\nsolvers = ["ga"]\nset = { "workpiece.main_radius_m" = -1.0 }', "main_radius_m"),
        ('cells = ["three_er16"]\nsolvers = ["ga"]\nseeds = 0', "seeds"),
        ('cells = ["three_er16"]\nsolvers = []', "solvers"),
        ('cells = ["three_er16"]\nsolver = ["ga"]', "did you mean 'solvers'"),
    ],
)
def test_what_is_wrong_is_told_in_one_line(tmp_path, text, told):
    path = study(tmp_path, text)
    with pytest.raises(CellError) as caught:
        load_study(path)
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith(str(path))
    assert told in str(caught.value)


def test_changes_leave_the_cell_itself_alone():
    cell = load_cell("three_er16")
    other = changed(cell, {"search.lower_m.0": -0.5})
    assert other.search.lower_m[0] == -0.5
    assert cell.search.lower_m[0] == -0.6
    assert changed(cell, {}).content_hash == cell.content_hash
    with pytest.raises(OptionError, match="no 'serch'; did you mean 'search'"):
        changed(cell, {"serch.lower_m.0": -0.5})


@pytest.mark.parametrize("path", sorted(STUDIES.glob("*.toml")), ids=lambda path: path.stem)
def test_studies_that_come_along_can_be_read_and_have_a_place_for_every_run(path):
    tasks = load_study(path)
    assert len({task.place for task in tasks}) == len(tasks)
    assert all(task.budget.time_s for task in tasks)
