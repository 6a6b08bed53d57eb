"""The comparison methods on the report's own problems: Figs 5, 10-12, 17-22, free decay, stick-slip at resonance."""

import numpy as np
import pytest
from comparison_cases import FREE_FREE, PLAIN, SDOF, UNIT, basis, elastic_plastic, sine, tanh
from report_methods import duhamel, euler, newmark
from report_methods.point_laws import Coulomb

from patchfem.core import DriveSegment, InitialState
from patchfem.structure.drives import Piecewise, release

STICK_SLIP = 0.28704671337871602595  # exact peak, D = .8, 2 xi = .006


def figure(law, h, convergence="velocity", tolerance=1e-6, relax=0.5, duration=40.0) -> dict:
    """What rig.md tells of a run of Fig 16 (m = k = P0 = 1, omega = 1.14) by steps of h."""
    found = duhamel.run(
        FREE_FREE, sine(1.14, h), (law,), duration, 1000, convergence, tolerance, relax
    )
    x, force = found.slide(FREE_FREE)[0], found.force[0]
    first = int(np.argmax(np.abs(x) > 0.05))
    return {
        "early": float(np.abs(x[found.time < 8]).max()),
        "time": found.time[first],
        "force": abs(force[first]),
        "jumps": float(np.mean(np.abs(np.diff(force)) > 1)),
        "x20": float(np.interp(20, found.time, x)),
        "x40": float(np.interp(40, found.time, x)),
        "run": found,
    }


def test_exact_a_displacement_criterion_moves_a_stuck_mass():
    """Figs 17 and 18: the mass moves while the force is far below 3; what is accepted says why."""
    smooth = figure(Coulomb(3.0, 3.0), 0.05, "displacement", 1e-2, 0.1)
    assert smooth["early"] == pytest.approx(0.115, abs=5e-4) and smooth["time"] == pytest.approx(
        5.5
    )
    assert smooth["force"] == pytest.approx(2.56, abs=5e-3) and smooth["jumps"] == 0
    assert smooth["run"].iterations[1:].mean() == pytest.approx(2.0) and smooth["run"].failures == 0
    assert smooth["run"].worst > 3  # N, of a limit of 3: the criterion is content
    rough = figure(Coulomb(3.0, 3.0), 0.05, "displacement", 1e-3, 0.5)
    assert rough["early"] == pytest.approx(0.079, abs=5e-4) and rough["time"] == pytest.approx(3.5)
    assert rough["force"] == pytest.approx(1.38, abs=5e-3) and rough["jumps"] == pytest.approx(
        0.2, abs=0.03
    )


@pytest.mark.parametrize(
    "h, convergence, tolerance, relax, early",
    [
        (0.05, "displacement", 1e-6, 0.1, 0.015),
        (0.05, "velocity", 1e-4, 0.1, 0.015),
        (0.02, "velocity", 1e-6, 0.5, 0.03),
    ],
)
def test_exact_tight_criteria_hold_the_mass_with_an_erratic_force(
    h, convergence, tolerance, relax, early
):
    """Figs 19 and 20: no drift before the limit is reached, but sgn has no fixed point at rest."""
    found = figure(Coulomb(3.0, 3.0), h, convergence, tolerance, relax)
    assert found["early"] < early and found["time"] == pytest.approx(8.6, abs=0.06)
    assert found["force"] == pytest.approx(3.0, abs=0.02) and 0.1 < found["jumps"] < 0.35
    assert found["run"].failures > 0.2 * found["run"].time.size and found["run"].worst > 5


def test_exact_a_static_branch_cures_it():
    found = figure(Coulomb(3.0, 3.0, 0.01), 0.02, "velocity", 1e-8)
    assert (
        found["early"] < 2e-4
        and found["force"] == pytest.approx(3.0, abs=5e-3)
        and found["jumps"] < 0.01
    )
    assert found["x20"] == pytest.approx(-0.30479, abs=0.006)


