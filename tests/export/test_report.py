"""Report page of a run: one self-contained file with the verdict first, and correct numbers and units."""

import re
from copy import deepcopy
from dataclasses import replace
from html.parser import HTMLParser
from types import SimpleNamespace

import numpy as np
import pytest
from page_data import find_accessibility_errors, read_charts, read_page_data, strip_scripts

from patchfem.core import G_N, Outcome
from patchfem.export import report
from patchfem.export.drawing import charts
from patchfem.export.page_data import Measured, Motion, PressedPatch, RunData, SceneText, Verdict
from patchfem.export.pages import sentences
from patchfem.response import TABLE as MOTION

PERIOD, MIL = 1 / 143, 25.4e-6


def make_measure(value, unit, error=None):
    """Return a measure with a value, a unit and an error."""
    return {"value": value, "unit": unit, "error": error, "floor": 0.0}


def make_run_data(kind, outcome, effects, measures, title="a title") -> RunData:
    """Return the data that the page of every kind of run needs."""
    rows = [{"effect": name, "equations": "a < b & c", "seconds": 0.1} for name in effects]
    summary = {
        "patchfem": "0",
        "title": title,
        "kind": kind,
        "outcome": outcome,
        "measures": measures,
        "effects": rows,
        "not_in_scene": ["wear"],
        "warnings": [],
        "notes": [],
        "seconds": {"total": 1.0},
    }
    scene = SceneText("scene-file", 'title = "<b>"', "")
    return RunData(scene, Verdict(summary, Outcome(outcome).sentence), {"python": "3"})


def make_patch_data(load=1.0, frames=1, effects=("contact",)) -> RunData:
    """Return the data of a patch with a Hertzian pressure over a tenth of 10 mm and a stress that decays with depth."""
    x = np.linspace(-5e-3, 5e-3, 201)
    sigma = load * 5e7 * np.sqrt(np.maximum(0, 1 - (x / 0.5e-3) ** 2))
    data = make_run_data(
        "patch",
        "done" if load else "no_contact",
        effects,
        {
            "contact_fraction": make_measure(0.1 * load, "1", 0.005),
            "pressure_peak": make_measure(5e7 * load, "Pa", 2e4),
            "moment": make_measure(3.2e-16, "N m", 4.1e-16),
            "contact_half_width": make_measure(5e-4 * load, "m", 1e-6),
        },
    )
    fields = {"time": np.arange(frames) * 1e-3, "normal_stress": np.tile(sigma, (frames, 1))}
    if frames > 1:
        fields["shear_stress"] = 0.3 * sigma * np.sin(np.arange(frames))[:, None]
    return replace(data, patch=PressedPatch(x, fields=fields))


def make_rig_data(
    cycles=60.0, title="a title", effects=("contact", "contact.coating", "structure")
) -> RunData:
    """Return the data of a rig in steady state over a patch, with a table of measured responses.

    Before the last three cycles only the reversals are stored.
    """
    n_full_cycles = min(cycles, 3.0)
    last_times = np.linspace(
        (cycles - n_full_cycles) * PERIOD, cycles * PERIOD, round(n_full_cycles * 400) + 1
    )
    reversal_times = (np.arange(0, 2 * (cycles - n_full_cycles)) / 2 + 0.25) * PERIOD
    time = np.concatenate([reversal_times, last_times])
    wave = {t.size: np.sin(2 * np.pi * t / PERIOD) for t in (last_times, time)}
    displacement = 1.4808e-5 * wave[time.size]
    last_wave = wave[last_times.size]
    data = make_patch_data(frames=5, effects=effects)
    summary = data.verdict.summary
    summary |= {"kind": "rig", "outcome": "steady", "title": title}
    summary["measures"] |= {
        "relative_displacement_amplitude": make_measure(1.48081e-5, "m", 4.1e-8),
        "absolute_acceleration_peak": make_measure(5.2 * G_N, "m s-2", 0.1),
        "loop_area": make_measure(1.96e-3, "J", 5.8e-6),
        "slip_start_phase": make_measure(2.89849, "rad", 1.6),
    }
    rows = [
        SimpleNamespace(
            frequency=143.0, input=5 * G_N, acceleration=6 * G_N, displacement=0.23 * MIL, flag=""
        ),
        SimpleNamespace(
            frequency=143.0, input=8 * G_N, acceleration=None, displacement=None, flag="U"
        ),
    ]
    motion = Motion(
        history={"time": time, "displacement": displacement, "force": 30 * wave[time.size]},
        window={
            "time": last_times,
            "displacement": 1.4808e-5 * last_wave,
            "acceleration": 50 * last_wave,
            "base": 49 * last_wave,
        },
        loop={
            "slide": 1.4808e-5 * last_wave,
            "force": 30 * np.cos(2 * np.pi * last_times / PERIOD),
            "time": last_times,
        },
        period=PERIOD,
    )
    return replace(
        data,
        verdict=replace(data.verdict, engine="march", cycles=cycles),
        motion=motion,
        measured=Measured(rows, (1.0, 1.0), 143.0, 5 * G_N),
    )


