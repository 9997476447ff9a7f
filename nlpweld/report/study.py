"""A study's folder as figures see it: records, traces, baselines, CSV data and plans, each read once."""

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import pandas as pd

from nlpweld.errors import OutputError
from nlpweld.plan import Plan, load_plan
from nlpweld.records.frames import answers_frame, runs_frame, study_records, traces_frame
from nlpweld.records.model import Record
from nlpweld.report.records import load_baselines, load_reference
from nlpweld.report.statistics import Statistics


@dataclass(frozen=True)
class Study:
    """A folder with ``records/`` and perhaps ``baselines/``, ``data/*.csv`` and ``plans/*.json``."""

    folder: Path
    _read: dict[str, Any] = field(default_factory=dict, repr=False)

    @cached_property
    def records(self) -> list[tuple[Path, Record]]:
        """Files and records, without their traces."""
        return study_records(self.folder, traces=False)

    @cached_property
    def runs(self) -> pd.DataFrame:
        """One row a run, with its ``file``."""
        files = [path.relative_to(self.folder).as_posix() for path, _ in self.records]
        return runs_frame((record for _, record in self.records), file=files)

    @cached_property
    def traces(self) -> pd.DataFrame:
        """One row a step of a run."""
        return traces_frame(record for _, record in study_records(self.folder))

    @cached_property
    def answers(self) -> pd.DataFrame:
        """One row an answer that a run held and the verifier confirmed."""
        return answers_frame(record for _, record in self.records)

    @cached_property
    def statistics(self) -> Statistics:
        """What the runs say of the solvers."""
        return Statistics(self.runs, self.answers, load_reference(self.folder))

    @cached_property
    def baselines(self) -> pd.DataFrame:
        """One row a placement that no solver found; may be empty."""
        return load_baselines(self.folder)

    def data(self, name: str) -> pd.DataFrame:
        """Return ``data/<name>.csv``.

        Raises:
            OutputError: it cannot be read as a table.
        """
        if name not in self._read:
            self._read[name] = _table(self.folder / "data" / f"{name}.csv")
        return self._read[name]

    def plan(self, name: str) -> Plan:
        """Return ``plans/<name>.json``."""
        if f"plan {name}" not in self._read:
            self._read[f"plan {name}"] = load_plan(self.folder / "plans" / f"{name}.json")
        return self._read[f"plan {name}"]

    def missing(self, needs: tuple[str, ...]) -> list[str]:
        """Return which of the files, named below the folder, are not there."""
        return [name for name in needs if not (self.folder / name).is_file()]


def _table(path: Path) -> pd.DataFrame:
    try:
        return pd.read_csv(path)
    except (OSError, ValueError) as error:
        raise OutputError(f"{path}: cannot be read ({str(error).splitlines()[0]}); make it again") from None
