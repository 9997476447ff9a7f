"""The study of the positioner, small: runs, resumes, and says what is known of its cells from elsewhere."""

import importlib.util
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from nlpweld.errors import NlpweldError
from nlpweld.formulation.nlp import Evaluation, Nlp

SCRIPT = Path(__file__).parents[2] / "experiments" / "reproduce_positioner.py"
DUAL, SINGLE = "dual_welder_positioner", "robot_positioner"
# from a prototype in NumPy that shares no code with this project
PLACEMENTS = {"A": 0.226960, "B": 0.212600, "C": 0.243867, "D": 0.290770}
OPTIMA = {DUAL: 0.310703, SINGLE: 0.583401}
AT_BREAKS_OF_B = [
    (-0.072, 0.363, -0.527, 0.045, 0.044, -0.190),
    (0.000, -0.183, -0.152, 0.143, 0.190, -0.311),
    (0.000, 0.248, 0.170, -0.177, -0.234, 0.389),
    (-0.127, 0.368, -0.406, -0.041, -0.057, -0.095),
]
JOINTS = [f"J{i}_deg_s" for i in range(1, 7)]


def reproduce(folder, *more):
    command = [sys.executable, str(SCRIPT), "--quick", "--workers", "1", "--out", str(folder), *more]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study") / "positioner"
    return folder, reproduce(folder)


def data(study, name):
    return pd.read_csv(study[0] / "data" / f"{name}.csv")


def test_it_ends_well_and_prints_the_table(study):
    folder, done = study
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    for told in ("Zhang et al. A", "nominal", "regret", DUAL, SINGLE, str(folder)):
        assert told in done.stdout.replace("\n", ""), told


def test_published_placements_are_verified_and_have_the_prototypes_values(study):
    table = pd.read_csv(study[0] / "tables" / "summary.csv").set_index("solver")
    for name, value in PLACEMENTS.items():
        row = table.loc[f"Zhang et al. {name}"]
        assert row["verified"] == 1
        assert row["objective_mean"] == pytest.approx(value, abs=1e-6)
    assert table.loc["nominal", "objective_mean"] == pytest.approx(0.489716, abs=1e-6)


def test_references_are_verified_and_have_the_prototypes_values(study):
    reference = data(study, "reference").set_index("cell")
    assert reference["verified"].all()
    assert reference["note"].str.contains("not a rigorous bound").all()
    for cell, value in OPTIMA.items():
        assert reference.loc[cell, "mmr_mean"] == pytest.approx(value, abs=1e-6)
        assert 0.95 * value < reference.loc[cell, "grid_best"] < reference.loc[cell, "mmr_mean"]
    assert reference.loc[DUAL, ["x_m", "y_m"]].tolist() == pytest.approx([0.0, -1.4759], abs=1e-4)


def test_regret_is_what_is_missing_to_the_reference(study):
    table = pd.read_csv(study[0] / "tables" / "summary.csv")
    reference = data(study, "reference").set_index("cell")["mmr_mean"].reindex(table["cell"]).to_numpy()
    missing = 100 * (1 - table["objective_mean"] / reference)
    assert table["regret_percent"].to_numpy() == pytest.approx(missing, abs=1e-6)
    assert (table["regret_percent"] > -1e-3).all()
    assert table.set_index("solver").loc["Zhang et al. B", "regret_percent"] == pytest.approx(31.575, abs=1e-3)


def test_every_run_is_verified(study):
    runs = pd.read_csv(study[0] / "tables" / "runs.csv")
    assert sorted(set(runs["cell"])) == [DUAL, SINGLE]
    assert len(runs) == 6
    assert runs["verified"].all()


def test_joint_speeds_break_where_line_and_arc_meet_and_nowhere_else(study):
    speeds, breaks = data(study, "speeds"), data(study, "speed_breaks")
    assert sorted(set(speeds["placement"])) == list("ABCD")
    of_b = breaks[breaks["placement"] == "B"]
    assert of_b["arc_mm"].tolist() == pytest.approx([300, 300, 300 + 150 * np.pi, 300 + 150 * np.pi])
    assert of_b[JOINTS].to_numpy() == pytest.approx(np.array(AT_BREAKS_OF_B), abs=1.5e-3)
    for _, own in speeds.groupby("placement"):
        steps = own[JOINTS].diff().abs().max(axis=1)
        across = own["piece"].diff() == 1
        assert across.sum() == 2
        assert steps[across].min() > 0.3
        assert steps[~across].max() < 0.05


def test_the_table_turns_on_the_arc_only(study):
    table = data(study, f"table_angles-{DUAL}")
    rates = table.groupby("piece")["theta2_deg_s"].agg(["min", "max"])
    assert rates.loc[[0, 2]].to_numpy() == pytest.approx(0.0, abs=1e-5)
    assert rates.loc[1].to_numpy() == pytest.approx(-np.degrees(5 / 150), abs=1e-5)
    assert table["theta1_deg"].to_numpy() == pytest.approx(-90.0)


