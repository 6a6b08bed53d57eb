"""Pages of all kinds of runs: self-contained, accessible, equal to their files, and made again from the files alone."""

import os
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from command_line import read_json, read_page, run_successfully
from page_data import (
    find_accessibility_errors,
    find_strange_curves,
    find_wrong_numbers,
    parse_page,
    read_charts,
    read_measures,
    read_tiles,
    strip_scripts,
)
from scene_texts import (
    BENCH,
    COATED,
    COULOMB,
    DRIVE,
    FORCED,
    LINEAR,
    MODE,
    PAIR,
    PLASTIC,
    POINT,
    RIG,
    SMALL_PATCH,
    SWEEP,
)

from patchfem.export import backbones, page, quantities, store
from patchfem.export.charts import panels, plotly
from patchfem.export.charts.panel import Axis, Curve, Panel
from patchfem.export.rows import CHARTS

LEVELS = DRIVE.replace(
    'acceleration = "5 g"', 'waveform = "levels"\nlevels = ["3 g", "5 g", "6 g"]'
)
RELEASE = '[drive]\nkind = "free"\ndisplacement = "0.1 mm"\ncycles = 60\n'
RANDOM = (
    '[drive]\nkind = "base"\nwaveform = "random"\nspectrum = "1e-2 g^2/Hz"\nfrom = "20 Hz"\nto = "300 Hz"\n'
    'duration = "2 s"\n'
)
WEAR = '[slide]\nkind = "sine"\namplitude = "15 um"\nfrequency = "143 Hz"\ncycles = 2\n[wear]\n'
WEAR += 'coefficient = "1e-15 1/Pa"\ncycles = 1e5\n'
CURVE = SWEEP + '[accuracy]\nmethod = "harmonic"\ntolerance = 1e-2\n'
SMALL_LOAD = '[normal]\nload = "2 N"\n'
SCENES = {
    "patch": SMALL_PATCH,
    "no contact": COATED.replace('load = "26 lbf"\n', "")
    + '[contact.approach]\ndistance = "0 um"\n',
    "bench": BENCH,
    "rig": RIG,
    "linear": LINEAR,
    "masses": PAIR + FORCED,
    "levels": POINT + PLASTIC + MODE + LEVELS,
    "release": SMALL_LOAD + COULOMB + MODE + RELEASE,
    "random": POINT + PLASTIC + MODE + RANDOM,
    "curve": SMALL_LOAD + COULOMB + MODE + CURVE,
    "wear": SMALL_PATCH + COULOMB + WEAR,
}


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """Return a function that runs a scene of SCENES once and returns its results folder."""
    base = tmp_path_factory.mktemp("pages")

    def find_folder(name: str):
        """Return the results folder of a scene."""
        folder = base / name.replace(" ", "_")
        if not folder.exists():
            scene = base / f"{folder.name}.toml"
            scene.write_text(SCENES[name], "utf-8")
            run_successfully("run", scene, "-o", folder, "-q")
        return folder

    return find_folder


def test_exact_names_of_the_template_exist():
    """Every name of `quantities` in the template exists: Jinja takes an unknown name as empty."""
    template = Path(quantities.__file__).with_name("page.html").read_text("utf-8")
    names = re.findall(r" quantities\.(\w+)", template)
    assert "SURFACE_ANSWER_KINDS" in names and set(names) <= vars(quantities).keys()


@pytest.mark.parametrize("name", SCENES)
def test_exact_numbers_of_page_equal_files(folders, name):
    """Tiles and measures of the page equal summary.json, and the charts contain the arrays of result.nc."""
    folder = folders(name)
    page = read_page(folder)
    summary = read_json(folder / "summary.json")
    measures = summary["measures"]
    texts = read_measures(page)
    assert find_wrong_numbers(texts, measures) == []
    zeros = (
        {one.replace(" ", "_") for one in re.findall(r"Zero: (.*?)\.</p>", page)[0].split(", ")}
        if "Zero: " in page
        else set()
    )
    assert texts.keys() | zeros == measures.keys()
    tiles = {label.replace(" ", "_"): text for label, text in read_tiles(page).items()}
    assert len(tiles) <= quantities.MAX_KEY_QUANTITIES and find_wrong_numbers(tiles, measures) == []

    if (folder / "result.nc").is_file():
        assert find_strange_curves(page, folder / "result.nc") == []


