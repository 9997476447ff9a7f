"""A study's folder as figures see it: records, traces, baselines, CSV data and plans, each read once."""

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import pandas as pd

from nlpweld.errors import OutputError
from nlpweld.plan import Plan, load_plan
from nlpweld.report.records import load_baselines, load_records, load_traces


@dataclass(frozen=True)
class Study:
    """A folder with ``records/`` and perhaps ``baselines/``, ``data/*.csv`` and ``plans/*.json``."""

    folder: Path
    _read: dict[str, Any] = field(default_factory=dict, repr=False)

    @cached_property
    def runs(self) -> pd.DataFrame:
        """One row a run."""
        return load_records(self.folder)

    @cached_property
    def traces(self) -> pd.DataFrame:
        """One row a step of a run."""
        return load_traces(self.folder)

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
