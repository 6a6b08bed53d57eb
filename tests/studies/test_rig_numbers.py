"""The numbers that README and the page on trust print of the shipped rig are those of its runs."""

import re
from functools import cache
from pathlib import Path

import pytest
from command_line import read_json
from study_module import load_study

import patchfem as pf
from patchfem.core import G_N

ROOT = Path(__file__).parents[2]
ONSETS = ROOT / "studies/report/onset.md"
MIL = 25.4e-6  # m


def read_page(page: str) -> str:
    """Return the text of a page."""
    return (ROOT / page).read_text("utf-8")


@cache
def run_shipped_rig():
    """Return the result of the shipped rig, computed once for several tests."""
    return pf.run(ROOT / "studies/rig/rig.toml")


def test_exact_readme_prints_the_answer_of_its_first_command(tmp_path):
    """The lines that the README shows are those of the first command, and it explains their numbers."""
    text = read_page("README.md")
    shown = re.search(r"```text\n(.*?)```", text, re.S)[1].splitlines()
    run_shipped_rig().save(tmp_path)
    assert [
        line for line in shown if line in read_json(tmp_path / "summary.json")["verdict"]
    ] == shown
    amplitude, energy = re.search(r"output ([\d.]+) ± .* g, ([\d.]+) ± ", shown[0]).groups()
    explained = " ".join(text.partition(shown[-1])[2].split())
    assert f"moves {amplitude} um to each side" in explained
    assert f"turns {energy} mJ into heat" in explained


def test_exact_amplitude_of_trust_page_equals_shipped_rig():
    """Amplitude, error and steady amplitude of the page on trust equal those of the shipped rig in all printed digits."""
    page = " ".join(read_page("studies/site/trust.md").split())
    measures = run_shipped_rig().measures
    amplitude = measures["relative_displacement_amplitude"]
    steady = measures["relative_displacement_amplitude_steady"]
    value, error, steady_value, steady_error, value_after_800_cycles = re.search(
        r"amplitude after 200 cycles is ([\d.]+) um with an estimated error of ([\d.]+) um;.*?a steady "
        r"amplitude of ([\d.]+) ± ([\d.]+) um; after 800 cycles it is ([\d.]+) um",
        page,
    ).groups()
    assert (value, error) == (
        f"{1e6 * amplitude.value:.{len(value) - 3}f}",
        f"{1e6 * amplitude.error:.{len(error) - 2}f}",
    )
    assert f"Amplitude {value} ± {error} um" in read_page("studies/answers.md")
    assert (steady_value, steady_error) == tuple(
        f"{1e6 * one:.3f}" for one in (steady.value, steady.error)
    )
    assert abs(float(value_after_800_cycles) - 1e6 * steady.value) < 1e6 * steady.error
    (value_alone,) = re.findall(r"alone(?:, )? gives ([\d.]+) um", page)
    assert abs(float(value_alone) - 1e6 * amplitude.value) < 1e6 * amplitude.error


def test_exact_comparison_at_5_g_is_reproduced():
    """The displacements at 5 g in README and on the page on trust are reproduced in all printed digits.

    So are their ratios to the measured 0.23 mil.
    """
    readme, bullet = (
        " ".join(read_page(page).split()) for page in ("README.md", "studies/site/trust.md")
    )
    amplitude = "relative_displacement_amplitude"
    at_5_g = run_shipped_rig().measures[amplitude].value / MIL
    ratio = f"{at_5_g:.3f} mil, {at_5_g / 0.23:.2f} times the measured 0.23 mil"
    assert ratio in readme and f"displacement is {ratio}" in bullet
    row = r"shipped rig, 143 Hz, 4 g: displacement \| 0.08 mil \| ([\d.]+) mil"
    (at_4_g,) = re.findall(row, read_page("studies/report/reproduced.md"))
    assert f"{float(at_4_g):.3f} mil (measured: 0.08 mil)" in readme
    second = pf.run(ROOT / "studies/table_1/second_path.toml").measures[amplitude].value / MIL
    assert (
        f"displacement at 5 g is {second:.3f} mil, {second / 0.23:.2f} times the measured one"
        in bullet
    )


def read_onsets() -> dict:
    """Return {(model, criterion): levels [g] at the four frequencies} of the page of onsets."""
    rows = re.findall(
        r"^\| ([^|*]+) \| (slip|distortion|gauge) \| (.*) \|$", ONSETS.read_text(), re.M
    )
    return {
        (model, criterion): [float(cell.split()[0]) for cell in cells.split(" | ")]
        for model, criterion, cells in rows
    }


def test_exact_onsets_of_rigid_block_agree_with_page_and_closed_form():
    """By first slip the rigid block has the onset mu N/m at every frequency; the page has its onsets, and README's."""
    study = load_study("report/onset.py")
    page = read_onsets()
    assert set(page) == {(model, one) for model in study.MODELS for one in study.CRITERIA}
    block, *_ = study.MODELS
    for criterion in study.CRITERIA:
        for frequency, level in zip(study.FREQUENCIES, page[block, criterion]):
            found = study.find_onset(block, criterion, frequency)
            assert found.level == pytest.approx(level, abs=0.006)
            if criterion == "slip":
                assert abs(found.level - 0.3 * 26 * 4.4482216152605 / 0.884 / G_N) <= found.error
    text = " ".join(read_page("README.md").split())
    for model in ("shipped patch, bonds", "shipped patch, elastic-plastic"):
        levels = page[model, "distortion"]
        spread = f"{min(levels):.2f}", f"{max(levels):.2f}"
        assert all(one in study.ANSWER for one in spread)
    *first, last = (f"{level:.2f}" for level in page["shipped patch, bonds", "distortion"])
    assert f"third harmonic from {', '.join(first)} and {last} g on at 135" in text
    assert {f"{level:.1f}" for level in levels} == {"4.1"} and "from 4.1 g on at all" in text


@pytest.mark.slow
@pytest.mark.parametrize("index", range(1, 5))
def test_exact_onsets_of_page_are_reproduced(index: int):
    """The onsets of every other model are those of the page."""
    study = load_study("report/onset.py")
    model = list(study.MODELS)[index]
    for criterion in study.CRITERIA:
        for frequency, level in zip(study.FREQUENCIES, read_onsets()[model, criterion]):
            assert study.find_onset(model, criterion, frequency).level == pytest.approx(
                level, abs=0.006
            )
