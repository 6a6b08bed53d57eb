"""The report page: one file that stands alone, says what the run was, and rounds and scales its numbers truly."""

import pickle
import re
import subprocess
import sys
from copy import deepcopy
from dataclasses import replace
from html.parser import HTMLParser
from types import SimpleNamespace

import numpy as np
import pytest
from page_data import charts_of, data_of, own_part, unheard

from patchfem.__main__ import main
from patchfem.core import G_N, Outcome
from patchfem.export import report
from patchfem.export.drawing import charts
from patchfem.export.page_data import Measured, Motion, PressedPatch, RunData, SceneText, Verdict
from patchfem.export.pages import sentences
from patchfem.export.pages.document import sentence_html
from patchfem.response import TABLE as MOTION

PERIOD, MIL = 1 / 143, 25.4e-6


def measure(value, unit, error=None):
    return {"value": value, "unit": unit, "error": error, "floor": 0.0}


def base(kind, outcome, effects, measures, title="a title") -> RunData:
    """What every page is made of; the rest is added per kind."""
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


def patch(load=1.0, frames=1, effects=("contact",)) -> RunData:
    """A Hertzian pressure over a tenth of 10 mm, and a stress that fades with depth."""
    x = np.linspace(-5e-3, 5e-3, 201)
    depth = np.linspace(0, 5e-3, 21)
    sigma = load * 5e7 * np.sqrt(np.maximum(0, 1 - (x / 0.5e-3) ** 2))
    data = base(
        "patch",
        "done" if load else "no_contact",
        effects,
        {
            "contact_fraction": measure(0.1 * load, "1", 0.005),
            "pressure_peak": measure(5e7 * load, "Pa", 2e4),
            "moment": measure(3.2e-16, "N m", 4.1e-16),
            "contact_half_width": measure(5e-4 * load, "m", 1e-6),
        },
    )
    fields = {"time": np.arange(frames) * 1e-3, "normal_stress": np.tile(sigma, (frames, 1))}
    if frames > 1:
        fields["shear_stress"] = 0.3 * sigma * np.sin(np.arange(frames))[:, None]
    mises = np.tile((sigma[1:] + sigma[:-1])[:, None] / 2 * np.exp(-depth[1:] / 1e-3), (2, 1, 1))
    bodies = {
        "x": x,
        "depth": (depth, depth),
        "coating": (0.0, 0.25e-3),
        "mises": mises,
        "pressure": sigma,
    }
    return replace(data, patch=PressedPatch(x, fields=fields, bodies=bodies))


def rig(
    cycles=60.0, title="a title", effects=("contact", "contact.coating", "structure")
) -> RunData:
    """A settled sine over `cycles`, its reversals alone before the last three cycles, over a patch, with a table."""
    keep = min(cycles, 3.0)
    late = np.linspace((cycles - keep) * PERIOD, cycles * PERIOD, round(keep * 400) + 1)
    early = (np.arange(0, 2 * (cycles - keep)) / 2 + 0.25) * PERIOD
    time = np.concatenate([early, late])
    wave = {t.size: np.sin(2 * np.pi * t / PERIOD) for t in (late, time)}
    whole = 1.4808e-5 * wave[time.size]
    end = wave[late.size]
    data = patch(frames=5, effects=effects)
    summary = data.verdict.summary
    summary |= {"kind": "rig", "outcome": "steady", "title": title}
    summary["measures"] |= {
        "relative_displacement_amplitude": measure(1.48081e-5, "m", 4.1e-8),
        "absolute_acceleration_peak": measure(5.2 * G_N, "m s-2", 0.1),
        "loop_area": measure(1.96e-3, "J", 5.8e-6),
        "slip_start_phase": measure(2.89849, "rad", 1.6),
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
        history={"time": time, "displacement": whole, "force": 30 * wave[time.size]},
        window={
            "time": late,
            "displacement": 1.4808e-5 * end,
            "acceleration": 50 * end,
            "base": 49 * end,
        },
        loop={
            "slide": 1.4808e-5 * end,
            "force": 30 * np.cos(2 * np.pi * late / PERIOD),
            "time": late,
        },
        period=PERIOD,
    )
    return replace(
        data,
        verdict=replace(data.verdict, engine="march", cycles=cycles),
        motion=motion,
        measured=Measured(rows, (1.0, 1.0), 143.0, 5 * G_N),
    )


