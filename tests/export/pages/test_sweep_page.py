"""The page of a sweep: one file, nothing fetched, texts shown as texts, numbers as they came."""

import json
import re

import numpy as np
import pytest
from chromium import LATER
from page_data import data_of, own_part, swept_key, swept_measure, swept_table, unheard

from patchfem.export import shorten_number
from patchfem.export.pages import library
from patchfem.export.pages.document import Section, document_html, figure_html, to_json
from patchfem.export.pages.document import table_html as sheet
from patchfem.export.pages.headline import span_sentence
from patchfem.export.pages.sweep import page_html
from patchfem.export.sweeps.page import join_tables, suits_log_axis

NAN = np.nan
AMPLITUDE = "relative_displacement_amplitude"


def test_exact_numbers_stand_in_the_page_in_the_unit_they_were_written_in(table):
    data = data_of(page_html(table))
    assert data["keys"][0]["unit"] == "mrad" and data["keys"][1]["unit"] == "N"
    np.testing.assert_allclose(
        data["keys"][0]["values"], table["keys"][0]["values"] * 1e3, rtol=1e-9
    )
    shown = next(one for one in data["measures"] if one["name"] == AMPLITUDE)
    assert shown["unit"] == "um" and shown["values"][7] is None
    rest = np.arange(12) != 7
    np.testing.assert_allclose(
        np.array(shown["values"], float)[rest],
        table["measures"][shown["name"]]["values"][rest] * 1e6,
        rtol=1e-8,
    )
    np.testing.assert_allclose(
        np.array(shown["errors"], float)[rest] / np.array(shown["values"], float)[rest],
        0.01,
        rtol=1e-8,
    )
    assert data["along"] == "contact.tilt.angle" and data["first"] == AMPLITUDE


def test_exact_a_key_of_words_carries_the_word_of_each_of_its_numbers(table):
    assert [one["words"] for one in data_of(page_html(table))["keys"]] == [None, None]
    table["keys"][0] |= {
        "name": "friction.law",
        "values": np.arange(12) % 3.0,
        "unit": "1",
        "log": False,
        "texts": [["coulomb", "iwan", "tanh"][case % 3] for case in range(12)],
    }
    law, load = data_of(page_html(table))["keys"]
    assert law["words"] == [[0.0, "coulomb"], [1.0, "iwan"], [2.0, "tanh"]]
    assert load["words"] is None


def test_always_one_file_below_three_megabytes_that_fetches_nothing(table):
    text = page_html(table)
    assert len(text.encode()) < 3e6
    targets = re.findall(r"(?:src|href)=[\"']?([^\"' >]+)", own_part(text))
    assert targets and all(re.match(r"#|sweep\.|cases/", one) for one in targets)
    assert not re.search(r"@import|url\(", own_part(text))


def test_always_texts_from_outside_are_shown_as_texts(table):
    whole = page_html(table)
    text = own_part(whole)
    assert "Tilt &lt;/script&gt;&lt;b&gt;&amp;amp;" in text
    for foreign in ("<b>&amp;", "<i>a scene", "<i>peak", "<refused>"):
        assert foreign not in text
    assert whole.count("</script>") == 5


@pytest.mark.parametrize(
    "value, error, shown",
    [
        (15.3131, 0.02, "15.313 ± 0.020"),
        (1.0, 1e-9, "1"),
        (0.0, 0.0, "0"),
        (2.0422, np.nan, "2.0422"),
        (np.nan, 0.1, "&ndash;"),
        (0.12345678, 1e-4, "0.12346 ± 0.00010"),
        (-3.0, 7.0, "-3.0 ± 7.0"),
    ],
)
def test_exact_a_case_shows_its_error_where_its_digits_do_not(table, value, error, shown):
    one = table["measures"][AMPLITUDE]
    one |= {"unit": "1", "values": np.full(12, value), "errors": np.full(12, error)}
    one["values"][3] = 7.25  # so that the measure changes from case to case
    assert page_html(table).count(f"<td class=n>{shown}</td>") >= 11


def test_exact_the_scene_is_named_beneath_the_keys_that_were_swept(table):
    text = own_part(page_html(table | {"of": "<a> rig tilted by 0.1 mrad"}))
    # and no seconds: those of all processes are neither wall nor CPU
    assert "patchfem 1.2.3</p>" in text
    assert "<p class=soft>Scene: &lt;a&gt; rig tilted by 0.1 mrad &middot; patchfem " in text


