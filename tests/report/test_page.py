"""The page of a study: whole in itself, and honest about claims."""

import re
from html.parser import HTMLParser

from nlpweld.report.page import write_page


class Reader(HTMLParser):
    """Collects what a page asks for from elsewhere, and its text."""

    def __init__(self):
        super().__init__()
        self.elsewhere, self.text, self.images = [], "", 0

    def handle_starttag(self, tag, attrs):
        facts = dict(attrs)
        self.images += tag == "img"
        self.elsewhere += [v for k, v in facts.items() if k in ("src", "href") and not v.startswith("data:")]
        self.elsewhere += [tag] if tag in ("script", "link", "iframe") else []

    def handle_data(self, data):
        self.text += data


def test_the_page_holds_all_it_needs_and_names_what_was_not_verified(folder, add):
    for seed in range(3):
        add(solver="ga", seed=seed, mmr=0.28 + 0.001 * seed, budget={"evaluations": 5000})
        add(solver="ipopt", seed=seed, mmr=0.29)
    add(solver="liar", seed=0, mmr=9.0, verified=False)
    add(solver="<b>", seed=0, status="FAILED", verified=False, message="died & gone")
    path = write_page(folder)
    page = Reader()
    page.feed(path.read_text())
    assert page.elsewhere == []
    assert page.images > 3
    text = re.sub(r"\s+", " ", page.text)
    counts = ("8 runs on 1 problems", "7 called solved", "6 verified", "1 failed")
    named = ("three_er16, reduced, liar:default, seed 0", "died & gone", "best verified of this study")
    terms = ("5000 evaluations", "nlpweld 0.1.0", "2 cores", "ga:default {}")
    for told in (*counts, *named, *terms):
        assert told in text, told
    assert "9.0" not in text.partition("Claims that were not verified")[0]