def bench() -> RunData:
    """Two cycles of a slide at one point."""
    data = base(
        "bench",
        "done",
        ("normal", "friction.law=coulomb"),
        {"friction_ratio_peak": measure(0.3, "1", 1e-6), "loop_area": measure(1e-3, "J", 1e-9)},
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
    "patch": patch,
    "no contact": lambda: patch(load=0.0),
    "rig": rig,
    "short": lambda: rig(0.3),
    "bench": bench,
}


@pytest.fixture(scope="module")
def pages():
    return {name: (data := make(), report.page_html(data)) for name, make in PAGES.items()}


class Parsed(HTMLParser):
    """Ids, references, tags and the first cell of each table row."""

    def __init__(self, text):
        super().__init__()
        self.ids = []
        self.links = []
        self.tags = []
        self.cells = []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        for name, value in attributes:
            if name == "id":
                self.ids.append(value)
            if name in ("href", "xlink:href", "src"):
                self.links.append(value)

    def handle_data(self, text):
        if self.tags[-1:] == ["td"]:
            self.cells.append(text)


@pytest.mark.parametrize("name", PAGES)
def test_always_a_page_can_be_heard(name, pages):
    assert unheard(pages[name][1]) == []


def captions(page) -> str:
    return " ".join(re.findall(r"<figcaption>(.*?)</figcaption>", page))


def spoken(page) -> str:
    """The verdict as it is read."""
    return re.sub(r"<[^>]+>", "", re.search(r"<p class=verdict>(.*?)</p>", page)[1])


@pytest.mark.parametrize("name", PAGES)
def test_always_one_file_that_fetches_nothing(pages, name):
    text = pages[name][1]
    words = own_part(text)
    seen = Parsed(words)
    assert not {"link", "iframe", "img", "object", "metadata"} & set(seen.tags)
    assert all(link.startswith("#") or link in dict(report.RESULT_FILES) for link in seen.links)
    assert "http" not in words and "@import" not in words and "url(" not in words
    assert not re.search(r"<script[^>]* src", text) and len(text.encode()) < 3e6


@pytest.mark.parametrize("name", PAGES)
def test_always_ids_are_unique_and_references_meet_one(pages, name):
    text = pages[name][1]
    seen = Parsed(own_part(text))
    assert len(seen.ids) == len(set(seen.ids))
    wanted = {link[1:] for link in seen.links if link.startswith("#")}
    wanted |= {chart["anchor"] for chart in data_of(text).get("charts", [])}
    assert wanted and wanted <= set(seen.ids)


def test_exact_the_pictures_hold_the_numbers_of_the_run(pages):
    data, text = pages["rig"]
    found = charts_of(text)
    loop = found["Friction loop", "friction force"]["marks"][0]
    np.testing.assert_allclose(loop["x"], data.motion.loop["slide"] * 1e6, rtol=1e-8)
    np.testing.assert_allclose(loop["y"], data.motion.loop["force"], rtol=1e-8)
    whole = found["Whole run", "displacement"]
    band, late = whole["marks"]
    assert band["kind"] == "band" and max(band["high"]) == pytest.approx(14.808, rel=1e-6)
    assert late["x"][-1] == pytest.approx(
        60 * PERIOD * 1e3 if whole["x"]["unit"] == "ms" else 60 * PERIOD
    )
    pressure = found["Pressure on the interface", "normal stress"]
    x = np.array(pressure["marks"][1]["x"])
    sigma = np.array(pressure["marks"][1]["y"])
    assert pressure["x"]["unit"] == "um" and pressure["y"]["unit"] == "MPa"
    np.testing.assert_allclose(sigma, 50 * np.sqrt(np.maximum(0, 1 - (x / 500) ** 2)), atol=1e-5)
    # the part in contact
    assert -700 < pressure["x"]["range"][0] < -500 and 500 < pressure["x"]["range"][1] < 700
    assert [mark["name"] for mark in found["Acceleration at 143 Hz", "acceleration"]["marks"]] == [
        "unstable in the test",
        "measured",
        "computed",
    ]


