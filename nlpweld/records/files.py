"""Records as files: written whole or not at all, sealed by a digest, read back only if nothing was changed.

The first line of a record holds the digest of all that follows it, so that a file is checked without being parsed.
"""

import hashlib
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pydantic_core
from pydantic import ValidationError

from nlpweld.errors import OutputError
from nlpweld.plan import write_text
from nlpweld.records.model import FORMAT, VERSION, Record

OPENING, CLOSING = b'{"digest": "', b'",'
MEND = "remove it and run it again"


def write_record(path: Path, record: Record) -> Path:
    """Write a record.

    Raises:
        OutputError: the file cannot be written.
    """
    return write_text(path, sealed(record.model_dump(mode="json")))


def sealed(data: Mapping[str, Any]) -> str:
    """Return the text of a record's data, its digest first, then one field a line."""
    body = ",\n".join(f"{json.dumps(name)}: {json.dumps(value)}" for name, value in data.items()) + "\n}\n"
    digest = hashlib.sha256(body.encode()).hexdigest()
    return f"{OPENING.decode()}{digest}{CLOSING.decode()}\n{body}"


def read_record(path: Path, trace: bool = True) -> Record:
    """Read a record.

    Args:
        path: of the file.
        trace: whether to read its trace, which is most of it, too.

    Raises:
        OutputError: it cannot be read, is no record, was edited or cut, or is of another version than this nlpweld's.
    """
    try:
        text = path.read_bytes()
    except OSError as error:
        raise OutputError(f"{path}: cannot be read ({error.strerror}); check its permissions") from None
    head, _, body = text.partition(b"\n")
    if not (head.startswith(OPENING) and head.endswith(CLOSING)):
        raise OutputError(f"{path}: {_what_it_is(text)}; {MEND}")
    if hashlib.sha256(body).hexdigest().encode() != head[len(OPENING) : -len(CLOSING)]:
        raise OutputError(f"{path}: digest: the record was edited or cut; {MEND}")
    if not trace:
        body = b"\n".join(line for line in body.split(b"\n") if not line.startswith(b'"trace": '))
    try:
        return Record.model_validate_json(b"{" + body)
    except ValidationError as error:
        raise OutputError(f"{path}: {_blame(body, error)}") from None


def record_files(folder: Path) -> Iterator[Path]:
    """Yield the files of a study's records, sorted."""
    return iter(sorted((folder / "records").rglob("*.json")))


def _blame(body: bytes, error: ValidationError) -> str:
    """Return why a sealed text is not a record of this version."""
    version = pydantic_core.from_json(b"{" + body).get("version")
    if isinstance(version, int) and version > VERSION:
        return f"version: {version} is newer than {VERSION}; update nlpweld, or run it again"
    first = error.errors()[0]
    where = ".".join(str(part) for part in first["loc"])
    return f"{where}: {first['msg'].lower()}; {MEND}"


def _what_it_is(text: bytes) -> str:
    """Return what a text without a seal is, as far as can be told."""
    try:
        data: Any = json.loads(text)
    except ValueError:
        return "not JSON, or cut"
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        return "format: not a record"
    version = data.get("version")
    if isinstance(version, int) and version < VERSION:
        return f"version: {version} is older than {VERSION}"
    return "digest: missing, so it was edited"
