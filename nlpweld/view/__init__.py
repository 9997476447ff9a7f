"""A plan as a page to watch: the cell in three dimensions, and its measures, at one cursor."""

from nlpweld.view.page import write_view
from nlpweld.view.picture import save_picture

__all__ = ["save_picture", "write_view"]
