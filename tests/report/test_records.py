"""What stands beside the records of a study."""

import pytest

from nlpweld.errors import OutputError
from nlpweld.report.records import load_baselines
from nlpweld.report.study import Study


def test_every_run_tells_its_file(folder, add):
    add(solver="ga", seed=1, mmr=0.25)
    add(solver="ga", seed=0, mmr=0.28)
    runs = Study(folder).runs
    assert runs["mmr_mean"].tolist() == [0.28, 0.25]
    assert runs["file"].tolist() == [f"records/three_er16/reduced/ga-default/seed00{i}.json" for i in (0, 1)]
    assert len(Study(folder).traces) == 16


def test_a_broken_record_is_named(folder, add):
    path = add(seed=3)
    path.write_text("{")
    with pytest.raises(OutputError, match=r"seed003\.json"):
        _ = Study(folder).runs


def test_a_broken_baseline_is_named(folder, add_baseline):
    add_baseline()
    path = next((folder / "baselines").glob("*.json"))
    path.write_text('{"name": "C"}')
    with pytest.raises(OutputError, match=r"paper-three_er16\.json: not a baseline \(missing 'placement'\)"):
        load_baselines(folder)
