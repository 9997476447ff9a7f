"""A live view of a study: what is done, running and failed, and how long it may still take."""

from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, ProgressColumn, Task, TextColumn, TimeElapsedColumn
from rich.text import Text

from nlpweld.records.model import Record


class StudyProgress:
    """A bar for :func:`~nlpweld.bench.run.run`, as a context manager.

    Attributes:
        bar: the bar, to which others may add tasks of their own.
    """

    def __init__(self, console: Console | None = None, quiet: bool = False) -> None:
        """Show the bar on a console, on standard error by default, or nowhere."""
        columns = (TextColumn("{task.description:<44.44}"), BarColumn(16), MofNCompleteColumn(), _Counts())
        shown = console or Console(stderr=True, quiet=quiet)
        self.bar = Progress(*columns, TimeElapsedColumn(), _Left(), console=shown, disable=quiet)
        self._slots = 1

    def __enter__(self) -> "StudyProgress":
        """Start to show."""
        self.bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Stop showing."""
        self.bar.stop()

    def begin(self, tasks: int, slots: int) -> None:
        """Show a bar for so many tasks, so many at once."""
        self._slots = slots
        self._task = self.bar.add_task("runs", total=tasks, slots=slots, failed=0, new=0, spent_s=0.0)

    def told(self, record: Record, known: bool) -> None:
        """Count a record; what it took tells how long the others may take."""
        fields = next(task for task in self.bar.tasks if task.id == self._task).fields
        what = f"{record.cell} {record.formulation} {record.solver}:{record.preset} {record.seed}"
        self.bar.update(
            self._task,
            advance=1,
            description=f"{what} {'known' if known else record.status}",
            failed=fields["failed"] + (record.status == "FAILED"),
            new=fields["new"] + (not known),
            spent_s=fields["spent_s"] + (0.0 if known else record.wall_s),
        )


class _Counts(ProgressColumn):
    """How many run, and how many have failed."""

    def render(self, task: Task) -> Text:
        if "slots" not in task.fields:
            return Text("")
        running = min(task.fields["slots"], int(task.remaining or 0))
        failed = task.fields["failed"]
        return Text(f"{running} running, {failed} failed", style="red" if failed else "")


class _Left(ProgressColumn):
    """Time left, from the mean time of the runs that were made."""

    max_refresh = 0.5

    def render(self, task: Task) -> Text:
        if not task.fields.get("new") or not task.remaining:
            return Text("")
        left_s = task.remaining * task.fields["spent_s"] / task.fields["new"] / task.fields["slots"]
        return Text(f"{left_s // 60:.0f}:{left_s % 60:02.0f} left", style="cyan")
