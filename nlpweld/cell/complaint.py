"""What is wrong with a file, told in one line: field, complaint, mend."""

import difflib
from collections.abc import Iterable
from typing import Any

from pydantic import ValidationError


def first_complaint(error: ValidationError, data: Any, where: str = "") -> str:
    """Return the most telling complaint as ``field: what; mend``, with a count of the others.

    Args:
        error: what the model said.
        data: what the model was given; list items with a name are called by it.
        where: field of the file that holds the data, for a table checked on its own.
    """
    complaints = sorted(error.errors(), key=lambda e: e["type"] == "missing")  # a misspelt name explains a missing one
    first = complaints[0]
    missing = [str(e["loc"][-1]) for e in complaints if e["type"] == "missing"]
    text, explained = _mend(first, missing)
    field = ".".join(filter(None, [where, field_path(first, data), _discriminator(first)]))
    others = len(complaints) - 1 - explained
    told = [f"{field}: " if field else "", text, f" (+{others} more)" if others > 0 else ""]
    return " ".join("".join(told).split())


def field_path(complaint: Any, data: Any) -> str:
    """Return a field as the file has it: list items by name or else counted from 1, no branches that a union tried."""
    parts, loc = [], list(complaint["loc"])
    absent = loc.pop() if complaint["type"] == "missing" else None
    for part in loc:
        if not _holds(data, part):
            continue  # a branch of a union, not a key of the file
        data = data[part]
        parts.append(_called(part, data))
    return ".".join(parts if absent is None else [*parts, _called(absent, None)])


def _called(part: int | str, item: Any) -> str:
    """Return what a key or list item is called; joints and stations count from 1."""
    if isinstance(part, str):
        return part
    named = isinstance(item, dict) and isinstance(item.get("name"), str)
    return item["name"] if named else str(part + 1)


def nearest(name: str, known: Iterable[str]) -> str:
    """Return which known name was meant, as a question, or else all of them."""
    names = sorted(known)
    close = difflib.get_close_matches(name, names, n=1)
    return f"did you mean '{close[0]}'?" if close else f"there are {', '.join(names) or 'none'}"


def _holds(data: Any, part: int | str) -> bool:
    if isinstance(data, dict):
        return part in data
    return isinstance(data, list | tuple) and isinstance(part, int) and part < len(data)


def _discriminator(complaint: Any) -> str:
    return complaint["ctx"]["discriminator"].strip("'") if complaint["type"].startswith("union_tag") else ""


def _mend(complaint: Any, missing: list[str]) -> tuple[str, int]:
    """Say what is wrong with one field and how to mend it, and how many other complaints that explains."""
    kind, context = complaint["type"], complaint.get("ctx", {})
    if kind == "missing":
        return "missing; add it", 0
    if kind == "extra_forbidden":
        close = difflib.get_close_matches(str(complaint["loc"][-1]), missing, n=1)
        mend = f"did you mean '{close[0]}'?" if close else "remove it or mend its name"
        return f"unknown field; {mend}", len(close)
    if kind == "value_error":
        return str(context["error"]), 0
    if kind == "union_tag_invalid":
        return f"'{context['tag']}' is not one of {context['expected_tags']}; choose one of them", 0
    if kind == "union_tag_not_found":
        return "missing; add it", 0
    got = complaint["input"]
    shown = "" if isinstance(got, dict | list) else f", got {got!r}"[:60]
    return f"{complaint['msg'][0].lower()}{complaint['msg'][1:]}{shown}; mend the value", 0
