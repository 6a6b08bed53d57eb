"""Page of a sweep: one file without external resources, with escaped texts and unchanged numbers."""

import re

import numpy as np
import pytest
from chromium import LATER
from page_data import (
    find_accessibility_errors,
    make_sweep_key,
    make_sweep_measure,
    make_sweep_table,
    read_page_data,
    strip_scripts,
)

from patchfem.export import shorten_number
from patchfem.export.pages import library
from patchfem.export.pages.document import Section, document_html
from patchfem.export.pages.document import table_html as sheet
from patchfem.export.pages.headline import span_sentence
from patchfem.export.pages.sweep import page_html
from patchfem.export.sweeps.page import join_tables, suits_log_axis

NAN = np.nan
AMPLITUDE = "relative_displacement_amplitude"


def test_exact_page_has_numbers_in_input_units(sweep_table):
    """The page holds keys in the units of the input and measures in customary units, with their errors."""
    data = read_page_data(page_html(sweep_table))
    assert data["keys"][0]["unit"] == "mrad" and data["keys"][1]["unit"] == "N"
    np.testing.assert_allclose(
        data["keys"][0]["values"], sweep_table["keys"][0]["values"] * 1e3, rtol=1e-9
    )
    shown = next(measure for measure in data["measures"] if measure["name"] == AMPLITUDE)
    assert shown["unit"] == "um" and shown["values"][7] is None
    valid = np.arange(12) != 7
    np.testing.assert_allclose(
        np.array(shown["values"], float)[valid],
        sweep_table["measures"][shown["name"]]["values"][valid] * 1e6,
        rtol=1e-8,
    )
    np.testing.assert_allclose(
        np.array(shown["errors"], float)[valid] / np.array(shown["values"], float)[valid],
        0.01,
        rtol=1e-8,
    )
    assert data["along"] == "contact.tilt.angle" and data["first"] == AMPLITUDE


def test_exact_key_of_words_has_table_of_words(sweep_table):
    """A key with words as values holds the word of each of its numbers; other keys hold none."""
    assert [key["words"] for key in read_page_data(page_html(sweep_table))["keys"]] == [None, None]
    sweep_table["keys"][0] |= {
        "name": "friction.law",
        "values": np.arange(12) % 3.0,
        "unit": "1",
        "log": False,
        "texts": [["coulomb", "iwan", "tanh"][case % 3] for case in range(12)],
    }
    law, load = read_page_data(page_html(sweep_table))["keys"]
    assert law["words"] == [[0.0, "coulomb"], [1.0, "iwan"], [2.0, "tanh"]]
    assert load["words"] is None


def test_always_page_is_small_and_self_contained(sweep_table):
    """The page is one file below 3 MB that loads no other file and links only files of its folder."""
    text = page_html(sweep_table)
    assert len(text.encode()) < 3e6
    targets = re.findall(r"(?:src|href)=[\"']?([^\"' >]+)", strip_scripts(text))
    assert targets and all(re.match(r"#|sweep\.|cases/", target) for target in targets)
    assert not re.search(r"@import|url\(", strip_scripts(text))


def test_always_foreign_texts_are_escaped(sweep_table):
    """Titles, scenes, meanings and messages with HTML markup are escaped on the page."""
    page = page_html(sweep_table)
    text = strip_scripts(page)
    assert "Tilt &lt;/script&gt;&lt;b&gt;&amp;amp;" in text
    for markup in ("<b>&amp;", "<i>a scene", "<i>peak", "<refused>"):
        assert markup not in text
    assert page.count("</script>") == 5


@pytest.mark.parametrize(
    "value, error, text",
    [
        (15.3131, 0.02, "15.313 ± 0.020"),
        (0.0, 0.0, "0"),
        (2.0422, np.nan, "2.0422"),
        (-3.0, 7.0, "-3.0 ± 7.0"),
    ],
)
def test_exact_case_shows_value_with_error(sweep_table, value, error, text):
    """The table of cases shows values with errors; the error is left out if it is below the shown digits."""
    measure = sweep_table["measures"][AMPLITUDE]
    measure |= {"unit": "1", "values": np.full(12, value), "errors": np.full(12, error)}
    measure["values"][3] = 7.25  # with one other value the measure changes from case to case
    assert page_html(sweep_table).count(f"<td class=n>{text}</td>") >= 11


