"""`patchfem compare --pairs`: a table of pairs, their means, failed pairs and error messages."""

import csv
import json

import pytest
from command_line import read_json, read_page, run_cli
from traces import write_traces

import patchfem as pf


@pytest.fixture(scope="module")
def pairs_table(tmp_path_factory):
    """Return a table of three pairs with a wear track; the last pair has no file after wear."""
    place = tmp_path_factory.mktemp("pairs")
    for k in range(2):
        write_traces("groove", 7100 + k, place, (f"before{k}", f"after{k}"))
    path = place / "pairs.csv"
    path.write_text(
        "specimen,before,after,direction\nA,before0.csv,after0.csv,y\n\nB,before1.csv,after1.csv,y\n"
        "C,before0.csv,nowhere.csv,x\n"
    )
    return path


@pytest.fixture(scope="module")
def pairs_answer(pairs_table, tmp_path_factory):
    """Return the answer and the folder of the comparison of the table."""
    out = tmp_path_factory.mktemp("answered") / "out"
    return run_cli("compare", "--pairs", pairs_table, "-o", out, "--json"), out


def test_exact_pair_equals_single_comparison(pairs_table, pairs_answer):
    """A pair of the table has the results of a single comparison, and a pair without a file fails with a message."""
    answer, out = pairs_answer
    rows = answer.content
    assert answer.code == 3 and [row["line"] for row in rows] == [2, 4, 5]
    alone = pf.compare(
        pairs_table.parent / "before1.csv", pairs_table.parent / "after1.csv", direction="y"
    )
    table_fields = {
        "line": 4,
        "before": "before1.csv",
        "after": "after1.csv",
        "labels": {"specimen": "B"},
        "outcome": "done",
        "message": "",
    }
    assert rows[1] == json.loads(json.dumps(alone)) | table_fields
    assert rows[2]["outcome"] == "failed"
    assert "nowhere.csv: there is no such file" in rows[2]["message"]
    assert [row["direction"] for row in rows] == ["y", "y", "x"]
    assert f"{pairs_table}:5: " in answer.err
    assert "3 pairs: 2 worn, 0 not, 1 failed." in read_page(out)


def test_exact_table_has_a_line_for_each_pair(pairs_answer):
    """The written table and the stored answer have the values and the labels of each pair."""
    answer, out = pairs_answer
    lines = list(csv.DictReader((out / "pairs.csv").read_text().splitlines()))
    assert [one["specimen"] for one in lines] == ["A", "B", "C"]
    depths = [row.get("worn_depth_mean", {"value": ""})["value"] for row in answer.content]
    assert [float(one["worn_depth_mean [m]"] or "nan") for one in lines[:2]] == depths[:2]
    assert lines[2]["worn_depth_mean [m]"] == ""
    assert read_json(out / "pairs.json")["pairs"] == answer.content


@pytest.mark.parametrize(
    "text, says",
    [
        (
            "before,then\na.csv,b.csv\n",
            ":1: a header like `before,after` is needed, not 'before,then' (no column after)",
        ),
        ("before,after\n\n", ": no pair below its header"),
        (
            "before,after\na.csv\n",
            ":2: the number of cells must be 2 (before, after), not 1 as in 'a.csv'",
        ),
        ("before,after\na.csv,\n", ":2: after: the name of a file is needed"),
        (
            "before,after,direction\na.csv,b.csv,z\n",
            ":2: direction: must be x, y or empty, not 'z'",
        ),
        ("", ":1: a header like `before,after` is needed"),
    ],
)
def test_refuses_invalid_pairs_table(tmp_path, text, says):
    """A table without the required columns or rows is refused with file and line."""
    path = tmp_path / "pairs.csv"
    path.write_text(text)
    answer = run_cli("compare", "--pairs", path, "-o", tmp_path / "out")
    assert answer.code == 2 and f"{path}{says}" in answer.err and not (tmp_path / "out").exists()