@pytest.mark.parametrize("name", PAGES)
def test_always_the_verdict_first_and_every_measure_listed(pages, name):
    data, text = pages[name]
    at = text.index("<p class=verdict>")
    assert all(tag not in text[:at] for tag in ("<figure", "<table", "<h2"))
    assert spoken(text).startswith(f"{data.verdict.summary['outcome']}: {data.verdict.sentence}")
    assert set(data.verdict.summary["measures"]) <= set(Parsed(text).cells)


@pytest.mark.parametrize(
    "text, html",
    [
        ("set `wear.jumps` or `a < b`", "set <code>wear.jumps</code> or <code>a &lt; b</code>"),
        ("one ` alone & <b>", "one ` alone &amp; &lt;b&gt;"),
        ("`` and `a` and `b", "`` and <code>a</code> and `b"),
        ("plain", "plain"),
        ("`a\nb`", "`a\nb`"),
    ],
)
def test_exact_a_sentence_on_a_page_has_its_quoted_words_as_code(text, html):
    assert sentence_html(text) == html


def test_always_no_sentence_of_a_page_shows_back_quotes(pages):
    """Notes, warnings, captions and meanings of measures; a scene or a command is shown as it is written."""
    key = "`structure.travel`"
    stick = MOTION["stick_fraction"].text
    assert "`slip_amplitude`" in stick
    data = base("rig", "steady", ["friction"], {"stick_fraction": measure(0.5, "1", 0.01)})
    data.verdict.summary["notes"] = [f"raise {key}"]
    data.verdict.summary["warnings"] = [f"lower {key}"]
    data.verdict.means["stick_fraction"] = stick
    text = report.page_html(data)
    assert text.count("<code>structure.travel</code>") == 2
    assert "as in <code>slip_amplitude</code>" in text
    for whole in (text, *(page for _, page in pages.values())):
        said = re.sub(r"(?s)<(script|style|pre)\b.*?</\1>", "", whole)
        assert "`" not in said


def test_always_captions_speak_of_what_the_run_has(pages):
    words = {name: captions(text) for name, (_, text) in pages.items()}
    assert "shear" not in words["patch"]
    assert "cycle" not in words["patch"]
    assert "coating" not in words["patch"]
    assert "with their coatings" in words["rig"] and "4 instants of the last cycle" in words["rig"]
    assert "over the last 3 cycles" in words["rig"] and "only reversals were kept" in words["rig"]
    assert "instants of the run" in words["short"] and "last cycle" not in words["short"]
    assert "whole run" in words["bench"] and "cycle" not in words["bench"]
    coated = captions(report.page_html(patch(effects=("contact", "contact.coating"))))
    assert "with their coatings under the load." in coated


def test_always_no_picture_where_nothing_touches(pages):
    data, text = deepcopy(pages["no contact"])
    assert "<script" not in text and spoken(text) == f"no_contact: {data.verdict.sentence}"
    data.verdict.summary["warnings"] = [data.verdict.sentence, "another one"]
    assert report.page_html(data).count(data.verdict.sentence) == 1


def test_always_a_part_of_a_cycle_claims_nothing_per_cycle(pages):
    assert "1.9600 ± 0.0058 mJ dissipated per cycle" in spoken(pages["rig"][1])
    assert "per cycle" not in spoken(pages["short"][1]) and "In 0.3 of a cycle" in spoken(
        pages["short"][1]
    )


def test_always_the_heading_is_the_title_or_the_file():
    data = rig(title="")
    assert "<h1>scene-file</h1>" in report.page_html(data)
    data = replace(data, source=replace(data.source, name=""))
    assert "<h1>patchfem run</h1>" in report.page_html(data)
    assert "&lt;b&gt;" in report.page_html(data)


@pytest.mark.parametrize("name", ["rig", "bench"])
def test_exact_the_same_data_give_the_same_bytes(tmp_path, name):
    data = PAGES[name]()
    (tmp_path / "data").write_bytes(pickle.dumps(data))
    code = (
        "import pickle, sys; from patchfem.export.report import page_html; "
        "open(sys.argv[2], 'w', encoding='utf-8').write(page_html(pickle.load(open(sys.argv[1], 'rb'))))"
    )
    subprocess.run(
        [sys.executable, "-c", code, tmp_path / "data", tmp_path / "page.html"],
        check=True,
        env={"PYTHONHASHSEED": "7", "PATH": "", "MPLCONFIGDIR": str(tmp_path)},
    )
    text = report.page_html(deepcopy(data))
    assert text == report.page_html(data) == (tmp_path / "page.html").read_text("utf-8")


