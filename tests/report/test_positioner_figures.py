"""Figures and regret of a study with a positioner, from invented data."""

import json
import re

import matplotlib
import numpy as np
import pandas as pd
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text

from nlpweld.errors import OutputError
from nlpweld.report.figures.comparison import objective_label
from nlpweld.report.markup import markdown
from nlpweld.report.plots import drawings, write_plots
from nlpweld.report.records import load_baselines, load_reference
from nlpweld.report.study import Study
from nlpweld.report.style import RC
from nlpweld.report.tables import as_text, format_summary, summary, write_tables
from tests.records import made

DUAL = "dual_welder_positioner"
AT = {"A": (-0.5, -1.3), "B": (0.0, -1.2), "C": (0.4, -1.3), "D": (0.2, -1.4)}
BREAKS_MM, LENGTH_MM = (300.0, 771.0), 1071.0
NAMES = {"fig09_joint_speeds"} | {
    f"{kind}-{DUAL}" for kind in ("fig07_weld_frames", "weld_angles", "table_angles", "placement_map")
}


def report(value):
    each = {"robot_1": 0.5, "robot_2": 0.4}
    kinds = ("manipulability_mean", "manipulability_min", "singularity_min")
    return {"reading": "product", "mmr_mean": value, "feasible": True, "violations": [], **dict.fromkeys(kinds, each)}


def store(folder, solver, seed, value, at=(0.0, -1.476)):
    placement = dict(zip(("x_m", "y_m", "z_m", "yaw_rad"), (*at, 0.5, 0.0), strict=True))
    where = {name: [value] * 2 for name, value in placement.items()}
    columns = {"time_s": [1.0, 1.0], "evaluations": [50, 100], "placement": where}
    steps = columns | {"best": [value] * 2, "mean": [value] * 2, "spread": [0.1] * 2}
    facts = {"cell": DUAL, "placement": placement, "trace": steps, "report": report(value)}
    made.store(folder, solver=solver, seed=seed, mmr=value, **facts)


def speeds():
    """Speeds that jump by one from piece to piece, and what they are at the jumps."""
    rows, breaks = [], []
    for name in AT:
        arc = np.linspace(0, LENGTH_MM, 61)
        piece = np.searchsorted(BREAKS_MM, arc)
        joints = {f"J{i}_deg_s": piece + 0.1 * i for i in range(1, 7)}
        rows.append(pd.DataFrame({"placement": name, "piece": piece, "arc_mm": arc, "time_s": arc / 5, **joints}))
        for k, at in enumerate(BREAKS_MM):
            for side, p in (("before", k), ("after", k + 1)):
                value = {f"J{i}_deg_s": p + 0.1 * i for i in range(1, 7)}
                breaks.append({"placement": name, "arc_mm": at, "side": side, **value})
    return {"speeds": pd.concat(rows), "speed_breaks": pd.DataFrame(breaks)}


def seams():
    s = np.linspace(0, 1, 24)
    frames, lies = [], []
    for name, z in (("main", 0.5), ("second", -0.5)):
        curve = {"x_m": 0.3 * np.cos(np.pi * s), "y_m": 0.15 * np.sin(np.pi * s), "z_m": z}
        axes = {f"{axis}_{i + 1}": np.eye(3)[i, j] for j, axis in enumerate("xyz") for i in range(3)}
        frames.append(pd.DataFrame({"seam": name, "s": s, **curve, **axes}))
        angles = {"slope_deg": 0.0, "rotation_deg": 135.0 if z > 0 else 45.0}
        lies.append(pd.DataFrame({"cell": DUAL, "placement": "A", "seam": name, "s": s, "iso": "PB", **angles}))
    table = pd.DataFrame({"piece": np.searchsorted(BREAKS_MM, LENGTH_MM * s), "arc_mm": LENGTH_MM * s})
    table = table.assign(time_s=table["arc_mm"] / 5, theta1_deg=-90.0, theta2_deg=90 - 180 * s)
    return {f"frames-{DUAL}": pd.concat(frames), "weld_positions": pd.concat(lies), f"table_angles-{DUAL}": table}


