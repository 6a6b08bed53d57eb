"""Errors of `event_driven`, histories, samples and early ends."""

import dataclasses

import numpy as np
import pytest
from event_driven_cases import coulomb, make_modes, make_oscillator
from random_rigs import RIGS, make_case

from patchfem.core import SineDrive
from patchfem.event_driven import cases, drives, runs
from patchfem.event_driven.laws.masing import from_elements
from patchfem.event_driven.records import Setting, Status
from patchfem.structure.drives import RecordedDrive, SweepDrive


def test_histories_are_those_of_the_dense_output():
    """Samples lie on the solution of a run whose steps are much smaller; the acceleration obeys eq. 3.4."""
    modes, drive = make_modes(zeta=0.003), SineDrive(1.0, 1.0)
    time = np.linspace(0.0, 60.0, 301)
    motions = [
        runs.run_case(make_oscillator(coulomb(), cycles=10, rtol=rtol, samples=time))
        for rtol in (1e-7, 1e-12)
    ]
    fine, exact = (motion.make_response(modes, drive) for motion in motions)
    at = [np.searchsorted(response.time, time) for response in (fine, exact)]
    assert fine.slide[at[0]] == pytest.approx(exact.slide[at[1]], abs=1e-6)
    assert np.all(np.diff(fine.time) >= 0)
    relative = fine.acceleration - fine.base_acceleration
    residual = relative + fine.slide + 0.006 * fine.slide_rate + fine.force + np.sin(fine.time)
    assert np.abs(residual).max() < 1e-12
    # Between two events the friction work is that of the constant force along the slide.
    ledger = fine.extra["ledger"]
    assert ledger[0] == pytest.approx(ledger[2], rel=1e-12)
    path = np.abs(np.diff(fine.slide)).sum()
    assert ledger[0, -1] - ledger[0, 0] == pytest.approx(0.8 * path, rel=1e-5)


@pytest.mark.parametrize("name", ["4", "7", "16", "38", "13"])
def test_energy_is_balanced(name):
    """Work of the drive = energy of the modes + friction + dampers, whatever the laws."""
    motion = runs.run_case(make_case(RIGS[name]["spec"], rtol=1e-11))
    assert motion.values["energy_balance"] < 1e-9


@pytest.mark.parametrize("law", [coulomb(), from_elements([0.5, 1.0], [0.3, 0.6])])
def test_a_motion_goes_on_from_the_end_of_another(law):
    """Two runs of 20 cycles, the second from the end of the first, equal a run of 40 cycles."""
    options = {"acceleration": 0.9, "zeta": 0.01, "rtol": 1e-11, "load": 0.5}
    whole = runs.run_case(make_oscillator(law, cycles=40, **options))
    half = make_oscillator(law, cycles=20, **options)
    first = runs.run_case(half)
    second = runs.run_case(half, start=first.final)
    extremes = np.concatenate([first.extremes, second.extremes])
    assert extremes == pytest.approx(whole.extremes, rel=1e-7)
    work = [motion.values["friction_work"] for motion in (first, second, whole)]
    assert work[0] + work[1] == pytest.approx(work[2], rel=1e-7)
    assert second.values["energy_balance"] < 1e-8


@pytest.mark.parametrize("late", [0, 1e-15])
def test_cycles_that_are_not_computed_have_the_samples_of_all_cycles(late):
    """A motion that repeats early has samples, works and events as if each cycle had been computed.

    Samples may be late by round-off, so that those at the end of a cycle belong to the next one.
    """
    samples = np.arange(0, 60.5, 0.25) * 2 * np.pi * (1 + late)
    case = make_oscillator(coulomb(), cycles=60, zeta=0.2, rtol=1e-9, load=0.6, samples=samples)
    whole = case.rig.settings.copy()
    whole[Setting.REPEAT] = 0
    every = dataclasses.replace(case, rig=case.rig._replace(settings=whole))
    short, full = (runs.run_case(one) for one in (case, every))
    assert short.repeats and not full.repeats
    assert short.rows.shape == full.rows.shape
    n = 1 + case.y.size
    assert short.rows[:, :n] == pytest.approx(full.rows[:, :n], rel=1e-6, abs=1e-7)


@pytest.mark.parametrize("omega", [0.94, 1.23, 1.25, 1.88])
def test_samples_at_ends_of_repeated_cycles_have_their_times(omega):
    """A motion that repeats has a row at each time of a sample, also at the ends of cycles that are not computed, where
    round-off may move the end of a step before the sample."""
    period = 2 * np.pi / omega
    samples = np.arange(0, 56 * period, period / 40)
    case = make_oscillator(
        coulomb(), cycles=60, zeta=0.2, rtol=1e-9, load=0.6, omega=omega, samples=samples
    )
    motion = runs.run_case(case)
    time = motion.rows[:, 0]
    assert motion.repeats and time[-1] <= 60 * period * (1 + 1e-12)
    assert np.abs(time[:, None] - samples).min(axis=0).max() < 1e-9 * period
    assert time.size == samples.size + 2 * len(motion.event_rows)


def test_drives_have_the_values_of_their_records():
    """Pieces of sweeps and records give the same motion as a finely sampled record of the drive."""
    modes = make_modes(zeta=0.05)
    for drive in (
        SweepDrive(0.1, 0.3, 40.0, acceleration=1.0),
        SweepDrive(0.3, 0.1, 40.0, displacement=0.5, logarithmic=True),
    ):
        time = np.linspace(0.0, 60.0, 6001)
        outputs = []
        for signal in (
            drives.make_signal(drive),
            drives.make_signal(RecordedDrive(time, drive.values(time), drive.period)),
        ):
            interface = cases.Interface(coulomb(), cases.Load(0.3), np.ones(1))
            rig = cases.make_rig(
                modes, signal, [interface], (1.0, 1.0), cases.Options(moves_base=True, rtol=1e-9)
            )
            case = cases.Case(
                rig,
                cases.make_start(rig, [interface]),
                np.array([59.0]),
                np.zeros(1),
                np.zeros(0),
                1,
            )
            outputs.append(runs.run_case(case).final.y[:2])
        assert outputs[0] == pytest.approx(outputs[1], abs=1e-4)


def test_too_stiff_a_law_is_refused_in_a_sentence():
    """A run that would need too many steps ends with a message."""
    from patchfem.event_driven.records import LawNumbers

    law = LawNumbers("tanh", (1.0, 1e-7))
    motion = runs.run_case(make_oscillator(law, acceleration=0.7, cycles=50, max_steps=20_000))
    assert motion.status is Status.TOO_MANY_STEPS
    assert "steps" in motion.message and "\n" not in motion.message
