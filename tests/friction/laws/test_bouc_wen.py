"""The Bouc-Wen law: limit, slope and closed loops, and one law in every run."""

import numpy as np
import pytest
from law_runs import LOAD, bench_along, shrinking
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from patchfem.friction.laws.bouc_wen import loop_from_keys
from patchfem.scene import Friction

LAW = 'law = "bouc-wen"\nstatic = 0.31\nstiffness = "1.3e7 N/m"\n'
LIMIT, EPS = 0.31 * LOAD, 0.31 * LOAD / 1.3e7


def law_of(exponent, shape):
    return LAW + f"exponent = {exponent}\nshape = {shape}\n"


def integrated(slide, exponent, shape):
    """z along straight legs of the slide, from the equation."""
    z = [0.0]
    for dq in np.diff(slide):

        def rate(_, y, v=dq):
            return v / EPS * (1 - np.abs(y) ** exponent * (shape * np.sign(v * y) + 1 - shape))

        z.append(solve_ivp(rate, (0, 1), z[-1:], method="DOP853", rtol=1e-12, atol=1e-14).y[0, -1])
    return np.array(z)


@pytest.mark.parametrize("exponent", [1.0, 2.0])
def test_exact_closed_loops(exponent):
    """s = 1/2 unloads on the elastic line and loads as 1 - e^-x or tanh x: the symmetric loop in closed form."""
    amplitude = 3e-6
    time = np.arange(12001) / 1e5
    found = bench_along(law_of(exponent, 0.5), time, amplitude * np.sin(2 * np.pi * 100 * time))
    rise = (lambda x: -np.expm1(-x)) if exponent == 1 else np.tanh
    top = brentq(lambda z: rise(2 * amplitude / EPS - z) - z, 0.0, 1.0, xtol=1e-15)
    x = 2 * amplitude / EPS - top
    half = LIMIT * EPS * (-(top**2) / 2 + (x - top if exponent == 1 else np.log(np.cosh(x))))
    assert found.force[-751] == pytest.approx(LIMIT * top, rel=1e-9)
    assert found.ledger[0, -1] - found.ledger[0, -1001] == pytest.approx(2 * half, rel=1e-9)


@pytest.mark.share(0, 3)
@pytest.mark.parametrize("exponent, shape", [(1.0, 0.5), (2.0, 0.8), (1.5, 0.2), (4.0, 1.0)])
def test_exact_a_bench_loop_is_the_equation(exponent, shape):
    time, slide = shrinking(60)
    found = bench_along(law_of(exponent, shape), time, slide)
    z = integrated(slide, exponent, shape)
    assert np.abs(found.force - LIMIT * z).max() <= 1e-6 * LIMIT
    work, stored, dissipated, created = found.ledger
    assert stored == pytest.approx(LIMIT * EPS * z**2 / 2, abs=1e-9 * LIMIT * EPS)
    assert work[-1] == pytest.approx(stored[-1] + dissipated[-1] - created[-1], rel=1e-12)
    assert created[-1] == 0 if shape >= 0.5 else created[-1] > 1e-3 * dissipated[-1]


@pytest.mark.parametrize("exponent, shape", [(0.3, 0.5), (1.0, 1.0), (1.5, 0.2), (4.0, 0.7)])
def test_exact_steady_loops_are_the_equation(exponent, shape):
    """Force at the turns and area of the loop that strokes of the law settle to, from half a length to 40 of them."""
    keys = Friction.model_construct(static=0.31, stiffness=1.3e7, exponent=exponent, shape=shape)
    slides = np.array([[0.5, 3.0], [12.0, 40.0]]) * EPS
    tip, area = loop_from_keys(keys, LOAD, slides)
    for u, force, loss in zip(slides.flat, tip.flat, area.flat):

        def stroke(z, u=u):
            """(z, its integral over the slide [m]) after a slide of 2 u from z."""

            def rate(x, y):
                return [
                    (1 - np.abs(y[0]) ** exponent * (shape * np.sign(y[0]) + 1 - shape)) / EPS,
                    y[0],
                ]

            return solve_ivp(
                rate,
                (0, 2 * u),
                [z, 0.0],
                method="DOP853",
                rtol=1e-10,
                atol=[1e-12, 1e-12 * u],
                max_step=0.5 * EPS,
            ).y[:, -1]

        end = brentq(lambda z: stroke(-z)[0] - z, 0.0, 1.0, xtol=1e-13)
        assert force == pytest.approx(LIMIT * end, rel=1e-7)
        assert loss == pytest.approx(2 * LIMIT * stroke(-end)[1], rel=1e-7)


def test_exact_one_and_one_is_the_stretch_reading():
    time, slide = shrinking()
    bonds = f'law = "nonlocal"\nstatic = 0.31\nbond_length = "{EPS!r} m"\n'
    a = bench_along(law_of(1.0, 1.0), time, slide)
    b = bench_along(bonds, time, slide)
    assert a.force == pytest.approx(b.force, abs=1e-10 * LIMIT)
    assert a.ledger[0] == pytest.approx(b.ledger[0], abs=1e-10 * a.ledger[0, -1])