@pytest.mark.parametrize("name", SCENES)
def test_always_page_is_self_contained_and_accessible(folders, name):
    """A page is one file below 2.5 MB; its links lead to files beside it, its ids are unique, its charts have a text."""
    folder = folders(name)
    page = read_page(folder)
    parsed = parse_page(page)
    assert find_accessibility_errors(page) == []
    assert len(parsed.ids) == len(set(parsed.ids))
    assert all((folder / link).exists() for link in parsed.links)
    content = strip_scripts(page)
    assert "http" not in content and "url(" not in content and "@import" not in content
    assert not re.search(r"<script[^>]* src", page) and len(page.encode()) < 2.5e6


@pytest.mark.parametrize("name", SCENES)
def test_exact_headline_is_short_and_stands_first(folders, name):
    """The headline has at most 30 words, the verdict at most four sentences, and both stand before charts and tables."""
    page = read_page(folders(name))
    box = re.search(r'<div class="box">(.*?)</div>', page)[1]
    sentences = re.findall(r"<p>(.*?)</p>", box)
    assert 1 <= len(sentences) <= 4 and len(sentences[0].split()) <= 30
    start = page.index('<div class="box">')
    assert not any(tag in page[:start] for tag in ("<figure", "<table", "<h2"))


def test_exact_page_is_made_again_from_its_files(folders, tmp_path, monkeypatch):
    """The page made by `report` from a moved folder equals the first one byte by byte, without scene and caches."""
    for name in ("rig", "wear", "random"):
        folder = tmp_path / name
        shutil.copytree(folders(name), folder)
        first = (folder / "report.html").read_bytes()
        os.remove(folder / "report.html")
        monkeypatch.setenv("PATCHFEM_CACHE", str(tmp_path / "empty"))
        run_successfully("report", folder)
        assert (folder / "report.html").read_bytes() == first


EXPECTED_CHARTS = {
    "patch": {"Pressure on the interface", "Gap", "von Mises stress in both pieces"},
    "bench": {"Friction loop", "Displacement", "Friction force", "Energy"},
    "rig": {
        "Friction loop",
        "Displacement",
        "Acceleration",
        "Whole run",
        "Pressure on the interface",
        "Shear stress on the interface",
        "Where it sticks and slips",
        "Energy",
        "von Mises stress in both pieces",
    },
    "levels": {"Levels of the drive"},
    "release": {"Frequency of the decay", "Damping of the decay", "Whole run"},
    "random": {"Frequency response H1", "Spectral density", "Coherence"},
    "curve": {"Steady motions"},
    "wear": {"Wear over the cycles", "Pressure while it wears", "Worn depth"},
    "no contact": set(),
}


@pytest.mark.parametrize("name", EXPECTED_CHARTS)
def test_exact_page_has_charts_of_its_kind(folders, name):
    """The page of each kind of run has the charts of its kind, with labels and units on both axes."""
    charts = read_charts(read_page(folders(name)))
    assert charts.keys() >= EXPECTED_CHARTS[name]
    if name == "no contact":
        assert (
            "von Mises stress in both pieces" not in charts
            and "Pressure on the interface" not in charts
        )
    for title, figure in charts.items():
        for axis in ("xaxis", "yaxis"):
            assert figure["layout"][axis]["title"]["text"], title


def test_exact_levels_are_listed_with_their_errors(folders):
    """The table of levels has drive, amplitude with error and state of each level, as in result.nc."""
    folder = folders("levels")
    page = read_page(folder)
    table = page[page.index("<h2>Levels of the drive</h2>") :]
    rows = re.findall(r"<tr>(<td.*?</td>)</tr>", table[: table.index("</table>")])
    with xr.open_dataset(folder / "result.nc") as data:
        assert len(rows) == data.sizes["level"] == 3
        for row, drive in zip(rows, data.level_drive.values / 9.80665, strict=True):
            assert f">{drive:g} g</td>" in row and ("slips" in row or "sticks" in row)


