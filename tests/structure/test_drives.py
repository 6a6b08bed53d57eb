"""Drives: their signals, the march under each drive against closed forms, and scenes."""

import numpy as np
import pytest
from march_contacts import make_contact
from modal_bases import make_modal_basis
from scene_texts import MODE, PLASTIC, POINT
from scipy.integrate import quad

from patchfem import SceneError, plan, run
from patchfem.core import Outcome, SineDrive
from patchfem.scene import loads
from patchfem.structure.drive_sizes import choose_samples_per_cycle, is_release
from patchfem.structure.drives import (
    RecordedDrive,
    SweepDrive,
    make_levels,
    make_release,
    make_step,
)
from patchfem.structure.tones import make_tones
from patchfem.time_steps.time_march import march

OMEGA = 2 * np.pi * 143


# ---- signals


@pytest.mark.parametrize("logarithmic", [False, True])
@pytest.mark.parametrize("low, high", [(50.0, 200.0), (200.0, 50.0)])
def test_exact_sweep_phase_is_integral_of_frequency(low, high, logarithmic):
    """The phase of a linear or logarithmic sweep is the integral of its frequency."""
    sweep = SweepDrive(low, high, 2.0, 3.0, None, logarithmic)
    for t in (0.3, 1.7, 2.0, 2.4):
        cycles = (
            quad(lambda s: float(sweep.frequency(s)), 0, min(t, 2.0), epsabs=1e-12)[0]
            + max(t - 2.0, 0) * high
        )
        assert sweep.phase(t) == pytest.approx(2 * np.pi * cycles, rel=1e-12)
    assert sweep.frequency(np.array([0.0, 2.0, 9.0])) == pytest.approx([low, high, high])
    middle_frequency = np.sqrt(low * high) if logarithmic else (low + high) / 2
    assert sweep.frequency(1.0) == pytest.approx(middle_frequency)
    displacement_sweep = SweepDrive(low, high, 2.0, 0.0, 1e-3, logarithmic)
    assert displacement_sweep.values(1.0) == pytest.approx(
        1e-3 * (2 * np.pi * middle_frequency) ** 2 * np.sin(displacement_sweep.phase(1.0))
    )


def test_exact_level_change_preserves_phase():
    """A change of the amplitude level preserves the phase of the signal."""
    drive = make_levels([2.0, 3.0], OMEGA, 2.5)
    sine = SineDrive(1.0, OMEGA)
    t = np.linspace(0, 5 * sine.period, 101)[:-1]
    amplitude = np.where(t < 2.5 * sine.period - 1e-12, 2.0, 3.0)
    assert drive.values(t) == pytest.approx(amplitude * np.sin(OMEGA * t), abs=1e-12)


@pytest.mark.parametrize(
    "frequencies, cycles",
    [((40.0, 60.0), 2), ((60.0, 90.0, 150.0), 2), ((100.0, 101.0), 100), ((2.5, 1.0), 5)],
)
def test_exact_tones_repeat_after_their_beat(frequencies, cycles):
    """Several tones repeat after the least common multiple of their periods, and after no fewer cycles of the first."""
    signal = make_tones(frequencies, np.ones(len(frequencies)), np.zeros(len(frequencies)), 1.0)
    counts = np.arange(1, cycles + 1)[:, None] * np.array(frequencies) / frequencies[0]
    are_whole = np.all(np.abs(counts - np.round(counts)) < 1e-9, axis=1)
    assert signal.beat == cycles == counts[are_whole][0, 0]


# ---- the march


def march_without_friction(modes, drive, cycles, steps=200):
    """Return a march of a basis under a drive without friction."""
    contact = make_contact([], modes.interfaces[:0], (), 1.0)
    return march(modes, drive, contact, cycles, steps, window=1000)


def test_exact_step_response_agrees_with_closed_form():
    """Displacement and acceleration after a step of the base agree with the damped closed form."""
    drive = make_step(9.0, 2 * np.pi / OMEGA)
    zeta = 0.05
    response = march_without_friction(
        make_modal_basis(OMEGA, zeta, mass=0.9), drive, 20, 40
    ).response
    damped_omega = OMEGA * np.sqrt(1 - zeta**2)
    expected = 1 - np.exp(-zeta * OMEGA * response.time) * (
        np.cos(damped_omega * response.time)
        + zeta * OMEGA / damped_omega * np.sin(damped_omega * response.time)
    )
    assert response.slide == pytest.approx(-9.0 / OMEGA**2 * expected, rel=1e-10, abs=1e-17)
    assert response.acceleration == pytest.approx(
        -2 * zeta * OMEGA * response.slide_rate - OMEGA**2 * response.slide, abs=1e-9
    )
    assert response.base_acceleration == pytest.approx(9.0)