def test_always_a_measure_without_any_value_is_not_offered_and_a_failed_case_is_told(table):
    text = page_html(table)
    assert "loop_area" not in [one["name"] for one in data_of(text)["measures"]]
    assert (
        "<b>12 cases</b> over contact.tilt.angle × normal.load: 10 steady, 1 failed, 1 grows."
        in text
    )
    assert "<i>grows</i>: The amplitude still grows at the end of the run, and" in text
    assert "<i>steady</i>" not in text and "<i>failed</i>" not in text
    assert "1 case failed: normal.load: &lt;refused&gt;" in text


def test_always_a_sweep_without_a_value_has_a_page_without_pictures(table):
    for one in table["measures"].values():
        one["values"] = np.full(12, np.nan)
    text = page_html(table)
    assert "No case has a value to draw" in text and "<script" not in text


def test_always_many_cases_are_thinned_to_a_page_below_three_megabytes_with_all_extremes():
    n_cases = 200_000
    random = np.random.default_rng(3)
    keys = [
        swept_key(name, random.uniform(1, 2, n_cases), "N")
        for name in ("normal.load", "drive.force")
    ]
    measures = {
        f"loop_area{k}": swept_measure(
            random.normal(size=n_cases), random.uniform(0, 1e-4, n_cases), "J"
        )
        for k in range(30)
    }
    outcome = ["steady" if case % 3 else "grows" for case in range(n_cases)]
    outcome[777] = "stuck"
    folders = [f"cases/{case}" for case in range(n_cases)]
    text = page_html(swept_table(keys, measures, outcome=outcome, folders=folders, grid=False))
    data = data_of(text)
    assert len(text.encode()) < 3e6
    assert f"{len(data['outcome'])} of {n_cases} cases are drawn" in text
    cases = [int(link.removeprefix("cases/")) for link in data["links"]]
    assert len(set(cases)) == len(cases) > 1000 and (cases[0], cases[-1]) == (0, n_cases - 1)
    assert data["outcome"] == [outcome[case] for case in cases] and not data["whole"]
    for shown, measure in zip(data["measures"], measures.values()):
        np.testing.assert_allclose(shown["values"], measure["values"][cases], rtol=1e-6)
        np.testing.assert_allclose(shown["errors"], measure["errors"][cases], rtol=5e-3)
    for column in (*keys, *measures.values()):
        assert {np.argmin(column["values"]), np.argmax(column["values"])} <= set(cases)


def test_always_a_grid_that_is_too_large_is_thinned_to_points_with_its_extremes():
    places = [grid.ravel() for grid in np.meshgrid(np.arange(500), np.arange(100), indexing="ij")]
    n_cases = places[0].size
    values = np.random.default_rng(4).normal(size=n_cases)
    keys = [swept_key(f"key{k}", place) for k, place in enumerate(places)]
    text = page_html(swept_table(keys, {"loop_area": swept_measure(values, 1e-3)}))
    data = data_of(text)
    shown = np.array([key["values"] for key in data["keys"]])
    assert len(text.encode()) < 3e6 and 400 < shown.shape[1] < n_cases and not data["grid"]
    assert f"{shown.shape[1]} of {n_cases} cases are drawn: evenly spaced cases" in text
    cases = np.ravel_multi_index(shown.astype(int), (500, 100))
    assert {int(np.argmax(values)), int(np.argmin(values))} <= set(cases.tolist())


def test_exact_a_key_written_in_several_units_is_shown_in_that_of_its_numbers(table):
    load = table["keys"][1]
    load["texts"] = ["10 N" if value == 10 else f"{value / 1e3:g} kN" for value in load["values"]]
    shown = data_of(page_html(table))["keys"][1]
    assert shown["unit"] == "N" and shown["values"] == load["values"].tolist()


@pytest.mark.parametrize(
    "text, shown",
    [
        ("3.16227766016838e-06 rad", "3.16228e-6 rad"),
        ("26 lbf", "26 lbf"),
        ("0.0001 rad", "0.0001 rad"),
        ("nonlocal", "nonlocal"),
        ("0.123456789", "0.123457"),
    ],
)
def test_exact_long_numbers_are_shown_short(text, shown):
    assert shorten_number(text) == shown


def test_exact_numbers_that_are_not_finite_are_null():
    given = {
        "a": [np.nan, np.inf, 1 / 3],
        "b": np.float64(2.0),
        "c": (np.int64(3), "x", None),
        4: True,
    }
    assert json.loads(to_json(given)) == {
        "a": [None, None, 0.333333333],
        "b": 2.0,
        "c": [3, "x", None],
        "4": True,
    }


