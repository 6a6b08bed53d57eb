"""Stated errors compared with true errors: sequences of known order, and random rigs with far finer steps."""

from dataclasses import replace

import numpy as np
import pytest

from patchfem import build
from patchfem.response import (
    absolute_change,
    add_errors,
    convergence_errors,
    merged_cell_errors,
)
from patchfem.response.errors import SAFETY_FACTOR
from patchfem.runs import choose_numerics
from patchfem.runs.rig import march as rig_march
from patchfem.scene import scene

NAME = "relative_displacement_amplitude"

TEXT = """
[normal]
load = "100 N"
[friction]
law = "{law}"
static = {static}
bond_length = "{length} um"
[structure]
moving_mass = "1 kg"
[[structure.mode]]
name = "axial"
frequency = "143 Hz"
damping = {damping}
slide = 1.0
{other}
[drive]
kind = "base"
frequency = "{frequency} Hz"
acceleration = "5 g"
cycles = {cycles}
"""
OTHER = """[[structure.mode]]
name = "yaw"
frequency = "{} Hz"
damping = 0.01
slide = {}
"""


def make_random_scene(rng):
    """Return a random rig with the law nonlocal or elastic-plastic."""
    other = OTHER.format(rng.uniform(60, 400), rng.uniform(0.05, 0.3)) if rng.random() < 0.5 else ""
    return scene.loads(
        TEXT.format(
            law=rng.choice(["nonlocal", "elastic-plastic"]),
            static=rng.uniform(0.2, 0.55),
            length=10 ** rng.uniform(-1, 1),
            damping=rng.choice([0.003, 0.01, 0.05]),
            other=other,
            frequency=rng.uniform(110, 180),
            cycles=rng.choice([20, 60]),
        )
    )


def coverage_of_errors(count, seed, finest=12800):
    """Return the fraction of stated errors of random rigs that cover the difference to `finest` steps.

    The rigs are computed with 400 steps per cycle.
    """
    rng = np.random.default_rng(seed)
    held = []
    for _ in range(count):
        model = build(make_random_scene(rng))
        numerics = choose_numerics(model)
        runs = {
            n: rig_march.march_in_time(model, replace(numerics, steps=n), None).values
            for n in (400, 200, 100, finest)
        }
        errors = convergence_errors(runs[400], runs[200], runs[100], steps=400)
        truth = absolute_change(runs[400], runs[finest])
        for name, measure in add_errors(runs[400], [("steps", errors)]).items():
            if name in truth and name != "energy_balance":
                held.append(truth[name] <= measure.error + measure.floor)
    return float(np.mean(held))


def test_always_stated_errors_cover_true_errors():
    """At least 95 % of the stated errors of four random rigs cover the true errors."""
    assert coverage_of_errors(4, 5, 6400) >= 0.95


def make_sequence(*steps, order, size=1e-3):
    """Return runs whose value is 1 with an error of size * h**order at each step h."""
    return [{NAME: 1 + size * h**order} for h in steps]


@pytest.mark.parametrize("order", [1.0, 2.0])
@pytest.mark.parametrize("size", [1e-3, -1e-3])
@pytest.mark.parametrize("count", [3, 5])
def test_exact_error_of_sequence_of_known_order(order, size, count):
    """For three or more runs of a known order, the stated error is SAFETY_FACTOR times the true error."""
    runs = make_sequence(*2.0 ** np.arange(count), order=order, size=size)
    assert convergence_errors(*runs)[NAME] == pytest.approx(SAFETY_FACTOR * abs(size), rel=1e-9)


@pytest.mark.parametrize("order", [0.5, 4.0])
def test_always_errors_cover_orders_from_half_to_four(order):
    """The stated error covers the true one for orders from 1/2 to 4, although orders above 2 count as 2."""
    assert convergence_errors(*make_sequence(1, 2, 4, order=order))[NAME] >= 1e-3


@pytest.mark.parametrize(("ratio", "order"), [(4.0, 2.0), (30.0, 1.0)])
def test_exact_two_runs_use_given_order(ratio, order):
    """For two runs the given order determines the error; a measure absent from the coarser run gets none."""
    fine, coarse = make_sequence(1.0, ratio, order=order)
    found = convergence_errors(fine | {"loop_area": 1.0}, coarse, ratio=ratio, order=order)
    assert found == {NAME: pytest.approx(SAFETY_FACTOR * 1e-3)}


def test_exact_cell_error_orders_of_measures():
    """The error from the cells of a law is of first order for instants of events, and of second order for other measures."""
    fine = {"stick_fraction": 0.2, "loop_area": 1.0}
    coarse = {"stick_fraction": 0.21, "loop_area": 1.15}
    found = merged_cell_errors(fine, coarse, fine)
    assert found == {"stick_fraction": pytest.approx(0.01), "loop_area": pytest.approx(0.03)}


def test_exact_time_fractions_have_sampling_error():
    """Fractions of time and phases have an error of the sampling interval, even if all runs agree."""
    same = {"open_fraction": 0.25, "slip_start_phase": 0.6, "stick_fraction": 0.2, NAME: 1.0}
    assert convergence_errors(same, same, same, steps=128) == pytest.approx(
        {
            "open_fraction": 4 / 128,
            "slip_start_phase": 1 / 128,
            "stick_fraction": 0.35 / 128,
            NAME: 0.0,
        }
    )


def test_exact_error_rules_of_measure_kinds():
    """Errors contain a relative part; a phase error is at most pi/2, and a drift error depends on the amplitude."""
    values = {NAME: 2e-3, "slip_start_phase": 3.0, "energy_balance": 4e-9, "drift_per_cycle": 1e-12}
    parts = {NAME: 1e-6, "slip_start_phase": 1.8, "energy_balance": 1e-10, "drift_per_cycle": 1e-15}
    errors = [("steps", parts)]
    measures = add_errors(values, errors, min_relative_error=1e-9)
    found = {name: measure.error for name, measure in measures.items()}
    assert found == {
        NAME: pytest.approx(1e-6 + 2e-12, rel=1e-12),
        "slip_start_phase": np.pi / 2,
        "energy_balance": 4e-9,
        "drift_per_cycle": pytest.approx(1e-15 + 1e-9 * 2e-3 + 1e-21, rel=1e-9),
    }
    least = add_errors(values, errors)["drift_per_cycle"].error
    assert least == pytest.approx(1e-15 + 1e-13 * 2e-3, rel=1e-9)
