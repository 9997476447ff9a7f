"""Formulas in pages: what breaks one without a warning when the site is built."""

import re

import pytest

from tests.docs.pages import ROOT


@pytest.mark.parametrize("page", sorted(path.name for path in (ROOT / "docs").glob("*.md")))
def test_no_formula_is_cut_by_the_bar_of_a_table(page):
    for line in (ROOT / "docs" / page).read_text().splitlines():
        if line.startswith("|"):
            assert all(cell.count("$") % 2 == 0 for cell in re.split(r"(?<!\\)\|", line)), line
