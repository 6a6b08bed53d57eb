"""Consequences of equations 2.8 to 2.21 that the other tests leave open, numbered as checks C1 to C20.

Lengths are in eps_0 and forces in mu_s N unless a test says otherwise. The reference values are
integrals by mpmath or scipy of the printed law, closed forms, or an integrated equation; none calls
the code under test.
"""

import mpmath
import numpy as np
import pytest
from friction_paths import LowerPressure, march_bonds, upper_pressure
from march_contacts import make_bond_contact
from modal_bases import make_modal_basis
from scipy.special import gammainc
from vibration_forms import sliding_amplitude

from patchfem import build
from patchfem.core import SineDrive
from patchfem.friction import BondGrowth, Bonds
from patchfem.friction.bonds.list_numbers import cutoff_age
from patchfem.motion_measures import energy_balance
from patchfem.runs.bench import bench as law_bench
from patchfem.scene import scene
from patchfem.time_steps.time_march import march

UNIT_PRESSURE = upper_pressure([1.0])
OMEGA = 2 * np.pi * 143


# ---- C8: dwell


@pytest.mark.parametrize("dwell_time", [0.05, 0.2, 1.0])
def test_exact_dwell_of_stretch_law_agrees_with_closed_form(dwell_time):
    """A dwell keeps the force of steady sliding, and the force after it is that of the longer new bonds (C8).

    Sliding at a high speed leaves bonds of half the length, which grow by 10 exp(-10 t) at rest. The step after the dwell
    is as fast, so that the length decreases over one bond length of slip.
    """
    law = Bonds(1.0, 1.0, ratio=0.5, growth=BondGrowth(10.0, 1.0, 1.0))
    for x in (0.25, 0.5, 1.0, 2.0):
        path = np.append(np.linspace(0.0, 60.0, 121), [60.0, 60.0 + x])
        times = np.concatenate([np.full(120, 1e-12), [dwell_time, 1e-12]])
        force = march_bonds(law, path, UNIT_PRESSURE, times).traction[:, 0]
        assert force[119:121] == pytest.approx(0.5, abs=1e-9)
        eps = 0.5 + 0.5 * (1 - np.exp(-10 * dwell_time)) * np.exp(-x / 2)
        assert force[-1] == pytest.approx(eps + (0.5 - eps) * np.exp(-x / eps), abs=1e-9)


# ---- C9: pressure on the lower piece


def pad_traction(law, depth, tail):
    """Return the traction (m,) at points that slid `depth` (m,) into a pad of uniform unit pressure."""
    edge = 1e-12
    end = depth.max() + 1.0
    places = np.concatenate([depth - end, [-edge, 0.0, end]])
    order = np.argsort(places)
    sigma = (places >= 0.0).astype(float)

    # A point passes the edge of the pad within one step; further steps are at most half a bond length.
    entries = end - depth
    marks = [entries - 2 * edge, entries + edge, np.arange(0.25, end, 0.5), [0.0, end]]
    pressure = LowerPressure(places[order], sigma[order])
    traction = march_bonds(law, np.unique(np.concatenate(marks)), pressure, tail=tail).traction[-1]
    return traction[np.argsort(order)[: depth.size]]


@pytest.mark.share(0, 2, 5, 7)
@pytest.mark.parametrize(
    "order, reading, tail",
    [(0.0, "report", 0.0), (1.0, "report", 0.0), (1.0, "stretch", 0.0), (1.0, "stretch", None)],
)
@pytest.mark.parametrize(
    "width, expected",
    [(5, (0.80134759, 0.60943313)), (10, (0.90000454, 0.80005448)), (100, (0.99, 0.98))],
)
def test_exact_resultant_of_pad_on_lower_piece(order, reading, tail, width, expected):
    """The traction behind the leading edge of a pad on the lower piece and its resultant agree with closed forms (C9)."""
    y, w = np.polynomial.legendre.leggauss(24 if width < 50 else 70)
    depth = width * (1 + y) / 2
    tau = pad_traction(Bonds(1.0, 1.0, order, reading), depth, tail)
    s = order + 1

    assert tau == pytest.approx(gammainc(s, depth), abs=1e-11)
    assert w / 2 @ tau == pytest.approx(
        gammainc(s, width) - s / width * gammainc(s + 1, width), abs=1e-8
    )
    assert w / 2 @ tau == pytest.approx(expected[int(order)], abs=1e-8)