def make_bench_data() -> RunData:
    """Return the data of a point contact under two cycles of a slide."""
    data = make_run_data(
        "bench",
        "done",
        ("normal", "friction.law=coulomb"),
        {
            "friction_ratio_peak": make_measure(0.3, "1", 1e-6),
            "loop_area": make_measure(1e-3, "J", 1e-9),
        },
    )
    time = np.linspace(0, 0.02, 401)
    slide = 1e-5 * np.sin(200 * np.pi * time)
    force = 30 * np.cos(200 * np.pi * time)
    motion = Motion(
        {"time": time, "displacement": slide, "force": force},
        {"slide": slide, "force": force, "time": time},
    )
    return replace(data, verdict=replace(data.verdict, cycles=2.0), motion=motion)


PAGES = {
    "patch": make_patch_data,
    "no contact": lambda: make_patch_data(load=0.0),
    "rig": make_rig_data,
    "short": lambda: make_rig_data(0.3),
    "bench": make_bench_data,
}


@pytest.fixture(scope="module")
def run_pages():
    """Return the data and the page of each entry of PAGES, by name."""
    return {name: (data := make(), report.page_html(data)) for name, make in PAGES.items()}


class PageParser(HTMLParser):
    """Parser that collects the ids, links, tags and table cells of a page."""

    def __init__(self, text):
        """Parse the text of a page."""
        super().__init__()
        self.ids = []
        self.links = []
        self.tags = []
        self.cells = []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        """Collect the tag, its id and its links."""
        self.tags.append(tag)
        for name, value in attributes:
            if name == "id":
                self.ids.append(value)
            if name in ("href", "xlink:href", "src"):
                self.links.append(value)

    def handle_data(self, text):
        """Collect the text of a table cell."""
        if self.tags[-1:] == ["td"]:
            self.cells.append(text)


@pytest.mark.parametrize("name", PAGES)
def test_always_page_is_accessible_to_screen_readers(name, run_pages):
    """The pages of all kinds of runs have the labels and headings that screen readers need."""
    assert find_accessibility_errors(run_pages[name][1]) == []


def verdict_text(page) -> str:
    """Return the verdict of a page without markup."""
    return re.sub(r"<[^>]+>", "", re.search(r"<p class=verdict>(.*?)</p>", page)[1])


@pytest.mark.parametrize("name", PAGES)
def test_always_page_is_self_contained(run_pages, name):
    """The page is one file below 3 MB without external resources; its links point to the page or to result files."""
    text = run_pages[name][1]
    content = strip_scripts(text)
    parsed = PageParser(content)
    assert not {"link", "iframe", "img", "object", "metadata"} & set(parsed.tags)
    assert all(link.startswith("#") or link in dict(report.RESULT_FILES) for link in parsed.links)
    assert "http" not in content and "@import" not in content and "url(" not in content
    assert not re.search(r"<script[^>]* src", text) and len(text.encode()) < 3e6


