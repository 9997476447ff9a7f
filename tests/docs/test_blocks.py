"""Every code block of README and docs is run, in order, page by page, and what is shown is what comes out.

Convention: a block that a comment ``<!-- blocks: skipped: reason -->`` leads is not run. What takes long is run
smaller, as ``INSTEAD`` says; README and CONTRIBUTING stay free of comments, so ``NOT_RUN`` gives their reasons.
"""

import pytest

from tests.docs.pages import ROOT, SHOWN, blocks, commands, compare, run_command, run_examples

PAGES = ["README.md", "CONTRIBUTING.md", *sorted(f"docs/{path.name}" for path in (ROOT / "docs").glob("*.md"))]
SMALL = "--seeds 1 --evaluations 120 --points 18"
INSTEAD = {  # a line, and what is run in its place
    "nlpweld compare three_er16 --solvers ipopt,ga,random_search --seeds 5 --out study": (
        f"nlpweld compare three_er16 --solvers random_search {SMALL} --out study"
    ),
    "nlpweld sim out/timed.json --out out/sim": "nlpweld sim out/timed.json --from 2 --to 3 --out out/sim",
    'table = nw.compare(cell, ["ga", "ipopt"], seeds=2)  # a pandas DataFrame, one row a run': (
        'table = nw.compare(cell.with_(seam={"points": 18}), ["random_search"], seeds=1, '
        "budget=nw.Budget(evaluations=120))"
    ),
}
NOT_RUN = {  # how a line or block begins, and why it is not run here
    "make reproduce": "takes minutes; tests/experiments runs it small",
    "make test": "runs this very test",
    "nlpweld solve three_er16 --solver ipopt --formulation redundant": "takes half a minute; tests/formulation has it",
    "nlpweld compare --study": "takes hours; tests/bench/test_study.py loads the file",
    '"""Halton points': "tests/solvers/test_contributing.py puts it in place and runs it",
}


def not_run(text: str) -> bool:
    return any(text.startswith(begin) for begin in NOT_RUN)


@pytest.mark.parametrize("page", PAGES)
def test_blocks_run_and_show_what_comes_out(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names: dict = {"__name__": "page"}
    for block in blocks(page):
        if block.skipped or block.language in SHOWN or not_run(block.text):
            continue
        if block.language == "python":
            exec(compile("\n".join(INSTEAD.get(line, line) for line in block.text.splitlines()), page, "exec"), names)
        elif block.language == "pycon":
            run_examples(block.text, names)
        else:
            assert block.language in ("console", "commands"), f"{page}:{block.line}: language '{block.language}'"
            run_commands(block)


def run_commands(block):
    for line, shown in commands(block):
        if not_run(line):
            continue
        found = run_command(INSTEAD.get(line.partition("  #")[0].strip(), line))
        if shown is not None:
            compare(shown, found)


def test_no_substitute_and_no_reason_outlives_its_line():
    lines = [line for page in PAGES for block in blocks(page) for line in block.text.splitlines()]
    for line in INSTEAD:
        assert any(other.partition("  #")[0].strip() == line or other == line for other in lines), line
    for begin in NOT_RUN:
        assert any(line.startswith(begin) for line in lines), begin


@pytest.mark.parametrize(
    ("shown", "found"),
    [
        ("a 0.284 b", "a 0.2844999 b"),
        ("a 1.0e-04", "a 1.04e-04"),
        ("a ... c", "a b and b c"),
        ("...", "anything\nat all"),
        ("a\n...\nd", "a\nb\nc\nd"),
        ("72 points", "72 points  "),
    ],
)
def test_what_is_the_same_to_its_digits_passes(shown, found):
    compare(shown, found)


@pytest.mark.parametrize(
    ("shown", "found"),
    [
        ("a 0.284 b", "a 0.286 b"),
        ("a 0.284 b", "a -0.284 b"),
        ("72 points", "73 points"),
        ("a\nb", "a"),
        ("a", "a\nb"),
        ("a\nc", "a\nb\nc"),
        ("a\n...\nd", "a\nb\nc"),
        ("feasible", "NOT feasible"),
        ("w1 5", "w2 5"),
    ],
)
def test_what_differs_is_told(shown, found):
    with pytest.raises(AssertionError):
        compare(shown, found)
