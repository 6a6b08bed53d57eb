"""Roots of series against dense samples, constructed polynomials and closed forms."""

from math import asin, factorial, inf, pi, sqrt

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from patchfem.dynamics.events.signals import BERNSTEIN, TERMS, Signal, combine, derivative, first_root


def series(*coefs):
    return np.array([*coefs, *[0.0] * (TERMS - len(coefs))])


def cosine(rate, size=1.0, lift=0.0, phase=0.0):
    """lift + size cos(rate u + phase)."""
    out = np.array([size * rate**k * np.cos(phase + k * pi / 2) / factorial(k) for k in range(TERMS)])
    out[0] += lift
    return out


TERM = st.tuples(st.floats(0.05, 1.0), st.floats(0, 6), st.floats(0, 2))


@settings(max_examples=150)
@given(st.lists(TERM, min_size=1, max_size=3), st.floats(1e-6, 2.0))
def test_always_first_root_against_samples(terms, start):
    f = sum(cosine(rate, size, 0.0, phase) for size, phase, rate in terms)
    f[0] += start - f[0]
    found, u = first_root(f), np.linspace(0, 1, 20_001)
    y = np.polyval(f[::-1], u)
    below = np.flatnonzero(y <= 0)
    if not below.size:
        assert found == inf or abs(np.polyval(f[::-1], found)) < 1e-14
        return
    k = below[0]
    wanted = brentq(lambda x: np.polyval(f[::-1], x), u[k - 1], u[k], xtol=1e-16) if y[k] < 0 else u[k]
    if found < wanted - 1e-9:  # a dip between two samples: it must be a true root
        assert abs(np.polyval(f[::-1], found)) < 1e-14
        assume(False)
    assert abs(np.polyval(f[::-1], found)) < 1e-14
    assert found == pytest.approx(wanted, abs=1e-6)


@settings(max_examples=60)
@given(st.floats(1e-11, 1e-2), st.floats(1.65, 3.0), st.booleans())
def test_always_grazing_is_decided(depth, rate, touches):
    """1 + cos(2 rate u) -+ depth: the dip reaches zero or passes just above it."""
    found = first_root(cosine(2 * rate, 1.0, 1.0 - depth if touches else 1.0 + depth) if rate < 2 else
                       cosine(2.0 * 1.9, 1.0, 1.0 - depth if touches else 1.0 + depth))
    turn = 2 * rate if rate < 2 else 3.8
    if touches:
        assert found == pytest.approx((pi - 2 * asin(sqrt(depth / 2))) / turn, rel=1e-14 / sqrt(depth) + 1e-13)
    else:
        assert found == inf


@pytest.mark.parametrize("roots", [(0.3, 0.30000001, 0.9), (0.5,), (1e-9, 0.2), (0.25, 0.5, 0.75), (2.0,)])
def test_exact_roots_of_a_product(roots):
    coefs = np.array([1.0])
    for r in roots:
        coefs = np.convolve(coefs, [1.0, -1.0 / r])
    found = first_root(series(*coefs))
    assert found == (inf if roots[0] > 1 else pytest.approx(roots[0], rel=1e-7 if len(roots) == 3 else 1e-14))


def test_exact_small_dips_are_passed_over():
    dip = series(0.25 - 1e-12, -1.0, 1.0)
    assert first_root(dip) == pytest.approx(0.5 - 1e-6, rel=1e-9)
    assert first_root(dip, 2e-12) == inf


def test_exact_bernstein_form_bounds_and_ends():
    coefs = cosine(1.7, 0.8, 0.1, 0.4)
    b = BERNSTEIN @ coefs
    u = np.linspace(0, 1, 200)
    y = 0.1 + 0.8 * np.cos(1.7 * u + 0.4)
    np.testing.assert_allclose(np.polyval(coefs[::-1], u), y, atol=1e-15)
    assert b.min() <= y.min() + 1e-15 and y.max() <= b.max() + 1e-15
    np.testing.assert_allclose(b[[0, -1]], y[[0, -1]], atol=1e-15)


def test_exact_signal_of_two_pieces():
    """cos t cut at 1.5, in different units."""
    pieces = Signal(np.array([0.0, 1.5, 2.5]), np.array([2.0, 1.0]),
                    np.array([cosine(2.0), cosine(1.0, 1.0, 0.0, 1.5)]))
    t = np.linspace(0, 2.5, 100)
    np.testing.assert_allclose(pieces.many(t), np.cos(t), atol=1e-15)
    np.testing.assert_allclose(pieces.rate().many(t), -np.sin(t), atol=1e-14)
    np.testing.assert_allclose(combine([pieces, pieces.rate()], [2.0, -1.0]).many(t), 2 * np.cos(t) + np.sin(t),
                               atol=1e-14)
    np.testing.assert_allclose(derivative(cosine(1.0)[:, None])[:-1, 0], -cosine(1.0, 1, 0, -pi / 2)[:-1], atol=1e-15)
