"""The whole study, small: runs, resumes, and gives the same data again."""

import json
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest

SCRIPT = Path(__file__).parents[2] / "experiments" / "reproduce_paper.py"
FIGURES = ("fig03a", "fig03b", "fig05", "fig06", "fig07", "fig08", "fig13", "fig14", "fig15", "fig16")
FIGURES += ("fig17a", "fig17b", "fig17c", "fig18", "fig19", "map_x", "map_y", "map_z", "map_near_x", "mmr_by_solver")


def reproduce(folder, *more):
    command = [sys.executable, str(SCRIPT), "--quick", "--out", str(folder), *more]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study") / "paper"
    return folder, reproduce(folder)


def test_it_ends_well_and_prints_the_table(study):
    folder, done = study
    assert done.returncode == 0, done.stderr
    assert "Pan et al. C" in done.stdout
    assert "left out" not in done.stdout
    assert done.stderr == ""
    assert str(folder) in done.stdout.replace("\n", "")


def test_the_papers_placement_and_a_better_verified_one_stand_in_the_table(study):
    table = pd.read_csv(study[0] / "tables" / "summary.csv")
    table = table[table["cell"] == "three_er16"].set_index(["solver", "preset"])
    paper = table.loc["Pan et al. C"].iloc[0]
    assert paper["objective_mean"] == pytest.approx(0.284151, abs=1e-6)
    assert table["objective_best"].max() > 0.2963
    assert (table["verified"] > 0).all()


def test_every_figure_is_a_file(study):
    for start in FIGURES:
        for ending in ("png", "pdf"):
            files = list((study[0] / "figures").glob(f"{start}*.{ending}"))
            assert files, start
            assert all(f.stat().st_size > 4000 for f in files)


def test_the_near_singular_placement_stays_below_the_floor_and_is_within_reach(study):
    poor = pd.read_csv(study[0] / "data" / "poor_placements.csv").set_index("name")
    profile = pd.read_csv(study[0] / "data" / "profile_near_singular.csv")
    assert profile["w_welder_m3"].max() == pytest.approx(poor.loc["near_singular", "w_welder_max_m3"])
    assert profile["w_welder_m3"].max() < 0.12
    assert "singularity" in poor.loc["near_singular", "breaks"]
    assert not poor["breaks"].str.contains("reach|joint_limit").any()


def test_the_unsteady_placement_swings_more_than_the_optimum(study):
    swing = {n: pd.read_csv(study[0] / "data" / f"profile_{n}.csv")["mmr"] for n in ("unsteady", "optimum")}
    assert swing["unsteady"].max() - swing["unsteady"].min() > 1.2 * (swing["optimum"].max() - swing["optimum"].min())


def test_maps_agree_with_the_verifier_at_the_optimum(study):
    table = pd.read_csv(study[0] / "data" / "map_near_z.csv")
    assert set(table["first_failing"]) <= {"reach", "joint_limit", "singularity", "clearance", "feasible"}
    optimum = json.loads((study[0] / "plans" / "optimum.json").read_text())["placement_m"]
    profile = pd.read_csv(study[0] / "data" / "profile_optimum.csv")
    assert table["z_m"].unique() == pytest.approx([optimum[2]], abs=1e-8)
    feasible = table[table["first_failing"] == "feasible"]
    assert 0.2 < feasible["mmr"].max() <= profile["mmr"].mean() * 1.001


def test_seam_in_the_welders_base_is_the_flat_seam_moved_to_the_papers_placement(study):
    seam = pd.read_csv(study[0] / "data" / "seam.csv")
    shift = {axis: (seam[f"{axis}_B_m"] - seam[f"{axis}_flat_m"]) for axis in "xyz"}
    for axis, expected in zip("xyz", (0.023, -1.266, 0.404), strict=True):
        assert shift[axis].to_numpy() == pytest.approx(expected, abs=1e-8)


def test_again_runs_nothing_and_gives_the_same_data(study):
    folder = study[0]
    before = {p: p.read_bytes() for kind in ("data", "records", "plans") for p in (folder / kind).rglob("*.*")}
    stamps = {p: p.stat().st_mtime_ns for p in (folder / "records").rglob("*.json")}
    done = reproduce(folder, "--no-figures")
    assert done.returncode == 0, done.stderr
    assert {p: p.stat().st_mtime_ns for p in stamps} == stamps
    assert [p.name for p, data in before.items() if p.read_bytes() != data] == []


def test_an_unwritable_folder_is_one_line(tmp_path):
    (tmp_path / "file").write_text("")
    done = reproduce(tmp_path / "file" / "paper")
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "cannot be written" in done.stderr
