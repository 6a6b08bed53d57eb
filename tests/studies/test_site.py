"""The site: scenes of all effects, the glossary, links of the pages, and a complete build."""

import ast
import json
import os
import re
import shlex
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest
from chromium import Chromium, find_chromium
from command_line import run_cli

import patchfem as pf
from patchfem.effects import EFFECTS

ROOT = Path(__file__).parents[2]
SITE = ROOT / "studies/site"
sys.path.insert(0, str(SITE))
check, examples, made = (__import__(name) for name in ("check", "examples", "made"))


@pytest.fixture(scope="module")
def scene_folder(tmp_path_factory):
    """Folder with the files that the scenes of the effects read."""
    folder = tmp_path_factory.mktemp("files")
    for name, text in examples.FILES.items():
        (folder / name).write_text(text, "utf-8")
    return folder


def test_always_every_effect_has_an_example_scene(scene_folder):
    """Every effect has an example scene, and `patchfem plan` lists the effect for it."""
    assert sorted(examples.EXAMPLES) == sorted(made.SHOWN_EFFECTS)
    for name in set(made.SHOWN_EFFECTS) - {"sweep"}:
        (scene_folder / "scene.toml").write_text(examples.scene(name), "utf-8")
        assert name in pf.plan(scene_folder / "scene.toml").effects, name


def test_always_page_of_an_effect_shows_its_records(scene_folder):
    """The page of contact.tilt shows its equations, its scene and results with and without tilt."""
    page = made.effect("contact.tilt", scene_folder)
    assert (scene_folder / "contact-tilt.svg").read_text("utf-8").startswith("<?xml")
    assert EFFECTS["contact.tilt"].equations in page
    assert '[contact.tilt]\nangle = "0.1 mrad"' in page
    with_it, without = re.search(
        r"`contact_fraction` \| ([\d.]+) ± [\d.]+ \| ([\d.]+)", page
    ).groups()
    assert float(with_it) < 0.25 and float(without) == 1
    assert "with every other effect" in made.limits("friction.law=convolution")[0]
    assert made.source("friction.law=iwan")[1].startswith(
        "Segalman, D. J.: A four-parameter Iwan model"
    )


def test_always_glossary_lists_measures_and_terms_once():
    """The glossary lists every measure and every term once."""
    headings = re.findall(r"^(\S[^\n]*)\n  \S", made.glossary(), re.M)
    assert len(headings) == len(set(headings)) > 90
    terms = made.glossary_terms()
    rows = (*made.PATCH_TABLE.values(), *made.MOTION_MEASURE_ROWS)
    assert {row.name.replace("_", " ") for row in rows} | set(terms) == set(headings)
    assert terms["slide"] != terms["slip"] and "Irreversible part" in terms["slip"]


def find_source_pages() -> list:
    """Return the pages of the repository from which the site is built, without generated pages."""
    conf = (SITE / "conf.py").read_text("utf-8")
    patterns = ast.literal_eval(re.search(r"include_patterns = (\[.*?\])", conf, re.S)[1])
    paths = {
        path for pattern in patterns for path in ROOT.glob(pattern.replace("**.md", "**/*.md"))
    }
    return sorted(path for path in paths if "made" not in path.parts and path != SITE / "README.md")


def read_page_text(page: Path) -> str:
    """Return the Markdown of a page or of a notebook's cells."""
    text = page.read_text("utf-8")
    if page.suffix != ".ipynb":
        return text
    return "\n".join(
        "".join(cell["source"])
        if cell["cell_type"] == "markdown"
        else f"```python\n{''.join(cell['source'])}\n```"
        for cell in json.loads(text)["cells"]
    )


def generated_page_names() -> set:
    """Return the names of the pages that a build generates."""
    return {
        "glossary.md",
        "messages.md",
        "commands.md",
        "python.md",
        "code.md",
        "effects/index.md",
        *(f"effects/{made.slug(name)}.md" for name in made.SHOWN_EFFECTS),
    }