@pytest.mark.parametrize(
    "name, value, unit, error, text",
    [
        ("relative_displacement_amplitude_steady", 0.01106, "m", None, "435.433 mil"),
        ("relative_displacement_amplitude", 1.48081e-5, "m", 1.9e-8, "0.58300 mil"),
        ("slip_start_phase", 2.898, "rad", 0.0012, ""),
        ("rotation", 1e-4, "rad", 1e-16, "0.005729578 deg"),
        ("pressure_centre", 3.4e-18, "m", 4.5e-18, ""),  # zero within its error
        ("drift_per_cycle", 8.1e-22, "m", 1e-25, ""),  # smaller than any unit
        ("approach", 0.0, "m", 0.0, ""),
        ("pressure_peak", 7.9044e6, "Pa", 4.5e5, "1.146 ksi"),
        ("contact_fraction", 0.2225, "1", 0.005, ""),
        ("normal_stiffness", 5.3907e8, "N m-1", 1.7e6, "3078.2 klbf/in"),
        ("absolute_acceleration_peak", 5 * G_N, "m s-2", None, ""),
        ("energy_balance", 1e-13, "1", 0.0, ""),
    ],
)
def test_exact_units_follow_the_size(name, value, unit, error, text):
    assert sentences.format_imperial(name, measure(value, unit, error)) == text


def test_exact_the_band_joins_the_reversals_of_each_cycle():
    number = np.arange(20)
    time = (number / 2 + 0.25) * PERIOD
    high = 1 + number // 2
    gone = (number // 2 != 3) & (number // 2 != 4)
    middle, low, top = charts.cycle_envelope(time[gone], ((-1.0) ** number * high)[gone], PERIOD)
    assert middle == pytest.approx((np.arange(10) + 0.5) * PERIOD)
    assert np.isnan(low[3:5]).all() and np.isnan(top[3:5]).all()
    kept = np.array([0, 1, 2, 5, 6, 7, 8, 9])
    assert np.array_equal(top[kept], kept + 1) and np.array_equal(low[kept], -kept - 1.0)


def test_exact_a_run_gives_the_page_what_it_reads(tmp_path):
    (tmp_path / "swing.toml").write_text(
        """\
[structure]
moving_mass = "0.884 kg"
[[structure.mode]]
name = "axial"
frequency = "143 Hz"
damping = 0.02
slide = 1.0
[drive]
kind = "base"
frequency = "143 Hz"
acceleration = "5 g"
cycles = 20
""",
        "utf-8",
    )
    with pytest.raises(SystemExit) as end:
        main(["run", str(tmp_path / "swing.toml"), "-o", str(tmp_path / "out"), "-q"])
    text = (tmp_path / "out" / "report.html").read_text("utf-8")
    assert not end.value.code and "<h1>swing</h1>" in text
    assert "friction" not in captions(text)  # no contact, no friction: the motion alone
    assert [title for title, _ in charts_of(text)] == [
        "Whole run",
        "Last 2 cycles",
        "Last 2 cycles",
    ]


@pytest.mark.parametrize(
    "cell, said",
    [
        ((0, 0), "where the face of the coating meets the end"),
        ((5, 0), ""),
        ((0, 7), ""),
        ((-1, -1), "where the held far face ends"),
    ],
)
def test_exact_a_stress_without_bound_is_named_where_it_is_the_largest(cell, said):
    """Beside a coating a corner showed 6.7 to 8.3 MPa on finer meshes of one pressed pair, without a word."""
    data = patch()
    data.patch.bodies["mises"][1][cell] = 1e9
    caption = report.find_picture("bodies", data).caption
    assert "largest stress in a cell is 1 GPa" in caption and (
        said in caption if said else "bound" not in caption
    )


def test_exact_a_fraction_that_is_extrapolated_is_told_from_the_places_of_the_finest_mesh():
    """59.2 % from x = -1.724 to 1.724 of 6 mm were two answers, as these ends give 57.5 %."""
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
