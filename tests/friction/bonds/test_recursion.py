"""The recursion of the bond state compared with the sum over all bonds, for pressure on either piece."""

import numpy as np
import pytest
from friction_paths import (
    LowerPressure,
    PathHistory,
    march_bonds,
    reference_traction,
    upper_pressure,
)
from hypothesis import example, given
from hypothesis import strategies as st

from patchfem.friction import Bonds
from patchfem.friction.bonds.point_kernels import bond_mean

GROWTH = [{}, {"ratio": 0.5, "rest_growth": 0.4, "slip_growth": 0.3, "rest_speed": 1e-2}]
X = np.linspace(-30, 30, 31)


def make_pressure(name):
    """Return the pressure as a function of the displacement, on the upper or the lower piece."""
    if name == "upper":
        return upper_pressure(1 + 0.5 * np.cos(X))
    floor = 1.5 if name == "lower" else 0.2
    return LowerPressure(X, np.maximum(np.sin(2 * np.pi * X / 7) + floor, 0.0))


@st.composite
def growth_parameters(draw):
    """Draw growth parameters of the bonds, or none."""
    if draw(st.booleans()):
        return {}
    return {
        "ratio": draw(st.floats(0.05, 1)),
        "rest_growth": draw(st.floats(1e-3, 10)),
        "slip_growth": draw(st.floats(0.01, 10)),
        "rest_speed": draw(st.floats(1e-4, 1)),
    }


# ---- recursion and sum over bonds


@pytest.mark.share(0, 9, 17)
@pytest.mark.parametrize("piece", ["upper", "lower", "lower with bare places"])
@pytest.mark.parametrize("growth", GROWTH)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_exact_recursion_equals_sum_over_bonds(piece, growth, seed):
    """The recursion has the tractions, means and energies of the sum over all bonds.

    The sum has the error of two Gauss points per strip.
    """
    rng = np.random.default_rng(seed)
    steps = rng.normal(0, 1, 120) * 10.0 ** rng.uniform(-3, 0.7, 120)
    steps[rng.integers(0, 120, 10)] = 0.0
    path = np.concatenate([[0], np.cumsum(steps)])
    times = rng.uniform(0.01, 1, 120)
    law = Bonds(0.4, 1.0, initial=0.8, **growth)
    recursion = march_bonds(law, path, make_pressure(piece), times)
    summed = march_bonds(law, path, make_pressure(piece), times, 0.0)
    if piece == "lower with bare places":
        contact_changes = np.diff(
            (np.array([make_pressure(piece)(q) for q in path]) <= 0).astype(int), axis=0
        )
        assert (
            contact_changes > 0
        ).sum() > 20  # the test is only meaningful if contact is lost often
    assert recursion.traction == pytest.approx(summed.traction, abs=2e-7)
    # These are sums over the points.
    for name in PathHistory._fields[1:]:
        tolerance = 2e-7 * np.sqrt(X.size)
        assert getattr(recursion, name) == pytest.approx(getattr(summed, name), abs=tolerance), name


def test_exact_step_mean_equals_average_along_step():
    """The mean traction of a step agrees with Gauss quadrature over partial steps whose bonds are summed by hand."""
    law = Bonds(1.0, 1.0)
    path = np.array([0.0, 0.8, -0.5, 0.1, 2.0])
    run = march_bonds(law, path, make_pressure("upper"), 0.5)
    y, w = np.polynomial.legendre.leggauss(10)
    for k in range(1, 5):
        dq = path[k] - path[k - 1]
        parts = [
            reference_traction(
                law,
                np.append(path[:k], path[k - 1] + dq * (1 + a) / 2),
                make_pressure("upper"),
                0.5,
            )
            for a in y
        ]
        assert run.mean[k - 1] == pytest.approx((w / 2 @ np.array(parts)).sum(), abs=1e-9)


def test_exact_slope_equals_derivative_of_mean():
    """The slope returned with the mean force agrees with its central difference."""
    for m, z, sigma in ((0.7, 0.4, 1.0), (0.2, -0.1, 0.6)):
        for dq in (-3.0, -0.4, -0.02, 0.01, 0.2, 1.5):
            h = 1e-5 * abs(dq)
            low, high = (bond_mean(m, z, dq + sign * h, sigma, 0.8)[0] for sign in (-1, 1))
            slope = bond_mean(m, z, dq, sigma, 0.8)[1]
            assert slope == pytest.approx((high - low) / (2 * h), rel=1e-6, abs=1e-8)


# ---- passivity


@given(st.lists(st.floats(-3, 3), min_size=1, max_size=15), growth_parameters())
@example([2e-309], {})
def test_always_sum_over_bonds_is_passive(steps, growth):
    """No step creates energy, and the stored energy of the recursion is never negative.

    That of a list, whose sums have quadrature errors, is above -1e-4 of the work of a bond length at the limit.
    """
    law = Bonds(1.0, 1.0, **growth)
    path = np.concatenate([[0], np.cumsum(steps)])
    for tail, least in ((None, 0.0), (0.0, -1e-4 * X.size)):
        run = march_bonds(law, path, make_pressure("lower with bare places"), 0.3, tail)
        total = max(np.abs(run.mean * np.diff(path)).sum(), 1e-3)
        assert run.dissipated.min() >= -1e-12 * total
        assert run.stored.min() >= least


# ---- extreme values


@pytest.mark.parametrize("growth", GROWTH)
def test_exact_huge_steps_reach_steady_sliding(growth):
    """A step of a million bond lengths reaches the friction limit of steady sliding without overflow."""
    law = Bonds(0.3, 1.0, **growth)
    path = np.array([0.0, 1e6, -1e6, -1e6, -1e6 + 1e-9])
    for tail in (None, 1e-9):
        run = march_bonds(law, path, make_pressure("upper"), 1.0, tail)
        assert all(np.isfinite(values).all() for values in run)
        sigma = make_pressure("upper")(0)
        length_ratio = 0.5 if growth else 1.0
        assert run.traction[0] == pytest.approx(0.3 * length_ratio * sigma, rel=1e-4)
        assert run.traction[1] == pytest.approx(-0.3 * length_ratio * sigma, rel=1e-4)
        assert run.mean[1] == pytest.approx(-0.3 * length_ratio * sigma.sum(), rel=1e-4)
        assert run.traction[2] == pytest.approx(run.traction[1], rel=1e-12)  # step of zero length
