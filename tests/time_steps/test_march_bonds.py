"""Points of bonds in the march: the recursion, and lists of any order and reading behind springs."""

from types import SimpleNamespace

import numpy as np
import pytest
from march_contacts import make_bond_contact
from march_paths import OMEGA, follow_path
from modal_bases import make_modal_basis
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import gammainc

from patchfem.core import SineDrive
from patchfem.friction import BondGrowth, Bonds
from patchfem.motion_measures import energy_balance
from patchfem.time_steps.contacts import BondSum
from patchfem.time_steps.time_march import march

ROW = np.ones(1)
FORCE = np.array([0.7, 1.3, 2.0, 0.4]) / 0.4  # normal forces of four points [N]
LAWS = [(reading, order) for reading in ("report", "stretch") for order in (0.0, 0.5, 1.0, 2.0)]
GROWTH = {"ratio": 0.7, "growth": BondGrowth(0.05, 3e-7, 1e-4)}


def make_lists(law, force, shear=None, reach=25.0, merge=0.02, **options):
    """Return points whose bonds are summed over lists."""
    return make_bond_contact(law, force, ROW, shear, BondSum(law, reach, merge), **options)


def make_shear(shape, stiffness):
    """Return shear modes of points with given slides (m, r) per coordinate."""
    return SimpleNamespace(
        shape=np.asarray(shape),
        stiffness=np.asarray(stiffness, float),
        points=np.arange(len(shape)),
    )


def check_balance(found, path, rel=1e-12) -> None:
    """Check that at every sample the work equals the change of the stored energy plus the loss."""
    work = found.forces[:-1, 1] * np.diff(path)
    imbalance = np.cumsum(work - found.energies[:-1, 0]) - found.energies[1:, 1]
    assert np.abs(imbalance + found.energies[0, 1]).max() < rel * np.abs(work).sum()


# ---- prescribed paths


@pytest.mark.parametrize(
    ("order", "curve", "tolerance"),
    [
        (0.0, None, 2e-6),
        (2.0, lambda x: gammainc(2, x), 2e-6),
        (0.5, lambda x: gammainc(0.5, x), 1e-4),
    ],
)
def test_exact_initial_loading_behind_spring_agrees_with_closed_form(order, curve, tolerance):
    """A point behind a spring follows the regularised incomplete gamma function P(p, s/eps) of its order p.

    This follows from P(p + 1, x) + x^p exp(-x)/Gamma(p + 1) = P(p, x); p = 0 is Coulomb friction. The slide is
    s + force/stiffness.
    """
    law = Bonds(0.4, 1e-6, order, "report")
    stiffness = 3e6
    path = np.linspace(0, 4e-6, 1601)
    shear = make_shear(np.ones((1, 1)), [stiffness])
    found = follow_path(make_lists(law, [5.0], shear, 745.0, 0.0), path, 1e-3)

    def find_force(slide):
        if curve is None:
            return min(stiffness * slide, 2.0)
        rest = lambda s: s + 2.0 * curve(s / 1e-6) / stiffness - slide  # noqa: E731
        return 2.0 * curve(brentq(rest, 0, slide, xtol=1e-18) / 1e-6)

    samples = np.arange(400, 1601, 100)
    assert found.n_unsolved == 0
    expected = [find_force(path[k]) for k in samples]
    assert found.forces[samples, 0] == pytest.approx(expected, abs=tolerance)


@pytest.mark.share(0, 3, 7, 9, 11, 14)
@pytest.mark.parametrize("growth", [{}, GROWTH], ids=["constant", "grows"])
@pytest.mark.parametrize(("reading", "order"), LAWS)
def test_exact_energy_balance_over_reversals(reading, order, growth):
    """Work, stored energy and losses are balanced over reversals and coarse steps; the reading by stretch creates no energy.

    Where the pieces move by b against the slide s of a point, the force of a step does not do the work of the point, but
    2 s b/(s + b) (mean of the path - mean of both ends) less. This vanishes with the third power of the step. Only
    while points of order 0 stick before they slip does it exceed their losses: this first step is divided.
    """
    law = Bonds(0.4, 1e-6, order, reading, **growth)
    t = np.linspace(0, 1, 161)
    path = 3e-6 * np.sin(2 * np.pi * 2.5 * t) * (0.4 + t)  # five reversals at different slides [m]
    path = np.insert(path, 1, path[1] * np.array([0.01, 0.1, 0.3, 0.5, 0.7]))
    rng = np.random.default_rng(3)
    shape = rng.normal(size=(4, 3)) / np.sqrt(0.4 * FORCE)[:, None]
    found = follow_path(make_lists(law, FORCE, make_shear(shape, [1e6, 3e6, 1e7])), path, 1e-3)
    assert found.n_unsolved == 0
    check_balance(found, path)
    losses = found.energies[:, 0]
    created = -np.minimum(losses, 0).sum()
    assert reading == "report" or created < 1e-7 * losses.sum()


