"""The write-up: it is set without a warning, from stored results alone, and nothing in it was typed or forgotten."""

import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from .conftest import Ask, build, typst

Plant = Callable[[str, str], Path]

# What may stand typed: names, and where something is said in a cited paper or a standard.
ALLOWED = (
    r"ESTUN ER16\.?|the ER16|\"ER16\"",  # the robot's name as Pan et al. print it
    r"ISO 6947\.?",
    r"(eq\.|equation|Equation|is|of)? ?[\"(]*\"?(equation )?\(1?\d\)\"?[,:;.]*( ?\(1?\d\)[:,]?)?",  # equations
    r"section 4|Table 1|Figs?\. (3|9|18)( and)?|(and )?19( of.*)?",  # of a cited paper
    r"(takes|and) 1/▪",  # one over a number that was read
    r"\$ 12",  # six by two in the stacked Jacobian
    r"\$ 32",  # the constant of the shortest S-curve's duration
)
READ_BY_HAND = re.compile(  # a typed number, passed off as read
    r"""\b(?:number|scientific|decimals)\(\s*[-+\d.]+\s*[,)]|\bshown\(\s*["\[][^"\]]*\d|\bvector\(\s*\(\s*[-+\d]"""
)


def sources(root: Path = build.ROOT) -> list[Path]:
    return [root / build.MAIN, *sorted((root / "paper" / "sections").glob("*.typ"))]


def typed(ask: Ask, root: Path = build.ROOT) -> list[str]:
    """Return what was typed and looks like a number, in the text set with numbers hidden and in its sources."""
    set_there = [text for text in ask("<typed>", root, "value", numbers="hidden") if not allowed(text)]
    return set_there + [found for path in sources(root) for found in READ_BY_HAND.findall(path.read_text("utf-8"))]


def allowed(text: str) -> bool:
    return any(re.fullmatch(pattern, text.strip()) for pattern in ALLOWED)


def cited(ask: Ask, root: Path = build.ROOT) -> set[str]:
    return {key.strip("<>") for key in ask("cite", root, "key")}


def defined(root: Path = build.ROOT) -> set[str]:
    return set(re.findall(r"^(\w+):$", (root / "paper" / "references.yml").read_text("utf-8"), re.M))


def referred(ask: Ask, root: Path = build.ROOT) -> set[str]:
    return {ref["target"].strip("<>") for ref in ask("ref", root)}


def labels(ask: Ask, root: Path = build.ROOT) -> list[str]:
    return [figure.get("label", "a figure without a label").strip("<>") for figure in ask("figure", root)]


def test_is_set_without_a_warning_on_eight_to_fourteen_pages() -> None:
    images, warnings = build.pages(format="png", ppi=12)
    assert warnings == []
    assert 8 <= len(images) <= 14


def test_same_results_give_the_same_file() -> None:
    (one, warnings), (two, _) = build.pages(), build.pages()
    assert warnings == []
    assert one.startswith(b"%PDF")
    assert one == two
    assert b"CreateDate" not in one  # nor will they tomorrow


def test_no_number_is_typed_where_a_result_exists(ask: Ask) -> None:
    assert typed(ask) == []


@pytest.mark.parametrize(
    "text",
    [
        "Ipopt ends at 0.29666 from every seed.",
        "It gains 62 % there.",
        "It gains $62.2$ percent, $p = 0.0165$.",
        "#figure(table([gain], [59.2]), caption: [Gains.])",
        "#figure([a], caption: [Of 280 runs.])",
        "#(59.2)",
        '#shown("59.2")',
        "#number(59.2, digits: 1)",
        "#vector((0.023, 0.266))",
    ],
)
def test_a_typed_number_is_found(ask: Ask, plant: Plant, text: str) -> None:
    assert typed(ask, plant("sections/comparison.typ", text))


def test_numbers_are_hidden_only_where_asked(ask: Ask) -> None:
    assert ask("<typed>", field="value") == []


