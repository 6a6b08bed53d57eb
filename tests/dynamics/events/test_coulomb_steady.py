"""Shooting on the event map against printed numbers, long runs, finite differences and perturbed
runs."""

from math import pi, sqrt

import numpy as np
import pytest
from event_run import period_map, simulate, steady
from modal_bases import basis_of, random_basis
from vibration_forms import sliding_amplitude, two_stop_amplitude

from patchfem.core import InitialState, PatchfemError, SineDrive
from patchfem.structure import drives


def amplitude_of_run(modes, drive, static, kinetic, cycles, begin=None):
    """Half the peak-to-peak of the last cycle of a run."""
    low, high = simulate(modes, drive, static, kinetic, cycles, 1, start=begin).amplitudes[-1]
    return (high - low) / 2


@pytest.mark.parametrize(
    "d, zeta, wanted, regime",
    [
        (0.8, 0.003, 0.28704671337871602595, "2 stops"),
        (0.8, 0.0, 0.29943104174842751488, "2 stops"),
        (0.5, 0.003, 60.5632260810004979, "sliding"),
        (2 / 3, 0.003, 25.1953787788816, "sliding"),
        (4 / 7, 0.003, 45.4055793050063, "sliding"),
        (0.79, 0.0, 0.435537658848, "2 stops"),
        (1.2, 0.003, 0.0, "stuck"),
        (0.95, 0.0, None, "2 stops"),
        (0.828843, 0.0, None, "2 stops"),
        (pi / 4 + 1e-3, 0.0, None, "2 stops"),
        (pi / 4 + 1e-6, 0.0, None, "2 stops"),
        (pi / 4 - 1e-4, 0.0, np.inf, "unbounded"),
        (0.6, 0.0, np.inf, "unbounded"),
    ],
)
def test_exact_amplitudes_at_resonance(d, zeta, wanted, regime):
    """Printed numbers, or the closed form of two stops, whose condition near pi/4 is that of a
    square root."""
    found = steady(basis_of(1.0, zeta), SineDrive(1.0, 1.0), d, d)
    assert found.regime == regime
    if regime == "unbounded":
        return
    rel = 2e-12 if wanted is not None else 1e-12 / (d - pi / 4)
    assert found.amplitude == pytest.approx(
        two_stop_amplitude(d) if wanted is None else wanted, rel=rel
    )
    assert found.residual < 1e-12 and found.alone
    if regime != "stuck":
        assert np.abs(found.multipliers).max() < 1


@pytest.mark.parametrize(
    "hertz, level, amplitude", [(135, 6, 5.22698), (150, 7, 6.66151), (155, 8, 4.29575)]
)
def test_table_check_7_without_damping(hertz, level, amplitude):
    found = steady(basis_of(1.0), SineDrive(level / 4, hertz / 143), 1.0, 1.0)
    assert (
        found.amplitude / (level / 4) == pytest.approx(amplitude, rel=2e-6)
        and found.regime == "sliding"
    )


@pytest.mark.parametrize(
    "hertz, knee", [(135, 1.2466), (143, 1.2792), (150, 1.3108), (155, 1.3337)]
)
def test_table_check_8_knee(hertz, knee):
    """Input over friction at which the last stop vanishes."""
    regimes = [
        steady(basis_of(1.0, 0.003), SineDrive(knee + side, hertz / 143), 1.0, 1.0).regime
        for side in (-1e-3, 1e-3)
    ]
    assert regimes == ["2 stops", "sliding"]


POINTS = [
    (0.4, 2.0),
    (0.6, 1.5),
    (0.8, 1.3),
    (0.9, 1.15),
    (1.0, 1.25),
    (1.05, 1.2),
    (1.1, 1.6),
    (1.3, 3.0),
    (1.7, 1.4),
    (2.5, 2.2),
]


def test_exact_steady_points_against_runs():
    for ratio, level in POINTS:
        modes = basis_of(1.0, 0.08)
        drive = SineDrive(level, ratio)
        found = steady(modes, drive, 1.0, 1.0)
        marched = amplitude_of_run(modes, drive, 1.0, 1.0, 60)
        assert found.amplitude == pytest.approx(marched, rel=1e-9), (ratio, level)


