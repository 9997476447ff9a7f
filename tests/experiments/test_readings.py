"""The study of objectives: what it asks, the cross table of verified optima, and what it says where there is none."""

import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from rich.console import Console

sys.path.insert(0, str(Path(__file__).parents[2] / "experiments"))

import readings
from readings import Asked, crossed, markdown, objectives, optimum, study, tasks

from nlpweld.bench.answer import evaluate
from nlpweld.cell import load_cell
from nlpweld.records.files import write_record
from nlpweld.records.model import Record
from tests.records import made

PLACES = {"product": (0.0, -1.0, 0.5), "product minimum": (-0.2, -1.1, 0.5)}


def coarse(name: str) -> Asked:
    cell = load_cell("robot_positioner").with_(seam={"points": 18})
    return Asked(cell.with_(objective={"over_seam": "minimum"}) if "minimum" in name else cell, name)


def record(asked: Asked, at: tuple[float, float, float], verified: bool = True, seed: int = 0) -> Record:
    report = evaluate(asked.cell, at)
    place = dict(zip(("x_m", "y_m", "z_m", "yaw_rad"), (*at, 0.0), strict=True))
    facts = {"cell": asked.label, "placement": place, "report": report.to_json()}
    return made.record(solver="ipopt", seed=seed, verified=verified, **facts)


@pytest.fixture(scope="module")
def asked() -> list[Asked]:
    return [coarse(name) for name in PLACES]


@pytest.fixture(scope="module")
def records(asked: list[Asked]) -> list[Record]:
    return [record(a, PLACES[a.name]) for a in asked]


def test_every_reading_is_asked_of_cells_with_handlers_and_the_rest_of_the_cells_own() -> None:
    found = objectives()
    names = [a.name for a in found if a.cell.name == "three_er16"]
    assert names[:2] == ["paper", "millimetres"]
    assert names[-3:] == ["paper soft 1", "paper soft 8", "paper minimum"]
    assert next(a.name for a in found if a.cell.name == "robot_positioner") == "product"
    assert len({a.cell.content_hash for a in found}) == len(found)
    assert len({t.place for t in tasks(found, 2)}) == 2 * len(found)


def test_cross_table_measures_every_optimum_by_every_objective(asked: list[Asked], records: list[Record]) -> None:
    rows = [optimum(a, [r]) for a, r in zip(asked, records, strict=True)]
    optima, cross = crossed(asked, pd.DataFrame(rows))
    square = cross.pivot(index="optimum_of", columns="measured_by", values="value")
    by_mean, by_least = (evaluate(asked[0].cell, PLACES[name]) for name in PLACES)
    assert square.loc["product", "product"] == pytest.approx(by_mean.mmr_mean, rel=1e-12)
    assert square.loc["product", "product minimum"] == pytest.approx(by_mean.mmr_min, rel=1e-12)
    assert square.loc["product minimum", "product"] == pytest.approx(by_least.mmr_mean, rel=1e-12)
    shares = cross.set_index(["optimum_of", "measured_by"]).share_percent
    assert shares["product", "product"] == pytest.approx(100.0)
    assert shares["product", "product minimum"] == pytest.approx(100 * by_mean.mmr_min / by_least.mmr_min)
    assert optima.moved_mm.tolist() == pytest.approx([0.0, 1e3 * np.hypot(0.2, 0.1)])
    assert optima.unit.tolist() == ["m^3", "m^3"]


def test_an_objective_without_a_verified_answer_says_so_and_enters_no_cross_table(asked: list[Asked]) -> None:
    bad = record(asked[1], PLACES[asked[1].name], verified=False)
    rows = [optimum(asked[0], [record(asked[0], PLACES[asked[0].name])]), optimum(asked[1], [bad])]
    optima, cross = crossed(asked, pd.DataFrame(rows))
    assert cross.optimum_of.unique().tolist() == ["product"]
    text = markdown(optima, cross)
    assert "product minimum (no verified answer)" in text
    assert "nan" not in text.replace("dominant", "")


def test_study_writes_tables_and_figure(
    asked: list[Asked], records: list[Record], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def told(todo: list, folder: Path, *rest: object) -> list[Record]:
        for task, r in zip(todo, records, strict=True):
            write_record(folder / "records" / f"{task.place}.json", r)
        return records

    monkeypatch.setattr(readings, "objectives", lambda: asked)
    monkeypatch.setattr(readings, "run", told)
    study(tmp_path, 1, 1, Console(quiet=True))
    text = (tmp_path / "tables" / "readings.md").read_text()
    assert "| robot_positioner | product minimum | 1 | 1 | 1 |" in text
    assert "m^6 to m^3" in text
    assert (tmp_path / "figures" / "readings.png").stat().st_size > 10_000
    assert pd.read_csv(tmp_path / "data" / "cross.csv").share_percent.notna().all()