@pytest.mark.parametrize("page", find_source_pages(), ids=lambda page: str(page.relative_to(ROOT)))
def test_always_page_links_resolve_and_its_python_parses(page):
    """Every link and list of a page leads to an existing page and heading; its Python code parses."""
    text = read_page_text(page)
    prose = re.sub(r"^```.*?^```|`[^`\n]*`", "", text, flags=re.S | re.M)
    for image in re.findall(r'<img src="([^"]+)"', prose):
        assert image.startswith("http") or (page.parent / image).exists(), image
    for link, name in re.findall(r"\]\(([^)#\s]*)#?([^)]*)\)", prose):
        if link.startswith(("http", "made/")):
            assert (
                link.startswith("http") or link.removeprefix("made/") in generated_page_names()
            ), link
            continue
        target = (page.parent / link).resolve() if link else page
        assert target.exists() and (
            target.suffix not in (".md", ".ipynb") or target in find_source_pages()
        ), link
        headings = (
            re.findall(r"^#+ (.*)$", target.read_text("utf-8"), re.M)
            if name and target.suffix == ".md"
            else ()
        )
        assert not name or name in {
            re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings
        }, name
    for entries in re.findall(r"^```\{toctree\}\n(.*?)^```", text, re.S | re.M):
        for line in (line for line in entries.splitlines() if line and not line.startswith(":")):
            entry = re.sub(r"^.*<(.*)>$", r"\1", line)
            assert (
                f"{entry.removeprefix('made/')}.md" in generated_page_names()
                if entry.startswith("made/")
                else any((page.parent / f"{entry}{end}").exists() for end in (".md", ".ipynb"))
            ), line
    if page.name == "ADDING.md":
        return  # tests/test_adding.py executes its blocks; some are single lines of a table
    for code in re.findall(r"^```(?:python|\{code-cell\} ipython3)\n(.*?)^```", text, re.S | re.M):
        ast.parse(code)


@pytest.mark.slow
def test_always_commands_of_the_paraview_page_run(tmp_path, monkeypatch):
    """The nine commands of the page on ParaView run without error."""
    monkeypatch.chdir(tmp_path)
    commands = check.commands(SITE / "tasks/paraview.md")
    assert len(commands) == 9
    for command in commands:
        program, *words = shlex.split(command)
        assert program == "patchfem" and run_cli(*words).code == 0, command


@pytest.mark.slow
@pytest.mark.skipif(
    find_spec("myst_nb") is None, reason="the site is built where patchfem[docs] is installed"
)
def test_always_site_build_has_no_warnings_or_broken_links(tmp_path, tmp_path_factory):
    """The site is built without warnings, broken links, failing commands or errors in the browser."""
    words = [
        sys.executable,
        "-m",
        "sphinx",
        "-W",
        "--keep-going",
        "-q",
        "-c",
        str(SITE),
        str(ROOT),
        str(tmp_path),
    ]
    process = subprocess.run(words, capture_output=True, text=True, env=os.environ)
    assert process.returncode == 0, process.stderr[-2000:]
    n_links, broken = check.links(tmp_path)
    assert broken == check.mute(tmp_path) == [] and n_links > 1000
    assert [text for page in check.PAGES for text in check.faults(page)] == []
    if find_chromium() is not None:
        assert find_browser_errors(tmp_path, tmp_path_factory.mktemp("chromium")) == []


def find_browser_errors(site: Path, home: Path) -> list:
    """Return console messages of four pages and words broken at a width of 390 px."""
    browser = Chromium(home)
    errors = []
    for name in ("README", "studies/README", "studies/site/start", "patchfem/scene/MEASURES"):
        page = browser.visit(site / f"{name}.html")
        errors += [f"{name}: {fault}" for fault in page.faults]
        errors += [f"{name}: the word {word} is broken" for word in page.broken_words()]
    browser.close()
    return errors
