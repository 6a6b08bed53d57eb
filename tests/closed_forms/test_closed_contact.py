"""The shipped contact forms against quadrature of the half plane, many-digit transfer matrices and summed strips."""

from itertools import pairwise

import friction_forms
import mpmath
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from patchfem.closed_forms import contact as exact

MODULUS = 6.74e10
TITANIUM, CARBIDE, THICKNESS = (121e9, 0.32), (250e9, 0.24), 152.4e-6


def _over(lo, hi, integrand, kinks=()):
    """Integral over lo..hi of a function that may be infinite like 1/sqrt at its ends; `kinks` inside split it."""
    middle = (lo + hi) / 2
    half = (hi - lo) / 2
    size = abs(integrand(middle + 0.3 * half)) * half
    points = sorted(
        {-np.pi / 2, np.pi / 2, *(np.arcsin((k - middle) / half) for k in kinks if lo < k < hi)}
    )
    return sum(
        quad(
            lambda t: integrand(middle + half * np.sin(t)) * half * np.cos(t),
            a,
            b,
            limit=400,
            epsabs=1e-13 * size,
            epsrel=1e-10,
        )[0]
        for a, b in pairwise(points)
    )


def slope(pressure, lo, hi, x, kinks=()):
    """d(inward displacement)/dx of two half planes at x: 2/(pi E*) PV int p(s)/(s - x) ds, x inside lo..hi or not."""
    here = pressure(x) if lo < x < hi else 0.0
    rest = _over(lo, hi, lambda s: (pressure(s) - here) / (s - x) if s != x else 0.0, (*kinks, x))
    return 2 / (np.pi * MODULUS) * (rest + (here * np.log((hi - x) / (x - lo)) if here else 0.0))


# ---- punches

HALF, LOAD = 2e-3, 3e4
OFFSETS = [0.0, 0.3e-3, -0.7e-3, 1.0e-3, 1.2e-3, -1.9e-3]


@pytest.mark.parametrize("offset", OFFSETS)
def test_exact_punch_carries_its_load_on_its_line(offset):
    lo, hi = exact.punch_contact(HALF, offset)
    assert _over(lo, hi, lambda x: exact.punch_pressure(x, LOAD, HALF, offset)) == pytest.approx(
        LOAD, rel=1e-7
    )
    turn = _over(lo, hi, lambda x: x * exact.punch_pressure(x, LOAD, HALF, offset))
    assert turn == pytest.approx(LOAD * offset, rel=1e-7, abs=1e-9 * LOAD * HALF)


@pytest.mark.parametrize("offset", OFFSETS)
@pytest.mark.parametrize("share", [0.1, 0.35, 0.8])
def test_exact_punch_stays_flat(offset, share):
    """Inside, opening = rotation x - delta + u is nothing, so the slope of the face is -rotation."""
    lo, hi = exact.punch_contact(HALF, offset)
    rotation = exact.punch_rotation(LOAD, HALF, MODULUS, offset)
    found = slope(
        lambda x: exact.punch_pressure(x, LOAD, HALF, offset), lo, hi, lo + share * (hi - lo)
    )
    assert found == pytest.approx(-rotation, rel=1e-6, abs=1e-7 * LOAD / (MODULUS * HALF))


@pytest.mark.parametrize("offset", [1.2e-3, -1.9e-3])
def test_always_the_unloaded_part_of_a_punch_stays_open(offset):
    """From the end of the contact outwards the opening can only grow: rotation + u' > 0 to the right of it."""
    lo, hi = exact.punch_contact(HALF, offset)
    rotation = exact.punch_rotation(LOAD, HALF, MODULUS, offset)
    end, way = (lo, -1) if offset > 0 else (hi, 1)
    for far in (0.01, 0.3, 0.99):
        x = end + way * far * (2 * HALF - (hi - lo))
        assert (
            way
            * (rotation + slope(lambda s: exact.punch_pressure(s, LOAD, HALF, offset), lo, hi, x))
            > 0
        )


