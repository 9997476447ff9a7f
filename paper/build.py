"""Set the write-up: ``python paper/build.py`` makes paper/nlpweld.pdf from stored results, without TeX or a network.

Typst's own fonts alone are used and no date is written, so that the same results give the same file.
"""

import argparse
import json
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
MAIN, OUT = Path("paper/main.typ"), Path("paper/nlpweld.pdf")
MISSING = "the write-up is set by Typst: pip install '.[paper]'"


def inputs(root: Path, **others: str) -> dict[str, str]:
    """Return what the text is told besides what it reads: which files there are below results/."""
    results = root / "results"
    stored = sorted(path.relative_to(results).as_posix() for path in results.rglob("*") if path.is_file())
    kept = [name for name in stored if "/records/" not in name]
    return {"results": json.dumps(kept), **others}


def pages(root: Path = ROOT, format: str = "pdf", ppi: float | None = None) -> tuple[bytes | list[bytes], list[str]]:
    """Return the set text, and what Typst warns of.

    Args:
        root: folder that holds paper/, results/ and the cell files.
        format: ``pdf``, or ``png`` for one image a page.
        ppi: of images.

    Raises:
        typst.TypstError: a file, row, column, reference or figure is missing; the message says which and where.
    """
    import typst

    done, warnings = typst.compile_with_warnings(
        str(root / MAIN),
        root=str(root),
        format=format,
        ppi=ppi,
        ignore_system_fonts=True,
        sys_inputs=inputs(root),
    )
    return done, [f"{warning.message} {' '.join(warning.trace)}" for warning in warnings]


def main() -> int:
    """Set the text from the command line: 0 when done, 2 when it cannot be."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--png", type=Path, help="folder for one image a page besides")
    chosen = parser.parse_args()
    try:
        import typst
    except ImportError:
        print(f"error: {MISSING}", file=sys.stderr)
        return 2
    try:
        done, warnings = pages()
        images = pages(format="png", ppi=90)[0] if chosen.png else []
    except typst.TypstError as error:
        print(f"error: {error.message}\n{error.diagnostic}", file=sys.stderr)
        return 2
    for warning in warnings:
        print(f"warning: {warning}", file=sys.stderr)
    (ROOT / OUT).write_bytes(done)
    for number, image in enumerate(images, start=1):
        chosen.png.mkdir(parents=True, exist_ok=True)
        (chosen.png / f"page{number:02d}.png").write_bytes(image)
    print(OUT)
    return 0


if __name__ == "__main__":
    sys.exit(main())
