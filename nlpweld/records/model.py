"""The record of one run; its JSON Schema is published with the package."""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

FORMAT: Literal["nlpweld-record"] = "nlpweld-record"
VERSION: Literal[3] = 3
STATUSES = ("SOLVED", "INFEASIBLE", "TIMEOUT", "FAILED", "SKIPPED")
Seconds = Annotated[float, Field(ge=0.0)]
Count = Annotated[int, Field(ge=0)]


class Part(BaseModel):
    """Strict, frozen data: nothing unknown, no NaN or infinity."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False)


class Limits(Part):
    """Limits of one run; None where there is none."""

    evaluations: Count | None = None
    time_s: Seconds | None = None


class Trace(Part):
    """A solver's trace, column by column, oldest step first; None stands for NaN.

    Attributes:
        time_s: wall time since the start of the solver.
        evaluations: candidates so far.
        best: best feasible objective of the exact model at the seam's points so far.
        mean: mean objective of a population's feasible individuals.
        spread: mean distance between a population's individuals.
        placement: coordinates of each step by name [m; rad].
    """

    time_s: list[float] = []
    evaluations: list[int] = []
    best: list[float | None] = []
    mean: list[float | None] = []
    spread: list[float | None] = []
    placement: dict[str, list[float]] = {}


class Held(Part):
    """An answer a run held on its way or at its end, and what the verifier made of it afterwards.

    Attributes:
        time_s: wall time of build and solve until then.
        evaluations: candidates until then.
        claimed: objective of the exact model at the seam's points.
        objective: the verifier's; None where there is no plan.
        verified: whether every level holds along the whole seam.
    """

    time_s: Seconds
    evaluations: Count
    claimed: float | None
    objective: float | None
    verified: bool


class Machine(Part):
    """Where a run was made."""

    system: str
    processor: str
    python: str
    cores: Count


class Record(Part):
    """One run of one solver on one problem.

    Attributes:
        key: hash of all that decides the answer.
        cell: name of the cell, or of the variant of it.
        cell_hash: hash of the cell's content.
        options: the solver's options that differ from its own defaults.
        limit_mb: memory a run may take, or None.
        status: what became of it; the solver's claim where it came to an end.
        message: the solver's last word, or what went wrong.
        stderr: last lines on standard error of a run that failed.
        verified: the verifier's word.
        placement: x_m, y_m, z_m, yaw_rad of the answer, and what else is free, by name.
        layout: x_m, y_m, yaw_rad of the bases that were free, by robot.
        claimed_objective: the solver's objective.
        wall_s: time of the process from its start to its end, verification included.
        answers: what the run held on its way, oldest first.
        sharpening: what soft penalties cost, solve by solve.
        starts: objective that each start of a multi-start came to; None where it brought nothing.
        report: the verifier's report.
        branches: branch of every robot.
    """

    format: Literal["nlpweld-record"] = FORMAT
    version: Literal[3] = VERSION
    key: str
    cell: str
    cell_hash: str
    formulation: str
    solver: str
    preset: str
    options: dict[str, Any]
    seed: int
    budget: Limits
    limit_mb: Count | None = None
    versions: dict[str, str]
    machine: Machine
    status: Literal["SOLVED", "INFEASIBLE", "TIMEOUT", "FAILED", "SKIPPED"]
    message: str
    stderr: list[str] = []
    verified: bool
    variables: Count = 0
    placement: dict[str, float] | None = None
    layout: dict[str, dict[str, float]] = {}
    claimed_objective: float | None = None
    evaluations: Count = 0
    build_s: Seconds | None = None
    solve_s: Seconds | None = None
    wall_s: Seconds
    trace: Trace = Trace()
    answers: list[Held] = []
    sharpening: list[dict[str, float | None]] = []
    starts: list[float | None] = []
    report: dict[str, Any] | None = None
    branches: dict[str, list[str]] | None = None