def test_exact_record_does_not_end_before_its_last_sample():
    """A time that exceeds the end of a record by round-off has its last value; the signal is 0 later.

    Sums of equal steps exceed the end, so that the last sample of a run had a false peak of the acceleration.
    """
    record = RecordedDrive(np.array([0.0, 0.1]), np.array([0.0, 3.0]), 0.1)
    step = 0.1 / 3
    for end in (np.nextafter(0.1, 1), 3 * step, step + step + step):
        assert record.values(end) == pytest.approx(3.0, rel=1e-12), end
    assert record.values(0.1001) == 0


def test_exact_loss_of_straight_lines(tmp_path):
    """A sine with 8 rows per cycle loses the part of its amplitude that `find_line_loss` states."""
    time = np.arange(801) / (8 * 143.0)
    rows = np.c_[time, np.sin(2 * np.pi * 143 * time)]
    head = "time [s],acceleration [m/s^2]"
    np.savetxt(tmp_path / "a.csv", rows, delimiter=",", header=head, comments="")
    drive = '[drive]\nkind = "base"\nwaveform = "file"\nfile = "a.csv"\n'
    rig = plan(loads(MODE + drive, tmp_path / "a.toml")).model.rig
    loss = rig.drive.signal.find_line_loss(rig.modes)
    fine = np.linspace(0, time[-1], 200_000, endpoint=False)
    sine = np.sin(2 * np.pi * 143 * fine)
    amplitude = 2 * np.mean(rig.drive.signal.values(fine) * sine)
    assert loss == pytest.approx((143.0, 8.0, 1 - amplitude), rel=1e-4)


# ---- scenes

RIG = POINT + PLASTIC + MODE + "[accuracy]\ntolerance = 1e-2\n"


def run_drive(drive):
    """Return the result and the values of its measures for the text of a drive."""
    result = run(plan(loads(f"{RIG}[drive]\n{drive}")))
    assert result.outcome is not Outcome.NOT_CONVERGED
    return result, {name: m.value for name, m in result.measures.items()}


def test_force_drive_equals_base_drive_in_relative_motion():
    """A force of mass times base acceleration gives the same relative motion and another absolute acceleration."""
    _, force = run_drive('kind = "force"\nfrequency = "143 Hz"\nforce = "39 N"\ncycles = 30')
    _, base = run_drive(
        f'kind = "base"\nfrequency = "143 Hz"\nacceleration = "{39 / 0.884!r} m/s^2"\ncycles = 30'
    )
    for name in ("relative_displacement_amplitude", "loop_area", "friction_work"):
        assert force[name] == pytest.approx(base[name], rel=1e-9)
    assert force["absolute_acceleration_peak"] != pytest.approx(
        base["absolute_acceleration_peak"], rel=1e-2
    )


@pytest.mark.parametrize(
    "drive, key",
    [
        (
            'kind = "base"\nwaveform = "sweep"\nfrom = "1 Hz"\nto = "9 Hz"\nacceleration = "1 g"',
            "drive.rate",
        ),
        (
            'kind = "base"\nwaveform = "sweep"\nfrom = "1 Hz"\nto = "9 Hz"\nrate = "1 Hz/s"\nlog_rate = "1 oct/min"\n'
            'acceleration = "1 g"',
            "drive.log_rate",
        ),
        (
            'kind = "force"\nwaveform = "levels"\nlevels = ["1 g"]\nfrequency = "9 Hz"\ncycles = 3',
            "drive.levels",
        ),
        ('kind = "base"\nwaveform = "step"\ncycles = 3', "drive.acceleration"),
        ('kind = "base"\nwaveform = "file"', "drive.file"),
    ],
)
def test_refuses_incomplete_drive(drive, key):
    """A drive with a missing, superfluous or invalid key is refused with the name of the key."""
    with pytest.raises(SceneError, match=key.replace(".", r"\.")):
        loads(f"{RIG}[drive]\n{drive}")


def test_exact_only_a_drive_that_is_zero_stores_samples_of_all_cycles():
    """A release stores samples in equal steps, unless it has too many cycles; every other drive stores reversals alone."""
    release = make_release(1e-2)
    assert is_release(release)
    count = choose_samples_per_cycle(release, 10.0)
    assert count > 0 and choose_samples_per_cycle(release, 1e12) == 0
    others = [
        SineDrive(3.0, OMEGA),
        make_step(3.0, 1e-2),
        make_levels([1.0, 2.0], OMEGA, 3),
        SweepDrive(50.0, 200.0, 2.0, 3.0, None, False),
    ]
    for drive in others:
        assert not is_release(drive)
        assert choose_samples_per_cycle(drive, 10.0) == 0