def maps():
    found = {}
    for kind, x, y in (("map", (-1, 1), (-1.8, -0.8)), ("map_near", (-0.05, 0.05), (-1.526, -1.426))):
        a, b = (m.ravel() for m in np.meshgrid(np.linspace(*x, 12), np.linspace(*y, 10)))
        failing = np.where(b < -1.6, "reach", np.where(a > 0.7, "singularity", "feasible"))
        table = {"x_m": a, "y_m": b, "z_m": 0.5, "mmr": 0.31 - 0.1 * a**2, "first_failing": failing}
        found[f"{kind}-{DUAL}"] = pd.DataFrame(table)
    return found


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    folder = tmp_path_factory.mktemp("positioner") / "study"
    for solver, value in (("ga", 0.31), ("ipopt", 0.3107)):
        for seed in range(3):
            store(folder, solver, seed, value - 1e-3 * seed, (0.01 * seed, -1.476))
    (folder / "baselines").mkdir()
    for i, (name, at) in enumerate(AT.items()):
        data = {"name": f"Zhang et al. {name}", "cell": DUAL, "placement": [*at, 0.5], "report": report(0.2 + 0.02 * i)}
        (folder / "baselines" / f"{name}.json").write_text(json.dumps(data))
    (folder / "data").mkdir()
    reference = pd.DataFrame([{"cell": DUAL, "x_m": 0.0, "y_m": -1.476, "z_m": 0.5, "mmr_mean": 0.4}])
    for name, table in ({"reference": reference} | speeds() | seams() | maps()).items():
        table.to_csv(folder / "data" / f"{name}.csv", index=False)
    return folder


@pytest.fixture(scope="module")
def drawn(whole):
    """Name and laid-out figure of everything that this study has."""
    study, figures = Study(whole), {}
    for drawing in drawings(study):
        if not study.missing(drawing.needs):
            with matplotlib.rc_context(RC):
                figures[drawing.name] = drawing.draw(study)
                FigureCanvasAgg(figures[drawing.name]).draw()
    return figures


def test_every_figure_is_drawn_one_or_two_columns_wide_and_shows_something(drawn):
    assert set(drawn) >= NAMES
    for name, figure in drawn.items():
        wide = 2 if name in ("fig09_joint_speeds", f"placement_map-{DUAL}") else 1
        pixels = np.asarray(figure.canvas.buffer_rgba())[..., :3] / 255
        assert pixels.shape[1] == pytest.approx(wide * 85 / 25.4 * 200, abs=2), name
        assert pixels.std() > 0.05, name


def test_labels_have_units_and_nothing_is_cut_off(drawn):
    for name in NAMES:
        figure, renderer = drawn[name], drawn[name].canvas.get_renderer()
        labels = [getattr(axes, f"get_{a}label")() for axes in figure.axes for a in "xyz" if hasattr(axes, f"{a}axis")]
        assert any(labels)
        assert [label for label in labels if label and not re.search(r"\[.+\]", label)] == []
        texts = [t for axes in figure.axes for t in axes.get_children() if isinstance(t, Text) and t.get_text().strip()]
        sides = [getattr(axes, f"{a}axis").label for axes in figure.axes for a in "xyz" if hasattr(axes, f"{a}axis")]
        for part in [*figure.legends, *texts, *(label for label in sides if label.get_text())]:
            box = part.get_window_extent(renderer)
            inside = (
                box.x0 >= -2 and box.y0 >= -2 and box.x1 <= figure.bbox.width + 2 and box.y1 <= figure.bbox.height + 2
            )
            assert inside, (name, part)


def test_no_legend_lies_on_a_label(drawn):
    for name, figure in drawn.items():
        renderer = figure.canvas.get_renderer()
        labels = [axes.xaxis.label.get_window_extent(renderer) for axes in figure.axes if axes.get_xlabel()]
        for legend in figure.legends:
            assert not any(legend.get_window_extent(renderer).overlaps(label) for label in labels), name


