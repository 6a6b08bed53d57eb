"""Frequency and damping over the amplitude of measured decays: the truth lies in the intervals."""

import numpy as np
import pytest

from patchfem.core import PatchfemError
from patchfem.identify import compute_decay_curve
from patchfem.identify.half_cycles import find_half_cycles
from patchfem.response import fit_decay_curve


def viscous(rng):
    """(times, values, frequency(A), ratio(A)) of a decay that is exponential."""
    f = 10 ** rng.uniform(1, 2.5)
    zeta = 10 ** rng.uniform(-2.5, -1.2)
    per = 10 ** rng.uniform(1.2, 2)
    t = np.arange(int(rng.uniform(12, 60) * per)) / (per * f)
    own = np.sqrt(1 - zeta**2)
    w = 2 * np.pi * f
    y = np.exp(-zeta * w * t) * np.cos(w * own * t + rng.uniform(0, 6))
    return t, y, lambda a: f * own + 0 * a, lambda a: zeta + 0 * a


def rubbed(rng):
    """The same of a block that Coulomb friction alone brings to rest."""
    f = 10 ** rng.uniform(1, 2.5)
    h = 10 ** rng.uniform(-2.3, -1.3)
    per = 10 ** rng.uniform(1.2, 2)
    t = np.arange(int(min(0.45 / h, 120) / 2 * per)) / (per * f)
    k = np.floor(2 * f * t)
    return (
        t,
        (1 - 2 * h * k - h) * np.cos(2 * np.pi * f * t) + h * (-1.0) ** k,
        lambda a: f + 0 * a,
        lambda a: 2 * h / (np.pi * a),
    )


def covered(kind, seeds) -> np.ndarray:
    """(p, 2) whether frequency and ratio of every point lie in their intervals."""
    out = []
    for seed in seeds:
        rng = np.random.default_rng(seed)
        t, y, frequency, ratio = kind(rng)
        found = fit_decay_curve(
            find_half_cycles(t, y + 10 ** rng.uniform(-4, -1.5) * rng.normal(size=t.size))
        )
        out += zip(
            np.abs(found.frequency - frequency(found.amplitude)) <= found.frequency_error,
            np.abs(found.damping - ratio(found.amplitude)) <= found.damping_error,
        )
    return np.array(out)


@pytest.mark.parametrize("kind", [viscous, rubbed])
def test_intervals_hold(kind):
    held = covered(kind, range(9000, 9004))
    assert len(held) > 30 and held.mean() > 0.9


@pytest.mark.parametrize("name, power", [("displacement", 0), ("velocity", 1), ("acceleration", 2)])
def test_exact_any_trace_gives_the_amplitude_of_the_displacement(name, power):
    """Without noise: a displacement A leaves A w in the velocity, A w^2 in the acceleration."""
    zeta = 0.02
    w = 500.0
    t = np.arange(2000) / 10000
    pole = w * complex(-zeta, np.sqrt(1 - zeta**2))
    found, _ = compute_decay_curve({"time": t, name: (pole**power * 1e-3 * np.exp(pole * t)).real})
    assert found.damping == pytest.approx(zeta, rel=2e-3)
    exact = 1e-3 * np.exp(-zeta * w * found.time)
    assert found.amplitude == pytest.approx(exact, rel=2e-3)


def test_refuses_what_holds_no_decay():
    rng = np.random.default_rng(0)
    t = np.arange(500) / 1000
    with pytest.raises(PatchfemError, match=r"rise above the noise|samples per cycle"):
        find_half_cycles(t, rng.normal(size=t.size))
    with pytest.raises(PatchfemError, match="the free decay has 9 samples"):
        find_half_cycles(t[:9], t[:9])
    with pytest.raises(PatchfemError, match="the record contains no oscillation"):
        find_half_cycles(t, 0 * t)
    with pytest.raises(PatchfemError, match="samples per cycle"):
        find_half_cycles(t, np.cos(2 * np.pi * 300 * t))
