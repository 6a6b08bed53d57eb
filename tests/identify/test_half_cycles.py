"""Frequency and damping as functions of amplitude from measured decays: the intervals cover the true values."""

import numpy as np
import pytest

from patchfem.core import PatchfemError
from patchfem.identify import compute_decay_curve
from patchfem.identify.half_cycles import find_half_cycles
from patchfem.measures import fit_decay_curve


def viscous_decay(rng):
    """Return (times, values, frequency(A), ratio(A)) of an exponential decay."""
    f = 10 ** rng.uniform(1, 2.5)
    zeta = 10 ** rng.uniform(-2.5, -1.2)
    samples_per_cycle = 10 ** rng.uniform(1.2, 2)
    t = np.arange(int(rng.uniform(12, 60) * samples_per_cycle)) / (samples_per_cycle * f)
    damped_factor = np.sqrt(1 - zeta**2)
    w = 2 * np.pi * f
    y = np.exp(-zeta * w * t) * np.cos(w * damped_factor * t + rng.uniform(0, 6))
    return t, y, lambda a: f * damped_factor + 0 * a, lambda a: zeta + 0 * a


def coulomb_decay(rng):
    """Return (times, values, frequency(A), ratio(A)) of a decay by Coulomb friction alone."""
    f = 10 ** rng.uniform(1, 2.5)
    friction_ratio = 10 ** rng.uniform(-2.3, -1.3)
    samples_per_cycle = 10 ** rng.uniform(1.2, 2)
    t = np.arange(int(min(0.45 / friction_ratio, 120) / 2 * samples_per_cycle)) / (
        samples_per_cycle * f
    )
    k = np.floor(2 * f * t)
    return (
        t,
        (1 - 2 * friction_ratio * k - friction_ratio) * np.cos(2 * np.pi * f * t)
        + friction_ratio * (-1.0) ** k,
        lambda a: f + 0 * a,
        lambda a: 2 * friction_ratio / (np.pi * a),
    )


def coverage_of_curve(make_decay, seeds) -> np.ndarray:
    """Return whether the intervals cover frequency and damping ratio at every point, shape (p, 2)."""
    rows = []
    for seed in seeds:
        rng = np.random.default_rng(seed)
        t, y, frequency, ratio = make_decay(rng)
        curve = fit_decay_curve(
            find_half_cycles(t, y + 10 ** rng.uniform(-4, -1.5) * rng.normal(size=t.size))
        )
        rows += zip(
            np.abs(curve.frequency - frequency(curve.amplitude)) <= curve.frequency_error,
            np.abs(curve.damping - ratio(curve.amplitude)) <= curve.damping_error,
        )
    return np.array(rows)


@pytest.mark.parametrize("make_decay", [viscous_decay, coulomb_decay])
def test_intervals_cover_frequency_and_damping(make_decay):
    """At least 90 % of the intervals cover the frequency and damping of noisy decays."""
    is_covered = coverage_of_curve(make_decay, range(9000, 9004))
    assert len(is_covered) > 30 and is_covered.mean() > 0.9


@pytest.mark.parametrize("name, power", [("displacement", 0), ("velocity", 1), ("acceleration", 2)])
def test_any_record_gives_displacement_amplitude(name, power):
    """A displacement, velocity or acceleration record gives the same amplitude of displacement and damping."""
    zeta = 0.02
    w = 500.0
    t = np.arange(2000) / 10000
    pole = w * complex(-zeta, np.sqrt(1 - zeta**2))
    curve, _ = compute_decay_curve({"time": t, name: (pole**power * 1e-3 * np.exp(pole * t)).real})
    assert curve.damping == pytest.approx(zeta, rel=2e-3)
    expected = 1e-3 * np.exp(-zeta * w * curve.time)
    assert curve.amplitude == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize("name", ["displacement", "velocity", "acceleration"])
def test_damping_is_that_of_the_displacement_where_the_frequency_changes(name):
    """Where the frequency rises in a decay, each kind of record has the damping of the displacement within its interval.

    The decrement of the acceleration alone is 6 % smaller.
    """
    t = np.arange(0, 0.4, 1 / 16384)
    envelope = np.exp(-20 * t)
    omega = 2 * np.pi * (200 + 12 * (1 - envelope))
    phase = np.concatenate([[0.0], np.cumsum((omega[1:] + omega[:-1]) / 2 * np.diff(t))])
    pole = -20 + 1j * omega
    slope = 2j * np.pi * 12 * 20 * envelope  # of the pole
    factor = {"displacement": 1, "velocity": pole, "acceleration": pole**2 + slope}[name]
    value = (factor * 1e-4 * envelope * np.exp(1j * phase)).real
    noise = np.random.default_rng(86).standard_normal(t.size) * 1e-3 * np.abs(value).max()
    curve, _ = compute_decay_curve({"time": t, name: value + noise})
    true = 20 / np.hypot(20, 2 * np.pi * (200 + 12 * (1 - curve.amplitude / 1e-4)))
    is_inside = np.abs(curve.damping - true) <= curve.damping_error
    assert is_inside.mean() > 0.7
    assert np.median(np.abs(curve.damping / true - 1)) < 0.01


def test_refuses_record_without_decay():
    """A record without decay, with too few samples or without oscillation is refused."""
    rng = np.random.default_rng(0)
    t = np.arange(500) / 1000
    with pytest.raises(PatchfemError, match=r"fewer than three half cycles|samples per cycle"):
        find_half_cycles(t, rng.normal(size=t.size))
    with pytest.raises(PatchfemError, match="the free decay has 9 samples"):
        find_half_cycles(t[:9], t[:9])
    with pytest.raises(PatchfemError, match="the record contains no oscillation"):
        find_half_cycles(t, 0 * t)
    with pytest.raises(PatchfemError, match="samples per cycle"):
        find_half_cycles(t, np.cos(2 * np.pi * 300 * t))


def test_refuses_begin_after_the_end():
    """A decay that would begin after its record is refused with both times."""
    t = np.arange(200) / 1000
    values = {"time": t, "displacement": np.cos(300 * t) * np.exp(-5 * t)}
    with pytest.raises(PatchfemError, match="cannot begin at 5 s"):
        compute_decay_curve(values, 5.0)