def test_both_fillets_lie_horizontally_and_the_single_seam_in_the_ship_position(study):
    table = data(study, "weld_positions")
    found = {key: set(own["iso"]) for key, own in table.groupby(["cell", "seam"])}
    assert found == {(DUAL, "main"): {"PB"}, (DUAL, "second"): {"PB"}, (SINGLE, "main"): {"PA"}}
    assert (table.groupby(["cell", "seam"]).size() == 72).all()
    rotations = table[table["cell"] == DUAL].groupby("seam")["rotation_deg"].mean()
    assert rotations.to_dict() == pytest.approx({"main": 135.0, "second": 45.0})


def test_maps_hold_nothing_better_than_the_reference(study):
    reference = data(study, "reference").set_index("cell")["mmr_mean"]
    for cell in (DUAL, SINGLE):
        for kind in ("map", "map_near"):
            table = data(study, f"{kind}-{cell}")
            feasible = table[table["first_failing"] == "feasible"]
            assert 0.8 * reference[cell] < feasible["mmr"].max() <= reference[cell] + 1e-9
    assert set(data(study, f"map-{DUAL}")["first_failing"]) == {"reach", "singularity", "feasible"}


def test_every_figure_is_a_file(study):
    names = [f"{kind}-{c}" for kind in ("fig07_weld_frames", "placement_map", "table_angles") for c in (DUAL, SINGLE)]
    names += [f"{kind}-{DUAL}" for kind in ("weld_angles", "mmr_by_solver", "progress")]
    for name in ["fig09_joint_speeds", *names]:
        for ending in ("png", "pdf"):
            assert (study[0] / "figures" / f"{name}.{ending}").stat().st_size > 4000, name


def test_again_runs_nothing_and_gives_the_same_data(study):
    folder = study[0]
    before = {p: p.read_bytes() for kind in ("data", "records", "plans") for p in (folder / kind).rglob("*.*")}
    stamps = {p: p.stat().st_mtime_ns for p in (folder / "records").rglob("*.json")}
    assert len(stamps) == 6
    done = reproduce(folder, "--no-figures")
    assert done.returncode == 0, done.stderr
    assert {p: p.stat().st_mtime_ns for p in stamps} == stamps
    assert [p.name for p, content in before.items() if p.read_bytes() != content] == []


def test_plans_hold_the_positioners_path(study):
    plan = json.loads((study[0] / "plans" / "A.json").read_text())
    path = np.degrees(plan["paths_rad"]["positioner"])
    assert path[[0, -1]].tolist() == pytest.approx(np.array([[-90.0, 90.0], [-90.0, -90.0]]))


def test_an_unwritable_folder_is_one_line(tmp_path):
    (tmp_path / "file").write_text("")
    done = reproduce(tmp_path / "file" / "positioner")
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "cannot be written" in done.stderr


def search():
    spec = importlib.util.spec_from_file_location("positioner_search", SCRIPT.with_name("positioner_search.py"))
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # where a dataclass looks for its home
    spec.loader.exec_module(module)
    return module


def toy(wall):
    """A wide hill of height 1 and a narrow one of 1.2, of which x > wall is forbidden."""

    def evaluate(X):
        hills = np.exp(-((X - [-0.5, 0.0]) ** 2).sum(axis=1)) + np.exp(-80 * ((X - [0.613, 0.207]) ** 2).sum(axis=1))
        return Evaluation(hills, np.maximum(X[:, :1] - wall, 0.0), np.zeros(len(X), dtype=int))

    return Nlp("toy", "reduced", ("x_m", "y_m"), -np.ones(2), np.ones(2), ("wall",), evaluate)


def test_the_search_for_a_reference_finds_the_higher_hill_to_the_end_and_keeps_to_what_is_allowed():
    step = 0.1
    free, walled = search().sampled_optimum(toy(1.0), step), search().sampled_optimum(toy(0.605), step)
    assert free.grid_points == 21 * 21
    assert free.x == pytest.approx([0.613, 0.207], abs=0.01)
    fine = np.stack(np.meshgrid(*(np.linspace(c - 0.01, c + 0.01, 201) for c in free.x)), axis=-1).reshape(-1, 2)
    assert free.value == pytest.approx(toy(1.0).evaluate(fine).objective.max(), abs=1e-9)
    assert free.value > free.grid_best
    assert walled.x[0] == pytest.approx(0.605, abs=1e-5)
    assert walled.x[0] <= 0.605
    assert walled.feasible_share == pytest.approx(17 / 21)


def test_a_grid_without_a_feasible_point_is_told():
    with pytest.raises(NlpweldError, match=r"toy: nothing on a grid of 0\.5 m is feasible"):
        search().sampled_optimum(toy(-2.0), 0.5)
