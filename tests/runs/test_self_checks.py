"""Second computations from the values of a scene agree with the measures of its run; a wrong energy or load ends a run."""

from dataclasses import replace

import numpy as np
import pytest
from scene_runs import run_scene
from scene_texts import COATED, COULOMB, DRIVE, MODE, NONLOCAL, PLASTIC, POINT

from patchfem.core import Outcome
from patchfem.runs.bench import bench
from patchfem.runs.findings import mark_unbalanced
from patchfem.time_steps import time_march

SECOND = '[[structure.mode]]\nname = "second"\nfrequency = "170 Hz"\ndamping = 0.01\nslide = 0.4\noutput = 0.7\nbase = 0.3\n'
RIG = MODE + SECOND + DRIVE
CHANGES = "structure.mode.axial.damping=0.01; structure.mode.axial.base=0.9; drive.frequency=85 Hz; drive.cycles=20; "
MARCH = "accuracy.method=march; accuracy.steps_per_cycle=400; drive.cycles=10"
SLIDE = '[slide]\nkind = "sine"\namplitude = "60 um"\nfrequency = "50 Hz"\ncycles = 2\n'


@pytest.mark.parametrize(
    "text, changes",
    [
        (POINT + COULOMB + RIG, ""),
        (POINT + NONLOCAL + RIG, MARCH),
        (POINT + PLASTIC + RIG, "accuracy.method=harmonic"),
    ],
)
def test_motion_satisfies_equation_of_motion_of_scene(text, changes):
    """The last cycles satisfy z'' = -2 zeta omega z' - omega^2 z - base a - slide F/m with the numbers of the scene.

    The amplitude and the loop area are those of the sums over the modes, and the peak that of the acceleration.
    """
    result = run_scene(text, CHANGES + changes)
    window, measures = result.window, result.measures
    omega = 2 * np.pi * np.array([143.0, 170.0])
    slide, base, output = np.array([[1.0, 0.4], [0.9, 0.3], [1.0, 0.7]])
    drive = 5 * 9.80665 * np.sin(2 * np.pi * 85 * window.time)
    modal = -2 * 0.01 * omega * window.modal_rate - omega**2 * window.modal
    modal -= np.outer(drive, base) + np.outer(window.force, slide) / 0.884
    acceleration = modal @ output + drive
    # A friction force that jumps at a sample may have either value there.
    assert np.median(np.abs(window.acceleration - acceleration)) < 1e-6 * np.abs(drive).max()
    peak = measures["absolute_acceleration_peak"]
    assert peak.value == pytest.approx(np.abs(acceleration).max(), rel=0.05)
    amplitude = np.ptp(window.modal @ output) / 2
    assert measures["relative_displacement_amplitude"].value == pytest.approx(amplitude, rel=0.01)
    displacement = window.modal @ slide
    np.testing.assert_allclose(window.slide, displacement, atol=1e-9 * amplitude)
    force = (window.force[1:] + window.force[:-1]) / 2
    cycles = round((window.time[-1] - window.time[0]) * 85)
    work = np.diff(displacement) @ force / cycles
    assert measures["loop_area"].value == pytest.approx(work, rel=0.01)


@pytest.mark.parametrize(
    "owner, name, fault, text, changes, warning",
    [
        (
            time_march.March,
            "find_ledger",
            lambda balance: balance | {"friction": (1 + 1e-6) * balance["friction"]},
            POINT + NONLOCAL + RIG,
            CHANGES + MARCH,
            "of the exchanged energy is missing or was created (limit 1e-8)",
        ),
        (
            bench,
            "_compute_measures",
            lambda values: values | {"energy_balance": 0.5},
            POINT + PLASTIC + SLIDE,
            "",
            "energy balance: 0.5 of the exchanged energy is missing or was created",
        ),
    ],
    ids=["march", "bench"],
)
def test_always_lost_energy_ends_run_as_not_converged(
    monkeypatch, owner, name, fault, text, changes, warning
):
    """Energy that a run lost or created leads to not_converged, and the measures have no errors."""
    function = getattr(owner, name)
    monkeypatch.setattr(owner, name, lambda *arguments: fault(function(*arguments)))
    result = run_scene(text, changes)
    assert result.outcome is Outcome.NOT_CONVERGED
    assert any(warning in sentence for sentence in result.warnings), result.warnings
    assert all(measure.error is None for measure in result.measures.values())


def test_always_wrong_load_ends_run_as_not_converged():
    """A pressure whose integral is 1 % more than the load of 26 lbf leads to not_converged with both numbers."""
    result = run_scene(COATED, "")
    pressure = result.patch.pressure
    pressure = replace(pressure, sigma_n=1.01 * pressure.sigma_n)
    marked = mark_unbalanced(result.with_changes(patch=replace(result.patch, pressure=pressure)))
    assert marked.outcome is Outcome.NOT_CONVERGED
    warning = "is 116.81 N, but the load is 115.654 N; they differ by 0.01 of the load"
    assert warning in marked.warnings[0]