def test_always_page_works_in_browser(folders, chromium):
    """The charts are drawn without an error on the console, in the light and on a narrow screen without broken words."""
    for name in ("rig", "wear", "curve"):
        page = chromium.visit(folders(name) / "report.html")
        page.wait_for_charts()
        assert page.faults == [] and page.broken_words() == []
        assert page.evaluate("document.documentElement.scrollWidth") <= 390
        count = page.evaluate("document.querySelectorAll('.chart .main-svg').length")
        assert count >= len(read_charts(read_page(folders(name))))


def test_always_printed_page_fits_the_paper(folders, chromium):
    """Before printing, charts get the width of a column or of the sheet, and the measures are shown; then they return."""
    page = chromium.visit(folders("rig") / "report.html")
    page.wait_for_charts()
    widths = "[...document.querySelectorAll('.chart .main-svg:first-child')].map((one) => one.clientWidth)"
    before = page.evaluate(widths)
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    assert set(page.evaluate(widths)) == {320, 660}
    assert page.evaluate("document.getElementById('measures').open")
    page.evaluate("dispatchEvent(new Event('afterprint'))")
    assert page.evaluate(widths) == before and page.faults == []


def test_exact_response_curves_stand_in_order_of_their_levels(folders):
    """On a page, response curves are sorted by drive level on a logarithmic axis, and their chart is the first one."""
    answer = store.read_answer(folders("curve"))
    level = answer.data["curve_level"]
    answers = {}
    for factor in (3, 4, 0.5):
        scaled = replace(level, values=factor * level.values)
        answers[f"{factor}"] = replace(answer, data=answer.data | {"curve_level": scaled})
    ordered = page._sort_by_drive_level(answers)
    panel = panels.make_panels(ordered, CHARTS[answer.kind])[0]
    assert [curve.name for curve in panel.curves] == ["0.5", "3", "4"]
    assert panel.title == "Steady motions" and panel.y.is_log


def test_exact_round_off_does_not_stretch_a_logarithmic_axis():
    """A value of round-off beside large ones lies outside of a logarithmic axis, and a menu resets the range."""
    x = np.arange(4.0)
    panels_of_menu = [
        Panel(title, "line", Axis("x"), Axis("y", is_log=True), [Curve("", x, np.array(values))])
        for title, values in (("first", [1e-24, 2e-3, 1.0, 5.0]), ("second", [1.0, 2.0, 3.0, 4e3]))
    ]
    menu = replace(panels_of_menu[0], style="menu", choices=panels_of_menu)
    layout = plotly.make_plotly_figure(menu)["layout"]
    low, high = layout["yaxis"]["range"]
    assert -3.2 < low < np.log10(2e-3) < np.log10(5) < high < 1
    first, second = (button["args"][1] for button in layout["updatemenus"][0]["buttons"])
    assert first["yaxis.range"] == [low, high] and not first["yaxis.autorange"]
    assert second["yaxis.range"] is None and second["yaxis.autorange"]


def test_exact_note_of_a_backbone_has_no_padded_power_of_ten():
    """A clause on a backbone becomes a sentence in which 1e-05 is 1e-5."""
    clause = "the band holds the numerical error: at most 1e-05 % of the frequency."
    sentence = "The band holds the numerical error: at most 1e-5 % of the frequency."
    assert backbones._make_sentence(clause) == sentence


def test_exact_compliance_of_response_curves_is_a_choice_of_a_menu(folders):
    """Under forces of two levels the chart of amplitudes has a menu with compliances, which coincide for a linear rig."""
    answer = store.read_answer(folders("curve"))
    amplitude = answer.data["curve_amplitude"]
    answers = {}
    for factor in (1, 2):
        data = {
            "curve_amplitude": replace(amplitude, values=factor * amplitude.values),
            "curve_compliance": replace(amplitude, values=amplitude.values / 4, unit="m N-1"),
        }
        answers[f"{factor}"] = replace(answer, data=answer.data | data)
    panel = panels.make_panels(answers, CHARTS[answer.kind])[0]
    assert [choice.title for choice in panel.choices] == [
        "amplitude",
        "compliance (amplitude / force)",
    ]
    assert "um/N" in panel.choices[1].y.label
    first, second = panel.choices[1].curves
    assert first.y.tolist() == second.y.tolist()
