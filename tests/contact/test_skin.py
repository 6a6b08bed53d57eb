"""The skin of asperities: wedges in closed form, the unilateral limit, quadrature, scales, and random controls."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pieces import LENGTH, LOAD, WIDTH, coated_pair, rough
from scipy.integrate import quad
from scipy.stats import norm
from skins import longer, solve, strips_of, tangent

from patchfem.contact import (
    ExponentialAsperities,
    HertzAsperities,
    HolderLoads,
    LinearAsperities,
    asperity_layer,
    press,
    tangential_stiffness,
)
from patchfem.contact.asperity_laws import peak_integral
from patchfem.contact.strips import STRIP_RESIDUAL_TOL, HolderPosition, compute_strip_residuals
from patchfem.core import NotConverged, Outcome, PatchfemError

AREA = LENGTH * WIDTH
MEAN = LOAD / AREA
PEAKS = HertzAsperities(radius=10e-6, density=1e10, deviation=1e-6, modulus=1.3e11)
SKINS = {
    "linear": LinearAsperities(1e13),
    "exponential": ExponentialAsperities(0.5e-6, 1e6),
    "hertz": PEAKS,
}
each_skin = pytest.mark.parametrize("skin", SKINS.values(), ids=SKINS.keys())


def bodies(cells=100):
    """Closing compliance, places and areas of the coated pair."""
    pair = coated_pair(cells)
    return pair.normal, pair.interface.x, pair.interface.weight


def test_exact_reference_pressure_only_shifts_the_approach():
    c, x, weight = bodies()
    gap = rough(np.random.default_rng(1), x, 1e-6)
    one, two = (
        solve(ExponentialAsperities(1e-7, p), c, x, weight, gap, LOAD) for p in (None, 1e3 * MEAN)
    )
    assert np.abs(one.force - two.force).max() <= 1e-11 * LOAD
    assert one.delta - two.delta == pytest.approx(1e-7 * np.log(1e3), rel=1e-9)


# ------------------------------------------------------------------------------------------ against the bare unilateral
GAPS = {
    "flat": lambda x: 0 * x,
    "tilt": lambda x: 1e-4 * x,
    "rough": lambda x: rough(np.random.default_rng(5), x, 3e-7),
}


@pytest.mark.parametrize("offset", [None, 2e-3])
def test_order_one_a_stiff_linear_skin_tends_to_bare_contact(offset):
    pair = coated_pair(100)
    c, x, weight = bodies()
    gap = GAPS["tilt"](x)
    moment = None if offset is None else offset * LOAD
    bare = press(pair, gap, LOAD, moment)
    off = [
        np.abs(
            solve(LinearAsperities(k), c, x, weight, gap, LOAD, moment).pressure - bare.sigma_n
        ).max()
        / MEAN
        for k in (1e16, 1e17, 1e18)
    ]
    assert off[2] < 1e-3
    assert np.log10(off[0] / off[1]) == pytest.approx(1, abs=0.1)
    assert np.log10(off[1] / off[2]) == pytest.approx(1, abs=0.1)


@pytest.mark.parametrize("skin", [ExponentialAsperities(1e-6, MEAN), PEAKS])
def test_order_one_thin_smooth_skins_tend_to_bare_contact(skin):
    """P(s/t) with t -> 0, to within the logarithm of t."""
    c, x, weight = bodies()
    gap = GAPS["tilt"](x)
    bare = press(coated_pair(100), gap, LOAD).sigma_n
    off = [
        np.abs(solve(longer(skin, t), c, x, weight, gap, LOAD).pressure - bare).max() / bare.max()
        for t in (1e-3, 1e-4, 1e-5, 1e-6)
    ]
    assert off[3] < 2e-3 and all(6 < a / b < 14 for a, b in pairwise(off[1:]))


@each_skin
@pytest.mark.parametrize("offset", [0.0, 1.7e-3, -6.2e-3])
def test_exact_rotation_and_approach_held_where_the_moment_put_them_give_the_same_forces(
    skin, offset
):
    c, x, weight = bodies()
    gap = 2e-5 * x + rough(np.random.default_rng(3), x, 1e-7)
    free = solve(skin, c, x, weight, gap, LOAD, LOAD * offset)
    held = solve(skin, c, x, weight, gap + free.theta * x, LOAD, rotation=free.theta)
    pushed = solve(
        skin, c, x, weight, gap + free.theta * x, approach=free.delta, rotation=free.theta
    )
    for other in (held, pushed):
        assert np.abs(other.force - free.force).max() <= 1e-9 * free.force.max()
        assert other.delta == pytest.approx(free.delta, rel=1e-9) and other.theta == free.theta
    assert pushed.load == pytest.approx(LOAD, rel=1e-9)


def test_exact_forces_minimise_the_energy():
    """f.Cf/2 + g.f + sum A Psi(f/A) with Psi' = -P^-1 rises in every direction that keeps load and moment."""
    c, x, weight = bodies()
    rng = np.random.default_rng(4)
    gap = rough(rng, x, 1e-7)
    for skin in (ExponentialAsperities(1e-7, 1e6), PEAKS):
        state = solve(skin, c, x, weight, gap, LOAD, 1e-3 * LOAD)
        slope = c @ state.force + gap - skin.separation(state.pressure)
        move = np.stack([np.ones(x.size), x / LENGTH], axis=1)
        left = slope - move @ np.linalg.lstsq(move, slope, rcond=None)[0]
        assert np.abs(left).max() <= 1e-10 * (np.ptp(gap) + np.ptp(c @ state.force))


