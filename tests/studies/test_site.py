"""The site: every effect has a scene that names it, every measure a line, every link of a page a target; built slow."""

import ast
import json
import os
import re
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest
from chromium import Chromium, find_chromium

import patchfem as pf
from patchfem.effects import EFFECTS

ROOT = Path(__file__).parents[2]
SITE = ROOT / "studies" / "site"
sys.path.insert(0, str(SITE))
check, examples, made = (__import__(name) for name in ("check", "examples", "made"))


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """The folder of the files that the scenes of the effects read."""
    folder = tmp_path_factory.mktemp("files")
    for name, text in examples.FILES.items():
        (folder / name).write_text(text, "utf-8")
    return folder


def test_always_every_effect_has_a_scene_that_names_it(files):
    assert sorted(examples.EXAMPLES) == sorted(made.SHOWN_EFFECTS)
    for name in set(made.SHOWN_EFFECTS) - {"sweep"}:
        (files / "scene.toml").write_text(examples.scene(name), "utf-8")
        assert name in pf.plan(files / "scene.toml").effects, name


def test_always_an_effect_is_told_from_its_records(files):
    page = made.effect("contact.tilt", files)
    assert (files / "contact-tilt.svg").read_text("utf-8").startswith("<?xml")
    assert EFFECTS["contact.tilt"].equations in page
    assert '[contact.tilt]\nangle = "0.1 mrad"' in page
    with_it, without = re.search(
        r"`contact_fraction` \| ([\d.]+) ± [\d.]+ \| ([\d.]+)", page
    ).groups()
    assert float(with_it) < 0.25 and float(without) == 1
    assert "not supported yet" in " ".join(made.limits("friction.law=iwan"))
    assert made.source("friction.law=iwan")[1].startswith(
        "Segalman, D. J.: A four-parameter Iwan model"
    )


def test_always_every_value_has_a_sentence():
    said = [made.about(name) for name in made.SHOWN_EFFECTS]
    assert all(len(text) > 20 and text.endswith(".") for text in said)


def test_always_the_glossary_has_every_measure_and_term_once():
    heads = re.findall(r"^(\S[^\n]*)\n  \S", made.glossary(), re.M)
    assert len(heads) == len(set(heads)) > 90
    terms = made.glossary_terms()
    assert {row.name.replace("_", " ") for row in (*made.STATIC, *made.MOTION)} | set(terms) == set(
        heads
    )
    assert terms["slide"] != terms["slip"] and "Irreversible part" in terms["slip"]


def test_always_every_folder_of_the_package_is_told():
    order = re.findall(r"^\d+\. `(\w+)`", pf.__doc__, re.M)
    assert re.findall(r"^## (\w+)$", made.code(), re.M) == order and len(order) > 20


def sources() -> list:
    """The pages of the repository that the site is built from, without those that a build makes."""
    conf = (SITE / "conf.py").read_text("utf-8")
    wanted = ast.literal_eval(re.search(r"include_patterns = (\[.*?\])", conf, re.S)[1])
    found = {path for pattern in wanted for path in ROOT.glob(pattern.replace("**.md", "**/*.md"))}
    return sorted(path for path in found if "made" not in path.parts and path != SITE / "README.md")


def text_of(page: Path) -> str:
    """The Markdown of a page, of a notebook that of its cells."""
    text = page.read_text("utf-8")
    if page.suffix != ".ipynb":
        return text
    return "\n".join(
        "".join(cell["source"])
        if cell["cell_type"] == "markdown"
        else f"```python\n{''.join(cell['source'])}\n```"
        for cell in json.loads(text)["cells"]
    )


def made_pages() -> set:
    """Names of the pages that a build makes."""
    return {
        "glossary.md",
        "messages.md",
        "commands.md",
        "python.md",
        "code.md",
        "effects/index.md",
        *(f"effects/{made.slug(name)}.md" for name in made.SHOWN_EFFECTS),
    }


