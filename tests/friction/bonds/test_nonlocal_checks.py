"""Hand-worked consequences of 2.8-2.21 that the other tests leave open; numbered as in the list of checks C1-C20.

Lengths in eps_0 and forces in mu_s N unless a test says otherwise. Truths are mpmath or scipy integrals of the law as
printed, closed forms, or an integrated equation; none of them calls the code under test.
"""

from itertools import pairwise

import mpmath
import numpy as np
import pytest
from friction_paths import drift, lower_pressure, pulled, upper_pressure, walk
from modal_bases import basis_of
from scipy.special import gammainc
from vibration_forms import sliding_amplitude

from patchfem import build
from patchfem.core import SineDrive
from patchfem.dynamics import points_model
from patchfem.dynamics.march.march import march
from patchfem.friction import Bonds, FirstOrderBonds, Quadrature
from patchfem.friction.bonds.quadrature import cutoff_age
from patchfem.friction.bonds.recursion import BondState
from patchfem.friction.laws.elastic_plastic import ElasticPlastic
from patchfem.response import energy_balance
from patchfem.runs.bench import bench as law_bench
from patchfem.scene import scene

ONE = upper_pressure([1.0])
OMEGA = 2 * np.pi * 143


# ---- C8: dwell


@pytest.mark.parametrize("hold", [0.05, 0.2, 1.0])
def test_exact_c8_dwell_of_the_stretch_in_closed_form(hold):
    """From z = eps_k = 0.5, m = 1: eps = 1 - e^-10t/2, force unmoved, then z = eps + (0.5 - eps) e^-x/eps; 1e-12."""
    law = FirstOrderBonds(
        Bonds(1.0, 1.0, ratio=0.5, rest_growth=10.0, slip_growth=1e30, rest_speed=1.0)
    )
    state = BondState(np.array([[1.0], [0.5], [0.5]]), 0.5)
    one = np.ones(1)
    held = law.step(state, 0.0, one, one, hold)
    eps = 1 - 0.5 * np.exp(-10 * hold)
    assert held.state.eps == pytest.approx(eps, rel=1e-14) and law.traction(held.state)[0] == 0.5
    for x in (0.25, 0.5, 1.0, 2.0):
        force = law.traction(law.step(held.state, x, one, one, 0.0).state)[0]
        assert force == pytest.approx(eps + (0.5 - eps) * np.exp(-x / eps), abs=1e-12)


# ---- C9, C10: pressure on the lower piece


def over_a_pad(engine, depth, width, beyond=0.0, after=0.0):
    """Traction (m,) at points that entered a pad of uniform pressure 1 and slid `depth` (m,) into it or `width` and
    then `after` beyond its trailing edge, where the pressure is `beyond`."""
    starts = np.unique(np.concatenate([[0.0], depth.max() - depth, [depth.max()]]))
    on = np.zeros_like(depth)
    state = engine.start(on)
    for a, b in pairwise(starts):
        on = (depth.max() - depth <= a + 1e-14).astype(float)
        for cut in np.diff(np.linspace(a, b, max(2, int(np.ceil((b - a) / 0.5)) + 1))):
            state = engine.step(state, cut, on, on, 1.0).state
    if after:
        state = engine.step(state, after, beyond * on, beyond * on, 1.0).state
    return engine.traction(state)


@pytest.mark.share(0, 1, 2, 3, 5, 7)
@pytest.mark.parametrize(
    "order, engine", [(0.0, "printed"), (1.0, "printed"), (1.0, "sum"), (1.0, "state")]
)
@pytest.mark.parametrize(
    "width, want",
    [(5, (0.80134759, 0.60943313)), (10, (0.90000454, 0.80005448)), (100, (0.99, 0.98))],
)
def test_exact_c9_resultant_of_a_pad_that_bonds_enter_at_its_edge(order, engine, width, want):
    """Pressure on the lower piece: shear P(p + 1, x) from the leading edge; resultant P(s, X) - (s/X) P(s + 1, X)."""
    reading = "report" if engine == "printed" else "stretch"
    law = Bonds(1.0, 1.0, order, reading)
    law = FirstOrderBonds(law) if engine == "state" else Quadrature(law, tail=0.0)
    y, w = np.polynomial.legendre.leggauss(24 if width < 50 else 70)
    depth = width * (1 + y) / 2
    tau = over_a_pad(law, depth, width)
    s = order + 1
    assert tau == pytest.approx(gammainc(s, depth), abs=1e-11)
    assert w / 2 @ tau == pytest.approx(
        gammainc(s, width) - s / width * gammainc(s + 1, width), abs=1e-8
    )
    assert w / 2 @ tau == pytest.approx(want[int(order)], abs=1e-8)


