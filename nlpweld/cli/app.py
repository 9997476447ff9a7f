"""The commands and their options; what they do is in the modules beside this one."""

from pathlib import Path
from typing import Annotated

import typer

from nlpweld.cli import ask, judge, look, pallet, simulation, study, timed
from nlpweld.cli import export as export_
from nlpweld.cli import view as view_
from nlpweld.errors import OptionError

app = typer.Typer(
    help="Place a workpiece among cooperating welding robots, and plan every joint; each answer is verified.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    add_completion=False,
)

CellName = Annotated[str, typer.Argument(metavar="CELL", help="a built-in cell or the path of a TOML file")]
Json = Annotated[bool, typer.Option("--json", help="print one JSON object and nothing else")]
Branches = Annotated[
    str | None, typer.Option(metavar="front|any", help="inverse kinematics branches; the cell's own by default")
]
Reading = Annotated[str | None, typer.Option(metavar="NAME", help="reading of eq. (16); the cell's own by default")]
OverSeam = Annotated[
    str | None,
    typer.Option(metavar="NAME", help="mean, minimum or soft_minimum:P of the points; the cell's own by default"),
]
Points = Annotated[int | None, typer.Option(help="seam points; the cell's own by default")]
Formulation = Annotated[str, typer.Option(metavar="NAME", help="how the problem is written down")]
Robust = Annotated[
    bool, typer.Option("--robust", help="also under the errors of placement and bases that the cell states")
]
TimeLimit = Annotated[float | None, typer.Option(min=0.0, help="time limit of a run [s]")]
Evaluations = Annotated[int | None, typer.Option(min=1, help="limit on candidates of the exact model")]


@app.command()
def cells(json: Json = False) -> None:
    """List the built-in cells, robots and solvers."""
    look.cells(json)


@app.command()
def show(cell: CellName, json: Json = False) -> None:
    """Show a cell's numbers and where each comes from."""
    look.show(cell, json)


@app.command()
def evaluate(
    cell: CellName,
    at: Annotated[
        tuple[float, float, float] | None,
        typer.Option(metavar="X Y Z", help="where workpiece or positioner is put in W [m]"),
    ] = None,
    placement: Annotated[
        str | None, typer.Option(metavar="NAME", help="a placement named in the cell file, instead of --at")
    ] = None,
    branches: Branches = None,
    reading: Reading = None,
    over_seam: OverSeam = None,
    points: Points = None,
    robust: Robust = False,
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="keep the plan of this placement")] = None,
    json: Json = False,
) -> int:
    """Verify one placement along the whole seam."""
    chosen = ask.variant(cell, branches, ask.Goal(reading, over_seam), points)
    return ask.evaluate(chosen, at, placement, out, json, robust)


@app.command()
def solve(
    cell: CellName,
    solver: Annotated[str, typer.Option(metavar="NAME", help="NAME or NAME:PRESET; see 'nlpweld cells'")] = "ipopt",
    formulation: Formulation = "reduced",
    seed: Annotated[int, typer.Option(min=0, help="seed of every random draw")] = 0,
    time_limit: TimeLimit = None,
    evaluations: Evaluations = None,
    branches: Branches = None,
    reading: Reading = None,
    over_seam: OverSeam = None,
    points: Points = None,
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="keep the plan as DIR/plan.json")] = None,
    json: Json = False,
) -> int:
    """Find the best placement with one solver, and verify it."""
    chosen = ask.variant(cell, branches, ask.Goal(reading, over_seam), points)
    return ask.solve(ask.Question(chosen, solver, formulation, seed, time_limit, evaluations), out, json)


@app.command()
def verify(
    plan: Annotated[Path, typer.Argument(metavar="PLAN", help="a plan file")],
    robust: Robust = False,
    samples: Annotated[
        int | None, typer.Option(min=0, help="with --robust: scenarios drawn at random besides the vertices")
    ] = None,
    json: Json = False,
) -> int:
    """Check a plan along the whole seam, and its timeline if it is timed, apart from whatever made it."""
    return judge.verify(plan, json, robust, samples)


@app.command()
def time(
    plan: Annotated[Path, typer.Argument(metavar="PLAN", help="a plan file")],
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="keep the timed plan")] = None,
    speed: Annotated[
        float | None, typer.Option(metavar="M_S", help="of the torch along the seam [m/s]; the cell's own by default")
    ] = None,
    figure: Annotated[
        Path | None, typer.Option(metavar="FILE", help="draw torch speed and joint speeds over time, as PNG")
    ] = None,
    json: Json = False,
) -> int:
    """Time a plan: home, weld, home; slowed only where a joint's limit binds, and verified between instants."""
    return timed.time(plan, out, speed, figure, json)


@app.command()
def view(
    plan: Annotated[Path, typer.Argument(metavar="PLAN", help="a plan file")],
    html: Annotated[Path, typer.Option(metavar="FILE", help="the page to write")],
    beside: Annotated[Path | None, typer.Argument(metavar="[PLAN2]", help="another, shown beside it")] = None,
    force: Annotated[bool, typer.Option("--force", help="overwrite the page if it exists")] = False,
) -> None:
    """Write a page, whole in one file, that plays a plan, or two side by side."""
    view_.view([plan] if beside is None else [plan, beside], html, force)


