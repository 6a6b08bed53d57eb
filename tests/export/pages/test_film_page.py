"""The page of a film in a browser: it plays by itself, and its slider and button do what they say."""

import re

import numpy as np

from patchfem.export.drawing.reels import write

TEXTS = ("<i>a</i>, 1 s", "<i>a</i>, 2 s", "<i>a</i>, 3 s")
DRIVEN = """<script>
const notes = [];
const shown = () => frames.map(frame => getComputedStyle(frame).display === "block" ? frame.naturalWidth : 0);
const note = () => notes.push(`${play.textContent} ${at.value} ${shown()} ${at.getAttribute("aria-valuetext")}`);
setTimeout(() => {
  note();
  setTimeout(() => {
    note();
    at.value = 2; at.dispatchEvent(new Event("input"));
    note();
    setTimeout(() => { note(); play.click(); note(); document.body.dataset.notes = notes.join(";"); }, 1000);
  }, 300);
}, 150);
</script>"""


def test_exact_a_browser_plays_the_film(tmp_path, browser):
    pictures = [(text, np.full((4, 6 + k, 3), 60 * k, np.uint8)) for k, text in enumerate(TEXTS)]
    write(tmp_path / "a.html", iter(pictures), "<i>a</i>", 0.3)
    page = (tmp_path / "a.html").read_text("utf-8")
    seen = browser(page.replace("</body>", DRIVEN + "</body>"))
    notes = re.search('data-notes="([^"]+)"', seen)[1].replace("&lt;", "<").replace("&gt;", ">").split(";")
    assert notes[0] == f"pause 0 6,0,0 {TEXTS[0]}"  # by itself: a frame every 0.3 s
    assert notes[1] == f"pause 1 0,7,0 {TEXTS[1]}"
    assert notes[2] == notes[3] == f"play 2 0,0,8 {TEXTS[2]}"  # a hand on the slider stops it
    assert notes[4] == f"pause 2 0,0,8 {TEXTS[2]}"
    assert "<i>" not in seen.split("<script>")[0]  # a name is text