@pytest.mark.parametrize(
    "length, early, x20, x40",
    [(0.01, 0.0095, -0.302, -0.049), (0.03, 0.03, -0.66, None), (0.1, 0.1, 0.37, None)],
)
def test_exact_elastic_plastic_friction(length, early, x20, x40):
    """Figs 21 and 22, and what the contact's own vibration does to the offsets."""
    found = figure(elastic_plastic(3.0, length), 0.01)
    assert found["early"] == pytest.approx(early, rel=0.05) and found["jumps"] == 0
    assert found["x20"] == pytest.approx(x20, abs=5e-3) and found["run"].failures == 0
    assert x40 is None or found["x40"] == pytest.approx(x40, abs=2e-3)


def test_exact_the_printed_law_runs_away():
    found = figure(elastic_plastic(3.0, 0.03, True), 0.01)
    assert found["x20"] == pytest.approx(-91, abs=0.5) and found["x40"] == pytest.approx(
        -734, abs=2
    )


@pytest.mark.share(0, 1, 2, 3)
@pytest.mark.parametrize(
    "speed, steps, error",
    [
        (1e-3, 100, 0.057),
        (1e-3, 1000, -1.0),
        (1e-4, 100, 0.26),
        (1e-4, 1000, -0.011),
        (1e-4, 10000, -1.0),
    ],
)
def test_exact_newmark_gets_worse_as_the_step_falls(speed, steps, error):
    found = newmark.run(SDOF, UNIT, (Coulomb(0.8, 0.8),), 200 * UNIT.period, steps, speed)
    assert np.abs(found.z[-steps:]).max() / STICK_SLIP - 1 == pytest.approx(error, abs=1e-3)


@pytest.mark.parametrize("speed, peak", [(0.05, 0.281), (0.10, 0.264), (0.15, 0.23), (0.20, 0.172)])
def test_exact_newmark_stopped_by_force(speed, peak):
    """A coarse stick speed brings the peak down from .287 towards the .15 of the report's Fig 2."""
    found = newmark.run(SDOF, UNIT, (Coulomb(0.8, 0.8),), 200 * UNIT.period, 500, speed, True)
    assert np.abs(found.z[-5000:]).max() == pytest.approx(peak, abs=2e-3)


@pytest.mark.parametrize("steps, error", [(100, 0.33), (1000, 1.0), (10000, 21.0)])
def test_exact_newmark_in_free_decay(steps, error):
    start = InitialState(np.array([11.5]), np.zeros(1))
    found = newmark.run(
        PLAIN, release(2 * np.pi), (Coulomb(1.0, 1.0),), 100.0, steps, 1e-2, start=start
    )
    half = np.floor(found.time / np.pi)
    # 3.11, N0 = 6
    truth = np.where(half < 6, (10.5 - 2 * half) * np.cos(found.time) + (-1) ** half, -0.5)
    assert np.abs(found.z[:, 0] - truth).max() == pytest.approx(error, rel=0.02)


def plate(omega=0.1, c=0.04):
    """(drive, start) of a block on a plate that moves by sin(omega t), its spring and damper held to the ground (2.5):
    in coordinates of the plate it is driven by a'' + c a' + a."""
    turn = 1 - omega**2 + 1j * c * omega
    drive = Piecewise(
        (DriveSegment(0.0, 0.0, abs(turn), omega, np.angle(turn)),), 2 * np.pi / omega
    )
    return drive, InitialState(np.zeros(1), np.array([-omega]))


@pytest.mark.parametrize(
    "h, top, within",
    [
        (0.001, 0.1371, 1e-4),
        (0.01, 0.1373, 1e-4),
        (0.05, 0.1401, 2e-4),
        (0.1, 0.156, 3e-4),
        (0.2, 0.1895, 6e-4),
    ],
)
def test_exact_figure_5_by_euler(h, top, within):
    """Its ringing is exaggerated by the steps: at h = .2 by a third. (Plate coordinates: another error in h.)"""
    modes = basis([1.0], [0.02], [[1.0]], [1.0])
    drive, start = plate()
    steps = round(drive.period / h)
    found = euler.run(modes, drive, (tanh(0.1, 0.01),), 10 * drive.period, steps, start)
    x = found.z[-2 * steps :, 0] + np.sin(0.1 * found.time[-2 * steps :])
    assert np.abs(x).max() == pytest.approx(top, abs=within)
    assert euler.damping_left(modes, h) == pytest.approx([0.02 - h / 2])
    assert any("free vibration of this mode grows" in text for text in found.warnings) == (h > 0.04)


