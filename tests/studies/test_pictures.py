"""All pictures of the studies are legible in a README, have plain labels and are in the gallery."""

import re

import pytest
from study_module import ROOT

# Width of a README's column and smallest font size [pixel].
WIDTH, MIN_SIZE = 830, 9.0

# Pictures of the repository; the folder "made" holds output of the site's build.
PICTURES = sorted(
    path.relative_to(ROOT).as_posix() for path in ROOT.glob("**/*.svg") if "made" not in path.parts
)


def find_font_sizes(text: str) -> dict:
    """Return {text: smallest font size [pixel]} of a picture drawn WIDTH pixels wide."""
    width = float(re.search(r'viewBox="0 0 ([\d.]+)', text)[1])
    sizes = {}
    for style, content in re.findall(r'<text style="([^"]*)"[^>]*>(.*?)</text>', text, re.S):
        words = re.sub(r"<[^>]*>|\s+", " ", content).strip()
        sizes[words] = min(
            float(re.search(r"([\d.]+)px", style)[1]) * WIDTH / width, sizes.get(words, WIDTH)
        )
    return sizes


@pytest.mark.parametrize("name", PICTURES)
def test_always_picture_is_legible_and_without_code_names(name):
    """The letters of a picture are at least 9 pixels high; no label has an underscore."""
    text = (ROOT / name).read_text("utf-8")
    sizes = find_font_sizes(text)
    assert sizes and text.count("\n") < 1500 and len(text) < 160e3
    assert {words: size for words, size in sizes.items() if size < MIN_SIZE} == {}
    assert [words for words in sizes if "_" in words] == []


def test_always_gallery_shows_every_picture_once():
    """The page of pictures shows every picture of the repository once."""
    text = (ROOT / "pictures.md").read_text("utf-8")
    links = re.findall(r"!\[[^\]]+\]\(([^)]+\.svg)\)", text)
    assert sorted(set(links)) == PICTURES and len(links) == len(set(links))
