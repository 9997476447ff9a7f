"""Every figure whose data a study's folder holds, as PNG and PDF."""

import importlib
import pkgutil
from collections.abc import Callable
from pathlib import Path

from nlpweld.errors import OutputError
from nlpweld.plan import write_text
from nlpweld.report import figures
from nlpweld.report.figures import Drawing
from nlpweld.report.study import Study

ENDINGS = ("png", "pdf")
Note = Callable[[str], None]


def drawings(study: Study) -> list[Drawing]:
    """Return all figures of all families, drawable or not, by file name."""
    modules = (importlib.import_module(f"{figures.__name__}.{m.name}") for m in pkgutil.iter_modules(figures.__path__))
    found = [drawing for module in modules for drawing in module.drawings(study)]
    return sorted(found, key=lambda drawing: drawing.name)


def write_plots(folder: str | Path, note: Note | None = None) -> list[Path]:
    """Draw every figure whose data is there into ``figures/`` and return the files.

    Args:
        folder: the study's folder.
        note: called with one line for each figure left out, and why.

    Raises:
        OptionError: the folder holds no records.
        OutputError: stored data is broken, or a figure cannot be written.
    """
    study, written = Study(Path(folder)), []
    _ = study.runs
    for drawing in drawings(study):
        missing = study.missing(drawing.needs)
        if missing:
            if note:
                note(f"{drawing.name}: left out, no {', '.join(missing)}")
            continue
        written += write(drawing, study)
    return written


def write(drawing: Drawing, study: Study) -> list[Path]:
    """Draw one figure and save it in every format, its data beside it where that is no file of the study.

    Raises:
        OutputError: its data lacks a column, or the file cannot be written.
    """
    from matplotlib import rc_context

    from nlpweld.report.style import RC

    paths = [study.folder / "figures" / f"{drawing.name}.{ending}" for ending in ENDINGS]
    with rc_context(RC):
        try:
            figure = drawing.draw(study)
        except KeyError as error:
            sources = ", ".join(str(study.folder / name) for name in drawing.needs or ("records",))
            raise OutputError(f"{sources}: lacks a column ({error.args[0]}); make it again") from None
        try:
            paths[0].parent.mkdir(parents=True, exist_ok=True)
            for path in paths:
                figure.savefig(path, metadata={"CreationDate": None} if path.suffix == ".pdf" else None)
            if drawing.data:
                write_text(paths[0].with_suffix(".csv"), drawing.data(study).to_csv(index=False, float_format="%.9g"))
        except OSError as error:
            raise OutputError(f"{paths[0]}: cannot be written ({error.strerror}); choose another folder") from None
    return paths