@pytest.mark.parametrize("name", PAGES)
def test_always_ids_are_unique_and_links_resolve(run_pages, name):
    """The ids of a page are unique, and each internal link and chart has its element."""
    text = run_pages[name][1]
    parsed = PageParser(strip_scripts(text))
    assert len(parsed.ids) == len(set(parsed.ids))
    anchors = {link[1:] for link in parsed.links if link.startswith("#")}
    anchors |= {chart["anchor"] for chart in read_page_data(text).get("charts", [])}
    assert anchors and anchors <= set(parsed.ids)


def test_exact_charts_agree_with_run(run_pages):
    """The charts contain the loop, the history and the pressure of the run in customary units, within 1e-5."""
    data, text = run_pages["rig"]
    chart_by_title = read_charts(text)
    loop = chart_by_title["Friction loop", "friction force"]["marks"][0]
    np.testing.assert_allclose(loop["x"], data.motion.loop["slide"] * 1e6, rtol=1e-8)
    np.testing.assert_allclose(loop["y"], data.motion.loop["force"], rtol=1e-8)
    history = chart_by_title["Whole run", "displacement"]
    band, last_line = history["marks"]
    assert band["kind"] == "band" and max(band["high"]) == pytest.approx(14.808, rel=1e-6)
    assert last_line["x"][-1] == pytest.approx(
        60 * PERIOD * 1e3 if history["x"]["unit"] == "ms" else 60 * PERIOD
    )
    pressure = chart_by_title["Pressure on the interface", "normal stress"]
    x = np.array(pressure["marks"][1]["x"])
    sigma = np.array(pressure["marks"][1]["y"])
    assert pressure["x"]["unit"] == "um" and pressure["y"]["unit"] == "MPa"
    np.testing.assert_allclose(sigma, 50 * np.sqrt(np.maximum(0, 1 - (x / 500) ** 2)), atol=1e-5)
    # the axis covers the part in contact
    assert -700 < pressure["x"]["range"][0] < -500 and 500 < pressure["x"]["range"][1] < 700
    assert [
        mark["name"] for mark in chart_by_title["Acceleration at 143 Hz", "acceleration"]["marks"]
    ] == [
        "unstable in the test",
        "measured",
        "computed",
    ]


@pytest.mark.parametrize("name", PAGES)
def test_always_page_begins_with_verdict(run_pages, name):
    """The page begins with the verdict, before figures and tables, and lists every measure."""
    data, text = run_pages[name]
    start = text.index("<p class=verdict>")
    assert all(tag not in text[:start] for tag in ("<figure", "<table", "<h2"))
    assert verdict_text(text).startswith(
        f"{data.verdict.summary['outcome']}: {data.verdict.sentence}"
    )
    assert set(data.verdict.summary["measures"]) <= set(PageParser(text).cells)


def test_always_page_shows_no_backquotes(run_pages):
    """Notes, warnings, captions and meanings of measures show no backquotes.

    Scenes and commands are shown as written.
    """
    key = "`structure.travel`"
    meaning = MOTION["stick_fraction"].text
    assert "`slip_amplitude`" in meaning
    data = make_run_data(
        "rig", "steady", ["friction"], {"stick_fraction": make_measure(0.5, "1", 0.01)}
    )
    data.verdict.summary["notes"] = [f"raise {key}"]
    data.verdict.summary["warnings"] = [f"lower {key}"]
    data.verdict.means["stick_fraction"] = meaning
    text = report.page_html(data)
    assert text.count("<code>structure.travel</code>") == 2
    assert "as in <code>slip_amplitude</code>" in text
    for whole in (text, *(page for _, page in run_pages.values())):
        visible = re.sub(r"(?s)<(script|style|pre)\b.*?</\1>", "", whole)
        assert "`" not in visible


def test_always_page_without_contact_has_no_charts(run_pages):
    """The page of a patch without contact has no charts and states its verdict once."""
    data, text = deepcopy(run_pages["no contact"])
    assert "<script" not in text and verdict_text(text) == f"no_contact: {data.verdict.sentence}"
    data.verdict.summary["warnings"] = [data.verdict.sentence, "another one"]
    assert report.page_html(data).count(data.verdict.sentence) == 1