@app.command()
def sim(
    plan: Annotated[Path, typer.Argument(metavar="PLAN", help="a timed plan file; see 'nlpweld time'")],
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="keep report, time series, figures and the model (MJCF)")
    ] = None,
    from_s: Annotated[float | None, typer.Option("--from", metavar="S", help="first instant [s]")] = None,
    to_s: Annotated[float | None, typer.Option("--to", metavar="S", help="last instant [s]")] = None,
    hz: Annotated[float | None, typer.Option(help="how often the state is kept [1/s]")] = None,
    step_ms: Annotated[float | None, typer.Option(help="time step [ms]")] = None,
    force: Annotated[bool, typer.Option("--force", help="write over what DIR holds")] = False,
    json: Json = False,
) -> int:
    """Play a timed plan in MuJoCo, with masses, servos, gravity and contacts; the carriers close a real chain."""
    return simulation.sim(plan, out, json, force, (from_s, to_s), hz, step_ms)


@app.command()
def export(
    plan: Annotated[Path, typer.Argument(metavar="PLAN", help="a timed plan file")],
    format: Annotated[str, typer.Option(metavar="NAME", help="csv, ros2, ros2-json, rapid or krl")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="folder for the files")],
    force: Annotated[bool, typer.Option("--force", help="replace files that exist")] = False,
    every: Annotated[
        float | None,
        typer.Option(help="longest step between points [s]; as few points as keep within 0.01 deg by default"),
    ] = None,
    json: Json = False,
) -> None:
    """Write a timed plan as joint sequences for controllers."""
    export_.export(plan, format, out, force, every, json)


@app.command()
def compare(
    out: Annotated[Path, typer.Option(metavar="DIR", help="folder of the study; what it holds is not run again")],
    cells: Annotated[list[str] | None, typer.Argument(metavar="[CELL...]", help="built-in cells or TOML files")] = None,
    from_file: Annotated[Path | None, typer.Option("--study", metavar="FILE", help="a study file, for no CELL")] = None,
    solvers: Annotated[
        str, typer.Option(metavar="A,B,...", help="solvers, each NAME or NAME:PRESET")
    ] = "ipopt,ga,random_search",
    seeds: Annotated[int, typer.Option(min=1, help="seeds 0 to K-1")] = 5,
    workers: Annotated[int, typer.Option(min=1, help="runs at once; use 1 for runtime tables")] = 1,
    scheduler: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Dask scheduler whose workers run the study, or 'local'")
    ] = None,
    again: Annotated[bool, typer.Option("--again", help="run once more what the folder holds as FAILED")] = False,
    formulation: Formulation = "reduced",
    time_limit: TimeLimit = None,
    evaluations: Evaluations = None,
    memory_mb: Annotated[int | None, typer.Option(min=1, help="memory a run may take [MB]")] = None,
    branches: Branches = None,
    reading: Reading = None,
    over_seam: OverSeam = None,
    points: Points = None,
    json: Json = False,
) -> int:
    """Run solvers over seeds on cells, or a study file, verify every answer, and tabulate."""
    if (from_file is None) == (not cells):
        raise OptionError("give either CELL... or --study FILE")
    if from_file is not None:
        tasks = ask.tasks_of(from_file)
    else:
        variants = [ask.variant(name, branches, ask.Goal(reading, over_seam), points) for name in cells or []]
        tasks = ask.tasks(variants, solvers, formulation, seeds, (evaluations, time_limit), memory_mb)
    return study.compare(tasks, out, workers, scheduler, again, json)


@app.command()
def tables(folder: Annotated[Path, typer.Argument(metavar="DIR")], json: Json = False) -> None:
    """Write the tables of a study from its stored records."""
    study.tables(folder, json)


@app.command()
def plots(folder: Annotated[Path, typer.Argument(metavar="DIR")], json: Json = False) -> None:
    """Draw the figures of a study from its stored records."""
    study.plots(folder, json)


@app.command()
def report(folder: Annotated[Path, typer.Argument(metavar="DIR")], json: Json = False) -> None:
    """Write one page of a study's tables and figures, from its stored records."""
    study.report(folder, json)


@app.command()
def palletize(
    task: Annotated[str, typer.Argument(metavar="[TASK]", help="a built-in task or a TOML file")] = "cao_25_boxes",
    solver: Annotated[str, typer.Option(metavar="NAME", help="NAME or NAME:PRESET; see 'nlpweld cells'")] = "ipopt",
    seed: Annotated[int, typer.Option(min=0, help="seed of every random draw")] = 0,
    z_a: Annotated[
        float | None, typer.Option(metavar="M", help="how high axis B can rise; the task's own by default")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="keep the tables as DIR/boxes.csv, layers.csv")
    ] = None,
    json: Json = False,
) -> int:
    """Time the stacking of boxes: before, after in closed form, and by a solver."""
    return pallet.palletize(task, solver, seed, z_a, out, json)
