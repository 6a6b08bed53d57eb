"""Energy balance of the compiled bond list along random paths.

The stretch law never dissipates a negative energy, the work equals the stored and the dissipated
energy, and it agrees with the trapezoidal rule applied to the force.
"""

import numpy as np
import pytest
from march_paths import follow_path

from patchfem.friction import Bonds
from patchfem.friction.bonds.list_numbers import cutoff_age
from patchfem.points.contacts import BondSum, make_bond_contact

ENGINES = {"direct": (0.0, 0.0), "truncated": (1e-6, 0.0), "merged": (1e-6, 0.02)}  # tail, merge
LAWS = [
    ("stretch", 0.0),
    ("stretch", 0.3),
    ("stretch", 2.0),
    ("stretch", 3.3),
    ("report", 0.0),
    ("report", 1.0),
    ("report", -0.5),
]


def draw_law_and_path(rng, reading, order):
    """Return a random law and path with dwells; the bonds grow in every second draw."""
    step_scale = 10 ** rng.uniform(-4, 0.5)
    growth = {}
    steps = rng.normal(size=150) * step_scale * 10 ** rng.uniform(-2, 1, 150)
    steps[rng.random(150) < 0.05] = 0.0
    if rng.random() < 0.5:
        growth = {
            "ratio": rng.uniform(0.1, 1),
            "rest_growth": step_scale * 10 ** rng.uniform(-3, 2),
            "slip_growth": 10 ** rng.uniform(-3, 1),
            "rest_speed": step_scale * 10 ** rng.uniform(-4, -1),
        }
    initial = float(order >= 0 and rng.random() < 0.5)
    return Bonds(1.0, 1.0, order, reading, initial=initial, **growth), np.concatenate(
        [[0.0], np.cumsum(steps)]
    )


def make_lists(law, tail, merge):
    """Return a point whose bonds are summed over a list."""
    reach = cutoff_age(law.order, tail) if tail else np.inf
    return make_bond_contact(law, 1.0, np.ones(1), bond_sum=BondSum(law, reach, merge))


def check_energy_balance(seed, count, reading, order, engine):
    """Check the energy balance of the bond list on random paths."""
    rng, (tail, merge) = np.random.default_rng(seed), ENGINES[engine]
    for _ in range(count):
        law, path = draw_law_and_path(rng, reading, order)
        contact = make_lists(law, tail, merge)
        forces, energies, n_unsolved, _ = follow_path(contact, path, 10 ** rng.uniform(-2, 1))
        work = forces[:-1, 1] * np.diff(path)
        dissipated = energies[:-1, 0]
        total_work = np.abs(work).sum()
        assert n_unsolved == 0
        assert work.sum() - dissipated.sum() == pytest.approx(
            energies[-1, 1], abs=1e-12 * total_work
        )
        if reading == "stretch":
            assert dissipated.min() >= -1e-12 * total_work
            assert energies[:, 1].min() >= -1e-4


@pytest.mark.share(0, 3, 6, 9, 11, 14, 17, 20)
@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("reading, order", LAWS)
def test_always_stretch_list_energy_balance_closes(reading, order, engine):
    """No step of the stretch law creates energy, and the energy balance closes.

    With step means that were not derived from the stored energy, 5e-5 of the work was created on
    such paths.
    """
    check_energy_balance(1, 6, reading, order, engine)


@pytest.mark.share(0, 3, 6, 9, 11, 14, 17, 20)
@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("reading, order", LAWS)
def test_order_of_list_work_quadrature_is_two(reading, order, engine):
    """The trapezoidal work of the force converges to the work of the step means with order two (1.3 for order -0.5)."""
    tail, merge = ENGINES[engine]
    law = Bonds(1.0, 1.0, order, reading, 0.6, 0.3, 0.4, 1e-2, 0.0)
    contact = make_lists(law, tail, merge)
    errors = []
    for steps in (100, 400):
        path = 1.7 * np.sin(2 * np.pi * np.arange(2 * steps + 1) / steps)
        forces, _, _, _ = follow_path(contact, path, 2 * np.pi / steps)
        work = forces[:-1, 1] * np.diff(path)
        errors.append(abs(np.trapezoid(forces[:, 0], path) - work.sum()) / np.abs(work).sum())
    assert errors[1] < 2e-4 and (
        errors[1] < 1e-7 or np.log(errors[0] / errors[1]) / np.log(4) > (1.3 if order < 0 else 1.6)
    )