def test_exact_a_script_cannot_end_its_element():
    assert (
        library.escape_script("a</script>b<!--c</SCRIPT x</p")
        == "a<\\/script>b<\\!--c<\\/SCRIPT x</p"
    )
    hostile = document_html("t", "", [], {"x": "</script><!--"}, ("figures.js",))
    assert data_of(hostile) == {"x": "</script><!--"}


@pytest.mark.share(2)
@pytest.mark.parametrize(
    "off", [slice(0, 3), slice(9, 12), slice(None)], ids=["first", "last", "all"]
)
def test_always_a_browser_draws_a_sweep_that_does_not_settle_at_an_end(table, browser, off):
    """A shading without a left or right end once left the picture out."""
    table["outcome"] = np.array(table["outcome"], object)
    table["outcome"][off] = "grows"
    seen = browser(page_html(table))
    assert re.search(r'<div id="?chart"?[^>]*>\s*<div', seen), "no picture in its place"


def test_exact_labels_of_a_logarithmic_axis_are_numbers_that_people_read(chromium, table):
    """An axis from 0.05 to 3 once had labels from 0.5 on alone, one from 1e-7 powers of ten."""
    chromium.opened(page_html(table))
    for ends, labels in (
        ((0.05, 3), [0.05, 0.1, 0.2, 0.5, 1, 2]),
        ((0.9, 40), [1, 2, 5, 10, 20]),
        ((2.1, 3.4), [2.5, 3]),
        ((2e-7, 0.19), [1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1]),
        ((0.04, 700), [0.1, 0.3, 1, 3, 10, 30, 100, 300]),
    ):
        assert chromium.js(f"pictures.readable({ends[0]}, {ends[1]})") == pytest.approx(
            labels, rel=1e-12
        )
    assert chromium.js("[2e-6, 0.05, 3, 2e7].map(pictures.short)") == ["2e-6", "0.05", "3", "2e7"]
    assert not chromium.faults


def test_exact_values_over_two_decades_have_a_logarithmic_axis_and_what_misses_the_tolerance_is_hollow(
    chromium, table
):
    amplitude = table["measures"][AMPLITUDE]
    amplitude["values"] = 1e-9 * 4.0 ** np.arange(12)
    # the bars go below 0
    amplitude["errors"] = amplitude["values"] * np.where(np.arange(12) < 3, 2.0, 1e-3)
    text = page_html(table | {"tolerance": 0.01})
    assert text.count(
        "<td class=n data-over>"
    ) == 3 and "3 of 12 cases miss the tolerance of 1 %" in own_part(text)
    held = """Bokeh.documents[Bokeh.documents.length - 1].roots()[0]"""
    hollow = f"""{held}.renderers.filter((r) => r.glyph.type === 'Scatter').flatMap((r) =>
        r.data_source.get_array('fill')).filter((c) => c === pictures.ink('--paper')).length"""
    for dark in (False, True):
        chromium.opened(text, dark=dark)
        assert chromium.js("document.getElementById('log').checked") is True
        assert chromium.js(f"{held}.y_scale.type") == "LogScale"
        assert chromium.js(hollow) == 3 and not chromium.faults
    chromium.js("document.getElementById('log').click()")
    chromium.settled()
    assert chromium.js(f"{held}.y_scale.type") == "LinearScale" and not chromium.faults
    amplitude["values"] = amplitude["values"] - 2e-9  # one is negative
    chromium.opened(page_html(table))
    assert chromium.js("document.getElementById('log').checked") is False


def test_exact_the_axis_can_be_switched_and_no_band_leaves_it(chromium, table):
    """A band drawn for a wider page once stayed on a phone, beyond the axes."""
    held = "Bokeh.documents[Bokeh.documents.length - 1].roots()[0]"
    for key in table["keys"]:
        key["log"] = True
    chromium.opened(page_html(table), width=420)
    scales = []
    for _ in range(2):
        scales.append(chromium.js(f"{held}.x_scale.type"))
        chromium.js("document.getElementById('log-along').click()")
        chromium.settled()
    assert scales == ["LogScale", "LinearScale"] and not chromium.faults
    kinds = chromium.js(f"[...{held}.references()].map((one) => one.type)")
    assert "VArea" in kinds and "Band" not in kinds
    assert chromium.js("document.documentElement.scrollWidth") <= 420