def test_always_incomplete_cycle_has_no_values_per_cycle(run_pages):
    """The verdict of less than one cycle states no dissipation per cycle."""
    assert "1.9600 ± 0.0058 mJ dissipated per cycle" in verdict_text(run_pages["rig"][1])
    assert "per cycle" not in verdict_text(
        run_pages["short"][1]
    ) and "In 0.3 of a cycle" in verdict_text(run_pages["short"][1])


def test_always_heading_is_title_or_file_name():
    """The heading of a page is the title of the scene, else the name of its file."""
    data = make_rig_data(title="")
    assert "<h1>scene-file</h1>" in report.page_html(data)
    data = replace(data, source=replace(data.source, name=""))
    assert "<h1>patchfem run</h1>" in report.page_html(data)
    assert "&lt;b&gt;" in report.page_html(data)


@pytest.mark.parametrize(
    "name, value, unit, error, text",
    [
        ("relative_displacement_amplitude", 1.48081e-5, "m", 1.9e-8, "0.58300 mil"),
        ("slip_start_phase", 2.898, "rad", 0.0012, ""),
        ("pressure_centre", 3.4e-18, "m", 4.5e-18, ""),  # the value is zero within its error
        ("drift_per_cycle", 8.1e-22, "m", 1e-25, ""),  # the value is smaller than any unit shows
        ("pressure_peak", 7.9044e6, "Pa", 4.5e5, "1.146 ksi"),
        ("contact_fraction", 0.2225, "1", 0.005, ""),
        ("normal_stiffness", 5.3907e8, "N m-1", 1.7e6, "3078.2 klbf/in"),
    ],
)
def test_exact_imperial_units_follow_magnitude(name, value, unit, error, text):
    """Values are given in imperial units of suitable size, or not at all if they are zero within their error."""
    assert sentences.format_imperial(name, make_measure(value, unit, error)) == text


def test_exact_envelope_joins_reversals_of_cycles():
    """The envelope of a history joins the reversals of each cycle, with gaps at cycles that are missing."""
    number = np.arange(20)
    time = (number / 2 + 0.25) * PERIOD
    high = 1 + number // 2
    is_stored = (number // 2 != 3) & (number // 2 != 4)
    centres, low, top = charts.cycle_envelope(
        time[is_stored], ((-1.0) ** number * high)[is_stored], PERIOD
    )
    assert centres == pytest.approx((np.arange(10) + 0.5) * PERIOD)
    assert np.isnan(low[3:5]).all() and np.isnan(top[3:5]).all()
    present = np.array([0, 1, 2, 5, 6, 7, 8, 9])
    assert np.array_equal(top[present], present + 1) and np.array_equal(
        low[present], -present - 1.0
    )


def test_exact_caption_names_cycles_with_peak_at_edge():
    """The caption of the wear names the cycles at which the peak pressure lies at the edge, and its largest height."""
    history = {"cycle": np.array([0, 2e4, 5e4]), "pressure_peak_at_edge": np.array([0, 3e6, 2e6])}
    states = {"time": np.array([0, 5e4 * PERIOD]), "normal_stress": np.ones((2, 201))}
    states["worn_depth"] = np.ones((2, 201))
    data = make_patch_data()
    wear = SimpleNamespace(history=history, states=states, period=PERIOD)
    data = replace(data, evaluations=replace(data.evaluations, wear=wear))
    caption = report.find_picture("wear", data).caption
    assert "After 20000, 50000 cycles the peak pressure" in caption
    assert "up to 3 MPa above" in caption or "up to 3.0 MPa above" in caption


def test_exact_contact_range_and_extrapolated_fraction():
    """If the extrapolated contact fraction differs from that of the finest mesh, the sentence states both.

    Otherwise 59.2 % would contradict the range of -1.724 to 1.724 mm, which is 57.5 %.
    """
    contact = {"from": -3e-3, "to": 3e-3, "stretches": [[-1.724e-3, 1.724e-3]]}
    assert sentences.describe_contact(contact, 0.592) == (
        ", from x = -1.724 to 1.724 mm on the finest mesh (57.5 %; the fraction "
        "before is extrapolated from all meshes)"
    )
    assert (
        sentences.describe_contact(contact, 1.724 / 3)
        == sentences.describe_contact(contact)
        == ", from x = -1.724 to 1.724 mm"
    )
