"""Histories that a run stores, for every engine and drive."""

import numpy as np
import pytest
from scene_runs import run_scene
from scene_texts import (
    BLOCK,
    COULOMB,
    DRIVE,
    GROOVED,
    MODE,
    NONLOCAL,
    PLASTIC,
    POINT,
    SECOND,
    SHEAR,
    make_friction_table,
)

EVENT_DRIVEN, MARCH = (
    POINT + COULOMB + MODE,
    POINT + NONLOCAL.replace("1 um", "3 um") + MODE + SECOND,
)
BASE = '[drive]\nkind = "base"\nacceleration = "6 g"\n'
FREE = '[drive]\nkind = "free"\ndisplacement = "0.3 mm"\n'
CASES = {  # Scene and changes.
    "sine": (EVENT_DRIVEN + DRIVE, ""),
    "two modes": (POINT + COULOMB + MODE + SECOND + FREE, "drive.duration=1 ms"),
    "release": (POINT + make_friction_table("tanh") + MODE + FREE, "drive.duration=0.1 s"),
    "marched release": (MARCH + FREE, "accuracy.method=march; drive.duration=0.1 s"),
    "levels": (
        POINT + PLASTIC + MODE + DRIVE.replace('acceleration = "5 g"\n', ""),
        'accuracy.method=march; drive.waveform=levels; drive.levels=["4 g", "6 g"]; drive.cycles=15',
    ),
    "step": (
        EVENT_DRIVEN + '[drive]\nkind = "force"\nwaveform = "step"\nforce = "100 N"\n',
        "drive.duration=0.1 s",
    ),
    "sweep": (
        EVENT_DRIVEN + BASE,
        "accuracy.method=march; drive.waveform=sweep; drive.from=135 Hz; drive.to=150 Hz; drive.rate=60 Hz/s",
    ),
    "file": (MARCH + BASE.replace('acceleration = "6 g"\n', ""), "drive.waveform=file; drive.file=a.csv"),
}  # fmt: skip


@pytest.mark.parametrize("method", ["march", "exact"])
def test_exact_energies_continue_over_drive_levels(method):
    """Dissipated energy and work never start anew at a level: the balance holds at every sample of all levels."""
    text, changes = CASES["levels"]
    result = run_scene(text, changes.replace("march", method), estimate=False)
    time = result.response.time
    work, stored, dissipated, created = result.response.extra["ledger"]
    scale = dissipated[-1]
    gap = work - (stored - stored[0]) - dissipated + created
    assert np.abs(gap).max() <= (1e-9 if method == "march" else 1e-6) * scale
    assert np.diff(dissipated).min() >= -1e-9 * scale
    first_level = dissipated[time <= time[-1] / 2][-1]
    assert 0 < first_level < 0.5 * scale


SHAKEN = MODE.replace("0.003", "0.02") + DRIVE.replace("143", "150")
LEVELS = (
    'drive.waveform=levels; drive.levels=["1 g", "5 g"]; drive.cycles=10; accuracy.method=exact'
)
HARMONIC = "accuracy.method=harmonic"
RELEASE = "accuracy.method=exact"


@pytest.mark.parametrize("law", ["elastic-plastic", "bouc-wen", "lugre"])
@pytest.mark.parametrize(
    "changes", [HARMONIC, LEVELS, RELEASE], ids=["harmonic", "levels", "release"]
)
def test_exact_stored_energy_is_that_of_the_spring(law, changes):
    """The stored energy is F^2/2k at every sample, also of a periodic motion and of a level that starts with a stretch.

    A release begins without a stretch.
    """
    text = POINT + make_friction_table(law) + SHAKEN
    if changes == LEVELS:
        text = text.replace('acceleration = "5 g"\n', "")
    elif changes == RELEASE:
        text = text[: text.index("[drive]")] + FREE + "cycles = 20\n"
    response = run_scene(text, changes, estimate=False).response
    stiffness = 0.3 * 26 * 4.4482216152605 / 1e-6 if law == "elastic-plastic" else 1e7
    stored = response.extra["ledger"][1]
    assert stored == pytest.approx(response.force**2 / (2 * stiffness), abs=1e-5 * stored.max())
    assert stored.min() >= 0


@pytest.mark.parametrize(
    "interface",
    [
        POINT + make_friction_table("iwan"),
        POINT + NONLOCAL,
        BLOCK + '[contact.crown]\nradius = "20 m"\n' + SHEAR + COULOMB,
        GROOVED.replace("0.4", "0.05"),
    ],
    ids=["iwan", "bonds", "patch", "grooves"],
)
def test_exact_stored_energy_of_periodic_motion_agrees_with_run_from_rest(interface):
    """Over a cycle the energy of a periodic motion has the extremes of a motion that starts at rest, without energy."""
    periodic = run_scene(interface + SHAKEN, HARMONIC, estimate=False).window
    marched = run_scene(
        interface + SHAKEN, "accuracy.method=exact; drive.cycles=300", estimate=False
    )
    last = marched.window.time > marched.window.time[-1] - 1 / 150
    expected = marched.window.extra["ledger"][1][last]
    stored = periodic.extra["ledger"][1]
    assert stored.max() == pytest.approx(expected.max(), rel=1e-5)
    assert stored.min() == pytest.approx(expected.min(), abs=1e-5 * expected.max())


@pytest.mark.parametrize("name", CASES)
def test_always_last_two_cycles_have_hundred_samples_each(name, tmp_path):
    """A history has its start, its end, and at least 100 samples per cycle of the last two cycles; the motion between
    two samples of a release stays close to a straight line."""
    time = np.linspace(0, 0.1, 800)
    value = 6 * 9.81 * np.sin(2 * np.pi * (130 * time + 100 * time**2))
    np.savetxt(
        tmp_path / "a.csv",
        np.c_[time, value],
        delimiter=",",
        header="time [s],base_acceleration [m/s^2]",
        comments="",
    )
    text, changes = CASES[name]
    result = run_scene(text, changes, tmp_path / "a.toml", estimate=False)
    assert any("rows per cycle of" in text for text in result.warnings) == (name == "file")
    response = result.response
    period, end = result.plan.model.rig.drive.signal.period, result.window.time[-1]
    assert (np.diff(response.time) > 0).all() and response.time.size >= 100
    assert response.time[0] == 0 and response.time[-1] == end
    start = max(0.0, end - 2 * period)
    last_times = response.time[response.time >= start * (1 - 1e-9)]
    assert last_times[0] - start < 1e-6 * period
    assert np.diff(last_times).max() <= period / 100 * (1 + 1e-6)
    if "release" in name:
        assert np.diff(response.time).max() <= period / 20 * (1 + 1e-6)
        bends = np.diff(response.time) * np.diff(response.output_rate) / 8
        assert np.abs(bends).max() < 2e-2 * np.abs(response.output).max()
