"""Answer of a table of pairs: its headline, its files, and pairs that fail."""

import csv

from command_line import read_page
from comparisons import compare_traces

from patchfem.export import page, store
from patchfem.export.surfaces import compare

DEPTHS = (0.5e-6, 0.7e-6, 0.75e-6)


def make_rows() -> list[dict]:
    """Return three pairs of one group, one of another group and one that failed."""
    rows = []
    for line, depth in enumerate((*DEPTHS, 2e-6), 2):
        details = compare.make_comparison_answer(compare_traces()).details
        details["worn_depth_mean"] |= {"value": depth, "low": 0.99 * depth, "high": 1.01 * depth}
        labels = {"group": "b" if line == 5 else "a", "part": f"no. {line}"}
        rows.append(details | {"line": line, "labels": labels, "outcome": "done", "message": ""})
        rows[-1] |= {"before": f"{line}.csv"}
    failed = {"line": 6, "before": "x.csv", "after": "y.csv", "direction": None, "labels": {}}
    return [*rows, failed | {"outcome": "failed", "message": "x.csv: there is no such file"}]


def test_exact_files_of_pairs(tmp_path):
    """The headline counts the pairs; the table and the page have every pair, also one that failed."""
    answer = compare.make_pairs_answer(make_rows(), "pairs.csv")
    assert answer.verdict == ("5 pairs: 4 worn, 0 not, 1 failed.",)

    store.write_answer(answer, tmp_path)
    page.write_report(tmp_path)
    rows = list(csv.DictReader((tmp_path / "pairs.csv").read_text("utf-8").splitlines()))
    assert [float(row["worn_depth_mean [m]"] or 0) for row in rows] == [*DEPTHS, 2e-6, 0]
    assert rows[4]["message"] == "x.csv: there is no such file" and rows[0]["part"] == "no. 2"
    html = read_page(tmp_path)
    assert "Worn depth of the pairs" in html and "x.csv: there is no such file" in html
    page.write_report(tmp_path)
    assert html == read_page(tmp_path)
