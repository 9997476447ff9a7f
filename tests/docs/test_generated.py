"""What the site generates holds every field of every table, and every command with its options."""

import importlib.util
import inspect
import re
from collections.abc import Iterator
from typing import Any

import pytest
import typer
from pydantic import BaseModel

from nlpweld.cell import Cell, load_cell
from nlpweld.cell.checked import Checked
from nlpweld.cli.app import app
from tests.docs.pages import ROOT


@pytest.fixture(scope="module")
def generated():
    spec = importlib.util.spec_from_file_location("generated", ROOT / "docs" / "generated.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def page(generated):
    return generated.cell_file()


def models() -> list[type[BaseModel]]:
    """Return every model that the fields of a cell lead to."""
    every, found = list(_below(Checked)), [Cell]
    for model in found:
        types = " ".join(str(field.annotation) for field in model.model_fields.values())
        found += [m for m in every if m not in found and re.search(rf"\.{m.__name__}\b", types)]
    return found


def _below(model: type[BaseModel]) -> Iterator[type[BaseModel]]:
    for inner in model.__subclasses__():
        yield inner
        yield from _below(inner)


def section(page: str, name: str) -> str:
    return page.split(f"(schema-{name.lower()})=")[1].split("(schema-")[0]


@pytest.mark.parametrize("model", models(), ids=lambda m: m.__name__)
def test_every_field_of_every_table_is_told(page, model):
    text = section(page, model.__name__)
    head, _, *lines = [re.split(r" ?\| ?", line)[1:-1] for line in text.splitlines() if line.startswith("|")]
    rows = [dict(zip(head, line, strict=True)) for line in lines]
    assert {row["field"].strip("`") for row in rows} == set(model.model_fields)
    first = inspect.getdoc(model).splitlines()[0].replace("``", "`")
    assert re.sub(r":\w+:`(\w+)`", r"`\1`", first) in text
    for row in rows:
        name = row["field"].strip("`")
        assert row["takes"], name
        assert (row["default"] == "required") == model.model_fields[name].is_required(), name
        assert bool(row.get("unit")) == bool(re.search(r"_(m|m3|deg)(_s\d?)?$", name)), row


def test_tables_are_where_files_have_them(page):
    titles = dict(re.findall(r"^## (\w+): (.*)$", page, re.M))
    assert titles["Cell"] == "the file itself"
    assert titles["Station"] == "`[[stations]]`"
    assert titles["Grasp"] == titles["Torch"] == "`[stations.coupling]`"
    assert titles["Tool"] == "`[tools.NAME]`"
    assert titles["Joint"] == "`[[joints]]` in a robot or positioner file"
    assert titles["Pace"] == "`[timing.torch]`"


def test_units_bounds_defaults_and_meanings_are_read_off_the_schema(page):
    assert "| `singularity_floor_m3` | number >= 0 | m^3 | required |" in page
    assert "| `sign` | `-1` or `1` |  | `1` |" in page
    assert "| `jerk_deg_s3` | list of number >= 1e-06 <= 1e+09 | deg/s^3 | none |" in page
    assert "| `home_deg` | table by name of list of number | deg | required | joints of a welding robot" in page
    assert "| `coupling` | [Grasp](#schema-grasp) or [Torch](#schema-torch) |" in page


def test_every_command_and_option_is_told(generated):
    page = generated.commands()
    for name, command in typer.main.get_command(app).commands.items():
        text = page.split(f"## {name}\n")[1].split("\n## ")[0]
        assert inspect.cleandoc(command.help).splitlines()[0].split(",")[0][:40] in " ".join(text.split())
        for parameter in command.params:
            if parameter.param_type_name == "option":
                assert parameter.opts[0] in text, (name, parameter.opts)


def test_built_in_files_are_told_with_their_titles(generated):
    page = generated.built_in()
    title: Any = load_cell("three_er16").title
    assert f"| `three_er16` | cell | {title} |" in page
    assert "| `rt_head` | positioner |" in page
