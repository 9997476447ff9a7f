"""The command that times a palletising task: before, after in closed form, and by a solver beside it."""

import json as json_
from pathlib import Path

import pandas as pd
from pydantic import ValidationError
from rich import box as box_
from rich.console import Console
from rich.table import Table

from nlpweld.cell.complaint import first_complaint
from nlpweld.cli.ask import writable
from nlpweld.cli.judge import progress_bar
from nlpweld.errors import OptionError
from nlpweld.palletising import Palletised, PalletTask, load_pallet_task
from nlpweld.plan import write_text

FOUND_S = 1e-6  # regret of a box within which a solver has found the optimum
Columns = dict[str, tuple[str, str]]  # to heading and format
TIMES: Columns = {"before_s": ("before s", ".3f"), "after_s": ("after s", ".3f")}
HEIGHTS: Columns = {"z_max_m": ("z_max m", ".4f"), "z_most_m": ("up to m", ".4f")}
SOLVER: Columns = {"regret_s": ("regret s", ".0e")}
BOX: Columns = {"box": ("box", ".0f"), "layer": ("layer", ".0f"), "z_m": ("z_3 m", ".2f")}
BOX |= TIMES | HEIGHTS | {"case": ("case", ""), "solver_z_m": ("solver m", ".4f")} | SOLVER
LAYER: Columns = {"layer": ("layer", ".0f"), "box": ("boxes", ".0f")} | TIMES | HEIGHTS | SOLVER


def palletize(name: str, solver: str, seed: int, z_a_m: float | None, out: Path | None, json: bool) -> int:
    """Print totals, layers and boxes; 0 when the solver found every box's optimum, 1 when not.

    Raises:
        CellError: the task cannot be loaded.
        OptionError: no such solver, or one that cannot take it, or a z_a that does not suit the task.
    """
    from nlpweld.palletising import palletize as palletize_
    from nlpweld.solvers import make_solver

    task = _raised(load_pallet_task(name), z_a_m)
    kind, _, preset = solver.partition(":")
    made = make_solver(kind, preset or "default")
    if out is not None:
        writable(out)
    with progress_bar(quiet=json) as bar:
        job = bar.add_task(f"{solver} on z_max", total=len(task.places_m))
        found = palletize_(task, made, seed, told=lambda box: bar.advance(job))
    if out is not None:
        write_text(out / "boxes.csv", found.boxes.to_csv(index=False, float_format="%.12g"))
        write_text(out / "layers.csv", found.layers.to_csv(index=False, float_format="%.12g"))
    worst = float(found.boxes.regret_s.fillna(float("inf")).max())
    if json:
        print(json_.dumps(_facts(found, solver, seed, worst)))
    else:
        _print(found, solver, worst)
        if out is not None:
            print(f"boxes and layers: {out}")
    return 0 if worst <= FOUND_S else 1


def _raised(task: PalletTask, z_a_m: float | None) -> PalletTask:
    try:
        return task if z_a_m is None else task.with_(cycle={"z_a_m": z_a_m})
    except ValidationError as error:
        raise OptionError(f"--z-a: {first_complaint(error, {})}") from None


def _facts(found: Palletised, solver: str, seed: int, worst: float) -> dict[str, object]:
    totals = {f"{name}_s": total for name, total in found.totals_s.items()}
    tables = {"layers": found.layers.to_dict("records"), "boxes": found.boxes.to_dict("records")}
    stated = {"stated": None if found.task.stated is None else found.task.stated.model_dump()}
    asked = {"task": found.task.name, "solver": solver, "seed": seed}
    return {**asked, **totals, "saving_percent": found.saving_percent, "worst_regret_s": worst, **stated, **tables}


def _print(found: Palletised, solver: str, worst: float) -> None:
    console, task, totals = Console(), found.task, found.totals_s
    console.print(_table(found.boxes, BOX, f"{task.name}: {task.title}"))
    console.print(_table(found.layers, LAYER, "by layer"))
    told = f"before {totals['before']:.3f} s, after {totals['after']:.3f} s: {found.saving_percent:.2f} % less"
    if task.stated is not None:
        told += "; stated as planned {:.3f} s and {:.3f} s".format(*task.stated.planned_s)
    print(told)
    print(f"{solver}: {totals['solver']:.3f} s; no box takes over {max(worst, 0.0):.1e} s more than the closed form")


def _table(rows: pd.DataFrame, columns: Columns, title: str) -> Table:
    """Return some columns of a table for people."""
    table = Table(title=title, box=box_.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for heading, style in columns.values():
        table.add_column(heading, justify="right", no_wrap=not style)
    for _, row in rows.iterrows():
        table.add_row(*(format(row[name], style) for name, (_, style) in columns.items()))
    return table
