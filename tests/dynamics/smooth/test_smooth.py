"""High-order integration between reversals: rate laws against SciPy, energies, and the ends of
runs."""

import numpy as np
import pytest
import smooth_reference as ref
from march_paths import OMEGA, make_one_mode
from modal_bases import make_modal_basis
from scipy.integrate import simpson

from patchfem.core import InitialState, Outcome, SineDrive
from patchfem.dynamics import points_model
from patchfem.dynamics.march.march import march
from patchfem.dynamics.smooth.arrays import Counter
from patchfem.dynamics.smooth.run import Motion, simulate
from patchfem.friction import Bonds, LuGre, TanhLaw, points_element
from patchfem.friction.laws.bouc_wen import BoucWen
from patchfem.response import energy_balance
from patchfem.structure import drives

LOAD, MASS = 115.65, 0.884
ONE = make_one_mode(OMEGA, 0.003, MASS)
SINE = SineDrive(49.0, OMEGA)
THREE = make_modal_basis(
    OMEGA * np.array([1, 3.3, 8.0]),
    [0.003, 0.01, 0.02],
    [1, 0.6, -0.4],
    [1, 0.1, 0.0],
    [1, 0.2, 0.1],
    mass=MASS,
)
SHORT, LONG = Bonds(0.3, 5e-6), Bonds(0.3, 1e-4, initial=0.4)
GROWING = Bonds(0.3, 5e-6, ratio=0.6, rest_growth=10.0, slip_growth=1e-6, rest_speed=1e-4)
LUGRE = LuGre(0.3, 0.25, 1e7 / LOAD, 1e-2, 20 / LOAD, 3 / LOAD)


def make_element(law):
    """Return the friction element of a law under the load LOAD."""
    return points_element(law, [1.0], [LOAD]) if isinstance(law, Bonds) else law.element(LOAD)


def relative_errors(
    modes, law, form, cycles=3, drive=SINE, event=None, start=None, tolerance=1e-11
):
    """Return the largest relative errors of the coordinates and of the force, against SciPy's
    integrator."""
    run = Motion(modes, drive, make_element(law), cycles, tolerance, start=start)
    end = cycles * drive.period
    times = np.linspace(0, end, 50 * cycles + 1)
    n = modes.omega.size
    samples = run.run_to(end, times)
    z, force = ref.integrate_modes(modes, drive, form(law, LOAD), end, times, start, event)
    return (
        abs(samples[:, 1 : 1 + n].T - z).max() / abs(z).max(),
        abs(samples[:, 2 * n + 3] - force).max() / abs(force).max(),
    )


def bond_rest_event(y, v):
    """Return |v| minus the rest speed of growing bonds; the law has a kink at its zero."""
    return abs(v) - GROWING.rest_speed


def stretch_event(y, v):
    """Return the stretch of the Bouc-Wen law; the law has a kink at its zero."""
    return y[0]


@pytest.mark.share(1, 2, 3)  # each of the other laws compiles its own loop
@pytest.mark.parametrize(
    "law, modes, form, event, force_tolerance",
    [
        (SHORT, ONE, ref.bonds_form, None, 1e-8),
        (LONG, ONE, ref.bonds_form, None, 1e-8),
        (SHORT, THREE, ref.bonds_form, None, 1e-8),
        (GROWING, ONE, ref.bonds_form, bond_rest_event, 1e-6),
        (LUGRE, ONE, ref.lugre_form, None, 1e-5),
        (BoucWen(0.3, 5e-6), ONE, ref.bouc_wen_form, stretch_event, 1e-7),
        (BoucWen(0.3, 5e-6, 1.5, 0.8), ONE, ref.bouc_wen_form, stretch_event, 1e-7),
        (TanhLaw(0.3, 1e-2), ONE, ref.tanh_form, None, 1e-7),
    ],
)
def test_exact_rate_laws_agree_with_scipy(law, modes, form, event, force_tolerance):
    """The motion of every rate law agrees with SciPy's integrator within 1e-9, and its force within
    a tolerance that depends on the law."""
    motion, force = relative_errors(modes, law, form, event=event)
    assert motion < 1e-9 and force < force_tolerance


@pytest.mark.share(1, 3)
@pytest.mark.parametrize(
    "drive",
    [
        drives.SweepDrive(100.0, 160.0, 0.02, 49.0),
        drives.SweepDrive(160.0, 100.0, 0.02, displacement=6e-5, logarithmic=True),
        drives.make_levels([30.0, 60.0], OMEGA, 1.0),
        drives.RecordedDrive(
            np.array([0, 0.004, 0.009, 0.02]), np.array([0, 60.0, -50.0, 20.0]), 1 / 143, False
        ),
    ],
)
def test_exact_response_to_every_waveform_agrees_with_scipy(drive):
    """The response to sweeps, drive levels and recorded signals agrees with SciPy's integrator, the
    motion within 1e-9 and the force within 1e-8."""
    motion, force = relative_errors(ONE, SHORT, ref.bonds_form, 3, drive)
    assert motion < 1e-9 and force < 1e-8


