"""The entry point: runs a command, and turns every foreseen error into one line and exit status 2."""

import sys

import typer

from nlpweld.cli.app import app
from nlpweld.errors import NlpweldError

UsageProblem: type[Exception] = typer.BadParameter.__mro__[2]  # ClickException, wherever this typer keeps its click


def main(arguments: list[str] | None = None) -> None:
    """Run the command line and exit: 0 done, 1 done and the answer is no, 2 bad input.

    Args:
        arguments: words after the program's name; those of the process by default.
    """
    try:
        code = app(args=arguments, standalone_mode=False)
    except UsageProblem as error:
        code = complain(" ".join(error.format_message().split()))  # type: ignore[attr-defined]
    except NlpweldError as error:
        code = complain(str(error))
    except (typer.Abort, KeyboardInterrupt):
        code = 130
    except BrokenPipeError:
        code = 0
    sys.exit(code if isinstance(code, int) else 0)


def complain(message: str) -> int:
    """Print one line on standard error and return the exit status of bad input."""
    print(f"nlpweld: {message}", file=sys.stderr)
    return 2