@pytest.mark.parametrize(
    "missing",
    ["paper/figures/map_near_z.pdf", "pareto/figures/pareto_three_er16.png", "freedom/tables/freedom.csv"],
)
def test_a_missing_file_is_named(copy: Path, missing: str) -> None:
    (copy / "results" / missing).unlink()
    with pytest.raises(typst.TypstError, match=re.escape(missing)):
        build.pages(copy)


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ('#value("paper/tables/summary.csv", "objective_best", solver: "ipopt")', "3 rows"),
        ('#value("paper/tables/summary.csv", "objective_best", solver: "simplex")', "0 rows"),
        ('#value("robust/data/robust.csv", "nonsense", cell: "three_er16", errors: "0")', "nonsense"),
    ],
)
def test_a_wrong_row_or_column_is_named(plant: Plant, text: str, named: str) -> None:
    with pytest.raises(typst.TypstError) as caught:
        build.pages(plant("sections/abstract.typ", text))
    assert named in caught.value.message


def test_every_entry_of_the_bibliography_is_cited_and_every_citation_defined(ask: Ask) -> None:
    assert cited(ask) == defined()


def test_an_entry_nobody_cites_is_found(ask: Ask, plant: Plant) -> None:
    root = plant("references.yml", "nobody:\n  type: article\n  title: Uncited\n  author: A")
    assert defined(root) - cited(ask, root) == {"nobody"}


@pytest.mark.parametrize("target", ["somebody", "fig-nowhere", "eq-nowhere"])
def test_a_reference_to_nothing_is_refused(plant: Plant, target: str) -> None:
    with pytest.raises(typst.TypstError, match=target):
        build.pages(plant("sections/speed.typ", f"As in @{target}."))


def test_every_figure_and_table_is_spoken_of(ask: Ask) -> None:
    assert len(labels(ask)) > 15
    assert set(labels(ask)) <= referred(ask)


def test_a_figure_nobody_speaks_of_is_found(ask: Ask, plant: Plant) -> None:
    root = plant("sections/speed.typ", "#figure([x], caption: [y]) <fig-alone>")
    assert set(labels(ask, root)) - referred(ask, root) == {"fig-alone"}


def test_studies_that_are_not_there_are_said_to_be_missing(ask: Ask, copy: Path) -> None:
    for study in ("palletising", "timing", "simulation"):
        shutil.rmtree(copy / "results" / study, ignore_errors=True)
    assert len(ask("<unmeasured>", copy)) == 3
    assert build.pages(copy)[1] == []


@pytest.mark.parametrize("study", ["timing", "simulation", "palletising"])
def test_a_study_that_is_not_there_is_said_to_be_missing(ask: Ask, copy: Path, study: str) -> None:
    before = len(ask("<unmeasured>", copy))
    shutil.rmtree(copy / "results" / study)
    assert len(ask("<unmeasured>", copy)) == before + 1
    assert build.pages(copy)[1] == []


def test_numbers_are_written_as_a_reader_expects(copy: Path, ask: Ask) -> None:
    wanted = {
        "decimals(0.296655194, 5)": "0.29666", "decimals(0.999996, 5)": "1.00000", "decimals(-0.266, 3)": "−0.266",
        "decimals(-2e-8, 4)": "0.0000", "decimals(62100, 0)": "62,100", "decimals(2500, 0)": "2500",
        "decimals(3262.4, 1)": "3262.4", "decimals(12345.05, 2)": "12,345.05", "decimals(0.05, 2)": "0.05",
    }  # fmt: skip
    asked = "".join(f"#metadata({call}) <said>\n" for call in wanted)
    (copy / build.MAIN).write_text('#import "lib.typ": *\n' + asked, "utf-8")
    assert ask("<said>", copy, "value") == list(wanted.values())


def test_results_are_listed_without_records(copy: Path) -> None:
    (copy / "results" / "paper" / "records").mkdir()
    (copy / "results" / "paper" / "records" / "one.json").write_text("{}")
    listed = json.loads(build.inputs(copy)["results"])
    assert "paper/tables/summary.csv" in listed
    assert not [name for name in listed if "records/" in name]
