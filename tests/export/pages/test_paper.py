"""Printed pages: what is drawn in the dark theme has the colours of the light one on paper."""

import io
import re

import numpy as np
import pytest
from chromium import LATER, Chromium

from patchfem.export.drawing import charts, pictures
from patchfem.export.pages.document import PAGE_COLOURS, Section, document_html, figure_html
from patchfem.export.pages.sweep import page_html

TURN = "const e=document.getElementById('shown');e.value='map';e.dispatchEvent(new Event('change'))"


def stress_map() -> str:
    """A page with a map of cells and a line beside it, as a run has them."""
    x = np.linspace(0.0, 4.0, 5)
    y = np.linspace(0.0, 3.0, 4)
    value = np.add.outer(np.arange(4.0), np.arange(3.0))
    drawn = [
        charts.make_chart(
            "Von Mises stress",
            charts.make_axis("x", "mm"),
            charts.make_axis("y", "mm"),
            [charts.make_mark("cells", "", x=x, y=y, value=value, top=5.0, unit="MPa")],
        ),
        charts.make_chart(
            "Gap",
            charts.make_axis("x", "mm"),
            charts.make_axis("gap", "um"),
            [charts.make_mark("line", "accent", x=x, y=x**2)],
        ),
    ]
    for number, one in enumerate(drawn):
        one["anchor"] = f"chart-{number}"
    places = "".join(f'<div id="{one["anchor"]}" class=chart role=img></div>' for one in drawn)
    return document_html(
        "Maps",
        "",
        [Section("maps", "Maps", f"<div class=row>{places}</div>")],
        {"charts": drawn},
        ("figures.js", "curves.js"),
    )


def sweep_map(table: dict) -> str:
    return page_html(table).replace("</body>", f"<script>{LATER.format(TURN)}</script></body>")


def on_paper(chromium: Chromium, text: str, dark: bool) -> np.ndarray:
    """Pixels of the first picture as paper has it, of a page drawn in one theme."""
    import matplotlib.image

    seen = chromium.opened(text, dark=dark)
    assert not seen.faults, seen.faults
    assert seen.js("document.documentElement.dataset.drawn") == ("dark" if dark else "light")
    seen.themed(dark, "print")
    seen.js("new Promise(done => setTimeout(done, 200))")
    seen.js(
        "[...document.querySelectorAll('.chart')].find(one => one.offsetWidth).scrollIntoView()"
    )
    left, top, wide, high = (
        round(one)
        for one in seen.js(
            "(({x, y, width, height}) => [x, y, width, height])([...document.querySelectorAll('.chart')]"
            ".find(one => one.offsetWidth).getBoundingClientRect())"
        )
    )
    shot = matplotlib.image.imread(io.BytesIO(seen.picture()))[..., :3]
    return shot[max(top, 0) : top + high, left : left + wide]


@pytest.mark.share(0)
@pytest.mark.parametrize("kind", ["stress", "sweep"])
def test_exact_a_map_on_paper_has_the_colours_of_its_scale(chromium, table, kind):
    """Inverted, the highest stress of a dark page was the darkest on paper; now light and dark print alike."""
    text = stress_map() if kind == "stress" else sweep_map(table)
    light, dark = (on_paper(chromium, text, theme) for theme in (False, True))
    assert light.shape == dark.shape and light.std() > 0.1
    assert np.mean(np.abs(light - dark) > 0.02) < 2e-3


@pytest.mark.parametrize("dark, ink", [(False, "rgb(28, 36, 48)"), (True, "rgb(228, 233, 239)")])
def test_exact_a_picture_drawn_beforehand_has_the_colours_of_the_page(chromium, dark, ink):
    """Pages of surfaces stood dark on white in the dark."""
    svg = pictures.draw_charts(
        [
            charts.make_chart(
                "Trace",
                charts.make_axis("x", "mm"),
                charts.make_axis("z", "um"),
                [charts.make_line([0.0, 1.0], [0.0, 1.0], "accent", "before")],
            )
        ]
    )
    text = document_html(
        "Traces", "", [Section("a", "Traces", figure_html(0, svg, "Two", "a line"))]
    )
    assert not re.search("|".join(PAGE_COLOURS), text[text.index("<svg") :]) and set(
        pictures.COLOURS.values()
    ) < set(PAGE_COLOURS)
    seen = chromium.opened(text, dark=dark)
    assert seen.js("getComputedStyle(document.querySelector('figure text')).fill") == ink
    assert seen.js("getComputedStyle(document.body).color") == ink


def test_always_lines_are_dark_on_white_paper_and_the_screen_stays_dark(chromium):
    seen = chromium.opened(stress_map(), dark=True)
    shown = (
        "[...document.querySelectorAll('.chart')].map(one => getComputedStyle(one).display + ' ' + "
        "getComputedStyle(one).visibility + ' ' + getComputedStyle(one).filter)"
    )
    assert seen.js(shown) == ["block visible none", "block hidden none", "block visible none"]
    assert seen.js("document.documentElement.scrollWidth") <= 1200
    seen.themed(True, "print")
    assert seen.js(shown) == [
        "none visible invert(1) hue-rotate(180deg)",
        "block visible none",
        "block visible invert(1) hue-rotate(180deg)",
    ]
    assert seen.js("getComputedStyle(document.body).color") == "rgb(28, 36, 48)"
    seen.themed(False)
    seen.js("new Promise(done => setTimeout(done, 300))")
    assert seen.js("document.querySelectorAll('.onpaper').length") == 0
    assert seen.printed().startswith(b"%PDF")
