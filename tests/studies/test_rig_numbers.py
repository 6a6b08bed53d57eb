"""The numbers that README and the page on trust print of the shipped rig are those of its runs."""

import re
from functools import cache

import pytest
from command_line import read_json
from study_module import ROOT, load_study

import patchfem as pf
from patchfem.core import G_N

MIL = 25.4e-6  # m


def read_page(page: str) -> str:
    """Return the text of a page."""
    return (ROOT.parent / page).read_text("utf-8")


@cache
def run_shipped_rig():
    """Return the result of the shipped rig, computed once for several tests."""
    return pf.run(ROOT / "rig/rig.toml")


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
    ratio = f"{at_5_g:.2f} mil, {at_5_g / 0.23:.1f} times the measured 0.23 mil"
    assert ratio in readme and f"displacement is {ratio}" in bullet
    row = r"shipped rig, 143 Hz, 4 g: displacement \| 0.08 mil \| ([\d.]+) mil"
    (at_4_g,) = re.findall(row, read_page("studies/report/reproduced.md"))
    assert f"{float(at_4_g):.3f} mil (measured: 0.08 mil)" in readme
    second = pf.run(ROOT / "table_1/second_path.toml").measures[amplitude].value / MIL
    assert (
        f"displacement at 5 g is {second:.3f} mil, {second / 0.23:.2f} times the measured one"
        in bullet
    )


def test_exact_readme_has_the_measured_times_of_other_programs():
    """The README states by how much GetFEM is slower and Tamaas faster, as the page of earlier studies has it."""
    history = read_page("studies/history.md")
    getfem, tamaas = re.findall(r"(?:GetFEM|Tamaas) takes ([\d.]+) to", history)
    assert float(getfem) > 10 and "less than a tenth of the time" in read_page("README.md")
    assert f"Tamaas is up to {1 / float(tamaas):.1f} times as fast" in read_page("README.md")


def read_onsets() -> dict:
    """Return {(model, criterion): levels [g] at the four frequencies} of the page of onsets."""
    page = read_page("studies/report/onset.md")
    rows = re.findall(r"^\| ([^|*]+) \| (slip|distortion|gauge) \| (.*) \|$", page, re.M)
    return {
        (model, criterion): [float(cell.split()[0]) for cell in cells.split(" | ")]
        for model, criterion, cells in rows
    }


def test_exact_onsets_of_readme_are_those_of_the_page():
    """The page has the onset of every model by every criterion, and README and study state those of the shipped patch."""
    study = load_study("report/onset.py")
    page = read_onsets()
    assert set(page) == {(model, one) for model in study.MODELS for one in study.CRITERIA}
    text = " ".join(read_page("README.md").split())
    bonds, elastic = (
        page[f"shipped patch, {law}", "distortion"] for law in ("bonds", "elastic-plastic")
    )
    for levels in (bonds, elastic):
        assert all(f"{end(levels):.2f}" in study.ANSWER for end in (min, max))
    *first, last = (f"{level:.2f}" for level in bonds)
    assert f"third harmonic from {', '.join(first)} and {last} g on at 135" in text
    assert {f"{level:.1f}" for level in elastic} == {"4.1"} and "from 4.1 g on at all" in text


@pytest.mark.parametrize(
    "index", [0, *(pytest.param(index, marks=pytest.mark.slow) for index in range(1, 5))]
)
def test_exact_onsets_of_page_are_reproduced(index: int):
    """The onsets of a model are those of the page; by first slip that of a rigid block is mu N/m at every frequency."""
    study = load_study("report/onset.py")
    model = list(study.MODELS)[index]
    for criterion in study.CRITERIA:
        for frequency, level in zip(study.FREQUENCIES, read_onsets()[model, criterion]):
            found = study.find_onset(model, criterion, frequency)
            assert found.level == pytest.approx(level, abs=0.006)
            if index == 0 and criterion == "slip":
                assert abs(found.level - 0.3 * 26 * 4.4482216152605 / 0.884 / G_N) <= found.error