@pytest.mark.share(1)
@pytest.mark.parametrize("shown", ["lines", "map", "cloud"])
def test_always_a_browser_draws_it(table, browser, shown):
    table["grid"] = shown != "cloud"
    text = page_html(table)
    if shown == "map":
        turn = "const e=document.getElementById('shown');e.value='map';e.dispatchEvent(new Event('change'))"
        text = text.replace("</body>", f"<script>{LATER.format(turn)}</script></body>")
    seen = browser(text)
    words = re.search(r'<p id="?means"?[^>]*>(.*?)</p>', seen, re.S)[1]
    # grid: the loads are lines of their own, so the highest is that of 40 N at 1 mrad: 1e-5 * 5 * 4 = 200 um
    where = "" if shown == "cloud" else ", normal.load 40 N"
    assert f"highest value 200.0 ± 2.0 um at contact.tilt.angle 1 mrad{where}" in words
    assert "2 of 12 cases did not settle" in words
    assert re.search(r'<div id="?chart"?[^>]*>\s*<div', seen), "no picture in its place"


SPANS = {  # measures, cases that count, the sentence
    "the first measure that has values, with its largest relative error": (
        {
            "loop_area": ([NAN] * 3, [NAN] * 3, "J"),
            "pressure_peak": ([2e6, 3.1415926e6, 9e9], [5e3, NAN, 1e9], "Pa"),
        },
        [True, True, False],
        "Pressure peak of the settled cases ranges from 2 MPa to 3.142 MPa, with errors of at most 0.2 %.",
    ),
    "a single value": (
        {"loop_area": ([1e-3, NAN, NAN], [NAN] * 3, "J")},
        [True, True, False],
        "Loop area is 1 mJ.",
    ),
    "the relative error counts: 9e-9 of 9e-3 is less than 1e-9 of 3e-8": (
        {AMPLITUDE: ([2.939e-8, 8.2614e-3], [1e-9, 8e-8], "m")},
        [True, True],
        "Relative displacement amplitude ranges from 29.39 nm to 8.261 mm, with errors of at most 3 %.",
    ),
    "zero within its error": (
        {AMPLITUDE: ([0.0, 1.963e-5], [1e-13, 2e-14], "m")},
        [True, True],
        "Relative displacement amplitude ranges from 0 to 19.63 um.",
    ),
    "round-off is 0 and known absolutely": (
        {
            "loop_area": (
                np.array([4.2e-21, -1.4e-19, 3.7e-2]),
                np.array([1e-11, 1e-11, 7.4e-5]),
                "J",
            )
        },
        [True] * 3,
        "Loop area ranges from 0 to 37 mJ, with errors of at most 0.2 %.",
    ),
    "no value of interest": (
        {"loop_area": ([NAN], [NAN], "J"), "heat": ([1.0], [0.0], "J")},
        [True],
        "",
    ),
}


@pytest.mark.parametrize("measures, settled, sentence", SPANS.values(), ids=SPANS)
def test_exact_the_span_of_the_settled_cases(measures, settled, sentence):
    settled = np.array(settled)
    assert span_sentence(measures, dict.fromkeys(measures, settled), settled) == sentence


def test_exact_the_span_of_the_only_case_that_meets_the_tolerance_says_so():
    measures = {AMPLITUDE: ([2.939e-8, 8.2614e-3], [1e-9, 8e-8], "m")}
    within = {AMPLITUDE: np.array([False, True])}
    assert span_sentence(measures, within, np.ones(2, bool)) == (
        "Relative displacement amplitude in the only case that meets the tolerance in this measure is 8.261 mm, "
        "with errors of at most 0.001 %."
    )


def test_exact_a_fraction_has_percent_in_sentence_table_and_picture():
    values = np.array([1.0, 0.2193, 0.1231])
    measures = {"contact_fraction": (values, np.zeros(3), "1")}
    every = np.ones(3, bool)
    assert (
        span_sentence(measures, {"contact_fraction": every}, every, ("contact_fraction",))
        == "Contact fraction ranges from 12.31 % to 100 %."
    )
    tilt = swept_key("contact.tilt.angle", [0, 1e-4, 2e-4], "rad")
    text = page_html(swept_table([tilt], {"contact_fraction": swept_measure(values)}))
    (shown,) = data_of(text)["measures"]
    assert shown["unit"] == "%" and shown["values"] == pytest.approx([100, 21.93, 12.31])
    assert "contact fraction</a> [%]" in text and "<td class=n>21.93</td>" in text