def test_exact_breakaway_agrees_with_time_stepping():
    """With breakaway friction, time stepping with 6400 steps per cycle converges to the amplitude
    of the high-order integration, within 2e-5."""
    law = Bonds(0.3, 5e-6, breakaway=0.4)
    fine = simulate(ONE, SINE, make_element(law), 4, 1e-10, 1)
    errors = []
    for steps in (1600, 6400):
        result = march(ONE, SINE, points_model(law, [1.0], [LOAD]), 4, steps, 1)
        errors.append(
            abs(
                np.ptp(result.window.output) / 2
                - fine.integrated.values["relative_displacement_amplitude"]
            )
            / fine.integrated.values["relative_displacement_amplitude"]
        )
    assert errors[1] < 2e-5 and errors[1] < 0.2 * errors[0]


def test_order_error_falls_with_tolerance():
    """The error of the amplitude is below 1e-4 at a tolerance of 1e-6 and below 1e-8 at 1e-9."""
    amplitudes = [
        simulate(ONE, SINE, make_element(SHORT), 6, tolerance, 1).integrated.values[
            "relative_displacement_amplitude"
        ]
        for tolerance in (1e-6, 1e-9, 1e-13)
    ]
    coarse, fine = (abs(value - amplitudes[-1]) / amplitudes[-1] for value in amplitudes[:2])
    assert fine < 1e-8 and coarse < 1e-4 and fine < 0.02 * coarse


@pytest.mark.share(0, 1)  # LuGre would compile a loop for this test alone
@pytest.mark.parametrize("law", [SHORT, GROWING, LUGRE])
def test_exact_energy_is_balanced(law):
    """Work of the drive, stored energy and losses are balanced within 1e-8."""
    energies = simulate(ONE, SINE, make_element(law), 8, 1e-9, 2).ledger
    assert energy_balance(energies) < 1e-8
    assert energies["friction"] > 0.1 * energies["work_in"] > 0


def test_exact_released_energy_is_dissipated():
    """A released rig comes to rest, and the losses and the remaining stored energy equal its
    initial energy within 1e-8."""
    start = InitialState(np.array([2e-4]), np.zeros(1))
    result = simulate(
        ONE, drives.make_release(SINE.period), make_element(SHORT), 30, 1e-10, 2, start=start
    )
    energies = result.ledger
    assert energies["work_in"] == pytest.approx(MASS * OMEGA**2 * 2e-4**2 / 2, rel=1e-12)
    assert energies["work_in"] == pytest.approx(
        energies["stored"] + energies["friction"] + energies["viscous"], rel=1e-8
    )
    assert np.ptp(result.window.slide) < 2e-7


def test_exact_speed_at_reversals_is_zero():
    """The slide speed at recorded reversals is below 1e-13 of its maximum."""
    result = simulate(THREE, SINE, make_element(SHORT), 20, 1e-9, 2)
    is_reversal = result.response.time < 17 * SINE.period
    speeds = abs(result.response.slide_rate[is_reversal][1:])
    assert is_reversal.sum() > 30 and speeds.max() < 1e-13 * abs(result.window.slide_rate).max()


def test_exact_run_ends_at_travel_limit():
    """A run ends where the output exceeds the travel limit, within 1e-11."""
    result = simulate(ONE, SINE, make_element(SHORT), 20, 1e-9, 2, travel=2e-5)
    assert result.outcome is Outcome.EXCEEDS_TRAVEL
    assert abs(result.window.output[-1]) <= 2e-5 and result.cycles_done < 20
    run = Motion(ONE, SINE, make_element(SHORT), 20, 1e-9, 2e-5)
    run.run_to(1.0)
    assert abs(run.arrays.state[0]) == pytest.approx(2e-5, rel=1e-11)


def test_exact_forked_run_equals_original_run():
    """A copy of a run continues bit-identically to the original run."""
    run = Motion(ONE, SINE, make_element(SHORT), 4, 1e-10)
    run.run_to(1.3 * SINE.period)
    copy = run.fork(SINE)
    run.run_to(3 * SINE.period)
    copy.run_to(3 * SINE.period)
    assert (
        np.array_equal(run.arrays.state, copy.arrays.state)
        and copy.record.counters[Counter.ACCEPTED] == run.record.counters[Counter.ACCEPTED]
    )


