import subprocess
import sys

import numpy as np
import pandas as pd
import pytest
from rich.console import Console

from nlpweld.errors import OutputError
from nlpweld.report.markup import latex, markdown
from nlpweld.report.records import load_baselines
from nlpweld.report.study import Study
from nlpweld.report.tables import as_text, format_summary, summary, write_tables


def rows(folder):
    return summary(Study(folder).runs, load_baselines(folder)).set_index(["cell", "solver"])


def test_an_unverified_claim_enters_no_mean_and_no_best(folder, add, add_baseline):
    add(solver="ga", seed=0, mmr=0.28)
    add(solver="ga", seed=1, mmr=0.30)
    add(solver="ga", seed=2, mmr=99.0, verified=False)
    add(solver="liar", seed=0, mmr=1e6, verified=False)
    add_baseline(mmr=0.24)
    table = rows(folder)
    ga = table.loc[("three_er16", "ga")]
    assert (ga["runs"], ga["claimed"], ga["verified"]) == (3, 3, 2)
    assert ga["objective_mean"] == pytest.approx(0.29)
    assert ga["objective_std"] == pytest.approx(np.sqrt(2) * 0.01)
    assert ga["objective_best"] == pytest.approx(0.30)
    assert ga["share_percent"] == pytest.approx(100 * 0.29 / 0.30)
    liar = table.loc[("three_er16", "liar")]
    assert (liar["claimed"], liar["verified"]) == (1, 0)
    assert liar[["objective_mean", "objective_best", "share_percent", "to_reference_mm"]].isna().all()
    assert table.loc[("three_er16", "Pan et al. C")]["share_percent"] == pytest.approx(80.0)


def test_failed_runs_are_counted_and_leave_the_medians_alone(folder, add):
    for seed, solve_s in enumerate((1.0, 2.0, 6.0)):
        add(seed=seed, solve_s=solve_s)
    add(seed=3, status="FAILED", verified=False, report=None, solve_s=None)
    add(seed=4, status="SKIPPED", verified=False, report=None, solve_s=0.0, evaluations=0)
    row = rows(folder).loc[("three_er16", "ga")]
    assert (row["runs"], row["claimed"], row["verified"], row["failed"]) == (5, 3, 3, 1)
    assert row["solve_median_s"] == 2.0
    assert row["evaluations_median"] == 400


def test_distance_is_from_the_best_placement_to_the_baseline(folder, add, add_baseline):
    add(seed=0, mmr=0.30, at=(0.026, -0.266, 0.408))
    add(seed=1, mmr=0.29, at=(0.5, 0.5, 0.5))
    add_baseline(at=(0.023, -0.266, 0.404))
    table = rows(folder)
    assert table.loc[("three_er16", "ga")]["to_reference_mm"] == pytest.approx(5.0)
    assert table.loc[("three_er16", "Pan et al. C")]["to_reference_mm"] == 0.0


def test_cells_are_measured_by_their_own_best(folder, add, add_baseline):
    add(cell="a", mmr=0.2)
    add(cell="b", mmr=0.4)
    add_baseline(cell="b")
    table = rows(folder)
    assert table.loc[("a", "ga")]["share_percent"] == 100.0
    assert np.isnan(table.loc[("a", "ga")]["to_reference_mm"])


def test_an_infeasible_baseline_is_shown_but_counts_for_nothing(folder, add, add_baseline):
    add(mmr=0.29)
    add_baseline(mmr=0.9, feasible=False)
    table = rows(folder)
    assert table.loc[("three_er16", "Pan et al. C")][["objective_mean", "objective_best"]].isna().all()
    assert table.loc[("three_er16", "ga")]["share_percent"] == 100.0


def test_tables_are_written_in_every_form(folder, add, add_baseline):
    add(solver="random_search", seed=0, mmr=0.28)
    add(solver="random_search", seed=1, mmr=0.30)
    add_baseline()
    written = write_tables(folder)
    again = pd.read_csv(folder / "tables" / "summary.csv")
    assert again["objective_mean"].tolist() == pytest.approx(written["objective_mean"].tolist())
    assert len(pd.read_csv(folder / "tables" / "runs.csv")) == 2
    markdown = (folder / "tables" / "summary.md").read_text().splitlines()
    assert len({line.count("|") for line in markdown}) == 1
    assert "0.29000 ± 0.01414" in markdown[2]
    tex = (folder / "tables" / "summary.tex").read_text()
    assert all(rule in tex for rule in (r"\toprule", r"\midrule", r"\bottomrule", r"\end{tabular}"))
    assert r"three\_er16 & random\_search & 2 & 2 & 2 & 0.29000 $\pm$ 0.01414" in tex