def test_always_sudden_slip_dissipates_energy():
    """A point behind a soft spring whose bonds lose nine tenths of their length slips suddenly, and loses the energy."""
    law = Bonds(0.4, 1e-6, 1.0, "stretch", 0.1, BondGrowth(1e-3, 1e-7, 1e-6), 1.0)
    path = np.linspace(0, 6e-6, 301)
    shear = make_shear(np.ones((1, 1)), [2e5])
    found = follow_path(make_lists(law, [5.0], shear, 30.0, 0.01), path, 1e-4)
    assert found.n_unsolved == 0
    check_balance(found, path)


@pytest.mark.parametrize(
    ("slip_growth", "peak", "area"),
    [(3e-8, 46.990, 4.0979e-7), (1e-6, 46.96192, 2.98150e-7), (2e-8, 45.237, 4.3603e-4)],
    ids=["creeps", "hardly weakens", "slips suddenly"],
)
def test_steeply_weakening_bonds_follow_the_first_solution(slip_growth, peak, area):
    """Bonds of order 0 behind a soft spring creep or slip suddenly as a brute-force integration does.

    The references have a strip for each of 4000 or 1000 steps per cycle. Their slide continues that of the last step, up to
    the first change of sign of the residual; a sudden slip advances by 0.05 bond lengths at a time.
    """
    length = 0.3392e-6
    law = Bonds(
        0.721, length, 0.0, "stretch", 0.1517 / 0.721, BondGrowth(0.05, slip_growth, 1e-5), 0.1679
    )
    shear = make_shear(np.ones((1, 1)), [3.862e6])
    n_steps = 1024
    path = 12.16e-6 * np.sin(2 * np.pi * np.arange(2 * n_steps + 1) / n_steps)
    found = follow_path(make_lists(law, [234.5], shear, 30.0), path, 1 / (162.4 * n_steps))
    force = found.forces[:, 0]
    loop = np.sum((0.5 * (force[1:] + force[:-1]) * np.diff(path))[-n_steps:])
    assert found.n_unsolved == 0
    assert np.abs(force).max() == pytest.approx(peak, rel=1e-3)
    assert loop == pytest.approx(area, rel=1e-3)


# ---- motion


@pytest.mark.parametrize(
    "growth",
    [{}, {"ratio": 0.7, "growth": BondGrowth(10.0, 0.2e-6, 1e-3)}],
    ids=["constant length", "growing length"],
)
def test_order_two_against_integrated_rate_equations(growth):
    """Slide and force of bonds converge with order two to a solution of the rate equations by LSODA.

    The rig has 143 Hz, damping 0.003, 1 kg, 39 N, a bond length of 1 um and a drive of 5 g.
    """
    length = 1e-6
    limit = 0.4 * 98.0665
    drive = 5 * 9.80665
    law = Bonds(0.4, length, **growth)

    def find_rates(t, y):
        q, v, z, eps = y
        grows = 0.0
        if growth:
            grows = 10.0 / max(abs(v), 1e-3) * (length - eps) + abs(v) / 0.2e-6 * (
                0.7 * length - eps
            )
        accel = -drive * np.sin(OMEGA * t) - 0.006 * OMEGA * v - OMEGA**2 * q - limit * z / length
        return [v, accel, v - abs(v) * z / eps, grows]

    period = 2 * np.pi / OMEGA
    times = np.linspace(0, 2 * period, 101)
    reference = solve_ivp(
        find_rates,
        (0, times[-1]),
        [0, 0, 0, length],
        "LSODA",
        times,
        rtol=1e-10,
        atol=[1e-16, 1e-13, 1e-17, 1e-17],
        max_step=period / 800,
    )
    errors = []
    for steps in (100, 800, 6400):
        result = march(
            make_modal_basis(OMEGA, 0.003),
            SineDrive(drive, OMEGA),
            make_bond_contact(law, 98.0665, ROW),
            2,
            steps,
            window=2,
        )
        errors.append(np.abs(result.window.slide[:: steps // 50] - reference.y[0]).max() / length)
    assert (reference.y[3].min() < 0.701 * length) == bool(growth)
    assert errors[0] > errors[1] > errors[2] and errors[2] < 1e-4
    assert np.log2(errors[0] / errors[2]) / 6 == pytest.approx(2, abs=0.15)


# ---- lists without room


def test_always_full_list_keeps_forces_near_those_of_long_list(monkeypatch):
    """A list without room joins strips; the force changes by less than a thousandth of its limit, and no step fails."""
    law = Bonds(0.4, 2e-5, 1.0, "report", 0.6, BondGrowth(10.0, 5e-6, 1e-4))

    def march_list(room):
        for name in ("N_UNMERGED_STRIPS", "MAX_STRIPS"):
            monkeypatch.setattr(f"patchfem.friction.bonds.list_numbers.{name}", room)
        contact = make_lists(law, 98.0665, None, np.inf, 0.0)
        modes = make_modal_basis(OMEGA, 0.01)
        return march(modes, SineDrive(49.0, OMEGA), contact, 3, 100, window=3, frames=4)

    short, long = march_list(20), march_list(20_000)
    assert long.ledger["strips"] > 2 * short.ledger["strips"]
    assert short.window.force == pytest.approx(long.window.force, abs=1e-3 * 0.4 * 98.0665)
    assert energy_balance(short.ledger) < 1e-9