def test_exact_sweeps_side_by_side_keep_the_numbers_of_their_cases(table):
    other = table | {
        "measures": {"contact_fraction": table["measures"]["contact_fraction"]},
        "outcome": ["steady"] * 12,
        "messages": {0: "another"},
        "keys": table["keys"][::-1],
    }
    joined = join_tables([table, other], ["one", "other"])
    assert joined["messages"] == {7: "normal.load: <refused>", 12: "another"}
    assert joined["outcome"] == table["outcome"] + other["outcome"]
    np.testing.assert_array_equal(
        joined["measures"][AMPLITUDE]["values"],
        np.append(table["measures"][AMPLITUDE]["values"], np.full(12, np.nan)),
    )
    keys = {key["name"]: key for key in joined["keys"]}
    for key in table["keys"]:
        both = keys[key["name"]]
        np.testing.assert_array_equal(both["values"], np.tile(key["values"], 2))
        assert list(both["texts"]) == key["texts"] * 2


def test_exact_a_word_has_one_number_on_the_page_of_several_sweeps(table):
    """Each sweep numbers its words as they come: with coulomb first in one and tanh in the other both were 0."""
    laws = [
        swept_key("friction.law", np.arange(12) % 2, texts=list(words))
        for words in (("coulomb", "tanh") * 6, ("tanh", "iwan") * 6)
    ]
    joined = join_tables([table | {"keys": [law]} for law in laws], ["one", "other"])["keys"][1]
    numbers = dict(zip(joined["texts"], joined["values"]))
    assert numbers == {"coulomb": 0, "tanh": 1, "iwan": 2}
    assert [numbers[text] for text in joined["texts"]] == list(joined["values"])


@pytest.mark.parametrize(
    "values, log",
    [
        ((1.0, 10.0), True),
        ((1.0, 9.9), False),
        ((-1.0, 10.0), False),
        ((0.0, 1.0), False),
        (("a", "b"), False),
        ((5, 1, 60), True),
        ((0.0, 1e-6, 1e-5, 1e-4), True),
        ((1e-3, 0.0, 1e-5), True),
        ((0.0,), False),
        (tuple(range(21)), False),
        ((0.0, 1.0, 9.0), False),
    ],
)
def test_exact_an_axis_of_a_decade_or_more_is_logarithmic(values, log):
    assert suits_log_axis(values) is log


def test_always_a_browser_that_cannot_unpack_says_so(chromium, table):
    text = page_html(table)
    chromium.opened(text)
    assert chromium.js("document.getElementById('old').hidden") and not chromium.faults
    chromium._to(
        text.replace("<body>", "<body><script>delete window.DecompressionStream</script>", 1)
    )
    assert chromium.js("document.getElementById('old').innerText").startswith(
        "The pictures of this page are packed"
    )
    assert chromium.js("document.getElementById('old').offsetHeight") > 0 and not chromium.faults


def test_always_a_page_can_be_heard(table):
    """The sliders of the player had no name once: their labels named the value that stood before them."""
    assert unheard(page_html(table)) == []
    assert unheard(library.read_file("player.html")) == []
    assert (
        unheard(document_html("Ways", "", [Section("a", "Ways", sheet(("", ""), [["held", "1"]]))]))
        == []
    )
    bad = "<html><h1>a</h1><h3>b</h3><label>c <output></output><input></label><svg></svg><th>d</th>"
    assert unheard(bad) == ["<html>", "<input>", "<svg>", "<th>", "h1 before h3"]


def test_always_a_picture_is_one_stop_of_the_tab_key_and_obeys_keys(chromium, table):
    seen = chromium.opened(page_html(table))
    stops = """(function all(node) { return [...node.querySelectorAll('*')].flatMap((one) =>
        [...(one.tabIndex >= 0 ? [one.id] : []), ...(one.shadowRoot ? all(one.shadowRoot) : [])]) })"""
    assert seen.js(f"{stops}(document.getElementById('chart'))") == []
    assert seen.js("document.getElementById('chart').tabIndex") == 0
    assert seen.js("document.getElementById('chart').ariaDescription").startswith("arrow keys move")
    ends = "(({start, end}) => [start, end])(Bokeh.documents.at(-1).roots()[0].y_range)"
    low, high = seen.js(ends)
    seen.js("document.getElementById('chart').focus()")
    seen.pressed("+")
    assert seen.js(ends) == pytest.approx([low + 0.1 * (high - low), high - 0.1 * (high - low)])
    seen.pressed("ArrowUp")
    assert seen.js(ends) == pytest.approx([low + 0.18 * (high - low), high - 0.02 * (high - low)])
    seen.pressed("0")
    assert seen.js(ends) == pytest.approx([low, high])
    assert seen.faults == []


