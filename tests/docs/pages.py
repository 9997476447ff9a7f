"""Code blocks of Markdown pages: found, run in order, and their shown output compared with what comes out."""

import contextlib
import doctest
import io
import re
import shlex
import traceback
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from nlpweld.cli import main

ROOT = Path(__file__).parents[2]
SHOWN = ("text", "toml")  # languages of blocks that are only to be read
NUMBER = r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?![\w])"
SKIPPED = re.compile(r"<!-- blocks: skipped: (.+) -->$")


@dataclass(frozen=True)
class Block:
    """A fenced block.

    Attributes:
        page: path from the root.
        line: of its first line, from 1.
        language: as its fence says; commands where it says nothing.
        text: without the fences.
        skipped: why it is not run, as a comment before it says, or None.
    """

    page: str
    line: int
    language: str
    text: str
    skipped: str | None


def blocks(page: str) -> list[Block]:
    """Return the fenced blocks of a page, directives left out."""
    found, before, open_ = [], "", None
    for number, line in enumerate((ROOT / page).read_text(encoding="utf-8").splitlines(), start=1):
        if open_ is None and line.startswith("```"):
            reason = SKIPPED.match(before)
            open_ = (number + 1, line[3:].strip() or "commands", [], reason[1] if reason else None)
        elif open_ is not None and line == "```":
            found.append(Block(page, open_[0], open_[1], "\n".join(open_[2]), open_[3]))
            open_ = None
        elif open_ is not None:
            open_[2].append(line)
        before = line or before
    assert open_ is None, f"{page}: a block is not closed"
    return [block for block in found if not block.language.startswith("{")]


def commands(block: Block) -> list[tuple[str, str | None]]:
    """Return commands and the output shown for each, or None where none is shown."""
    if block.language == "commands":
        return [(line, None) for line in block.text.splitlines() if line]
    pieces = re.split(r"^\$ ", block.text, flags=re.M)
    assert not pieces[0].strip(), f"{block.page}:{block.line}: output before the first command"
    split = [piece.partition("\n") for piece in pieces[1:]]
    return [(command, shown.strip("\n") if shown.strip() else None) for command, _, shown in split]


def run_command(line: str) -> str:
    """Run a command line of nlpweld in this process; return what it printed.

    Raises:
        AssertionError: it ended with another status than 0.
    """
    words = shlex.split(line, comments=True)
    assert words[0] == "nlpweld", f"'{line}' is no nlpweld command; run it by hand or skip its block with a reason"
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            main(words[1:])
        except SystemExit as ended:
            code = ended.code
    assert code == 0, f"'{line}' ended with {code}: {err.getvalue()}"
    return out.getvalue()


def run_examples(text: str, names: dict[str, Any]) -> None:
    """Run ``>>>`` lines and compare what they show.

    Raises:
        AssertionError: something else came out.
    """
    for example in doctest.DocTestParser().get_examples(text):
        out, value = io.StringIO(), None
        with contextlib.redirect_stdout(out):
            try:
                value = _evaluated(example.source, names)
            except Exception as error:
                assert example.exc_msg, f"{example.source}{traceback.format_exc()}"
                compare(example.exc_msg.strip(), "".join(traceback.format_exception_only(error)).strip())
                continue
        assert not example.exc_msg, f"{example.source} raised nothing"
        shown = out.getvalue() + ("" if value is None else _plain(value))
        compare(example.want.strip("\n"), shown.strip("\n"))


def _evaluated(source: str, names: dict[str, Any]) -> Any:
    try:
        code = compile(source.strip(), "<page>", "eval")
    except SyntaxError:
        exec(compile(source, "<page>", "exec"), names)
        return None
    return eval(code, names)


def _plain(value: Any) -> str:
    """Return how a value shows itself, NumPy's numbers like Python's."""
    return repr(value.item() if hasattr(value, "item") and getattr(value, "ndim", 1) == 0 else value)


def compare(shown: str, found: str) -> None:
    """Hold what a page shows against what came out, line by line.

    ``...`` stands for any lines where it is a line, else for any text. Whole numbers must be the same, others within
    one unit of the last digit that is shown.

    Raises:
        AssertionError: they differ; names the first line that does.
    """
    wanted, lines = shown.splitlines(), found.splitlines()
    at = 0
    for k, line in enumerate(wanted):
        if line == "...":
            continue
        loose = k > 0 and wanted[k - 1] == "..."
        near = next((i for i in range(at, len(lines)) if _same(line, lines[i])), None)
        if near is None or not (loose or near == at):
            raise AssertionError(f"shown: {line!r}; found: {lines[at] if at < len(lines) else 'nothing'!r}\n{found}")
        at = near + 1
    assert at == len(lines) or wanted[-1:] == ["..."], f"not shown: {lines[at]!r}"


def _same(shown: str, found: str) -> bool:
    """Tell whether two lines are the same up to white space at their ends and the last digits of numbers."""
    pieces = re.split(rf"({NUMBER})|(\.\.\.)", shown.strip())
    pattern, numbers = "", []
    for text, number, rest in zip(pieces[::3], [*pieces[1::3], None], [*pieces[2::3], None], strict=True):
        pattern += re.escape(text) + (f"({NUMBER})" if number else ".*" if rest else "")
        numbers += [number] if number else []
    match = re.fullmatch(pattern, found.strip())
    return match is not None and all(map(_near, numbers, match.groups()))


def _near(shown: str, found: str) -> bool:
    mantissa, _, exponent = shown.partition("e")
    digits = len(mantissa.partition(".")[2])
    if digits == 0:
        return float(shown) == float(found)
    return abs(float(shown) - float(found)) <= 1.001 * 10.0 ** (int(exponent or 0) - digits)
