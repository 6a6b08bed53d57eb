"""patchfem compare --pairs: each pair as compare gives it alone, means over them, failures, refusals."""

import csv
import json
import re

import numpy as np
import pytest
from command_line import run_cli
from pairs import UM, make_track_pair
from scipy.stats import t

import patchfem as pf
from patchfem.surface import Quantity, read_pairs
from patchfem.surface.quantity import average_quantities

COUNT = 1201


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    """A table of three pairs with a track, the last of which has no file after."""
    place = tmp_path_factory.mktemp("pairs")
    for k in range(2):
        made = make_track_pair("band", 7100 + k, COUNT)
        for name, one in (("before", made.before), ("after", made.after)):
            (place / f"{name}{k}.csv").write_text(
                "x [um],z [um]\n"
                + "".join(f"{x / UM:.3f},{z / UM:.4f}\n" for x, z in zip(one.x, one.z))
            )
    path = place / "pairs.csv"
    path.write_text(
        "specimen,before,after,direction\nA,before0.csv,after0.csv,y\n\nB,before1.csv,after1.csv,y\n"
        "C,before0.csv,nowhere.csv,x\n"
    )
    return path


@pytest.fixture(scope="module")
def answered(table, tmp_path_factory):
    out = tmp_path_factory.mktemp("answered") / "out"
    return run_cli("compare", "--pairs", table, "-o", out, "--json"), out


def test_exact_each_pair_is_what_compare_gives_alone(table, answered):
    answer, out = answered
    rows = json.loads(answer.out)
    assert answer.code == 3 and [row["line"] for row in rows] == [2, 4, 5]
    alone = pf.compare(table.parent / "before1.csv", table.parent / "after1.csv", direction="y")
    own = {
        "line": 4,
        "before": "before1.csv",
        "after": "after1.csv",
        "labels": {"specimen": "B"},
        "outcome": "done",
        "message": "",
    }
    assert rows[1] == json.loads(json.dumps(alone)) | own
    assert rows[2]["outcome"] == "failed"
    assert "nowhere.csv: there is no such file" in rows[2]["message"]
    assert [row["direction"] for row in rows] == ["y", "y", "x"]
    assert f"{table}:5: " in answer.err
    assert "<b>3 pairs, 2 with detected wear, 1 failed.</b>" in (out / "report.html").read_text()


def test_exact_the_mean_over_the_pairs_and_the_table(table, answered):
    out = answered[1]
    lines = list(csv.DictReader((out / "pairs.csv").read_text().splitlines()))
    values = np.array([float(one["worn_depth_mean [m]"]) for one in lines[:2]])
    assert lines[2]["worn_depth_mean [m]"] == "" and [one["specimen"] for one in lines] == [
        "A",
        "B",
        "C",
    ]
    said = json.loads((out / "pairs.json").read_text())
    assert len(said["means"]) == 1
    found = said["means"][0]["worn_depth_mean"]
    side = t.ppf(0.975, 1) * values.std(ddof=1) / np.sqrt(2)
    assert found["value"] == pytest.approx(values.mean()) and found["scatter"] == pytest.approx(
        values.std(ddof=1)
    )
    assert (found["low"], found["high"]) == pytest.approx(
        (max(values.mean() - side, 0.0), values.mean() + side)
    )
    assert json.loads(json.dumps(pf.compare(pairs=table))) == said
    picture = (out / "report.html").read_text()
    bars = re.findall(
        r'd="M ([\d.]+) ([\d.]+) \nL \1 ([\d.]+) \n" [^>]*stroke: var.--accent', picture
    )
    dots = re.findall(r'x="([\d.]+)" y="([\d.]+)" style="fill: var.--accent', picture)
    assert len(bars) >= 2
    for x, low, high in bars:
        assert any(at == x and float(high) < float(y) < float(low) for at, y in dots)


def test_always_the_interval_of_a_mean_holds_the_truth_in_95_of_100():
    """Pairs that scatter, and pairs whose own errors are all there is: 400 means of four each."""
    random = np.random.default_rng(11)
    for scatter, own in ((3.0, 0.3), (0.0, 1.0)):
        held = []
        for _ in range(400):
            values = 50 + random.normal(0, np.hypot(scatter, own), 4)
            one = average_quantities(
                [Quantity(v, v - 1.96 * own, v + 1.96 * own, "m", "") for v in values], ""
            )
            held.append(one.mean.low <= 50 <= one.mean.high)
        assert np.mean(held) > 0.92


@pytest.mark.parametrize(
    "text, says",
    [
        (
            "before,then\na.csv,b.csv\n",
            ":1: a header like `before,after` is needed, not 'before,then' (no column after)",
        ),
        ("before,after\n\n", ": no pair below its header"),
        ("before,after\na.csv\n", ":2: two cells are needed, before and after, not 'a.csv'"),
        ("before,after\na.csv,\n", ":2: after: the name of a file is needed"),
        (
            "before,after,direction\na.csv,b.csv,z\n",
            ":2: direction: must be x, y or empty, not 'z'",
        ),
        ("before,after\na.csv,b.csv\na.csv,b.csv\n", ":3: repeats the pair of line 2"),
        ("", ":1: a header like `before,after` is needed"),
    ],
)
def test_refuses_a_table_that_is_none(tmp_path, text, says):
    path = tmp_path / "pairs.csv"
    path.write_text(text)
    answer = run_cli("compare", "--pairs", path, "-o", tmp_path / "out")
    assert answer.code == 2 and f"{path}{says}" in answer.err and not (tmp_path / "out").exists()
    with pytest.raises(pf.PatchfemError):
        read_pairs(path)


def test_refuses_a_table_of_which_no_pair_can_be_compared(tmp_path):
    (tmp_path / "pairs.csv").write_text("before,after\na.csv,b.csv\n")
    answer = run_cli("compare", "--pairs", tmp_path / "pairs.csv", "-o", tmp_path / "out")
    assert answer.code == 2 and (tmp_path / "out" / "pairs.csv").is_file()
    with pytest.raises(pf.PatchfemError, match="not both"):
        pf.compare("a.csv", "b.csv", pairs=tmp_path / "pairs.csv")
