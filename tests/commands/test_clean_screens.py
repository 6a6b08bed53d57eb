"""Screens and reports of the templates and of the shipped scenes: only expected warnings, and readable numbers."""

import re
from html import unescape
from pathlib import Path

import pytest
from command_line import read_json, read_page, run_successfully

from patchfem.scene import NEXT_VERB_BY_KIND, TEMPLATE_DESCRIPTIONS, read_template

ROOT = Path(__file__).parents[2]
SCENES = sorted(str(path.relative_to(ROOT)) for path in (ROOT / "studies").glob("*/*.toml"))
STEADY = (
    "rig",
    "linear",
)  # templates whose motion becomes steady; other runs are done at their end
DEAR = ("patch", "wear")
MEANT = {  # expected warnings of a scene, each with its remedy and the reason to keep it
    "studies/rig/report.toml": (
        "the law as printed in the report created",  # eq. 2.17
        "the shape of the patch does not",
    ),
    # it starts from rest, as the recipe of the ladder says, and is not steady at its end
    "studies/table_1/climbing.toml": ("relative_displacement_amplitude_steady has an estimated",),
    # fits run this scene hundreds of times on the mesh of its tolerance
    "studies/table_1/second_path.toml": ("slip_start_phase has an estimated",),
    # a finer mesh takes a minute, and the study compares volumes, whose error is smaller
    "studies/benchmarks/ti64_wear.toml": ("pressure_peak has an estimated",),
    # the study compares integrators on the elements of this mesh
    "studies/integrators/patch.toml": ("stick_fraction has an estimated",),
}
UNITS = "nm|um|mm|m|nJ|uJ|mJ|J|uN|mN|N|kN|Pa|kPa|MPa|GPa|urad|mrad|rad|us|ms|s|%|g|deg|N/m|N/mm|N/um|N m|mN m|uN m"
# 0 ± 0; a bar or a number with a unit as a power of ten; the sign of a zero; nan; more than ten significant digits
UGLY = re.compile(
    rf"± 0(?![.\d])|± [\d.]+e|\de[-+]?\d+ (?:{UNITS})\b|e[-+]0\d|(?<![\w.,-])-0(?:\.0*)?(?![.\d])|\bnan\b|"
    r"[1-9]\.\d{10}|[1-9]\d+\.\d{9}|\b0\.0*[1-9]\d{9}"
)


def visible_text(page: str) -> str:
    """Return the visible text of a page, without scripts, scene and tags."""
    page = re.sub(r"<(script|style|pre|details)\b.*?</\1>", " ", page, flags=re.S)
    return unescape(re.sub(r"<[^>]+>", " ", page))


def run_and_list_warnings(path: Path, out: Path, *words) -> list:
    """Run a scene, assert that screen and report have readable numbers, and return the warnings."""
    answer = run_successfully(*words, path, "-o", out)
    page = read_page(out)
    for text in (answer.out, answer.err, visible_text(page)):
        assert [
            text[max(0, one.start() - 40) : one.end() + 20] for one in UGLY.finditer(text)
        ] == []
    found = [
        line.removeprefix("warning: ")
        for line in answer.err.splitlines()
        if line.startswith("warning: ")
    ]
    assert ('<div class="box warn">' in page) == bool(found)
    return found


@pytest.mark.parametrize(
    "kind",
    [
        pytest.param(one, marks=pytest.mark.slow) if one in (*NEXT_VERB_BY_KIND, *DEAR) else one
        for one in TEMPLATE_DESCRIPTIONS
    ],
)
def test_always_templates_run_without_warnings(kind, tmp_path):
    """Every template runs without a warning and ends with the expected outcome."""
    path = tmp_path / f"{kind}.toml"
    path.write_text(read_template(kind), "utf-8")
    assert run_and_list_warnings(path, tmp_path / "out", NEXT_VERB_BY_KIND.get(kind, "run")) == []
    if kind not in NEXT_VERB_BY_KIND:
        summary = read_json(tmp_path / "out/summary.json")
        assert summary["outcome"] == ("steady" if kind in STEADY else "done")


@pytest.mark.slow
@pytest.mark.parametrize("scene", SCENES)
def test_always_shipped_scenes_give_expected_warnings(scene, tmp_path):
    """Every shipped scene gives exactly the warnings listed for it."""
    found = run_and_list_warnings(ROOT / scene, tmp_path / "out", "run")
    expected = MEANT.get(scene, ())
    assert len(found) == len(expected) and all(
        text.startswith(start) for text, start in zip(found, expected, strict=True)
    )
