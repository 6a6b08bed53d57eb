"""Every picture of the studies can be read at the width of a README, speaks in words, and stands in the gallery."""

import re

import pytest
from study_module import ROOT

WIDTH, LEAST = 830, 9.0  # pixels of a README's column, and of the smallest letters in it
# what a build of the site leaves
PICTURES = sorted(
    path.relative_to(ROOT).as_posix() for path in ROOT.glob("**/*.svg") if "made" not in path.parts
)


def letters(text: str) -> dict:
    """{text: its least size [pixel]} of all words of a picture that is WIDTH wide."""
    wide = float(re.search(r'viewBox="0 0 ([\d.]+)', text)[1])
    out = {}
    for style, inside in re.findall(r'<text style="([^"]*)"[^>]*>(.*?)</text>', text, re.S):
        words = re.sub(r"<[^>]*>|\s+", " ", inside).strip()
        out[words] = min(
            float(re.search(r"([\d.]+)px", style)[1]) * WIDTH / wide, out.get(words, WIDTH)
        )
    return out


@pytest.mark.parametrize("name", PICTURES)
def test_always_a_picture_is_legible_and_has_no_names_of_code(name):
    text = (ROOT / name).read_text("utf-8")
    found = letters(text)
    assert found and text.count("\n") < 1500 and len(text) < 160e3
    assert {words: size for words, size in found.items() if size < LEAST} == {}
    assert [words for words in found if "_" in words] == []


def test_always_the_gallery_shows_every_picture():
    shown = re.findall(r"!\[[^\]]+\]\(([^)]+\.svg)\)", (ROOT / "README.md").read_text("utf-8"))
    assert sorted(set(shown)) == PICTURES and len(shown) == len(set(shown))
