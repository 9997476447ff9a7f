"""One page that opens from a file and asks for nothing else: template, styles, scripts, three.js and the plans."""

import json
from collections import Counter
from collections.abc import Sequence
from importlib import resources
from pathlib import Path
from typing import Any

from jinja2 import Environment, StrictUndefined

from nlpweld.errors import OptionError
from nlpweld.plan import Plan, load_plan, refuse_existing, write_text
from nlpweld.verify import verify
from nlpweld.view.bundle import bundle
from nlpweld.view.content import content
from nlpweld.view.film import FRAMES, film

SCRIPTS = ("cell3d.js", "plots.js", "player.js")
SIDE_BY_SIDE = 2


def write_view(
    plans: Sequence[Plan | str | Path], path: str | Path, names: Sequence[str] | None = None, force: bool = False
) -> Path:
    """Write a page that plays one plan, or two side by side, and return its path.

    The page shows time where every plan has a timeline, and else the seam parameter. Each plan is verified, and the
    page says what it breaks.

    Args:
        plans: plans or their files.
        path: of the page.
        names: what the plans are called there; by default their files' names.
        force: whether a file of that name may be overwritten.

    Raises:
        OptionError: not one or two plans or a name for each; or meshcat is missing.
        OutputError: the page exists or cannot be written.
        PlanError: a plan file cannot be used.
        VerifierError: the geometry process hung or died twice.
    """
    path = Path(path)
    if not 1 <= len(plans) <= SIDE_BY_SIDE:
        raise OptionError(f"view: {len(plans)} plans; give one, or two to see them side by side")
    if names is not None and len(names) != len(plans):
        raise OptionError(f"view: {len(names)} names for {len(plans)} plans; give one each")
    refuse_existing([path], force)
    library = bundle()
    loaded = [plan if isinstance(plan, Plan) else load_plan(plan) for plan in plans]
    return write_text(path, page(loaded, names or called(plans), library))


def page(plans: Sequence[Plan], names: Sequence[str], library: tuple[str, str], frames: int = FRAMES) -> str:
    """Return the text of the page.

    Args:
        plans: one or two.
        names: what they are called.
        library: see :func:`~nlpweld.view.bundle.bundle`.
        frames: about how many frames to keep of each plan.
    """
    timed = all(plan.timeline is not None for plan in plans)
    dropped = [name for name, plan in zip(names, plans, strict=True) if plan.timeline is not None and not timed]
    told = [content(name, film(p, timed, frames), verify(p)) for name, p in zip(names, plans, strict=True)]
    data = {"timed": timed, "timeline_left_out": dropped, "plans": told}
    code, licences = library
    environment = Environment(autoescape=False, undefined=StrictUndefined, trim_blocks=True)
    return environment.from_string(_template("view.html")).render(
        title=_as_text("nlpweld: " + " and ".join(names)),
        styles=_template("view.css"),
        licences=licences.replace("--", "- -"),
        library=_as_script(code),
        scripts=[_as_script(_template(name)) for name in SCRIPTS],
        data=as_json(data),
    )


def as_json(data: Any) -> str:
    """Return data as JSON that no text in it can end the script element of."""
    return json.dumps(data, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")


def called(plans: Sequence[Plan | str | Path]) -> list[str]:
    """Return names of plans that differ: of the file, or of its folder where the file is just called plan."""
    names = []
    for plan in plans:
        path = None if isinstance(plan, Plan) else Path(plan).resolve()
        names.append("plan" if path is None else path.parent.name if path.stem == "plan" else path.stem)
    count = Counter(names)
    return [name if count[name] == 1 else f"{name} ({i})" for i, name in enumerate(names, start=1)]


def _template(name: str) -> str:
    return (resources.files("nlpweld.view") / "templates" / name).read_text(encoding="utf-8")


def _as_script(code: str) -> str:
    return code.replace("</script", "<\\/script")


def _as_text(text: str) -> str:
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