# ----------------------------------------------------------------------------------------------------- the law of peaks
@pytest.mark.parametrize("h", [-200.0, -8.001, -7.999, -3.0, 0.0, 0.7, 3.0, 12.0, 30.0])
def test_exact_peak_integral_against_adaptive_quadrature(h):
    log, fall = peak_integral(np.array([h]))

    def weighted(power):  # in units of phi(h) for a positive h: the tail underflows
        if h > 0:
            return quad(
                lambda t: t**power * np.exp(-h * t - t * t / 2), 0, np.inf, epsabs=0, epsrel=1e-12
            )[0]
        points = [max(-h - 9, 0), -h, -h + 9]
        inner = [
            quad(lambda t: t**power * norm.pdf(t + h), a, b, epsabs=0, epsrel=1e-12, limit=200)[0]
            for a, b in zip(points, [*points[1:], -h + 40], strict=False)
            if b > a
        ]
        return sum(inner)

    shift = -h * h / 2 - 0.5 * np.log(2 * np.pi) if h > 0 else 0.0
    assert log[0] == pytest.approx(np.log(weighted(1.5)) + shift, abs=1e-10, rel=1e-12)
    assert fall[0] == pytest.approx(1.5 * weighted(0.5) / weighted(1.5), rel=1e-9)


def test_always_the_tail_of_the_peaks_is_finite_and_keeps_its_law():
    """log F -> -h^2/2 - 5/2 log h + log(Gamma(5/2)/sqrt(2 pi)) far out, where F itself underflows."""
    log, fall = peak_integral(np.array([1e2, 1e3, 1e5]))
    h = np.array([1e2, 1e3, 1e5])
    far = -h * h / 2 - 2.5 * np.log(h) + np.log(0.75 * np.sqrt(np.pi) / np.sqrt(2 * np.pi))
    assert np.abs(log - far).max() <= 1e-3 and np.abs(fall / h - 1).max() <= 1e-3
    middle = np.linspace(-20, 30, 400)
    step = 1e-4
    rate = (peak_integral(middle - step)[0] - peak_integral(middle + step)[0]) / (2 * step)
    assert np.abs(rate / peak_integral(middle)[1] - 1).max() <= 1e-6


