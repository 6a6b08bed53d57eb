"""Answer and page of a sweep: sentences, quantities and charts agree with sweep.csv."""

import csv
import gzip
import json
import re
from base64 import b64decode
from types import SimpleNamespace

import numpy as np
import pytest
from command_line import run_cli
from scene_texts import COULOMB, PATCH, POINT, SHORT

from patchfem.export import store
from patchfem.export.sweeps import words as sweep_words

KINDS = {
    "one key": ("rig", ("--over", "friction.static=0.3,0.35,0.6,0.1")),
    "two keys": (
        "rig",
        ("--over", "friction.static=0.1..0.6:4", "--over", "drive.acceleration=1 g..5 g:3"),
    ),
    "random": (
        "rig",
        (
            "--over",
            "friction.static=0.1..0.5",
            "--over",
            "normal.load=50 N..200 N",
            "--sobol",
            "64",
        ),
    ),
    "frequency": ("rig", ("--over", "drive.frequency=120 Hz..170 Hz:11")),
    "patch": ("patch", ("--over", "contact.tilt.angle=1e-6 rad..1e-3 rad:7")),
}


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """Return the folder of a sweep of each kind."""
    root = tmp_path_factory.mktemp("sweeps")
    (root / "rig.toml").write_text(POINT + COULOMB + SHORT, encoding="utf-8")
    patch = PATCH + "[accuracy]\ntolerance = 1e-2\n"
    (root / "patch.toml").write_text(patch, encoding="utf-8")
    found = {}
    for kind, (scene, words) in KINDS.items():
        found[kind] = root / kind.replace(" ", "_")
        done = run_cli("sweep", root / f"{scene}.toml", *words, "-o", found[kind])
        assert done.code == 0, done.err
    return found


def read_figures(text: str) -> list[dict]:
    """Return the figures in the data of a page."""
    packed = re.search(r'id="data">(.*?)</script>', text, re.S)[1]
    return json.loads(gzip.decompress(b64decode(packed)))


def unpack(array) -> np.ndarray:
    """Return an array of a figure."""
    if isinstance(array, list):
        return np.array(array, float)
    return np.frombuffer(
        b64decode(array["bdata"]), {"f4": np.float32, "i1": np.int8}[array["dtype"]]
    )


@pytest.mark.parametrize("kind", KINDS)
def test_exact_verdict_is_short(folders, kind):
    """The headline has at most 30 words, the verdict at most four sentences, and both are those of sweep.json."""
    answer = store.read(folders[kind])
    assert len(answer.verdict[0].split()) <= 30
    assert 2 <= len(answer.verdict) <= 4
    assert answer.details["sentences"] == list(answer.verdict)
    assert answer.details["answer"] == answer.verdict[0]


@pytest.mark.parametrize("kind", KINDS)
def test_exact_page_shows_numbers_of_table(folders, kind):
    """The values that the menu of the page draws are those of sweep.csv for every measure, in single precision."""
    with open(folders[kind] / "sweep.csv", encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    text = (folders[kind] / "report.html").read_text("utf-8")
    figures = read_figures(text)
    (figure,) = [
        figure
        for figure in figures
        if "updatemenus" in figure["layout"]
        and figure["data"][0].get("mode", "").endswith("markers")
    ]
    buttons = figure["layout"]["updatemenus"][0]["buttons"]
    answer = store.read(folders[kind])
    n_checked = 0
    for button in buttons:
        name = button["label"].replace(" ", "_")
        shown = zip(figure["data"], button["args"][0]["visible"], strict=True)
        drawn = np.concatenate([unpack(trace["y"]) for trace, is_shown in shown if is_shown])
        cells = np.array([float(row[name] or "nan") for row in rows])
        values = answer.data[name].values.ravel()
        np.testing.assert_array_equal(np.sort(values), np.sort(cells))
        scale = np.nanmax(np.abs(drawn)) / (np.nanmax(np.abs(cells)) or 1.0) or 1.0
        expected = np.sort((cells * scale).astype(np.float32))
        np.testing.assert_allclose(np.sort(drawn), expected, rtol=3e-7)
        n_checked += 1
    assert n_checked == sum(
        np.isfinite(answer.data[name].values).any()
        for name in answer.data
        if f"{name}_error" in answer.data
    )


def test_exact_numbers_of_verdict_agree_with_closed_form(folders):
    """The headline of a patch has its values, and the limit of the tilt is in sentence, table and quantities."""
    answer = store.read(folders["patch"])
    limits = {row["measure"]: row for row in answer.details["limits"]}
    row = limits["contact_fraction"]
    assert row["low"] < row["value"] < row["high"] and row["unit"] == "rad"
    assert answer.quantities["limit_contact_fraction"].value == row["value"]
    assert (
        f"{row['value'] * 1e6:.3g} urad before contact fraction changes by 5 %" in answer.verdict[1]
    )
    text = (folders["patch"] / "report.html").read_text("utf-8")
    assert "How far the key may go" in text and "contact fraction" in text
    values = answer.data["pressure_peak"].values
    assert f"{values[-1] / 1e6:.4g} MPa" in answer.verdict[0]


@pytest.mark.parametrize(
    "n_settled, words_of_headline", [(1, "Only one of 5 cases"), (4, "No main")]
)
def test_exact_headline_of_one_settled_case_states_no_change(n_settled, words_of_headline):
    """Of a single settled case no change is known; several settled cases may agree within their errors."""
    counts = {"count": 6, "unfinished": 0, "failed": 1}
    table = SimpleNamespace(has_settled=np.arange(6) < n_settled)
    analysis = SimpleNamespace(cases=counts, ranges=[])
    assert sweep_words._describe_change(table, analysis).startswith(words_of_headline)