def test_always_page_lists_outcomes_and_failed_cases(sweep_table):
    """The page counts the outcomes and states the message of a failed case; measures without values are left out."""
    text = page_html(sweep_table)
    assert "loop_area" not in [measure["name"] for measure in read_page_data(text)["measures"]]
    assert (
        "<b>12 cases</b> over contact.tilt.angle × normal.load: 10 steady, 1 failed, 1 grows."
        in text
    )
    assert "<i>grows</i>: The amplitude still grows at the end of the run, and" in text
    assert "<i>steady</i>" not in text and "<i>failed</i>" not in text
    assert "1 case failed: normal.load: &lt;refused&gt;" in text


def test_always_sweep_without_values_has_no_charts(sweep_table):
    """The page of a sweep without any value states this and has no charts."""
    for measure in sweep_table["measures"].values():
        measure["values"] = np.full(12, np.nan)
    text = page_html(sweep_table)
    assert "No case has a value to draw" in text and "<script" not in text


def test_always_page_of_many_cases_keeps_extremes():
    """The page of 60 000 random cases stays below 3 MB and shows a subset of the cases.

    It contains the extremes of every key and measure, with unchanged values.
    """
    n_cases = 60_000
    random = np.random.default_rng(3)
    keys = [
        make_sweep_key(name, random.uniform(1, 2, n_cases), "N")
        for name in ("normal.load", "drive.force")
    ]
    measures = {
        f"loop_area{k}": make_sweep_measure(
            random.normal(size=n_cases), random.uniform(0, 1e-4, n_cases), "J"
        )
        for k in range(30)
    }
    outcome = ["steady" if case % 3 else "grows" for case in range(n_cases)]
    outcome[777] = "stuck"
    folders = [f"cases/{case}" for case in range(n_cases)]
    text = page_html(make_sweep_table(keys, measures, outcome=outcome, folders=folders, grid=False))
    data = read_page_data(text)
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


@pytest.mark.parametrize(
    "text, shortened",
    [
        ("3.16227766016838e-06 rad", "3.16228e-6 rad"),
        ("nonlocal", "nonlocal"),
        ("0.123456789", "0.123457"),
    ],
)
def test_exact_long_numbers_are_shortened(text, shortened):
    """Numbers with many digits are shortened to six digits; other texts are unchanged."""
    assert shorten_number(text) == shortened


def test_exact_data_cannot_end_script_element():
    """Data that contain the end of a script element are escaped, and are read back unchanged."""
    assert (
        library.escape_script("a</script>b<!--c</SCRIPT x</p")
        == "a<\\/script>b<\\!--c<\\/SCRIPT x</p"
    )
    hostile = document_html("t", "", [], {"x": "</script><!--"}, ("figures.js",))
    assert read_page_data(hostile) == {"x": "</script><!--"}


def test_exact_labels_of_logarithmic_axis_are_round(chromium, sweep_table):
    """The labels of a logarithmic axis are round numbers that cover the axis.

    Earlier an axis from 0.05 to 3 had labels only above 0.5.
    """
    chromium.open_html(page_html(sweep_table))
    for ends, labels in (
        ((0.05, 3), [0.05, 0.1, 0.2, 0.5, 1, 2]),
        ((0.9, 40), [1, 2, 5, 10, 20]),
        ((2.1, 3.4), [2.5, 3]),
        ((2e-7, 0.19), [1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1]),
        ((0.04, 700), [0.1, 0.3, 1, 3, 10, 30, 100, 300]),
    ):
        assert chromium.evaluate(f"pictures.readable({ends[0]}, {ends[1]})") == pytest.approx(
            labels, rel=1e-12
        )
    assert chromium.evaluate("[2e-6, 0.05, 3, 2e7].map(pictures.short)") == [
        "2e-6",
        "0.05",
        "3",
        "2e7",
    ]
    assert not chromium.faults


