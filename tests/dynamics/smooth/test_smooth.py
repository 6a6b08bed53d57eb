"""The integrator of high order between reversals: its coefficients, laws in rate form against SciPy, energies, ends."""

import numpy as np
import pytest
import smooth_reference as ref
from march_paths import OMEGA, one_mode
from modal_bases import basis_of
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
ONE = one_mode(OMEGA, 0.003, MASS)
SINE = SineDrive(49.0, OMEGA)
THREE = basis_of(
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


def element(law):
    return points_element(law, [1.0], [LOAD]) if isinstance(law, Bonds) else law.element(LOAD)


def compared(modes, law, form, cycles=3, drive=SINE, kink=None, start=None, tolerance=1e-11):
    """(largest error of the coordinates, of the force) over their sizes, against SciPy's integrator."""
    run = Motion(modes, drive, element(law), cycles, tolerance, start=start)
    end = cycles * drive.period
    times = np.linspace(0, end, 50 * cycles + 1)
    n = modes.omega.size
    rows = run.run_to(end, times)
    z, force = ref.integrate(modes, drive, form(law, LOAD), end, times, start, kink)
    return (
        abs(rows[:, 1 : 1 + n].T - z).max() / abs(z).max(),
        abs(rows[:, 2 * n + 3] - force).max() / abs(force).max(),
    )


def rest_of_bonds(y, v):
    """Kink of bonds that grow: below this speed they rest."""
    return abs(v) - GROWING.rest_speed


def sign_of_stretch(y, v):
    """Kink of Bouc-Wen's law."""
    return y[0]


@pytest.mark.share(0, 1, 2, 3)  # each other law is a loop to compile
@pytest.mark.parametrize(
    "law, modes, form, kink, near",
    [
        (SHORT, ONE, ref.bonds, None, 1e-8),
        (LONG, ONE, ref.bonds, None, 1e-8),
        (SHORT, THREE, ref.bonds, None, 1e-8),
        (GROWING, ONE, ref.bonds, rest_of_bonds, 1e-6),
        (LUGRE, ONE, ref.lugre, None, 1e-5),
        (BoucWen(0.3, 5e-6), ONE, ref.bouc_wen, sign_of_stretch, 1e-7),
        (BoucWen(0.3, 5e-6, 1.5, 0.8), ONE, ref.bouc_wen, sign_of_stretch, 1e-7),
        (TanhLaw(0.3, 1e-2), ONE, ref.tanh, None, 1e-7),
    ],
)
def test_exact_laws_are_their_rate_equations(law, modes, form, kink, near):
    motion, force = compared(modes, law, form, kink=kink)
    assert motion < 1e-9 and force < near


@pytest.mark.share(0, 1, 3)
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
def test_exact_every_waveform_drives_by_its_own_values(drive):
    motion, force = compared(ONE, SHORT, ref.bonds, 3, drive)
    assert motion < 1e-9 and force < 1e-8


def test_exact_breakaway_is_the_march_at_many_steps():
    law = Bonds(0.3, 5e-6, breakaway=0.4)
    fine = simulate(ONE, SINE, element(law), 4, 1e-10, 1)
    errors = []
    for steps in (1600, 6400):
        done = march(ONE, SINE, points_model(law, [1.0], [LOAD]), 4, steps, 1)
        errors.append(
            abs(np.ptp(done.window.output) / 2 - fine.integrated.output_amplitude)
            / fine.integrated.output_amplitude
        )
    assert errors[1] < 2e-5 and errors[1] < 0.2 * errors[0]


def test_order_of_the_error_follows_the_tolerance():
    found = [
        simulate(ONE, SINE, element(SHORT), 6, tolerance, 1).integrated.output_amplitude
        for tolerance in (1e-6, 1e-9, 1e-13)
    ]
    coarse, fine = (abs(value - found[-1]) / found[-1] for value in found[:2])
    assert fine < 1e-8 and coarse < 1e-4 and fine < 0.02 * coarse


@pytest.mark.share(0, 1)  # LuGre: a loop to compile for this alone
@pytest.mark.parametrize("law", [SHORT, GROWING, LUGRE])
def test_exact_energy_goes_into_motion_heat_and_stretch(law):
    book = simulate(ONE, SINE, element(law), 8, 1e-9, 2).ledger
    assert energy_balance(book) < 1e-8
    assert book["friction"] > 0.1 * book["work_in"] > 0


def test_exact_a_release_ends_at_rest_and_its_energy_is_lost():
    start = InitialState(np.array([2e-4]), np.zeros(1))
    done = simulate(
        ONE, drives.make_release(SINE.period), element(SHORT), 30, 1e-10, 2, start=start
    )
    book = done.ledger
    assert book["work_in"] == pytest.approx(MASS * OMEGA**2 * 2e-4**2 / 2, rel=1e-12)
    assert book["work_in"] == pytest.approx(
        book["stored"] + book["friction"] + book["viscous"], rel=1e-8
    )
    assert np.ptp(done.window.slide) < 2e-7


def test_exact_nothing_moves_without_a_push():
    done = simulate(ONE, drives.make_release(SINE.period), element(SHORT), 3, 1e-9, 1)
    assert not done.response.modal.any() and not done.response.force.any() and done.outcome is None


def test_exact_a_stuck_contact_is_a_spring():
    """Far below the bond length the motion is that of the linear oscillator with mu N/eps beside its spring."""
    small = SineDrive(1e-4, OMEGA)
    done = simulate(ONE, small, element(SHORT), 40, 1e-10, 1)
    stiff = OMEGA**2 + 0.3 * LOAD / SHORT.length / MASS
    ratio = done.integrated.loops[0].displacement_harmonic / done.integrated.loops[0].force_harmonic
    assert ratio == pytest.approx(SHORT.length / (0.3 * LOAD), rel=1e-4)
    decay = ONE.zeta[0] * ONE.omega[0]
    time = done.response.time
    turn = np.sqrt(stiff - decay**2)
    # z = Im(steady exp(i OMEGA t)) after the start
    steady = -1e-4 / complex(stiff - OMEGA**2, 2 * decay * OMEGA)
    left = -steady.imag, -(OMEGA * steady.real + decay * steady.imag) / turn
    linear = (steady * np.exp(1j * OMEGA * time)).imag + np.exp(-decay * time) * (
        left[0] * np.cos(turn * time) + left[1] * np.sin(turn * time)
    )
    assert done.response.slide == pytest.approx(linear, abs=1e-3 * np.abs(linear).max())


def test_exact_reversals_stand_at_rest_to_the_last_digit():
    done = simulate(THREE, SINE, element(SHORT), 20, 1e-9, 2)
    turns = done.response.time < 17 * SINE.period
    speeds = abs(done.response.slide_rate[turns][1:])
    assert turns.sum() > 30 and speeds.max() < 1e-13 * abs(done.window.slide_rate).max()


def test_exact_travel_ends_a_run_where_the_output_passes_it():
    done = simulate(ONE, SINE, element(SHORT), 20, 1e-9, 2, travel=2e-5)
    assert done.outcome is Outcome.EXCEEDS_TRAVEL
    assert abs(done.window.output[-1]) <= 2e-5 and done.cycles_done < 20
    row = Motion(ONE, SINE, element(SHORT), 20, 1e-9, 2e-5)
    row.run_to(1.0)
    assert abs(row.arrays.state[0]) == pytest.approx(2e-5, rel=1e-11)


def test_exact_a_fork_goes_on_as_the_run_would():
    run = Motion(ONE, SINE, element(SHORT), 4, 1e-10)
    run.run_to(1.3 * SINE.period)
    twin = run.fork(SINE)
    run.run_to(3 * SINE.period)
    twin.run_to(3 * SINE.period)
    assert (
        np.array_equal(run.arrays.state, twin.arrays.state)
        and twin.record.counters[Counter.ACCEPTED] == run.record.counters[Counter.ACCEPTED]
    )


def test_exact_phasors_of_chosen_cycles_are_those_of_every_cycle():
    every, chosen = (Motion(THREE, SINE, element(SHORT), 8, 1e-9) for _ in range(2))
    chosen.request_last_phasors(3)
    count = 1024
    rows = every.run_to(8 * SINE.period, np.arange(8 * count + 1) / count * SINE.period)
    chosen.run_to(8 * SINE.period)
    kept = np.array([False, True, False, False, True, False, False, True])
    assert np.array_equal(chosen.record.cycles[2:, kept], every.record.cycles[2:, kept])
    assert np.isnan(chosen.record.cycles[2:, ~kept]).all() and np.array_equal(
        chosen.arrays.state, every.arrays.state
    )
    output = rows[:, 1:4] @ THREE.output * np.exp(-2j * np.pi * np.arange(8 * count + 1) / count)
    turned = [2 / count * simpson(output[k * count : (k + 1) * count + 1]) for k in range(8)]
    assert every.record.cycles[2] + 1j * every.record.cycles[3] == pytest.approx(
        np.array(turned), rel=1e-8
    )


def test_always_snapshots_of_the_interface_are_those_of_the_march():
    fine = simulate(ONE, SINE, element(SHORT), 3, 1e-10, 1, frames=4)
    done = march(ONE, SINE, points_model(SHORT, [1.0], [LOAD]), 3, 3200, 1, frames=4)
    assert len(fine.snapshots) == len(done.snapshots) == 4
    for one, other in zip(fine.snapshots, done.snapshots):
        assert one.keys() == other.keys() and one["time"] == pytest.approx(other["time"], rel=1e-12)
        assert one["bonds"].shape == other["bonds"].shape
        assert one["bonds"][1] == pytest.approx(other["bonds"][1], abs=1e-3 * LOAD * SHORT.length)
        assert one["slide"] == pytest.approx(other["slide"], abs=1e-4 * 5e-5)


@pytest.mark.parametrize("drive", [SineDrive(1e-6, OMEGA), drives.make_release(1 / 143)])
def test_exact_slides_far_below_the_bond_length_cost_no_small_steps(drive):
    """Round-off of a bond length of 5 um is 1e-8 of such a slide: no step met its tolerance for it."""
    start = (
        InitialState(np.array([1e-14]), np.zeros(1)) if not drive.segments[0].amplitude else None
    )
    run = Motion(ONE, drive, element(SHORT), 4, 1e-11, start=start)
    end = 4 / 143
    times = np.linspace(0, end, 201)
    rows = run.run_to(end, times)
    stiff = 0.3 * LOAD / SHORT.length / MASS
    free = np.sqrt(OMEGA**2 + stiff - (0.003 * OMEGA) ** 2)
    if start is not None:
        # the bonds are unstretched at the start
        decay = 0.003 * OMEGA
        rest = 1e-14 * stiff / (stiff + OMEGA**2)
        sway = np.exp(-decay * times) * (np.cos(free * times) + decay / free * np.sin(free * times))
        want = rest + (1e-14 - rest) * sway
        assert rows[:, 1] == pytest.approx(want, abs=1e-7 * 1e-14)
    assert run.record.counters[Counter.ACCEPTED] < 1500


@pytest.mark.parametrize("share", [0.33, 0.348, 0.385])
def test_exact_a_speed_that_grazes_zero_turns_or_passes(share):
    modes = basis_of(
        OMEGA * np.array([1, 3.0]), [0.01, 0.003], [1.0, share], [1, 0.1], [1, 0.0], mass=MASS
    )
    motion, force = compared(modes, SHORT, ref.bonds, 3, SineDrive(60.0, OMEGA))
    assert motion < 1e-9 and force < 1e-8