@pytest.mark.parametrize("skin", [ExponentialAsperities(1e-7, 1e6), PEAKS])
def test_exact_separation_inverts_the_pressure(skin):
    wanted = 10.0 ** np.arange(-60, 16)
    assert np.abs(skin.pressure(skin.separation(wanted)) / wanted - 1).max() <= 1e-10
    s = np.linspace(-5, 5, 21) * 1e-6
    step = 1e-12
    slope = -(skin.pressure(s + step) - skin.pressure(s - step)) / (2 * step)
    assert np.abs(slope / skin.stiffness(s) - 1).max() <= 1e-5


# ------------------------------------------------------------------------------------------- scales and whole stiffness
@each_skin
def test_exact_twice_the_gap_skin_and_load_doubles_the_pressure(skin):
    c, x, weight = bodies()
    gap = 3e-5 * x + rough(np.random.default_rng(2), x, 1e-7)
    twice = {
        "linear": lambda: skin,
        "exponential": lambda: ExponentialAsperities(1e-6, 2e6),
        "hertz": lambda: replace(longer(skin, 2.0), density=2 * longer(skin, 2.0).density),
    }
    other = next(twice[name]() for name, law in SKINS.items() if law is skin)
    for moment in (None, 1e-3 * LOAD):
        one = solve(skin, c, x, weight, gap, LOAD, moment)
        two = solve(other, c, x, weight, 2 * gap, 2 * LOAD, None if moment is None else 2 * moment)
        assert np.abs(two.force - 2 * one.force).max() <= 1e-9 * two.force.max()
        assert two.delta == pytest.approx(2 * one.delta, rel=1e-9)


def test_exact_skin_and_bodies_in_series():
    """Rigid bodies leave the skin's sum k A; a stiff skin leaves the bodies; between, the matrix C + 1/(k A)."""
    pair = coated_pair(100)
    c, _, weight = bodies()
    k = np.full(weight.size, 1e13)
    assert tangent(0 * c, weight, k) == pytest.approx(1e13 * AREA, rel=1e-12)
    everywhere = np.ones(weight.size, bool)
    assert tangent(c, weight, 1e9 * k) == pytest.approx(
        tangential_stiffness(c, everywhere), rel=1e-5
    )
    ratio = tangent(pair.tangential, weight, 0.8 * k)
    summed = np.linalg.solve(
        pair.tangential + np.diag(1 / (0.8e13 * weight)), np.ones(weight.size)
    ).sum()
    assert ratio == pytest.approx(summed, rel=1e-11)
    assert ratio < min(0.8e13 * AREA, tangential_stiffness(pair.tangential, everywhere))
    half = np.where(np.arange(weight.size) < 40, k, 0.0)
    part = np.ix_(half > 0, half > 0)
    assert tangent(c, weight, half) == pytest.approx(
        np.linalg.solve(c[part] + np.diag(1 / (1e13 * weight[:40])), np.ones(40)).sum(), rel=1e-11
    )
    assert tangent(c, weight, 0 * k) == 0.0


# ------------------------------------------------------------------------------------------------------- never failing
@each_skin
@pytest.mark.parametrize("spring", [1e2, 1e4, 1e7])
def test_exact_spring_of_the_holder_is_the_moment_it_gives(skin, spring):
    """The rotation against a spring, sum f x = M + K theta, is the free rotation under the moment M + K theta."""
    c, x, weight = bodies(60)
    gap = 1e-4 * x
    moment = 2e-3 * LOAD
    held = solve(skin, c, x, weight, gap, LOAD, moment, rotation=1e-4, spring=spring)
    turned = held.theta - 1e-4
    free = solve(skin, c, x, weight, gap, LOAD, moment + spring * turned)
    assert abs(turned) > 1e-9 and free.theta == pytest.approx(turned, rel=1e-7)
    assert np.abs(held.force - free.force).max() <= 1e-9 * LOAD
    assert held.moment == pytest.approx(
        moment + spring * turned, rel=1e-8, abs=1e-9 * LOAD * LENGTH
    )


