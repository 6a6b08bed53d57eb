"""Energy balance of the compiled bond list along random paths.

The stretch law never dissipates a negative energy, the work equals the stored and the dissipated
energy, and it agrees with the trapezoidal rule applied to the force.
"""

import numpy as np
import pytest
from friction_paths import make_points, upper_pressure
from march_paths import follow_path

from patchfem.friction import Bonds

ENGINES = {"direct": (0.0, 0.0), "truncated": (1e-6, 0.0), "merged": (1e-6, 0.02)}  # tail, merge
CASES = [
    ("stretch", 0.0, "direct"),
    ("stretch", 0.3, "merged"),
    ("stretch", 3.3, "truncated"),
    ("report", 0.0, "truncated"),
    ("report", 1.0, "direct"),
    ("report", -0.5, "merged"),
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


@pytest.mark.parametrize("reading, order, engine", CASES)
def test_always_energy_balance_of_list_closes(reading, order, engine):
    """The energy balance closes, and no step of the stretch law creates energy.

    With step means that were not derived from the stored energy, 5e-5 of the work was created on such paths.
    """
    rng = np.random.default_rng(1)
    for _ in range(6):
        law, path = draw_law_and_path(rng, reading, order)
        contact = make_points(law, upper_pressure([1.0]), *ENGINES[engine])
        forces, energies, n_unsolved, _ = follow_path(contact, path, 10 ** rng.uniform(-2, 1))
        work = forces[:-1, 1] * np.diff(path)
        dissipated = energies[:-1, 0]
        total_work = np.abs(work).sum()
        assert n_unsolved == 0
        balance = work.sum() - dissipated.sum() - energies[-1, 1]
        assert abs(balance) <= 1e-12 * total_work
        if reading == "stretch":
            assert dissipated.min() >= -1e-12 * total_work
            assert energies[:, 1].min() >= -1e-4


@pytest.mark.parametrize("reading, order, engine", CASES)
def test_order_of_list_work_quadrature_is_two(reading, order, engine):
    """The trapezoidal work of the force converges to the work of the step means with order two (1.3 for order -0.5)."""
    law = Bonds(1.0, 1.0, order, reading, 0.6, 0.3, 0.4, 1e-2, 0.0)
    contact = make_points(law, upper_pressure([1.0]), *ENGINES[engine])
    errors = []
    for steps in (100, 400):
        path = 1.7 * np.sin(2 * np.pi * np.arange(2 * steps + 1) / steps)
        forces, _, _, _ = follow_path(contact, path, 2 * np.pi / steps)
        work = forces[:-1, 1] * np.diff(path)
        errors.append(abs(np.trapezoid(forces[:, 0], path) - work.sum()) / np.abs(work).sum())
    assert errors[1] < 2e-4 and (
        errors[1] < 1e-7 or np.log(errors[0] / errors[1]) / np.log(4) > (1.3 if order < 0 else 1.6)
    )
