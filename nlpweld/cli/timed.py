"""The command that gives a plan its time axis."""

import json as json_
from pathlib import Path

from nlpweld.cli.ask import busy, writable_file
from nlpweld.plan import load_plan, write_bytes


def time(path: Path, out: Path | None, speed_m_s: float | None, figure: Path | None, json: bool) -> int:
    """Time a plan file, verify and print; 0 when verified, 1 when not.

    Raises:
        PlanError: the file is no plan, or its chains do not close.
        MotionError: the plan cannot be timed.
        OutputError: a file cannot be written.
    """
    from nlpweld.timing import time_plan
    from nlpweld.verify.timing import verify_timing

    for file in (out, figure):
        if file is not None:
            writable_file(file)
    plan = load_plan(path)
    with busy(f"timing {plan.cell.name}", quiet=json):
        timed = time_plan(plan, speed_m_s)
        report = verify_timing(timed)
    if out is not None:
        timed.save(out)
    if figure is not None:
        from nlpweld.report.timeline import png

        write_bytes(figure, png(timed, report.torch_speed))
    files = {name: str(file) for name, file in (("plan", out), ("figure", figure)) if file is not None}
    if json:
        print(json_.dumps({**report.to_json(), **files}))
    else:
        print(report)
        print("\n".join(f"{name}: {file}" for name, file in files.items()) or "add --out FILE to keep the timed plan")
    return 0 if report.feasible else 1
