"""The pages for readers: the README stays short, every link leads somewhere, and what they show works."""

import os
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGES = ("README.md", "patchfem/CHANGES.md", "patchfem/scene/GUIDE.md", "patchfem/scene/README.md", "studies/README.md",
         "studies/drift/README.md", "studies/friction_ladder/README.md", "studies/report/README.md",
         "studies/report/conclusions.md", "studies/table_1/README.md", "tests/README.md")


def text(page: str) -> str:
    return (ROOT / page).read_text("utf-8")


def anchors(page: str) -> set:
    """Names under which the headings of a page can be linked, as code hosts make them."""
    heads = re.findall(r"^#+ (.*)$", text(page), re.M)
    return {re.sub(r"[^\w\- ]", "", head.lower()).replace(" ", "-") for head in heads}


def test_always_the_readme_fits_on_three_screens():
    assert len(text("README.md").splitlines()) <= 150


@pytest.mark.parametrize("page", PAGES)
def test_always_every_link_leads_somewhere(page):
    for link in re.findall(r"\]\(([^)]+)\)", text(page)):
        target, _, anchor = link.partition("#")
        if not target.startswith("http"):
            place = os.path.normpath(os.path.join(os.path.dirname(page), target)) if target else page
            assert (ROOT / place).exists(), link
            assert not anchor or anchor in anchors(place), link


def test_always_the_gallery_names_every_study_with_a_page():
    """A study is a script with a run of its own; its question stands in the gallery."""
    pages = text("studies/README.md")
    runs = [path for path in (ROOT / "studies").glob("*/*.py") if f"Run: python {path.relative_to(ROOT)}" in
            path.read_text("utf-8") or f"python {path.relative_to(ROOT)}" in path.read_text("utf-8")]
    assert len(runs) > 20
    lost = [path.name for path in runs if path.name != "picture.py" and
            f"({path.relative_to(ROOT / 'studies')})" not in pages]
    assert lost == []


def test_always_every_picture_of_the_studies_is_linked():
    pages = "".join(text(page) for page in ("README.md", "studies/README.md"))
    assert [path.name for path in (ROOT / "studies").glob("*/*.svg")
            if f"{path.parent.name}/{path.name})" not in pages] == []


def test_exact_the_scene_and_the_keys_of_the_readme():
    from patchfem.scene.scene import loads

    scene = loads(re.search(r"```toml\n(.*?)```", text("README.md"), re.S)[1])
    assert scene.kind == "rig" and scene.contact.tilt.angle == pytest.approx(1e-4)
    sets = dict(re.findall(r'\*\*\{"([\w.]+)": "([^"]+)"\}', text("README.md")))
    assert sets and all(loads(scene.text, sets=[f"{key}={value}"]).kind == "rig" for key, value in sets.items())


def test_exact_the_map_of_the_guide():
    """Pressure falls off with the tilt and rises with the load, at each of the guide's nine points."""
    names = {}
    script = re.search(r"```python\n(.*?)```", text("patchfem/scene/GUIDE.md"), re.S)[1]
    exec(script.replace('"studies/', f'"{ROOT}/studies/'), names)
    fraction, peak = names["answer"].fraction[:, :, 0], names["answer"].peak[:, :, 0]
    assert fraction.shape == (3, 3) and (peak[1:] > peak[:-1]).all() and (peak[:, 1:] > peak[:, :-1]).all()
    assert (fraction[:, 1:] <= fraction[:, :-1]).all() and fraction[1, 2] == pytest.approx(0.2225, abs=1e-3)
