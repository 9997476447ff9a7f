"""Families of figures, one module each; a module's ``drawings(study)`` lists what it can draw and from what."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from nlpweld.report.study import Study


@dataclass(frozen=True)
class Drawing:
    """One figure to be.

    Attributes:
        name: file name without ending.
        draw: makes the figure from the study.
        needs: files below the study's folder that it reads beside the records.
        data: the table it is drawn from, where that is not one of those files; it is written beside the figure.
    """

    name: str
    draw: "Callable[[Study], Figure]"
    needs: tuple[str, ...] = ()
    data: "Callable[[Study], pd.DataFrame] | None" = None