HIDDEN = """[...document.querySelectorAll('.across,.wide,figure')].filter(
    (one) => one.scrollWidth > one.clientWidth + 1).map((one) => one.textContent.slice(0, 40))"""
DOUBLE = """[...document.querySelectorAll('.across,.wide')].filter(
    (one) => one.scrollHeight > one.clientHeight + 1).length"""


def test_always_tables_and_pictures_are_whole_on_a_wide_and_on_a_narrow_page(chromium):
    """At 1400 px the cases were cut beside empty margins; at 420 px the changes scrolled within the page, meanings and
    halves of pictures lay outside."""
    rows = [
        [
            name,
            *(f"<td class=n>{value}</td>" for value in ("1.23456", "0.00012", "1.2 .. 3.4")),
            "um",
            "<td class=soft>distance by which the holders approach each other at x = 0</td>",
        ]
        for name in ("contact_half_width", "rotational_stiffness")
    ]
    heads = ("measure", ">value", ">error", ">95 %", "unit", "what it is")
    cases = sheet(
        [
            "contact.tilt.angle",
            "outcome",
            *(f">absolute acceleration fundamental {k} [um]" for k in range(6)),
        ],
        [["316.228 urad", "steady", *["15.3130 ± 0.0068"] * 6]] * 9,
        "wide",
    )
    svg = "<svg viewBox='0 0 900 300'><text x=880 y=20>x</text></svg>"
    text = document_html(
        "Where",
        "",
        [
            Section(
                "a",
                "A",
                sheet(heads, rows, "wide")
                + sheet(heads, rows, "across many")
                + figure_html(1, svg, "A picture.", "A picture"),
            ),
            Section("cases", "Cases", cases),
        ],
    )
    wide = chromium.opened(text, 1400)
    assert wide.js(HIDDEN) == []
    assert wide.js(DOUBLE) == 0
    assert wide.js("document.body.scrollWidth") <= 1400
    narrow = chromium.opened(text, 420)
    assert [one for one in narrow.js(HIDDEN) if not one.startswith("contact.tilt.angle")] == []
    assert narrow.js(DOUBLE) == 0 and narrow.js("document.documentElement.scrollWidth") <= 420


@pytest.mark.parametrize(
    "links, sentence",
    [
        (["cases/a/report.html", "cases/b/report.html"], "Click on a case to open its page."),
        (
            ["cases/a/summary.json", "cases/b/summary.json"],
            "Click on a case to open its summary.json; <code>--keep pages",
        ),
        (
            ["cases/a/report.html", "cases/b/summary.json"],
            "Click on a case to open its page or its summary.json;",
        ),
        (None, ""),
    ],
)
def test_exact_the_page_says_what_a_click_on_a_case_opens(links, sentence):
    """It promised to open cases of which nothing was kept, and opened raw JSON as if it were a page."""
    keys = [swept_key("normal.load", [1, 2], "N")]
    text = page_html(
        swept_table(keys, {"loop_area": swept_measure([1, 2], unit="J")}, folders=links)
    )
    assert sentence in text and ("Click on a case" in text) == bool(sentence)


def test_exact_names_of_keys_break_behind_dots_and_the_table_of_cases_fits():
    """structure.mode.axial.dampi/ng broke between its letters on a phone, and four keys with six measures did not fit a
    screen of 1400 pixels; a column of round-off, 0 in every row, was among them."""
    names = ["friction.static", "normal.load", "drive.acceleration", "structure.mode.axial.damping"]
    shown = "absolute_acceleration_peak friction_force_peak slip_amplitude friction_work loop_area"
    measures = {name: swept_measure([1, 2]) for name in (AMPLITUDE, *shown.split())}
    measures["energy_balance"] = swept_measure([1e-16, 2e-16])
    keys = [swept_key(name, [1, 2], "N") for name in names]
    text = page_html(swept_table(keys, measures, title="Sweep of " + " × ".join(names), grid=False))
    assert "structure.<wbr>mode.<wbr>axial.<wbr>damping × " not in text.partition("</h1>")[2]
    assert "× structure.<wbr>mode.<wbr>axial.<wbr>damping</h1>" in text
    cases = text[text.index('<section id="cases">') : text.index('<section id="measures">')]
    assert cases.count("<th scope=col") == 4 + 1 + 4
    assert "energy balance" not in cases and "1&nbsp;N" in cases
