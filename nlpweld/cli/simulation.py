"""The command that plays a timed plan in MuJoCo."""

import json as json_
from pathlib import Path

from nlpweld.cli.ask import writable
from nlpweld.cli.judge import progress_bar
from nlpweld.errors import PlanError
from nlpweld.plan import load_plan, refuse_existing


def sim(
    path: Path,
    out: Path | None,
    json: bool,
    force: bool,
    span_s: tuple[float | None, float | None],
    hz: float | None,
    step_ms: float | None,
) -> int:
    """Simulate a timed plan and print the report; 0 when it holds, 1 when not.

    Raises:
        OutputError: the folder holds a simulation already and ``force`` is not set.
        PlanError: the plan cannot be used or is not timed.
        OptionError: MuJoCo is missing, or an option does not fit the plan.
    """
    from nlpweld.report.simulation import write_simulation
    from nlpweld.sim.options import chosen
    from nlpweld.sim.play import stage
    from nlpweld.sim.simulate import REPORT, SERIES, run

    plan = load_plan(path)
    if out is not None:
        writable(out)
        refuse_existing([out / REPORT], force)
    options = chosen(hz, step_ms)
    try:
        set_up = stage(plan, options, span_s)
    except PlanError as error:
        raise PlanError(f"{path}: {error}") from None
    with progress_bar(quiet=json) as bar:
        job = bar.add_task("steps", total=len(set_up.t_s))
        simulated = run(plan, set_up, options, lambda done, _: bar.update(job, completed=done))
    files = []
    if out is not None:
        files = [*simulated.save(out), *write_simulation(out / SERIES, out / "figures")]
    if json:
        print(json_.dumps({**simulated.report.to_json(), "files": [str(file) for file in files]}))
    else:
        print(simulated.report)
        if files:
            print(f"report, time series, model and figures: {out}")
    return 0 if simulated.report.holds else 1
