"""The folder of a study: one record per task, skipped when its key matches, and one runner at a time."""

import contextlib
from collections.abc import Iterator
from pathlib import Path

from filelock import FileLock, Timeout

from nlpweld.bench.task import Task
from nlpweld.errors import OutputError
from nlpweld.plan import WRITING, write_text
from nlpweld.records import files
from nlpweld.records.model import Record

LOCK = ".lock"


def record_path(folder: Path, task: Task) -> Path:
    """Return where the record of a task lives."""
    return folder / "records" / f"{task.place}.json"


def known_record(folder: Path, task: Task) -> Record | None:
    """Return the stored record of this very task, or None when there is none with its key.

    Raises:
        OutputError: there is a record that was edited, cut, or comes from a newer version.
    """
    path = record_path(folder, task)
    if not path.is_file():
        return None
    record = files.read_record(path)
    return record if record.key == task.key else None


def write_record(folder: Path, task: Task, record: Record) -> Path:
    """Write the record of a task.

    Raises:
        OutputError: the file cannot be written.
    """
    return files.write_record(record_path(folder, task), record)


@contextlib.contextmanager
def owned(folder: Path) -> Iterator[None]:
    """Hold a folder for one runner; the system lets go of it however the runner ends.

    Raises:
        OutputError: the folder cannot be written, or another runner is at work in it.
    """
    records = folder / "records"
    lock = FileLock(records / LOCK, timeout=0)
    try:
        write_text(records / ".probe", "").unlink()
        lock.acquire()
    except Timeout:
        raise OutputError(f"{folder}: another run is writing here; wait for it or choose another --out") from None
    except OSError as error:
        raise OutputError(f"{folder}: cannot be written ({error.strerror}); choose another --out") from None
    try:
        for left in records.rglob(f"{WRITING}*"):  # by a runner that was killed while it wrote
            left.unlink(missing_ok=True)
        yield
    finally:
        lock.release()