def test_exact_punch_leaves_at_half_the_half_width_and_is_continuous_there():
    below, above = (
        exact.punch_rotation(LOAD, HALF, MODULUS, HALF / 2 * f) for f in (1 - 1e-9, 1 + 1e-9)
    )
    assert below == pytest.approx(-2 * LOAD / (np.pi * MODULUS * HALF), rel=1e-8) == above
    assert exact.punch_contact(HALF, 0.75 * HALF) == pytest.approx((0.0, HALF))
    assert (
        exact.punch_pressure(-HALF, LOAD, HALF, HALF / 2)
        == 0
        == exact.punch_pressure(2 * HALF, LOAD, HALF)
    )
    rigid = exact.combined_modulus(*TITANIUM, np.inf, 0.0)
    assert rigid == pytest.approx(121e9 / (1 - 0.32**2), rel=1e-15)


# ---- the punch with rounded edges

FLAT, ROUND = 1e-3, 0.05
LOADS = [2.0, 3e3, 3e5, 3e7]


@pytest.mark.parametrize("load", LOADS)
def test_exact_rounded_punch_carries_its_load(load):
    half = exact.rounded_punch_half_width(load, FLAT, ROUND, MODULUS)
    total = _over(
        -half,
        half,
        lambda x: exact.rounded_punch_pressure(x, load, FLAT, ROUND, MODULUS),
        (-FLAT, FLAT),
    )
    assert half > FLAT and total == pytest.approx(load, rel=1e-8)


@pytest.mark.share(0, 4, 8, 12, 14)
@pytest.mark.parametrize("load", LOADS[1:])
@pytest.mark.parametrize("share", [-0.9, 0.0, 0.2, 0.6, 0.97])
def test_exact_rounded_punch_follows_its_shape(load, share):
    half = exact.rounded_punch_half_width(load, FLAT, ROUND, MODULUS)
    x = share * half
    found = slope(
        lambda s: float(exact.rounded_punch_pressure(s, load, FLAT, ROUND, MODULUS)),
        -half,
        half,
        x,
        (-FLAT, FLAT),
    )
    want = -np.sign(x) * max(abs(x) - FLAT, 0) / ROUND
    assert found == pytest.approx(want, abs=1e-6 * half / ROUND)


@pytest.mark.parametrize("load, radius", [(1e4, 2e-4), (1e3, 1e-5)])
def test_order_a_rounded_corner_is_the_limit_of_the_rounded_punch(load, radius):
    flat = 4e-3
    modulus = 1e11
    reach, peak = exact.rounded_corner_contact(load / np.pi / np.sqrt(2 * flat), radius, modulus)
    x = flat + np.linspace(-2, 1, 3001) * reach
    assert exact.rounded_punch_half_width(load, flat, radius, modulus) - flat == pytest.approx(
        reach, rel=1e-4
    )
    assert exact.rounded_punch_pressure(x, load, flat, radius, modulus).max() == pytest.approx(
        peak, rel=1e-4
    )


def test_exact_rounded_punch_between_hertz_and_the_flat_punch():
    load = 3e6
    x = np.linspace(-0.9, 0.9, 7) * exact.hertz_half_width(load, ROUND, MODULUS)
    crown = exact.hertz_pressure(x, load, ROUND, MODULUS)
    assert np.allclose(
        exact.rounded_punch_pressure(x, load, 1e-8, ROUND, MODULUS), crown, rtol=1e-4
    )
    x = np.linspace(-0.9, 0.9, 7) * FLAT
    sharp = exact.rounded_punch_pressure(x, load, FLAT, 1e-12, MODULUS)
    assert np.allclose(sharp, exact.punch_pressure(x, load, FLAT), rtol=1e-5)
    ends = exact.rounded_punch_pressure(np.array([-FLAT, FLAT]), load, FLAT, ROUND, MODULUS)
    assert np.isfinite(ends).all() and ends[0] == pytest.approx(ends[1], rel=1e-12)