def test_latex_is_escaped(folder, add):
    add(solver="a_b", preset="50%&#{}~^\\$", cell="x_1")
    tex = latex(as_text(summary(Study(folder).runs, load_baselines(folder))))
    row = next(line for line in tex.splitlines() if "x\\_1" in line)
    assert r"a\_b:50\%\&\#\{\}\textasciitilde{}\textasciicircum{}\textbackslash{}\$" in row
    body = row.replace(r"\textasciitilde{}", "").replace(r"\textasciicircum{}", "").replace(r"\textbackslash{}", "")
    assert body.replace(r"\&", "").count("&") == tex.splitlines()[2].count("&")


def test_a_spread_too_small_to_show_is_not_shown_as_zero(folder, add):
    add(seed=0, mmr=0.29)
    add(seed=1, mmr=0.29 + 1e-9)
    assert "$\\pm$ $<$1e-5" in latex(as_text(summary(Study(folder).runs, load_baselines(folder))))


@pytest.mark.parametrize("width", [80, 100])
def test_printed_summary_fits_the_screen(folder, add, add_baseline, width):
    add(solver="random_search", seed=0)
    add(solver="random_search", seed=1, evaluations=500_000, solve_s=1234.5)
    add_baseline()
    console = Console(width=width, record=True, quiet=False, file=open("/dev/null", "w"))  # noqa: PTH123, SIM115
    console.print(format_summary(summary(Study(folder).runs, load_baselines(folder)), width))
    text = console.export_text()
    console.file.close()
    assert max(map(len, text.splitlines())) <= width
    for whole in ("random_search", "Pan et al. C", "three_er16", "[s]", "[mm]", "0.29000"):
        assert whole in text


def test_unwritable_tables_are_one_line(folder, add):
    add()
    (folder / "tables").write_text("a file is in the way")
    with pytest.raises(OutputError, match=r"cannot be written"):
        write_tables(folder)


def test_tables_need_neither_solvers_nor_matplotlib():
    code = "import sys, nlpweld.report.tables, nlpweld.report.plots; print([m for m in sys.modules if m in names])"
    names = "names = {'casadi', 'pymoo', 'matplotlib', 'fcl'};"
    done = subprocess.run([sys.executable, "-c", names + code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_heading_says_what_is_maximised(folder, add, asked):
    add(report=asked(0.4, reading="product"))
    assert "| product of w mean ± sd |" in markdown(as_text(rows(folder).reset_index()))
    add(report=asked(0.4, reading="paper", over_seam="minimum", objective=0.1))
    table = rows(folder).reset_index()
    assert "| least MMR mean ± sd |" in markdown(as_text(table))
    assert table["objective_mean"].tolist() == [0.1]
    add(report=asked(0.4, over_seam="soft_minimum", exponent=8.0, objective=0.2, reading="millimetres"))
    assert "| soft least MMR (millimetres) (p = 8) mean ± sd |" in markdown(as_text(rows(folder).reset_index()))


def test_rows_say_what_they_maximise_where_that_differs(folder, add, add_baseline, asked):
    add(cell="a", report=asked(0.4, reading="product"))
    add(cell="b")
    add_baseline(cell="b")
    lines = markdown(as_text(rows(folder).reset_index())).splitlines()
    assert "| maximised | mean ± sd |" in lines[0]
    assert [line.count("| MMR |") + 2 * line.count("| product of w |") for line in lines[2:]] == [2, 1, 1]


def test_older_records_maximise_the_mean(folder, add):
    add(mmr=0.29)
    runs = Study(folder).runs
    assert (runs["objective"] == 0.29).all()
    assert (runs["over_seam"] == "mean").all()


def test_on_a_narrow_screen_what_is_maximised_stands_beside_the_cell(folder, add, asked):
    add(cell="a", report=asked(0.4, reading="product"))
    add(cell="b")
    table = rows(folder).reset_index()
    for width, wanted in ((100, []), (80, ["a: product of w", "b: MMR"])):
        first = list(format_summary(table, width).columns[0].cells)
        assert [cell for cell in first if ":" in str(cell)] == wanted