def test_exact_phasors_of_selected_cycles_equal_all_phasors():
    """Phasors that are computed for selected cycles only equal those of a run that computes all,
    and agree with Simpson's rule within 1e-8."""
    every, chosen = (Motion(THREE, SINE, make_element(SHORT), 8, 1e-9) for _ in range(2))
    chosen.request_last_phasors(3)
    count = 1024
    samples = every.run_to(8 * SINE.period, np.arange(8 * count + 1) / count * SINE.period)
    chosen.run_to(8 * SINE.period)
    is_chosen = np.array([False, True, False, False, True, False, False, True])
    assert np.array_equal(chosen.record.cycles[2:, is_chosen], every.record.cycles[2:, is_chosen])
    assert np.isnan(chosen.record.cycles[2:, ~is_chosen]).all() and np.array_equal(
        chosen.arrays.state, every.arrays.state
    )
    output = samples[:, 1:4] @ THREE.output * np.exp(-2j * np.pi * np.arange(8 * count + 1) / count)
    phasors = [2 / count * simpson(output[k * count : (k + 1) * count + 1]) for k in range(8)]
    assert every.record.cycles[2] + 1j * every.record.cycles[3] == pytest.approx(
        np.array(phasors), rel=1e-8
    )


def test_always_interface_snapshots_agree_with_time_stepping():
    """Snapshots of the interface have the same entries as those of time stepping and agree within
    1e-3."""
    fine = simulate(ONE, SINE, make_element(SHORT), 3, 1e-10, 1, frames=4)
    reference = march(ONE, SINE, points_model(SHORT, [1.0], [LOAD]), 3, 3200, 1, frames=4)
    assert len(fine.snapshots) == len(reference.snapshots) == 4
    for snapshot, expected in zip(fine.snapshots, reference.snapshots):
        assert snapshot.keys() == expected.keys() and snapshot["time"] == pytest.approx(
            expected["time"], rel=1e-12
        )
        assert snapshot["bonds"].shape == expected["bonds"].shape
        assert snapshot["bonds"][1] == pytest.approx(
            expected["bonds"][1], abs=1e-3 * LOAD * SHORT.length
        )
        assert snapshot["slide"] == pytest.approx(expected["slide"], abs=1e-4 * 5e-5)


@pytest.mark.parametrize("drive", [SineDrive(1e-6, OMEGA), drives.make_release(1 / 143)])
def test_exact_tiny_slides_need_no_small_steps(drive):
    """Slides far below the bond length need fewer than 1500 steps, and a release agrees with its
    closed form within 1e-7. The round-off of a bond length of 5 um is 1e-8 of such a slide and must
    not count as an error."""
    start = (
        InitialState(np.array([1e-14]), np.zeros(1)) if not drive.segments[0].amplitude else None
    )
    run = Motion(ONE, drive, make_element(SHORT), 4, 1e-11, start=start)
    end = 4 / 143
    times = np.linspace(0, end, 201)
    samples = run.run_to(end, times)
    stiff = 0.3 * LOAD / SHORT.length / MASS
    damped_omega = np.sqrt(OMEGA**2 + stiff - (0.003 * OMEGA) ** 2)
    if start is not None:
        # at the start the bonds are relaxed
        decay = 0.003 * OMEGA
        equilibrium = 1e-14 * stiff / (stiff + OMEGA**2)
        oscillation = np.exp(-decay * times) * (
            np.cos(damped_omega * times) + decay / damped_omega * np.sin(damped_omega * times)
        )
        expected = equilibrium + (1e-14 - equilibrium) * oscillation
        assert samples[:, 1] == pytest.approx(expected, abs=1e-7 * 1e-14)
    assert run.record.counters[Counter.ACCEPTED] < 1500


@pytest.mark.parametrize("second_slide", [0.348])
def test_exact_grazing_speed_agrees_with_scipy(second_slide):
    """Motions whose speed comes close to zero, with or without a reversal, agree with SciPy's
    integrator within 1e-9."""
    modes = make_modal_basis(
        OMEGA * np.array([1, 3.0]),
        [0.01, 0.003],
        [1.0, second_slide],
        [1, 0.1],
        [1, 0.0],
        mass=MASS,
    )
    motion, force = relative_errors(modes, SHORT, ref.bonds_form, 3, SineDrive(60.0, OMEGA))
    assert motion < 1e-9 and force < 1e-8


def test_exact_a_run_below_two_cycles_leaves_its_drift_to_the_samples():
    """The engine knows no drift below 1.5 cycles; a value None would remove that of the samples."""
    short = simulate(ONE, SINE, make_element(SHORT), 1, 1e-6, 1)
    long = simulate(ONE, SINE, make_element(SHORT), 4, 1e-6, 4)
    assert "drift_per_cycle" not in short.integrated.values
    assert "drift_per_cycle" in long.integrated.values