# ---- bench scenes


def run_bench(friction, motion, steps):
    """Return the measures of a bench scene of one point under 100 N with `steps` per cycle."""
    text = f"""[normal]
load = "100 N"
[friction]
law = "nonlocal"
static = 0.6
bond_length = "2 um"
{friction}
[slide]
{motion}
"""
    return law_bench.run_bench(build(scene.loads(text, "bench.toml")), None, steps).values


@pytest.mark.parametrize(
    "keys, steps, areas",
    [
        ("", 8, (1.328022e-3, 0.953623, 16.000363, 36.0)),
        (
            'reading = "report"\norder = 0\ninitial_bonds = 0',
            40,
            (2.659583e-2, 2.149259, 18.0, 38.0),
        ),
    ],
)
def test_exact_bench_loop_area_agrees_with_closed_form(keys, steps, areas):
    """The loop area of a bench scene with triangular motion agrees with the closed form within 1e-6 (C4, C5)."""
    for ratio, expected in zip((0.1, 1.0, 5.0, 10.0), areas):
        measures = run_bench(
            keys,
            f'kind = "triangle"\namplitude = "{2 * ratio} um"\nspeed = "1 mm/s"\n'
            f"cycles = {int(np.ceil(9 / ratio)) + 2}",
            steps if ratio > 2 else 8,
        )
        assert measures["loop_area"] == pytest.approx(expected * 60 * 2e-6, rel=1e-6)


@pytest.mark.parametrize(
    "speed, order, expected", [("5 mm/s", 0, 0.423841), ("50 mm/s", 1, 0.428834)]
)
def test_exact_bench_steady_friction_of_printed_law(speed, order, expected):
    """The friction ratio after 40 um at constant speed agrees with the steady value of the printed law within 1e-4 (C1)."""
    measures = run_bench(
        'reading = "report"\ninitial_bonds = 0\nkinetic = 0.42\nrest_growth = "10 m/s^2"\n'
        f'slip_growth = "0.2 um"\norder = {order}',
        f'kind = "constant"\nspeed = "{speed}"\ndistance = "40 um"',
        800,
    )
    assert measures["friction_ratio_end"] == pytest.approx(expected, abs=1e-4)


# ---- any order


@pytest.mark.parametrize("order", [-0.9, 0.0, 20.0])
def test_exact_printed_law_of_any_order(order):
    """For orders -0.9 to 20 the first loading, the reversal and the cut-off age agree with incomplete gamma functions."""
    law = Bonds(1.0, 1.0, order, "report", initial=0.0)
    path = np.concatenate([np.linspace(0, 60, 121), 60 - np.array([0.01, 0.5, 4.0, 12.0, 30.0])])
    force = march_bonds(law, path, UNIT_PRESSURE, tail=0.0).traction[:, 0]

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


def test_order_of_convergence_to_coulomb_is_half():
    """The steady amplitude converges to the Coulomb solution (Den Hartog) with the square root of the bond length.

    The case is 135 Hz at 6 g, damping 0.05 and a friction limit of 4 g. A step spans thousands of
    bond lengths, and the energy balance closes.
    """
    drive = 6 * 9.80665
    omega = 2 * np.pi * 135
    coulomb_amplitude = sliding_amplitude(135 / 143, 4 / 6, 0.05) * drive / OMEGA**2
    deficits = []
    for length in (1e-7, 1e-8, 1e-9):
        contact = make_bond_contact(Bonds(0.4, length), 98.0665, np.ones(1))
        basis = make_modal_basis(OMEGA, 0.05)
        marched = march(basis, SineDrive(drive, omega), contact, 60, 3200, window=2)
        assert marched.outcome is None and energy_balance(marched.ledger) <= 1e-8
        deficits.append(1 - np.ptp(marched.window.slide) / 2 / coulomb_amplitude)
    assert np.log10(deficits[0] / deficits[1]) == pytest.approx(0.5, abs=0.03)
    assert (
        np.log10(deficits[1] / deficits[2]) == pytest.approx(0.5, abs=0.03)
        and 0 < deficits[2] < 4e-3
    )