def holds(skin, c, x, weight, gap, state, load, moment):
    """Law, balance and signs, from the state alone."""
    assert state.outcome is Outcome.DONE and max(state.residuals.values()) <= STRIP_RESIDUAL_TOL
    assert (
        state.force.min() >= 0 and np.isfinite(state.stiffness).all() and state.stiffness.min() >= 0
    )
    assert state.force.sum() == pytest.approx(load, rel=1e-11)
    if moment is not None:
        assert abs(state.force @ x - moment) <= 1e-11 * load * np.ptp(x)
    opening = gap + (0.0 if moment is None else state.theta) * x - state.delta + c @ state.force
    depth = np.ptp(gap) + np.abs(c @ state.force).max() + np.abs(state.theta * x).max()
    big = state.force > 1e-3 * state.force.max()
    assert (
        np.abs(opening - state.separation)[big].max()
        <= 1e-9 * np.abs(state.separation[big]).max() + 1e-13 * depth
    )


@given(
    law=st.sampled_from(["linear", "exponential", "hertz"]),
    scale=st.floats(-9, 6),
    stiff=st.floats(9, 18),
    thin=st.floats(-9, -5),
    angle=st.floats(-6, -2),
    rough_size=st.floats(-9, -4),
    jagged=st.booleans(),
    place=st.none() | st.floats(-0.499, 0.499),
    rigid=st.booleans(),
    seed=st.integers(0, 2**32 - 1),
)
def test_always_any_gap_load_moment_and_skin_converge(
    law, scale, stiff, thin, angle, rough_size, jagged, place, rigid, seed
):
    c, x, weight = bodies(40)
    c = 0 * c if rigid else c
    rng = np.random.default_rng(seed)
    gap = 10**angle * x + (
        10**rough_size * rng.normal(size=x.size) if jagged else rough(rng, x, 10**rough_size)
    )
    skin = {
        "linear": LinearAsperities(10**stiff),
        "exponential": ExponentialAsperities(10**thin),
        "hertz": replace(PEAKS, deviation=10**thin),
    }[law]
    load = LOAD * 10**scale
    moment = None if place is None else place * LENGTH * load
    holds(skin, c, x, weight, gap, solve(skin, c, x, weight, gap, load, moment), load, moment)


@given(
    depth=st.floats(-9, -5),
    sign=st.sampled_from([-1, 1]),
    seed=st.integers(0, 2**32 - 1),
    law=st.sampled_from(["linear", "exponential", "hertz"]),
)
def test_always_any_approach_is_answered(depth, sign, seed, law):
    c, x, weight = bodies(40)
    gap = 1e-6 * np.random.default_rng(seed).normal(size=x.size)
    skin = {**SKINS, "exponential": ExponentialAsperities(1e-8, 1e6)}[law]
    state = solve(skin, c, x, weight, gap, approach=gap.min() + sign * 10**depth)
    assert (
        state.force.min() >= 0 and max(state.residuals.values(), default=0.0) <= STRIP_RESIDUAL_TOL
    )
    # a linear skin that is open is not solved
    assert state.residuals or state.outcome is Outcome.NO_CONTACT
    assert (state.outcome is Outcome.DONE) == (state.load > 0)


def test_exact_an_approach_about_the_floor_of_the_pressure_is_answered():
    c, x, weight = bodies(40)
    gap = 1e-6 * np.random.default_rng(0).normal(size=x.size)
    skin = ExponentialAsperities(1e-8, 1e6)
    edge = 1e-8 * (
        np.log(1e6) + 300
    )  # the separation at which the pressure is exp(MIN_LOG_PRESSURE)
    for part in (1 - 1e-3, 1 - 1e-9, 1.0, 1 + 1e-9, 1 + 1e-3, 1 + 1e-2):
        state = solve(skin, c, x, weight, gap, approach=gap.min() - part * edge)
        assert max(state.residuals.values()) <= STRIP_RESIDUAL_TOL
        assert (state.outcome is Outcome.DONE) == (state.load > 0)
    assert state.outcome is Outcome.NO_CONTACT


