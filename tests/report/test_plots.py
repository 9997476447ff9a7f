import re
import shutil

import matplotlib
import numpy as np
import pytest
from matplotlib import image
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text

from nlpweld.errors import OptionError, OutputError
from nlpweld.report.figures.along_seam import closed
from nlpweld.report.figures.comparison import best_so_far
from nlpweld.report.figures.ellipsoids import directions, radius
from nlpweld.report.plots import drawings, write_plots
from nlpweld.report.study import Study
from nlpweld.report.style import RC

COUNTS = {"generation", "evaluations", "solver (verified of runs)", ""}  # axes without a unit
PAPERS = ["fig03a", "fig03b", "fig05", "fig06", "fig07", "fig08", "fig13", "fig14", "fig15", "fig16"]
PAPERS += ["fig17a", "fig17b", "fig17c", "fig18", "fig19"]


@pytest.fixture(scope="module")
def drawn(whole_study):
    """Name and laid-out figure of everything there is to draw."""
    study, figures = Study(whole_study), {}
    for drawing in drawings(study):
        with matplotlib.rc_context(RC):
            figures[drawing.name] = drawing.draw(study)
            FigureCanvasAgg(figures[drawing.name]).draw()
    return figures


def test_every_axis_has_a_label_with_its_unit(drawn):
    for name, figure in drawn.items():
        for axes in figure.axes:
            labels = [getattr(axes, f"get_{axis}label")() for axis in "xyz" if hasattr(axes, f"get_{axis}label")]
            assert any(labels), name
            for label in labels:
                assert label in COUNTS or re.search(r"\[.+\]", label), (name, label)


def test_no_title_label_or_legend_is_cut_off_at_the_edge(drawn):
    for name, figure in drawn.items():
        width, height = figure.bbox.width, figure.bbox.height
        renderer = figure.canvas.get_renderer()
        shown = [*figure.legends, *(part for axes in figure.axes for part in told(axes))]
        assert shown
        for part in shown:
            box = part.get_window_extent(renderer)
            inside = box.x0 >= -2 and box.y0 >= -2 and box.x1 <= width + 2 and box.y1 <= height + 2
            assert inside, (name, part, box, width, height)


def told(axes):
    """Return titles, axis labels, texts and legend of axes that say something."""
    titles = [a for a in axes.get_children() if isinstance(a, Text)]
    labels = [getattr(axes, f"{axis}axis").label for axis in "xyz" if hasattr(axes, f"{axis}axis")]
    legend = [axes.get_legend()] if axes.get_legend() else []
    return [t for t in [*titles, *labels] if t.get_text().strip()] + legend


def test_titles_and_legends_do_not_lie_on_each_other(drawn):
    for name, figure in drawn.items():
        renderer = figure.canvas.get_renderer()
        labels = [axes.xaxis.label.get_window_extent(renderer) for axes in figure.axes if axes.get_xlabel()]
        for legend in figure.legends:
            box = legend.get_window_extent(renderer)
            assert not any(box.overlaps(label) for label in labels), name


def test_every_figure_of_the_paper_is_there_and_shows_something(drawn):
    for start in [*PAPERS, "map_x", "map_near_z", "mmr_by_solver", "solve_time_by_solver", "progress"]:
        assert any(name.startswith(start) for name in drawn), start
    for name, figure in drawn.items():
        pixels = np.asarray(figure.canvas.buffer_rgba())[..., :3] / 255
        assert pixels.shape[1] == pytest.approx(85 / 25.4 * 200, abs=2)
        assert (pixels.min(axis=2) < 0.9).mean() > 0.01, name
        assert pixels.std() > 0.05, name


def test_whole_study_lacks_no_file(whole_study):
    study = Study(whole_study)
    assert [study.missing(drawing.needs) for drawing in drawings(study) if study.missing(drawing.needs)] == []


