"""Drive levels: onset of slip of a table, and onsets found by bisection."""

import numpy as np
import pytest
from scene_texts import COULOMB, MODE, POINT

from patchfem.core import G_N
from patchfem.measures import DriveLevel, bracket_onset, make_onset_test
from patchfem.runs.run import run
from patchfem.scene import loads

NAME = "relative_displacement_amplitude"
RIG = (
    POINT
    + COULOMB
    + MODE
    + """\
[drive]
kind = "base"
waveform = "levels"
frequency = "143 Hz"
levels = {levels}
onset = "slip"
cycles = 30
[accuracy]
tolerance = 1e-3
"""
)
ONSET = 0.3 * 26 * 4.4482216152605 / 0.884


def make_level(drive, amplitude, stuck=False, error=0.0):
    """Return a drive level with an amplitude and its error."""
    return DriveLevel(drive, stuck, {NAME: amplitude}, {NAME: error})


def test_exact_onset_of_table():
    """The onset brackets of a table of levels are those computed by hand."""
    table = [
        make_level(3, 0.0, True),
        make_level(4, 0.0, True),
        make_level(5, 1.0),
        make_level(6, 6.0, error=0.1),
        make_level(5, 1.5, error=0.2),
        make_level(4, 0.4),
    ]
    slips = make_onset_test("slip")
    assert bracket_onset(table, slips) == (1, 2)
    assert bracket_onset(table[2:], slips) == (-1, 0)
    assert bracket_onset(table[:2], slips) is None
    assert (
        bracket_onset([make_level(4, 0, True), make_level(3, 0, True), make_level(3, 1.0)], slips)
        is None
    )
    assert bracket_onset(table, make_onset_test("gauge", 2.0)) == (2, 3)


@pytest.mark.parametrize("levels", ['["3 g", "3.9 g", "4.5 g", "3.9 g"]', '["4.5 g", "5 g"]'])
def test_exact_onset_of_rigid_block_is_mu_n_over_m(levels):
    """The onset level of a rigid block agrees with mu N/m within its error, at most 1e-3."""
    result = run(loads(RIG.format(levels=levels)))
    onset = result.measures["onset_level"]
    assert abs(onset.value - ONSET) <= onset.error <= 1e-3 * ONSET
    table = result.motion.levels
    up = table[:3]  # on the way back a block that stands aside slips below mu N/m
    assert [one.stuck for one in up] == [one.drive < ONSET for one in up]
    assert result.response.time[-1] * 143 == pytest.approx(30 * len(table))
    assert np.all(np.diff(result.response.time) >= 0)


def test_always_progress_counts_levels_and_coarser_runs():
    """The completed fraction grows from level to level to 1; with errors, the coarser run is a part of it."""
    scene = loads(RIG.format(levels='["1 g", "2 g", "4 g", "5 g"]'))
    alone, all_runs = [], []
    run(scene, progress=alone.append, estimate=False)
    run(scene, progress=all_runs.append)
    assert alone == pytest.approx([0.25, 0.5, 0.75, 1.0])
    assert all_runs[:4] == pytest.approx([0.125, 0.25, 0.375, 0.5])
    assert all_runs == sorted(all_runs) and 0.5 < all_runs[-1] <= 1.0


def run_single_level(level: str):
    """Return a run at one drive level [g] from rest."""
    text = (
        RIG.format(levels='["1 g"]')
        .replace('waveform = "levels"\n', "")
        .replace('levels = ["1 g"]\nonset = "slip"', f'acceleration = "{level} g"')
    )
    return run(loads(text), estimate=False)


def third_harmonic_ratio(window) -> float:
    """Return the ratio of the third to the first harmonic of the acceleration in a window."""
    wave = [
        np.trapezoid(window.acceleration * np.exp(-2j * np.pi * n * 143 * window.time), window.time)
        for n in (1, 3)
    ]
    return abs(wave[1] / wave[0])


def test_exact_distortion_onset_has_three_percent_third_harmonic():
    """At the onset by distortion, the default, the third harmonic of the acceleration passes 3 % of the first."""
    text = RIG.format(levels='["3.9 g", "5 g"]').replace('onset = "slip"\n', "")
    onset = run(loads(text)).measures["onset_level"]
    assert onset.value > 1.005 * ONSET and onset.error <= 1e-3 * onset.value
    below, above = (
        third_harmonic_ratio(run_single_level((onset.value + way * onset.error) / G_N).window)
        for way in (-1, 1)
    )
    assert below < 0.03 < above < 0.031


def test_exact_gauge_onset_has_given_amplitude():
    """At the onset by a gauge, the amplitude of the output passes the given length."""
    text = RIG.format(levels='["3.9 g", "4.8 g", "6 g"]')
    found = run(
        loads(text.replace('onset = "slip"', 'onset = "gauge"\nonset_length = "0.1 mil"'))
    ).measures
    onset = found["onset_level"]
    below, above = (
        run_single_level((onset.value + way * onset.error) / G_N).measures[NAME].value
        for way in (-1, 1)
    )
    assert below < 2.54e-6 < above < 1.03 * 2.54e-6
    never = run(
        loads(text.replace('onset = "slip"', 'onset = "gauge"\nonset_length = "1 m"'))
    ).measures
    assert (
        never["onset_level"].reason
        == "no level of the increasing sequence has an amplitude of more than 1 m at the output"
    )