def test_exact_wide_range_has_logarithmic_axis_with_hollow_marks(chromium, sweep_table):
    """Values over more than two decades have a logarithmic axis, and cases that miss the tolerance have hollow marks.

    A negative value makes the axis linear.
    """
    amplitude = sweep_table["measures"][AMPLITUDE]
    amplitude["values"] = 1e-9 * 4.0 ** np.arange(12)
    # the error bars of the first cases extend below 0
    amplitude["errors"] = amplitude["values"] * np.where(np.arange(12) < 3, 2.0, 1e-3)
    text = page_html(sweep_table | {"tolerance": 0.01})
    assert text.count(
        "<td class=n data-over>"
    ) == 3 and "3 of 12 cases miss the tolerance of 1 %" in strip_scripts(text)
    figure = """Bokeh.documents[Bokeh.documents.length - 1].roots()[0]"""
    hollow = f"""{figure}.renderers.filter((r) => r.glyph.type === 'Scatter').flatMap((r) =>
        r.data_source.get_array('fill')).filter((c) => c === pictures.ink('--paper')).length"""
    for dark in (False, True):
        chromium.open_html(text, dark=dark)
        assert chromium.evaluate("document.getElementById('log').checked") is True
        assert chromium.evaluate(f"{figure}.y_scale.type") == "LogScale"
        assert chromium.evaluate(hollow) == 3 and not chromium.faults
    chromium.evaluate("document.getElementById('log').click()")
    chromium.wait_for_charts()
    assert chromium.evaluate(f"{figure}.y_scale.type") == "LinearScale" and not chromium.faults
    amplitude["values"] = amplitude["values"] - 2e-9  # one value is negative
    chromium.open_html(page_html(sweep_table))
    assert chromium.evaluate("document.getElementById('log').checked") is False


@pytest.mark.share(1)
@pytest.mark.parametrize("shown", ["lines", "map", "cloud"])
def test_always_browser_draws_lines_map_and_cloud(sweep_table, load_page, shown):
    """A browser draws a sweep as lines, as a map and as a cloud, and its caption states the highest value."""
    sweep_table["grid"] = shown != "cloud"
    text = page_html(sweep_table)
    if shown == "map":
        script = "const e=document.getElementById('shown');e.value='map';e.dispatchEvent(new Event('change'))"
        text = text.replace("</body>", f"<script>{LATER.format(script)}</script></body>")
    document = load_page(text)
    caption = re.search(r'<p id="?means"?[^>]*>(.*?)</p>', document, re.S)[1]
    # in a grid each load is a line; the highest is that of 40 N at 1 mrad, 1e-5 * 5 * 4 = 200 um
    load_text = "" if shown == "cloud" else ", normal.load 40 N"
    assert f"highest value 200.0 ± 2.0 um at contact.tilt.angle 1 mrad{load_text}" in caption
    assert "2 of 12 cases did not settle" in caption
    assert re.search(r'<div id="?chart"?[^>]*>\s*<div', document), "no picture in its place"


