"""Pages of results on a telephone: words stay whole, and the page is no wider than the screen."""

import pytest

import patchfem as pf


@pytest.mark.parametrize("width", [360, 390])
def test_always_no_word_is_broken_on_a_narrow_page(chromium, tmp_path, width):
    """The heading "in customary units" once stood as "customar y"."""
    pf.run(pf.new("patch")).save(tmp_path)
    page = chromium.visit(tmp_path / "report.html", width)
    page.settled()
    assert page.broken_words() == [] and page.faults == []
    assert page.js("document.documentElement.scrollWidth") <= width
