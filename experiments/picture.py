"""The viewer's picture in the README: the paper's placement beside the optimum, from the plans of ``make reproduce``.

Needs the extra ``view`` and a Chromium: ``python experiments/picture.py [--out results/view] [--at 0.4]``.
"""

import argparse
import tempfile
from pathlib import Path

from nlpweld.view import save_picture, write_view

PLANS = Path("results/paper/plans")
SHOWN = {"paper.json": "Pan et al., C", "optimum.json": "optimum"}


def main() -> None:
    """Write the page to a folder that goes, and keep a picture of it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("results/view"), help="folder of the picture")
    parser.add_argument("--at", type=float, default=0.4, help="where the cursor stands, as a share of the whole")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        plans, names = [PLANS / name for name in SHOWN], list(SHOWN.values())
        page = write_view(plans, Path(folder) / "view.html", names=names)
        print(save_picture(page, arguments.out / "three_er16.png", at=arguments.at))


if __name__ == "__main__":
    main()
