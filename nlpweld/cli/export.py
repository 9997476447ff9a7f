"""The command that writes a timed plan for controllers."""

import json as json_
from pathlib import Path

from nlpweld.cli.ask import writable
from nlpweld.errors import PlanError
from nlpweld.plan import load_plan


def export(path: Path, format: str, out: Path, force: bool, every_s: float | None, json: bool) -> None:
    """Write the files of a plan and say what they hold.

    Raises:
        PlanError: the file is no plan, or it is not timed.
        OptionError: no such format, or a step that cannot be used.
        OutputError: a file exists and is not to be replaced, or cannot be written.
    """
    from nlpweld.export import export_plan

    plan = load_plan(path)
    writable(out)
    try:
        made = export_plan(plan, format, every_s)
    except PlanError as error:
        raise PlanError(f"{path}: {error}") from None
    files = [str(file) for file in made.save(out, force)]
    facts = {"points": made.points, "duration_s": made.duration_s, "deviation_deg": made.deviation_deg}
    if json:
        print(json_.dumps({"format": format, **facts, "files": files}))
        return
    print(f"{format}: {made.points} points in {made.duration_s:.3f} s")
    print(f"  straight lines in joint space between them stay within {made.deviation_deg:.2g} deg of the plan")
    for file in files:
        print(f"  {file}")