# ---- waves

WAVE, HIGH = 80e-6, 1.5e-6
FULL = np.pi * MODULUS * HIGH / WAVE


def wave(x, share):
    return exact.westergaard_pressure(x, share * FULL, WAVE, HIGH, MODULUS)


@pytest.mark.parametrize("share", [1e-5, 0.05, 0.5, 0.99, 1.0, 1.2])
def test_exact_westergaard_mean_pressure_and_approach(share):
    """The face sinks by -2/(pi E*) int p ln|2 sin(pi s/lambda)| ds at the crest: that is the mean gap closed."""
    args = share * FULL, WAVE, HIGH, MODULUS
    end = exact.westergaard_half_width(*args)
    assert exact.westergaard_full_pressure(WAVE, HIGH, MODULUS) == pytest.approx(FULL, rel=1e-15)
    assert _over(-end, end, lambda x: wave(x, share)) == pytest.approx(
        share * FULL * WAVE, rel=1e-8
    )
    sunk = (
        -4
        / (np.pi * MODULUS)
        * _over(0.0, end, lambda s: wave(s, share) * np.log(2 * np.sin(np.pi * s / WAVE)))
    )
    assert exact.westergaard_approach(*args) == pytest.approx(sunk, rel=1e-8)


@pytest.mark.parametrize("share", [0.05, 0.5, 0.99, 1.2])
@pytest.mark.parametrize("place", [0.1, -0.5, 0.93])
def test_exact_westergaard_flattens_the_wave(share, place):
    """Slope by the periodic kernel cot: u' = 2/(lambda E*) PV int p(s) cot(pi (s - x)/lambda) ds = -gap'."""
    end = exact.westergaard_half_width(share * FULL, WAVE, HIGH, MODULUS)
    x = place * end
    here = wave(x, share)

    def cot(s):
        return 1 / np.tan(np.pi * (s - x) / WAVE)

    def pair(y):  # the two sides together: odd parts of the kernel cancel
        return sum(w * (wave(x + w * y, share) - here) * cot(x + y) for w in (1, -1))

    near = end - abs(x)
    far = x - np.sign(x) * near
    rest = _over(0.0, near, pair) + _over(
        min(-np.sign(x) * end, far),
        max(-np.sign(x) * end, far),
        lambda s: (wave(s, share) - here) * cot(s),
    )
    edge = (
        here
        * WAVE
        / np.pi
        * np.log(np.sin(np.pi * (end - x) / WAVE) / np.sin(np.pi * (end + x) / WAVE))
    )
    found = 2 / (WAVE * MODULUS) * (rest + edge)
    assert found == pytest.approx(-2 * np.pi * HIGH / WAVE * np.sin(2 * np.pi * x / WAVE), rel=1e-6)


@pytest.mark.parametrize("share", [1e-6, 0.05, 0.9])
def test_exact_westergaard_stiffness_is_the_slope_of_the_approach(share):
    up, down = (
        exact.westergaard_approach(share * f * FULL, WAVE, HIGH, MODULUS)
        for f in (1 + 1e-5, 1 - 1e-5)
    )
    found = 2e-5 * share * FULL / (up - down)
    assert exact.westergaard_stiffness(share * FULL, WAVE, HIGH, MODULUS) == pytest.approx(
        found, rel=1e-7
    )
    assert exact.westergaard_stiffness(FULL, WAVE, HIGH, MODULUS) == np.inf


# ---- the layered half plane