def test_records_alone_give_figures_with_their_data_and_notes_for_the_rest(folder, add):
    add(cell="a", seed=0)
    add(cell="a", seed=1, verified=False)
    add(cell="b", solver="ipopt")
    notes = []
    paths = write_plots(folder, notes.append)
    kinds = ("anytime", "mmr_by_solver", "progress", "solve_time_by_solver")
    names = [*(f"{kind}-{cell}" for kind in kinds for cell in "ab"), "reached_by_time"]
    assert all((folder / "figures" / f"{name}.csv").read_text().count("\n") > 1 for name in names)
    assert sorted(paths) == sorted(folder / "figures" / f"{name}.{end}" for name in names for end in ("png", "pdf"))
    assert any(note.startswith("fig16_manipulability: left out, no data/profile_optimum.csv") for note in notes)
    for path in paths:
        if path.suffix == ".png":
            assert image.imread(path)[..., :3].std() > 0.05
        else:
            assert path.read_bytes().startswith(b"%PDF")


def test_a_study_in_which_nothing_was_verified_or_ended_is_drawn_too(folder, add):
    add(verified=False)
    add(seed=1, status="FAILED", verified=False, report=None, trace={}, solve_s=None)
    assert len(write_plots(folder)) == 6


def test_an_unverified_run_is_a_cross(folder, add):
    add(seed=0, mmr=0.29)
    add(seed=1, mmr=5.0, verified=False)
    study = Study(folder)
    figure = next(d for d in drawings(study) if d.name == "mmr_by_solver-three_er16").draw(study)
    good, bad = figure.axes[0].collections[:2]
    assert good.get_offsets()[:, 1].tolist() == [0.29]
    assert bad.get_offsets()[:, 1].tolist() == [5.0]


def test_best_so_far_never_falls_waits_for_the_first_and_believes_no_claim(folder, add):
    add(seed=0, mmr=0.3)
    add(seed=1, mmr=0.2)
    add(seed=2, mmr=9.0, verified=False)
    steps = Study(folder).traces
    steps.loc[(steps["seed"] == 0) & (steps["step"] == 5), "best"] = 0.1
    steps.loc[(steps["seed"] == 0) & (steps["step"] == 6), "best"] = np.nan
    grid, best = best_so_far(steps)
    assert grid.tolist() == [50 * k for k in range(1, 9)]
    assert np.isnan(best[:, 0]).all()
    assert (np.diff(best[:2, 1:], axis=1) >= 0).all()
    assert best[:2, -1].tolist() == pytest.approx([0.3 - 0.0125, 0.2 - 0.0125])
    assert np.isnan(best[2]).all()


def test_closed_path_returns_to_its_start_by_whole_turns():
    q = np.array([[0.1, 0.2], [3.0, 0.3], [6.0, 0.1]])
    assert closed(q)[-1] == pytest.approx([0.1 + 2 * np.pi, 0.2])


def test_ellipsoid_radius_along_its_axes():
    core = np.diag([4.0, 9.0, 1.0])
    assert radius(core, np.eye(3)) == pytest.approx([2.0, 3.0, 1.0])
    assert np.linalg.norm(directions(8, 6), axis=0) == pytest.approx(np.ones((9, 7)))


def test_empty_folder_is_one_line(tmp_path):
    with pytest.raises(OptionError, match="holds no records"):
        write_plots(tmp_path)


def test_broken_data_is_named(whole_study, tmp_path):
    shutil.copytree(whole_study, tmp_path / "copy")
    path = tmp_path / "copy" / "data" / "seam.csv"
    path.write_text(path.read_text().replace("x_C_m", "x_C_mm"))
    with pytest.raises(OutputError, match=r"seam\.csv.*: lacks a column \(.*x_C_m.*\); make it again"):
        write_plots(tmp_path / "copy")


def test_figures_in_the_way_of_a_file_are_one_line(folder, add):
    add()
    (folder / "figures").write_text("a file is in the way")
    with pytest.raises(OutputError, match="cannot be written"):
        write_plots(folder)


@pytest.mark.parametrize("solve_s", [0.20398452300105419, 0.001, 1.0, 12.5])
def test_a_single_run_has_a_time_axis_with_height(folder, add, solve_s):
    add(solve_s=solve_s)
    study = Study(folder)
    (figure,) = [d.draw(study) for d in drawings(study) if d.name.startswith("solve_time_by_solver")]
    low, high = figure.axes[0].get_ylim()
    assert low < solve_s < high
    figure.canvas.draw()
