"""Pages of results on a narrow screen: words are not broken and the page is not wider than the screen."""

import patchfem as pf


def test_always_narrow_page_breaks_no_word(chromium, tmp_path):
    """No word of a page is broken on a narrow screen.

    Earlier "customary" in a heading was broken.
    """
    pf.run(pf.new("patch")).save(tmp_path)
    page = chromium.visit(tmp_path / "report.html", 360)
    page.wait_for_charts()
    assert page.broken_words() == [] and page.faults == []
    assert page.evaluate("document.documentElement.scrollWidth") <= 360