def transfer_compliance(k, coating, substrate, thickness):
    """C(k) from the 4 x 4 state (u, v, syy, sxy) carried through the layer and matched to decaying states below."""

    def state_matrix(young, poisson):
        young = mpmath.mpf(young)
        poisson = mpmath.mpf(poisson)
        mu = young / (2 * (1 + poisson))
        lam = 2 * mu * poisson / (1 - 2 * poisson)
        stiff = lam + 2 * mu
        return mpmath.matrix(
            [
                [0, k, 0, 1 / mu],
                [-lam * k / stiff, 0, 1 / stiff, 0],
                [0, 0, 0, -k],
                [k**2 * (stiff - lam**2 / stiff), 0, k * lam / stiff, 0],
            ]
        )

    with mpmath.workdps(50):
        k = mpmath.mpf(k)
        below = state_matrix(*substrate)
        grown = (below - k * mpmath.eye(4)) ** 2  # its columns span the decaying states
        decaying = mpmath.matrix(4, 2)
        for row in range(4):
            decaying[row, 0] = grown[row, 0]
            decaying[row, 1] = grown[row, 1]
        top = mpmath.expm(-state_matrix(*coating) * mpmath.mpf(thickness)) * decaying
        share = mpmath.lu_solve(
            mpmath.matrix([[top[2, 0], top[2, 1]], [top[3, 0], top[3, 1]]]), mpmath.matrix([-1, 0])
        )
        return float(top[1, 0] * share[0] + top[1, 1] * share[1])


@pytest.mark.parametrize(
    "wavelength", [20e-6, 80e-6, 0.2e-3, 0.5e-3, 1e-3, 2e-3, 5e-3, 12.7e-3, 1.0]
)
@pytest.mark.parametrize(
    "pair",
    [
        (CARBIDE, TITANIUM),
        (TITANIUM, CARBIDE),
        ((600e9, 0.22), (120e9, 0.32)),
        ((1e9, 0.45), (200e9, 0.0)),
    ],
)
def test_exact_layered_compliance_by_the_transfer_matrix(wavelength, pair):
    k = 2 * np.pi / wavelength
    want = transfer_compliance(k, *pair, THICKNESS)
    assert exact.layered_compliance(k, *pair, THICKNESS) == pytest.approx(want, rel=1e-12)


def test_exact_layered_compliance_limits():
    k = np.geomspace(1e2, 1e6, 9)
    bare = 2 * (1 - 0.32**2) / (121e9 * k)
    assert np.allclose(exact.layered_compliance(k, TITANIUM, TITANIUM, THICKNESS), bare, rtol=1e-14)
    assert np.allclose(exact.layered_compliance(k, CARBIDE, TITANIUM, 0.0), bare, rtol=1e-13)
    thick = exact.layered_compliance(k, CARBIDE, TITANIUM, 1.0)
    assert np.allclose(thick, 2 * (1 - 0.24**2) / (250e9 * k), rtol=1e-13)


# ---- shear of a crown


@pytest.mark.share(0, 4, 8)
@pytest.mark.parametrize("share", [-0.9, 0.2, 0.6])
@pytest.mark.parametrize("place", [-0.7, 0.2, 0.95])
def test_exact_cattaneo_sticks_inside_and_slips_outside(share, place):
    """The tangential kernel of half planes is the normal one: no slope of the slide within the stick zone."""
    line = 1e5
    radius = 1.0
    mu = 0.35
    shear = share * mu * line
    half = exact.hertz_half_width(line, radius, MODULUS)
    stick = exact.cattaneo_stick_half_width(shear, line, radius, MODULUS, mu)

    def q(x):
        return float(exact.cattaneo_shear(x, shear, line, radius, MODULUS, mu))

    assert _over(-half, half, q, (-stick, stick)) == pytest.approx(shear, rel=1e-8)
    assert abs(slope(q, -half, half, place * stick, (-stick, stick))) <= 1e-7 * half / radius
    outside = stick + abs(place) * (half - stick)
    assert q(outside) == pytest.approx(
        np.sign(share) * mu * exact.hertz_pressure(outside, line, radius, MODULUS)
    )
    # lags behind: slips the way of Q
    assert np.sign(share) * slope(q, -half, half, outside, (-stick, stick)) < 0