def test_speeds_are_drawn_piece_by_piece_up_to_the_breaks(drawn):
    panels = drawn["fig09_joint_speeds"].axes[:4]
    assert [axes.get_title(loc="left")[0] for axes in panels] == list("ABCD")
    assert "HD \N{MINUS SIGN}0.5 m" in panels[0].get_title(loc="left")
    curves = [line for line in panels[1].lines if len(line.get_xdata()) > 2]
    assert len(curves) == 6 * 3
    for line in curves:
        assert np.ptp(line.get_ydata()) == 0.0
    ends = sorted({line.get_xdata()[i] for line in curves for i in (0, -1)})
    assert ends == pytest.approx([0.0, *BREAKS_MM, LENGTH_MM])
    marks = [line.get_xdata()[0] for line in panels[1].lines if len(line.get_xdata()) == 2]
    assert marks == pytest.approx(list(BREAKS_MM))


def test_a_map_marks_every_placement_and_answer(drawn):
    left = drawn[f"placement_map-{DUAL}"].axes[0]
    points = np.vstack([c.get_offsets() for c in left.collections if c.get_offsets().shape[1:] == (2,)])
    for at in [*AT.values(), (0.02, -1.476)]:
        assert (np.abs(points - at).max(axis=1) < 1e-9).any(), at
    assert {t.get_text() for t in left.texts} == set(AT)
    assert [line.get_xdata()[0] for line in left.lines] == [0.0]


def test_several_baselines_are_named_on_their_lines(drawn):
    axes = drawn[f"mmr_by_solver-{DUAL}"].axes[0]
    assert {t.get_text(): t.xy[1] for t in axes.texts} == pytest.approx(
        {f"Zhang et al. {name}": 0.2 + 0.02 * i for i, name in enumerate(AT)}
    )
    assert axes.get_ylabel() == "mean $w_1 w_2$ [m$^6$]"


def test_objective_is_named_by_its_reading():
    runs = pd.DataFrame(
        {"reading": ["product"], "manipulability_mean_a_m3": [1.0], "manipulability_mean_b_m3": [np.nan]}
    )
    assert objective_label(runs, "mean") == "mean $w$ [m$^3$]"
    assert objective_label(runs.assign(reading="paper"), "mean") == "mean MMR [lengths in m]"
    assert objective_label(runs.assign(reading="millimetres"), "best", " so far") == "best MMR so far [lengths in mm]"
    least = runs.assign(reading="paper", over_seam="minimum")
    assert objective_label(least, "mean") == "least MMR [lengths in m]"
    assert objective_label(least, "best", " so far") == "best least MMR so far [lengths in m]"


def test_a_study_without_a_reference_has_none_of_these(whole, tmp_path):
    store(tmp_path, "ga", 0, 0.3)
    notes = []
    write_plots(tmp_path, notes.append)
    assert not any(note.startswith(("fig09", "table_angles", "placement_map")) for note in notes)


def test_regret_stands_in_the_table_in_place_of_the_distance(whole):
    table = write_tables(whole).set_index("solver")
    assert table.loc["Zhang et al. C", "regret_percent"] == pytest.approx(100 * (0.4 - 0.24) / 0.4)
    assert table.loc["ga", "regret_percent"] == pytest.approx(100 * (0.4 - 0.309) / 0.4)
    text = markdown(as_text(table.reset_index()))
    assert "regret %" in text
    assert "to C mm" not in text
    assert "| 40.000 |" in text
    plain = summary(Study(whole).runs, load_baselines(whole))
    assert "regret_percent" not in plain
    assert any("to C" in column.header for column in format_summary(plain).columns)


def test_a_regret_of_nearly_nothing_has_no_sign(whole):
    table = summary(Study(whole).runs, load_baselines(whole), pd.Series({DUAL: 0.26 * (1 - 1e-7)}))
    assert "| 0.000 |" in markdown(as_text(table))
    assert "-0.000" not in markdown(as_text(table))


def test_a_broken_reference_is_named(tmp_path):
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "reference.csv").write_text("cell,value\na,1\n")
    with pytest.raises(OutputError, match=r"reference\.csv: not a table of references \(missing 'mmr_mean'\)"):
        load_reference(tmp_path)


def test_traces_hold_the_placement_by_name(whole):
    traces = Study(whole).traces
    assert traces.loc[traces["seed"] == 2, "x_m"].tolist() == [0.02] * 4
    assert set(traces["z_m"]) == {0.5}
