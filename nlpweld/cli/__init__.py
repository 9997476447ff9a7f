"""The command line: every command prints for people, or one JSON object with ``--json``."""

from nlpweld.cli.main import main

__all__ = ["main"]