@pytest.mark.parametrize(
    "order, eps, size, lag",
    [
        (0.0, 2.0, 0.9878867, -8.92705),
        (1.0, 2.0, 0.9759201, -17.85411),
        (1.0, 20.0, 0.2884004, -115.03673),
    ],
)
def test_exact_c10_pressure_wave_is_smoothed_and_delayed(order, eps, size, lag):
    """80 um wave on the lower piece, steady slide: tau follows sigma by (1 + i k eps)^-(p + 1); steps halved once."""
    k = 2 * np.pi / 80
    x = 80 * np.arange(6) / 6

    def response(count):
        law = Bonds(1.0, eps, order, "report" if order == 0 else "stretch", initial=0.0)
        law = FirstOrderBonds(law) if order == 1 else Quadrature(law, tail=0.0)
        path = np.linspace(0, 30 * eps, count + 1)
        pressure = lower_pressure(x, 80.0, 2.0)
        tau = pulled(law, path, pressure).traction[-1]
        place = x + path[-1]
        return 1j * (tau @ np.exp(-1j * k * place)) / 3

    count = 100 if eps == 2 else 800
    got = (
        4 * response(2 * count) - response(count)
    ) / 3  # strips form at the mean of their ends: order two
    truth = (1 + 1j * k * eps) ** -(order + 1)
    assert got == pytest.approx(truth, abs=1e-6)
    assert (abs(truth), np.degrees(np.angle(truth)) % -360) == pytest.approx((size, lag), abs=1e-5)


def mode(omega=OMEGA, zeta=0.0):
    return basis_of(omega, zeta)


# ---- C17: contraction


def test_exact_c17_steps_longer_than_the_contraction_limit_converge():
    """Plain iteration fails for steps above dt_c = sqrt(2 eps_0/a_f) = 319.3 us."""
    for ratio in (0.95, 1.4, 3.0):
        omega = 2 * np.pi / (16 * ratio * 319.3e-6)
        got = march(
            mode(omega, 0.003),
            SineDrive(2 * 39.24, omega),
            points_model(Bonds(0.4, 2e-6), [1e-4], [98.1e4]),
            100,
            16,
            window=2,
        )
        assert got.outcome is None


# ---- the same numbers through a scene


def bench(friction, slide, steps):
    """Measures of a bench of 100 N at one point with `steps` per cycle."""
    text = f"""[normal]
load = "100 N"
[friction]
law = "nonlocal"
static = 0.6
bond_length = "2 um"
{friction}
[slide]
{slide}
"""
    return law_bench.run(build(scene.loads(text, "bench.toml")), None, steps).values


@pytest.mark.parametrize(
    "keys, steps, area",
    [
        ("", 8, (1.328022e-3, 0.953623, 16.000363, 36.0)),
        (
            'reading = "report"\norder = 0\ninitial_bonds = 0',
            40,
            (2.659583e-2, 2.149259, 18.0, 38.0),
        ),
    ],
)
def test_exact_c4_c5_loops_of_a_bench_scene(keys, steps, area):
    for ratio, want in zip((0.1, 1.0, 5.0, 10.0), area):
        got = bench(
            keys,
            f'kind = "triangle"\namplitude = "{2 * ratio} um"\nspeed = "1 mm/s"\n'
            f"cycles = {int(np.ceil(9 / ratio)) + 2}",
            steps if ratio > 2 else 8,
        )
        assert got["loop_area"] == pytest.approx(want * 60 * 2e-6, rel=1e-6)


@pytest.mark.parametrize("speed, order, want", [("5 mm/s", 0, 0.423841), ("50 mm/s", 1, 0.428834)])
def test_exact_c1_steady_printed_law_of_a_bench_scene(speed, order, want):
    """40 um in 800 steps of 50 nm, a quarter of the growth path at 50 mm/s: 1e-4."""
    got = bench(
        'reading = "report"\ninitial_bonds = 0\nkinetic = 0.42\nrest_growth = "10 m/s^2"\n'
        f'slip_growth = "0.2 um"\norder = {order}',
        f'kind = "constant"\nspeed = "{speed}"\ndistance = "40 um"',
        800,
    )
    assert got["friction_ratio_end"] == pytest.approx(want, abs=1e-4)


# ---- far ends

GROWTH = {"ratio": 0.5, "rest_growth": 0.4, "slip_growth": 0.3, "rest_speed": 1e-2}


