"""The numbers that pages of the guide print are those of the commands beside them."""

import re

import pytest
from command_line import read_json, run_successfully
from study_module import ROOT

import patchfem as pf

GUIDE = ROOT.parent / "patchfem/scene/guide"
SQUARE_PIECES = """\
[contact]
length = "12.7 mm"
width = "12.7 mm"
height = "6.35 mm"
load = "26 lbf"
substrate = "Ti-8Al-1Mo-1V"
coating = {material = "WC-Co", thickness = "6 mil"}
[contact.shear]
"""


def read_page(name: str) -> str:
    """Return a page of the guide in one line, without the marks of quotations."""
    return " ".join((GUIDE / name).read_text("utf-8").replace("\n> ", " ").split())


def print_measure(result: pf.Result, name: str, scale: float, form: str) -> str:
    """Return a measure in another unit, as a page prints it."""
    return format(result.measures[name].value / scale, form)


def test_exact_answer_of_first_patch_is_that_of_the_guide(tmp_path, monkeypatch):
    """The page on patches quotes the first sentence of `patchfem run` of the template."""
    monkeypatch.chdir(tmp_path)
    page = (GUIDE / "patch.md").read_text("utf-8")
    (quote,) = re.findall(r"(?:^> .*\n)+", page, re.M)
    run_successfully("new", "patch", "-o", "patch.toml")
    answer = " ".join(run_successfully("run", "patch.toml").out.split())
    assert " ".join(quote.replace("> ", "").split()) in answer


@pytest.mark.slow
def test_exact_stiffnesses_of_plane_pieces_and_blocks_are_those_of_the_guide():
    """The page on patches states the stiffnesses of the shipped pieces, pressed flat, and their ratios."""
    page = read_page("patch.md")
    plane, block = pf.run(SQUARE_PIECES), pf.run(SQUARE_PIECES + "[contact.area]\n")
    normal, shear = (
        [print_measure(result, name, 1e6, ".1f") for result in (plane, block)]
        for name in ("normal_stiffness", "tangential_stiffness")
    )
    assert f"have {normal[0]} N/um under the load and {shear[0]} in shear" in page
    assert f"as blocks {normal[1]} and {shear[1]}, so" in page
    excess = [100 * (float(one) / float(other) - 1) for one, other in (normal, shear)]
    assert f"plane strain is {excess[0]:.0f} % and {excess[1]:.1f} % too stiff" in page


@pytest.mark.slow
def test_exact_answer_of_area_template_is_that_of_the_guide():
    """The page on patches states the share of the face that touches in the template `area`."""
    touching = pf.run(pf.new("area")).measures["contact_fraction"]
    share = f"{100 * touching.value:.3f} ± {100 * touching.error:.3f} % of the face touches"
    assert share in read_page("patch.md")


@pytest.mark.slow
def test_exact_answer_about_an_hour_of_wear_is_that_of_the_guide(tmp_path, monkeypatch):
    """The page on wear quotes the worn depth after an hour and states the worn part of the patch."""
    monkeypatch.chdir(tmp_path)
    page = read_page("wear.md")
    rig = str(ROOT / "rig/rig.toml")
    wear = ("--set", "wear.coefficient=1e-14 m^2/N", "--set", "wear.cycles=514800")
    run_successfully("run", rig, "-o", "out/new")
    run_successfully("run", rig, *wear, "-o", "out/worn")
    answer = run_successfully("compare", "out/new", "out/worn", "-o", "out/wear").out
    (sentence,) = re.findall(r"^Worn depth .*$", answer, re.M)
    assert sentence in page
    track = read_json("out/wear/compare.json")["track"]
    start, end = (1e3 * track[name]["value"] for name in ("from", "to"))
    lost, hidden = (1e9 * track[name]["value"] for name in ("depth_mean", "hidden_wear"))
    assert f"runs from x = {start:.2f} mm to {end:.2f} mm and lost {lost:.0f} nm" in page
    assert f"of the {lost:.0f} nm this is {hidden:.0f} nm" in page