@pytest.mark.share(0)
@pytest.mark.parametrize("level, ratio, wanted", [(3.0, 0.11, 4), (2.0, 0.06, 8), (2.0, 0.05, 10)])
def test_exact_many_stops_below_resonance(level, ratio, wanted):
    """A slow drive: several stops per cycle, as the run counts them."""
    modes = basis_of(1.0, 0.0005)
    drive = SineDrive(level, ratio)
    found = steady(modes, drive, 1.0, 1.0)
    done = simulate(modes, drive, 1.0, 1.0, 80, 10)
    stops = np.count_nonzero((done.log.kind == 0) & (done.log.time > 70 * drive.period)) / 10
    assert found.stops == (stops,) == (wanted,) and found.regime == f"{wanted} stops"
    low, high = done.amplitudes[-1]
    assert found.amplitude == pytest.approx((high - low) / 2, rel=1e-10)


def test_exact_two_motions_at_one_level():
    """Kinetic below static friction: at rest it stays, kicked it goes on sliding."""
    modes = basis_of(1.0, 0.05)
    drive = SineDrive(0.9, 1.0)
    rest = steady(modes, drive, 1.0, 0.3)
    moving = steady(modes, drive, 1.0, 0.3, InitialState(np.zeros(1), np.array([8.0])))
    assert (rest.regime, moving.regime) == ("stuck", "sliding") and rest.amplitude == 0
    wanted = 0.9 * sliding_amplitude(1.0, 0.3 / 0.9, 0.05)
    assert moving.amplitude == pytest.approx(wanted, rel=1e-11)
    assert np.abs(moving.multipliers).max() < 1


def test_refuses_drives_that_do_not_repeat():
    with pytest.raises(PatchfemError, match="a single sine without end"):
        steady(basis_of(1.0), drives.make_levels([1.0, 2.0], 1.0, 5), 1.0, 1.0)


def two_faces(seed=2, ratio=1.0):
    rng = np.random.default_rng(seed)
    modes = random_basis(rng, 3, 2)
    static = rng.uniform(0.1, 0.3, 2)
    return modes, SineDrive(1.0, 1.2), static, ratio * static


@pytest.mark.share(1)
@pytest.mark.parametrize("seed, ratio", [(2, 1.0), (3, 0.7), (5, 1.0)])
def test_exact_two_interfaces_against_a_run(seed, ratio):
    modes, drive, static, kinetic = two_faces(seed, ratio)
    found = steady(modes, drive, static, kinetic)
    assert found.amplitude == pytest.approx(
        amplitude_of_run(modes, drive, static, kinetic, 400), rel=1e-8
    )
    again = simulate(modes, drive, static, kinetic, 1, 1, start=found.start).window
    np.testing.assert_allclose(
        again.modal[-1], found.start.z, atol=1e-11 * np.abs(again.modal).max()
    )
    np.testing.assert_allclose(
        again.modal_rate[-1], found.start.v, atol=1e-11 * np.abs(again.modal_rate).max()
    )


@pytest.mark.share(0, 3)
@pytest.mark.parametrize(
    "seed, n, faces, ratio", [(1, 3, 2, 1.0), (2, 3, 2, 0.6), (4, 4, 3, 1.0), (6, 4, 3, 0.7)]
)
def test_exact_derivative_of_the_map(seed, n, faces, ratio):
    """Pieces and saltations against central differences."""
    rng = np.random.default_rng(seed)
    modes = random_basis(rng, n, faces)
    static = rng.uniform(0.2, 1.0, faces)
    x = rng.normal(size=2 * n)
    drive = SineDrive(1.0, 1.2)
    step = 1e-6
    one = period_map(modes, drive, static, ratio * static, x)
    for j in range(2 * n):
        e = np.zeros(2 * n)
        e[j] = step
        ends = [period_map(modes, drive, static, ratio * static, x + s * e).end for s in (1, -1)]
        np.testing.assert_allclose(one.slope[:, j], (ends[0] - ends[1]) / (2 * step), atol=3e-8)


def test_exact_figure_16_repeats():
    h = sqrt(0.5)
    modes = basis_of([0.0, sqrt(2)], 0.0, [[h, -h]], (-h, -h), (h, -h))
    drive = SineDrive(1.0, 1.14)
    found = steady(modes, drive, 3.0, 3.0, cycles=120)
    assert found.amplitude == pytest.approx((0.69867878 + 0.39299347) / 2, abs=2e-8)
    assert found.regime == "2 stops"


def test_exact_coinciding_events_are_told():
    modes = basis_of([1.0, 1.0], 0.05, np.eye(2), (1, 1), (1, 0))
    assert not steady(modes, SineDrive(1.5, 0.9), 0.5, 0.5).alone
    assert steady(modes, SineDrive(1.5, 0.9), [0.5, 0.4], [0.5, 0.4]).alone
