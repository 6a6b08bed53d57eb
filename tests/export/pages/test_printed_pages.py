"""Printed pages have the colours of the light theme, also if the screen has the dark theme."""

import io

import numpy as np
import pytest
from chromium import LATER, Chromium

from patchfem.export.drawing import charts
from patchfem.export.pages.document import Section, document_html
from patchfem.export.pages.sweep import page_html

TURN = "const e=document.getElementById('shown');e.value='map';e.dispatchEvent(new Event('change'))"


def stress_page(frame: tuple = ()) -> str:
    """Return a page with a map of stresses over cells and a line, as the page of a run has them.

    `frame` is the size of the map [px].
    """
    x = np.linspace(0.0, 4.0, 5)
    y = np.linspace(0.0, 3.0, 4)
    value = np.add.outer(np.arange(4.0), np.arange(3.0))
    chart_list = [
        charts.make_chart(
            "Von Mises stress",
            charts.make_axis("x", "mm"),
            charts.make_axis("y", "mm"),
            [charts.make_mark("cells", "", x=x, y=y, value=value, top=5.0, unit="MPa")],
        )
        | ({"frame": frame} if frame else {}),
        charts.make_chart(
            "Gap",
            charts.make_axis("x", "mm"),
            charts.make_axis("gap", "um"),
            [charts.make_mark("line", "accent", x=x, y=x**2)],
        ),
    ]
    for number, chart in enumerate(chart_list):
        chart["anchor"] = f"chart-{number}"
    places = "".join(
        f'<div id="{chart["anchor"]}" class=chart role=img></div>' for chart in chart_list
    )
    return document_html(
        "Maps",
        "",
        [Section("maps", "Maps", f"<div class=row>{places}</div>")],
        {"charts": chart_list},
        ("figures.js", "curves.js"),
    )


def sweep_page(table: dict) -> str:
    """Return the page of a sweep with its map selected."""
    return page_html(table).replace("</body>", f"<script>{LATER.format(TURN)}</script></body>")


def printed_chart_pixels(chromium: Chromium, text: str, dark: bool) -> np.ndarray:
    """Return the pixels of the first chart in the print style, after the page was drawn in one theme."""
    import matplotlib.image

    page = chromium.open_html(text, dark=dark)
    assert not page.faults, page.faults
    assert page.evaluate("document.documentElement.dataset.drawn") == ("dark" if dark else "light")
    page.set_theme(dark, "print")
    page.evaluate("new Promise(done => setTimeout(done, 200))")
    page.evaluate(
        "[...document.querySelectorAll('.chart')].find(one => one.offsetWidth).scrollIntoView()"
    )
    left, top, width, height = (
        round(number)
        for number in page.evaluate(
            "(({x, y, width, height}) => [x, y, width, height])([...document.querySelectorAll('.chart')]"
            ".find(one => one.offsetWidth).getBoundingClientRect())"
        )
    )
    image = matplotlib.image.imread(io.BytesIO(page.take_screenshot()))[..., :3]
    return image[max(top, 0) : top + height, left : left + width]


@pytest.mark.share(0)
@pytest.mark.parametrize("kind", ["stress", "sweep"])
def test_exact_printed_map_is_independent_of_theme(chromium, sweep_table, kind):
    """A map printed from the dark and from the light theme has the same colours.

    Earlier the highest stress was the darkest if printed from the dark theme.
    """
    text = stress_page() if kind == "stress" else sweep_page(sweep_table)
    light, dark = (printed_chart_pixels(chromium, text, theme) for theme in (False, True))
    assert light.shape == dark.shape and light.std() > 0.1
    assert np.mean(np.abs(light - dark) > 0.02) < 2e-3


def test_always_dark_page_is_printed_light(chromium):
    """A page in the dark theme is printed in dark on white, and the screen stays dark afterwards."""
    page = chromium.open_html(stress_page(), dark=True)
    styles = (
        "[...document.querySelectorAll('.chart')].map(one => getComputedStyle(one).display + ' ' + "
        "getComputedStyle(one).visibility + ' ' + getComputedStyle(one).filter)"
    )
    assert page.evaluate(styles) == [
        "block visible none",
        "block hidden none",
        "block visible none",
    ]
    assert page.evaluate("document.documentElement.scrollWidth") <= 1200
    page.set_theme(True, "print")
    assert page.evaluate(styles) == [
        "none visible invert(1) hue-rotate(180deg)",
        "block visible none",
        "block visible invert(1) hue-rotate(180deg)",
    ]
    assert page.evaluate("getComputedStyle(document.body).color") == "rgb(28, 36, 48)"
    page.set_theme(False)
    page.evaluate("new Promise(done => setTimeout(done, 300))")
    assert page.evaluate("document.querySelectorAll('.onpaper').length") == 0
    assert page.print_pdf().startswith(b"%PDF")


@pytest.mark.parametrize("width, most", [(27, 1), (60, 3), (300, 9)])
def test_exact_numbers_under_narrow_map_do_not_overlap(chromium, width, most):
    """The axis under a map of a tall narrow piece has only as many numbers as fit under it."""
    page = chromium.open_html(stress_page((width, 270)))
    assert not page.faults, page.faults
    count = page.evaluate(
        "(fig => fig.below[0].ticker.get_ticks(fig.x_range.start, fig.x_range.end, fig.x_range, 0).major"
        ".filter(x => x >= fig.x_range.start && x <= fig.x_range.end).length)"
        "(Bokeh.documents.flatMap(one => one.roots()).find(one => one.frame_width))"
    )
    assert 1 <= count <= most