SPANS = {  # measures, steady cases, and the sentence about the range
    "the first measure that has values, with its largest relative error": (
        {
            "loop_area": ([NAN] * 3, [NAN] * 3, "J"),
            "pressure_peak": ([2e6, 3.1415926e6, 9e9], [5e3, NAN, 1e9], "Pa"),
        },
        [True, True, False],
        "Pressure peak of the settled cases ranges from 2 MPa to 3.142 MPa, with errors of at most 0.2 %.",
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
def test_exact_range_of_steady_cases(measures, settled, sentence):
    """The sentence about the range of a measure states the extremes of the steady cases.

    It also states their largest relative error.
    """
    settled = np.array(settled)
    assert span_sentence(measures, dict.fromkeys(measures, settled), settled) == sentence


def test_exact_joined_sweeps_keep_case_numbers(sweep_table):
    """Two sweeps joined in one table keep the order, messages and values of their cases."""
    other = sweep_table | {
        "measures": {"contact_fraction": sweep_table["measures"]["contact_fraction"]},
        "outcome": ["steady"] * 12,
        "messages": {0: "another"},
        "keys": sweep_table["keys"][::-1],
    }
    joined = join_tables([sweep_table, other], ["one", "other"])
    assert joined["messages"] == {7: "normal.load: <refused>", 12: "another"}
    assert joined["outcome"] == sweep_table["outcome"] + other["outcome"]
    np.testing.assert_array_equal(
        joined["measures"][AMPLITUDE]["values"],
        np.append(sweep_table["measures"][AMPLITUDE]["values"], np.full(12, np.nan)),
    )
    keys = {key["name"]: key for key in joined["keys"]}
    for key in sweep_table["keys"]:
        joined_key = keys[key["name"]]
        np.testing.assert_array_equal(joined_key["values"], np.tile(key["values"], 2))
        assert list(joined_key["texts"]) == key["texts"] * 2


def test_exact_joined_sweeps_share_word_numbers(sweep_table):
    """Each word has one number in the table of several sweeps.

    Earlier two sweeps with different first words gave both the number 0.
    """
    laws = [
        make_sweep_key("friction.law", np.arange(12) % 2, texts=list(words))
        for words in (("coulomb", "tanh") * 6, ("tanh", "iwan") * 6)
    ]
    joined = join_tables([sweep_table | {"keys": [law]} for law in laws], ["one", "other"])["keys"][
        1
    ]
    numbers = dict(zip(joined["texts"], joined["values"]))
    assert numbers == {"coulomb": 0, "tanh": 1, "iwan": 2}
    assert [numbers[text] for text in joined["texts"]] == list(joined["values"])


@pytest.mark.parametrize(
    "values, log",
    [
        ((1.0, 9.9), False),
        ((-1.0, 10.0), False),
        (("a", "b"), False),
        ((5, 1, 60), True),
        ((0.0, 1e-6, 1e-5, 1e-4), True),
        ((1e-3, 0.0, 1e-5), True),
        (tuple(range(21)), False),
    ],
)
def test_exact_axis_of_a_decade_is_logarithmic(values, log):
    """An axis of at least one decade is logarithmic, also if one value is 0, but not if values are evenly spaced."""
    assert suits_log_axis(values) is log


def test_always_old_browser_shows_notice(chromium, sweep_table):
    """A browser that cannot decompress the data of a page shows a notice."""
    text = page_html(sweep_table)
    chromium.open_html(text)
    assert chromium.evaluate("document.getElementById('old').hidden") and not chromium.faults
    chromium._load_html(
        text.replace("<body>", "<body><script>delete window.DecompressionStream</script>", 1)
    )
    assert chromium.evaluate("document.getElementById('old').innerText").startswith(
        "The pictures of this page are packed"
    )
    assert (
        chromium.evaluate("document.getElementById('old').offsetHeight") > 0 and not chromium.faults
    )


def test_always_page_is_accessible_to_screen_readers(sweep_table):
    """Pages have a language, labelled inputs and images, table scopes and ordered headings for screen readers.

    A page without them is reported with each fault.
    """
    assert find_accessibility_errors(page_html(sweep_table)) == []
    assert (
        find_accessibility_errors(
            document_html("Ways", "", [Section("a", "Ways", sheet(("", ""), [["held", "1"]]))])
        )
        == []
    )
    faulty_page = (
        "<html><h1>a</h1><h3>b</h3><label>c <output></output><input></label><svg></svg><th>d</th>"
    )
    assert find_accessibility_errors(faulty_page) == [
        "<html>",
        "<input>",
        "<svg>",
        "<th>",
        "h1 before h3",
    ]


def test_always_chart_is_operated_by_keyboard(chromium, sweep_table):
    """A chart is one stop of the tab key; arrow keys move it, and + and 0 change its magnification."""
    page = chromium.open_html(page_html(sweep_table))
    stops = """(function all(node) { return [...node.querySelectorAll('*')].flatMap((one) =>
        [...(one.tabIndex >= 0 ? [one.id] : []), ...(one.shadowRoot ? all(one.shadowRoot) : [])]) })"""
    assert page.evaluate(f"{stops}(document.getElementById('chart'))") == []
    assert page.evaluate("document.getElementById('chart').tabIndex") == 0
    assert page.evaluate("document.getElementById('chart').ariaDescription").startswith(
        "arrow keys move"
    )
    ends = "(({start, end}) => [start, end])(Bokeh.documents.at(-1).roots()[0].y_range)"
    low, high = page.evaluate(ends)
    page.evaluate("document.getElementById('chart').focus()")
    page.press_key("+")
    assert page.evaluate(ends) == pytest.approx(
        [low + 0.1 * (high - low), high - 0.1 * (high - low)]
    )
    page.press_key("ArrowUp")
    assert page.evaluate(ends) == pytest.approx(
        [low + 0.18 * (high - low), high - 0.02 * (high - low)]
    )
    page.press_key("0")
    assert page.evaluate(ends) == pytest.approx([low, high])
    assert page.faults == []