def test_exact_going_down_the_dual_alone_leads_to_the_same_answer(monkeypatch):
    c, x, weight = bodies(40)
    gap = 1e-5 * np.random.default_rng(9).normal(size=x.size)
    newton = asperity_layer._solve_newton
    for skin in (ExponentialAsperities(1e-8, MEAN), replace(PEAKS, deviation=1e-8)):
        for moment in (None, 2e-3 * LOAD):
            here = solve(skin, c, x, weight, gap, LOAD, moment)
            with monkeypatch.context() as without:  # Newton on the patch under its approach alone
                without.setattr(
                    asperity_layer,
                    "_solve_newton",
                    lambda *a: None if a[0].contact.target.size else newton(*a),
                )
                there = solve(skin, c, x, weight, gap, LOAD, moment)
            assert there.iterations > here.iterations
            assert np.abs(there.force - here.force).max() <= 1e-9 * LOAD


# ------------------------------------------------------------------------------------------------------------- refusals


def test_refuses_controls_without_an_answer():
    c, x, weight = bodies(40)
    for control in ({}, {"load": 1.0, "approach": 1e-6}, {"approach": 1e-6, "moment": 0.0}):
        with pytest.raises(PatchfemError, match="give a load"):
            solve(PEAKS, c, x, weight, 0 * x, **control)
    for load in (-1.0, np.nan, np.inf):
        with pytest.raises(PatchfemError, match=r"contact\.load"):
            solve(PEAKS, c, x, weight, 0 * x, load)
    with pytest.raises(PatchfemError, match="tips over"):
        solve(PEAKS, c, x, weight, 0 * x, LOAD, 0.5 * LENGTH * LOAD)
    with pytest.raises(PatchfemError, match="no first touch"):
        solve(ExponentialAsperities(1e-6), c, x, weight, 0 * x, approach=1e-6)
    with pytest.raises(PatchfemError, match="rough layer is too large to compute"):
        solve(ExponentialAsperities(1e-9, 1e6), 0 * c, x, weight, 0 * x, approach=1e-3)


def test_refuses_an_answer_that_did_not_settle(monkeypatch):
    c, x, weight = bodies(40)
    monkeypatch.setattr(asperity_layer, "MAX_NEWTON_STEPS", 1)
    with pytest.raises(NotConverged, match=r"contact\.asperities"):
        solve(PEAKS, c, x, weight, 1e-4 * x, LOAD)


def test_refuses_an_answer_whose_residual_is_too_large_with_a_remedy(monkeypatch):
    c, x, weight = bodies(40)
    monkeypatch.setattr("patchfem.contact.strips.STRIP_RESIDUAL_TOL", -1.0)  # below any residual
    with pytest.raises(
        NotConverged, match=r"contact\.asperities: .* exceeds .*; make the rough layer softer"
    ):
        solve(PEAKS, c, x, weight, 1e-4 * x, LOAD)


def test_always_the_independent_check_sees_a_wrong_force():
    c, x, weight = bodies(40)
    for skin in (SKINS["exponential"], PEAKS):
        state = solve(skin, c, x, weight, 1e-5 * x, LOAD)
        wrong = state.force.copy()
        wrong[3], wrong[4] = wrong[3] * 1.001, wrong[4] - 0.001 * wrong[3]
        checks = compute_strip_residuals(
            strips_of(c, x, weight, np.zeros(1), skin),
            1e-5 * x[None],
            wrong[None],
            HolderPosition(state.delta),
            HolderLoads(LOAD),
        )
        assert checks["law"] > STRIP_RESIDUAL_TOL and checks["force_balance"] < STRIP_RESIDUAL_TOL