@pytest.mark.parametrize("page", sources(), ids=lambda page: str(page.relative_to(ROOT)))
def test_always_a_page_leads_somewhere_and_its_python_is_python(page):
    """Every link inside the repository has its file, of pages one of the site, and its heading; so has every list."""
    text = text_of(page)
    prose = re.sub(r"^```.*?^```|`[^`\n]*`", "", text, flags=re.S | re.M)
    for link, name in re.findall(r"\]\(([^)#\s]*)#?([^)]*)\)", prose):
        if link.startswith(("http", "made/")):
            assert link.startswith("http") or link.removeprefix("made/") in made_pages(), link
            continue
        target = (page.parent / link).resolve() if link else page
        assert target.exists() and (
            target.suffix not in (".md", ".ipynb") or target in sources()
        ), link
        heads = (
            re.findall(r"^#+ (.*)$", target.read_text("utf-8"), re.M)
            if name and target.suffix == ".md"
            else ()
        )
        assert not name or name in {
            re.sub(r"[^\w\- ]", "", head.lower()).replace(" ", "-") for head in heads
        }, name
    for listed in re.findall(r"^```\{toctree\}\n(.*?)^```", text, re.S | re.M):
        for line in (line for line in listed.splitlines() if line and not line.startswith(":")):
            place = re.sub(r"^.*<(.*)>$", r"\1", line)
            assert (
                f"{place.removeprefix('made/')}.md" in made_pages()
                if place.startswith("made/")
                else any((page.parent / f"{place}{end}").exists() for end in (".md", ".ipynb"))
            ), line
    if page.name == "ADDING.md":
        return  # tests/test_adding.py executes its blocks, some of which are single lines of a table
    for code in re.findall(r"^```(?:python|\{code-cell\} ipython3)\n(.*?)^```", text, re.S | re.M):
        ast.parse(code)


def test_always_the_commands_of_a_page_run():
    assert len(check.commands(SITE / "tasks" / "paraview.md")) == 9
    assert check.faults(SITE / "tasks" / "paraview.md") == []


def test_always_a_dead_link_a_mute_picture_and_a_failing_command_are_found(tmp_path):
    (tmp_path / "a.html").write_text(
        '<h1 id="top"></h1><a href="#top"><a href="b.html#no"><a href="c.html">'
    )
    (tmp_path / "b.html").write_text("<p>")
    assert check.links(tmp_path) == (3, ["a.html: b.html#no", "a.html: c.html"])
    (tmp_path / "c.html").write_text(
        '<img src="a.svg" alt="a loop"><img src="b.svg" alt="b.svg"><img src="d.svg">'
    )
    assert check.mute(tmp_path) == ["c.html: b.svg", "c.html: d.svg"]
    page = tmp_path / "page.md"
    page.write_text("```bash\ntrue\nfalse\n```\n")
    assert check.faults(page) == ["page.md: false: "]


@pytest.mark.slow
@pytest.mark.skipif(
    find_spec("myst_nb") is None, reason="the site is built where patchfem[docs] is installed"
)
def test_always_the_site_is_built_without_a_warning_and_without_a_dead_link(
    tmp_path, tmp_path_factory
):
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
    done = subprocess.run(words, capture_output=True, text=True, env=os.environ)
    assert done.returncode == 0, done.stderr[-2000:]
    tried, dead = check.links(tmp_path)
    assert dead == check.mute(tmp_path) == [] and tried > 1000
    assert [text for page in check.PAGES for text in check.faults(page)] == []
    if find_chromium() is not None:
        assert console_errors(tmp_path, tmp_path_factory.mktemp("chromium")) == []


def console_errors(site: Path, home: Path) -> list:
    """Return what the console says on the first page of a visit, and the words that are broken at 390 px."""
    browser = Chromium(home)
    wrong = []
    for name in ("README", "studies/README", "studies/site/start", "patchfem/scene/MEASURES"):
        page = browser.visit(site / f"{name}.html", 390)
        wrong += [f"{name}: {fault}" for fault in page.faults]
        wrong += [f"{name}: the word {word} is broken" for word in page.broken_words()]
    browser.close()
    return wrong
