"""Small HTML tables, as which the main types show themselves in a notebook."""

from collections.abc import Iterable, Sequence
from html import escape


def html_table(title: str, rows: Iterable[Sequence[object]], header: Sequence[str] = ()) -> str:
    """Return a table with a caption, the first column as row headings.

    Args:
        title: what the table is of.
        rows: cells of each row, of equal number; shown as text, with markup escaped.
        header: headings of the columns, if any.
    """
    head = f"<thead><tr>{''.join(_cell('th', name) for name in header)}</tr></thead>" if header else ""
    body = "".join(f"<tr>{_cell('th', row[0])}{''.join(_cell('td', x) for x in row[1:])}</tr>" for row in rows)
    return f"<table><caption>{escape(title)}</caption>{head}<tbody>{body}</tbody></table>"


def _cell(tag: str, value: object) -> str:
    return f'<{tag} style="text-align: left">{escape(str(value))}</{tag}>'
