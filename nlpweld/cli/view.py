"""The command that makes a page of plans."""

from pathlib import Path

from nlpweld.cli.ask import busy


def view(plans: list[Path], html: Path, force: bool) -> None:
    """Write the page and say where it is."""
    from nlpweld.view.page import write_view

    with busy(f"verifying and drawing {' and '.join(str(plan) for plan in plans)}", quiet=False):
        path = write_view(plans, html, force=force)
    print(f"page: {path} ({path.stat().st_size / 1e6:.1f} MB); open it in a browser")