def test_exact_cattaneo_limits():
    x = np.linspace(-2e-3, 2e-3, 41)
    assert exact.cattaneo_stick_half_width(35.0, 100.0, 1.0, MODULUS, 0.35) == 0
    full = exact.cattaneo_shear(x, 35.0, 100.0, 1.0, MODULUS, 0.35)
    assert np.allclose(full, 0.35 * exact.hertz_pressure(x, 100.0, 1.0, MODULUS), rtol=1e-14)
    assert np.all(exact.cattaneo_shear(x, 0.0, 100.0, 1.0, MODULUS, 0.35) == 0)


# ---- tilted pads

PAD = {"load": 116.0, "length": 10e-3, "width": 10e-3, "stiffness": 1e13}
DECAY = 2.5e-6


@pytest.mark.parametrize("tilt", [1e-6, 2e-5, 2.32e-5, 1e-4, -3e-4, 3e-3])
def test_exact_wedge_by_sinking_a_pad(tilt):
    """The pad sinks until springs under it carry the load; fraction, centre and pressures are then read off."""
    length = PAD["length"]
    width = PAD["width"]
    kn = PAD["stiffness"]
    zero = [0.0]

    def total(sink, arm=0.0):
        zero[0] = sink / tilt
        return _over(
            -length / 2, length / 2, lambda x: kn * width * max(sink - tilt * x, 0) * x**arm, zero
        )

    sink = brentq(lambda d: total(d) - PAD["load"], -abs(tilt) * length / 2, 1e-3, xtol=1e-18)
    fraction, centre, least, largest = exact.wedge_on_linear_foundation(tilt, **PAD)
    edge = np.clip(sink / abs(tilt), -length / 2, length / 2)
    assert fraction == pytest.approx((edge + length / 2) / length, rel=1e-8)
    assert centre == pytest.approx(total(sink, 1) / PAD["load"], rel=1e-8)
    assert largest == pytest.approx(kn * (sink + abs(tilt) * length / 2), rel=1e-8)
    assert least == pytest.approx(kn * max(sink - abs(tilt) * length / 2, 0), rel=1e-8)


def test_exact_wedge_begins_to_open():
    opening = exact.wedge_opening_tilt(**PAD)
    below = exact.wedge_on_linear_foundation(opening * (1 - 1e-9), **PAD)
    above = exact.wedge_on_linear_foundation(opening * (1 + 1e-9), **PAD)
    assert opening == pytest.approx(2.32e-5, rel=1e-12)
    assert below[0] == 1 and above[0] < 1 and np.allclose(below, above, rtol=1e-8, atol=1)
    assert (
        exact.wedge_on_linear_foundation(-2e-4, **PAD)[1]
        == -exact.wedge_on_linear_foundation(2e-4, **PAD)[1]
    )


def test_exact_kern_and_wedge_agree_on_the_load_line():
    for tilt in (1e-5, 1e-4, 1e-3):
        fraction, centre, *_ = exact.wedge_on_linear_foundation(tilt, **PAD)
        assert exact.kern_contact_fraction(centre, PAD["length"]) == pytest.approx(
            fraction, rel=1e-12
        )
    assert exact.kern_contact_fraction(PAD["length"] / 6, PAD["length"]) == pytest.approx(
        1.0, rel=1e-12
    )