@pytest.mark.share(0, 2)
@pytest.mark.parametrize(
    "reading, order",
    [("stretch", 1.0), ("stretch", 2.0), ("report", -0.9), ("report", 0.0), ("report", 20.0)],
)
def test_exact_bond_lengths_of_a_nanometre_and_a_metre_are_one_law(reading, order):
    """Lengths scale with eps_0 and l_k, speeds too: the tractions are those of eps_0 = 1."""
    length = 1e-9
    rng = np.random.default_rng(5)
    path = np.concatenate([[0], np.cumsum(rng.normal(0, 1.5, 24))])
    laws = [Quadrature, FirstOrderBonds] if (reading, order) == ("stretch", 1.0) else [Quadrature]
    for growth in ({}, GROWTH):
        scaled = {key: value * (1.0 if key == "ratio" else length) for key, value in growth.items()}
        for maker in laws:
            unit = walk(maker(Bonds(0.3, 1.0, order, reading, **growth)), path, ONE, 0.5)
            run = walk(maker(Bonds(0.3, length, order, reading, **scaled)), path * length, ONE, 0.5)
            assert run.traction == pytest.approx(unit.traction, abs=1e-10)
            assert run.mean == pytest.approx(unit.mean, abs=1e-10)


@pytest.mark.parametrize("order", [-0.9, 20.0])
def test_exact_extreme_orders_of_the_printed_law(order):
    """p = -0.9, 20: virgin curve P(p + 1, x), reversal P(p + 1, 60 + x) - 2 P(p + 1, 2x) and cut-off in many digits."""
    law = Bonds(1.0, 1.0, order, "report", initial=0.0)
    path = np.concatenate([np.linspace(0, 60, 121), 60 - np.array([0.01, 0.5, 4.0, 12.0, 30.0])])
    force = pulled(Quadrature(law, tail=0.0), path, ONE).traction[:, 0]

    def below(x):
        return float(mpmath.gammainc(mpmath.mpf(order) + 1, 0, x, regularized=True))

    assert force[:120] == pytest.approx([below(x) for x in path[1:121]], abs=1e-12)
    for back, got in zip(60 - path[121:], force[120:]):
        assert got == pytest.approx(below(60 + back) - 2 * below(2 * back), abs=1e-12)
    assert float(
        mpmath.gammainc(
            mpmath.mpf(order) + 1, cutoff_age(order, 1e-9), mpmath.inf, regularized=True
        )
    ) == pytest.approx(1e-9, rel=1e-6)


def test_order_of_the_march_with_bonds_of_a_nanometre_is_half_towards_coulomb():
    """135 Hz at 6 g, damping 0.05, f = 4 g: steady amplitude against Den Hartog's; short by the root of eps_0.

    A step spans thousands of bond lengths; every one converges and the ledger closes.
    """
    drive = 6 * 9.80665
    w = 2 * np.pi * 135
    coulomb = sliding_amplitude(135 / 143, 4 / 6, 0.05) * drive / OMEGA**2
    short = []
    for length in (1e-7, 1e-8, 1e-9):
        model = points_model(Bonds(0.4, length), [1e-4], [98.0665e4])
        got = march(mode(zeta=0.05), SineDrive(drive, w), model, 60, 3200, window=2)
        assert got.outcome is None and energy_balance(got.ledger) <= 1e-8
        short.append(1 - np.ptp(got.window.slide) / 2 / coulomb)
    assert np.log10(short[0] / short[1]) == pytest.approx(0.5, abs=0.03)
    assert np.log10(short[1] / short[2]) == pytest.approx(0.5, abs=0.03) and 0 < short[2] < 4e-3


# ---- drift under a biased dither


@pytest.mark.parametrize(
    "law, forces, loads, drift_per_cycle",
    [
        (
            Quadrature(Bonds(1.0, 1.0, 1.0, "stretch"), tail=0.0),
            (0.8, 0.2),
            (1.0, 1.0),
            0.980829253,
        ),
        (ElasticPlastic(1.0, 1.0), (0.999, -0.999), (1.0, 1.0), 0.0),
        (FirstOrderBonds(Bonds(1.0, 1.0)), (0.5, 0.5), (0.9, 1.1), 0.0),
    ],
)
def test_exact_drift_under_a_dither(law, forces, loads, drift_per_cycle):
    """Force 0.5 +- 0.3 on the sum over bonds, by its closed form; a load that changes at rest: 0."""
    assert drift(law, forces, loads) == pytest.approx(drift_per_cycle, abs=1e-9)