def test_exact_figure_5_by_an_implicit_method():
    modes = basis([1.0], [0.02], [[1.0]], [1.0])
    drive, start = plate()
    found = newmark.run(modes, drive, (tanh(0.1, 0.01),), 10 * drive.period, 20000, start=start)
    last = slice(-20001, None)
    t, x = found.time[last], found.z[last, 0] + np.sin(0.1 * found.time[last])
    assert np.abs(x).max() == pytest.approx(0.13712, abs=2e-5)
    a = found.accelerations(modes)[last, 0] - 0.01 * np.sin(0.1 * t)
    assert np.abs(a).max() == pytest.approx(0.0371, abs=1e-4)
    rate = found.v[last, 0] + 0.1 * np.cos(0.1 * t)
    friction = np.trapezoid(found.force[0, last] * found.v[last, 0], t)
    assert friction == pytest.approx(0.3722, rel=1e-3)
    assert 0.04 * np.trapezoid(rate**2, t) == pytest.approx(0.00135, rel=1e-2)


@pytest.mark.parametrize(
    "ratio, x1, x2",
    [
        (0.1, 0.12796, 0.9205),
        (0.2, 0.1613, 0.9895),
        (0.5, 0.1997, 1.327),
        (0.9, 0.6635, 4.940),
        (1.0, 3.183, 21.816),
    ],
)
def test_exact_two_masses(ratio, x1, x2):
    """Figs 10-12 (2.6, 2.7 with the speeds of the two masses): at resonance (4/pi) F0/(2 zeta) and its complement."""
    modes = basis([1.0, 1.0], [0.02, 0.02], [[-1.0, 1.0]], [0.0, -1.0])
    drive = sine(ratio)
    settled = np.ceil(500 / drive.period)
    found = newmark.run(modes, drive, (tanh(0.1, 0.01),), settled * drive.period, 2000)
    top = np.abs(found.z[-4001:]).max(axis=0)
    assert top == pytest.approx([x1, x2], rel=1e-3)
    assert found.ledger["error"] == pytest.approx(0.0, abs=2e-3 * found.ledger["work_in"])


def two_masses(ratio, steps):
    """(modes, drive, run until it repeats) of (2.6, 2.7)."""
    modes = basis([1.0, 1.0], [0.02, 0.02], [[-1.0, 1.0]], [0.0, -1.0])
    drive = sine(ratio)
    duration = np.ceil(500 / drive.period) * drive.period
    return modes, drive, newmark.run(modes, drive, (tanh(0.1, 0.01),), duration, steps)


def test_exact_two_masses_ring_slowly_driven():
    """Fig 10: 14 turning points of x1 per cycle, its swings fall by exp(-pi zeta) each."""
    _, drive, found = two_masses(0.1, 2000)
    x = found.z[-2002:, 0]
    turn = np.flatnonzero(np.diff(x)[1:] * np.diff(x)[:-1] < 0) + 1
    assert turn.size == 14
    high = np.roll(x[turn], -int(np.argmax(x[turn])))[:6]
    assert high == pytest.approx([0.128, 0.0737, 0.1246, 0.0769, 0.1217, 0.0796], abs=1e-4)
    assert np.abs(high - 0.1)[3:5] / np.abs(high - 0.1)[2:4] == pytest.approx(
        np.exp(-0.02 * np.pi), abs=3e-3
    )
    slip = np.abs(found.v[-2000:] @ [-1.0, 1.0])
    assert np.mean(slip > 0.01) == pytest.approx(0.787, abs=0.003)
    assert drive.period == pytest.approx(62.832, abs=1e-3)


def test_exact_two_masses_driven_fast():
    """Omega = 5: the fundamental of x1 is (4 F0/pi)/(Omega^2 - 1)."""
    _, drive, found = two_masses(5.0, 400)
    last = slice(-400, None)
    part = 2 * np.mean(found.z[last, 0] * np.exp(-1j * 2 * np.pi / drive.period * found.time[last]))
    assert abs(part) == pytest.approx(0.4 / np.pi / 24, rel=0.01)
    assert np.abs(found.z[last, 1]).max() == pytest.approx(0.0402, rel=0.01)