@pytest.mark.parametrize("tilt", [0.0, 1e-9, 1.2e-5, 1.26e-5, 1e-4, -1e-3, 3e-3, 3e-2])
def test_exact_skin_by_quadrature(tilt):
    length = PAD["length"]
    edge = -np.sign(tilt) * length / 2
    points = edge - np.sign(edge or 1) * np.geomspace(1e-5, 1, 40) * length

    def total(weight):
        return _over(
            -length / 2,
            length / 2,
            lambda x: np.exp(-tilt * (x - edge) / DECAY) * weight(x),
            points,
        )

    fraction, centre = exact.wedge_on_asperities(tilt, length, DECAY)
    assert fraction == pytest.approx(total(lambda x: 1) / length, rel=1e-9)
    from_edge = total(lambda x: x - edge) / total(lambda x: 1)
    assert centre - edge == pytest.approx(from_edge, rel=1e-9, abs=1e-11 * length)


@pytest.mark.parametrize("tilt", [1e-5, 1e-4, 1e-3])
@pytest.mark.parametrize("ratio", [0.5, 1.0, 3.0, 30.0])
def test_exact_wedge_loop_is_the_sum_of_its_strips(tilt, ratio):
    mu = 0.4
    kt = 8e12
    area = 1e-4
    fraction, _, least, largest = exact.wedge_on_linear_foundation(tilt, **PAD)
    amplitude = ratio * mu * PAD["load"] / (kt * area)

    def strip(p):
        return friction_forms.jenkins_loop(amplitude, mu * p / kt, mu * p)[0]

    kink = min(max(amplitude * kt / mu, least), largest)
    want = sum(quad(strip, a, b, epsabs=0)[0] for a, b in ((least, kink), (kink, largest)) if b > a)
    want *= fraction * area / (largest - least)
    found = exact.wedge_loop_area(amplitude, mu, kt, fraction * area, least, largest)
    assert found == pytest.approx(want, rel=1e-10, abs=1e-18)


def test_exact_wedge_loop_of_a_level_pad_is_that_of_one_strip():
    amplitudes = np.array([0.5, 3.0]) * 1e-6
    level = exact.wedge_loop_area(amplitudes, 0.4, 8e12, 1e-4, 1e6, 1e6)
    strip = friction_forms.jenkins_loop(amplitudes, 0.4e6 / 8e12, 0.4e6)[0]
    assert level == pytest.approx(1e-4 * strip)


# ---- refusals


@pytest.mark.parametrize(
    "call",
    [
        lambda: exact.punch_contact(1.0, 1.0),
        lambda: exact.punch_contact(0.0),
        lambda: exact.punch_pressure(0.0, -1.0, 1.0),
        lambda: exact.punch_rotation(1.0, 1.0, 0.0),
        lambda: exact.rounded_punch_half_width(1.0, 0.0, 1.0, 1.0),
        lambda: exact.rounded_punch_pressure(0.0, 1.0, 1e-12, 1.0, 1.0),
        lambda: exact.westergaard_full_pressure(-1.0, 1.0, 1.0),
        lambda: exact.westergaard_approach(0.0, 1.0, 1.0, 1.0),
        lambda: exact.layered_compliance(0.0, TITANIUM, TITANIUM, 1.0),
        lambda: exact.layered_compliance(1.0, TITANIUM, TITANIUM, -1.0),
        lambda: exact.cattaneo_shear(0.0, 1.1, 1.0, 1.0, 1.0, 1.0),
        lambda: exact.cattaneo_stick_half_width(0.1, 1.0, 1.0, 1.0, 0.0),
        lambda: exact.wedge_opening_tilt(1.0, 1.0, 0.0, 1.0),
        lambda: exact.wedge_on_linear_foundation(1.0, 1.0, -1.0, -1.0, 1.0),
        lambda: exact.wedge_on_asperities(1.0, 1.0, 0.0),
        lambda: exact.wedge_loop_area(1.0, 1.0, 1.0, 1.0, 2.0, 1.0),
        lambda: exact.wedge_loop_area(1.0, 1.0, 1.0, 1.0, 0.0, 0.0),
        lambda: exact.kern_contact_fraction(0.5, 1.0),
    ],
)
def test_refuses_contact_arguments_without_a_meaning(call):
    with pytest.raises(ValueError):
        call()
