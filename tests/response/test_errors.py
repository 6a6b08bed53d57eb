"""Do stated errors hold the true error? Sequences of known order, and random rigs against themselves far finer."""

from dataclasses import replace

import numpy as np
import pytest

from patchfem import build, run
from patchfem.response import (
    absolute_change,
    add_errors,
    coarser_errors,
    convergence_error,
    convergence_errors,
    error_floor,
    merged_cell_errors,
    step_errors,
)
from patchfem.response.errors import SAFETY_FACTOR, observed_orders
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


def random_scene(rng):
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


def coverage(count, seed, finest=12800):
    """Share of stated errors of random rigs at 400 steps a cycle that hold, off `finest` steps."""
    rng = np.random.default_rng(seed)
    held = []
    for _ in range(count):
        model = build(random_scene(rng))
        numerics = choose_numerics(model)
        runs = {
            n: rig_march.run_march(model, replace(numerics, steps=n), None).values
            for n in (400, 200, 100, finest)
        }
        errors = step_errors(runs[400], runs[200], runs[100], steps=400)
        truth = absolute_change(runs[400], runs[finest])
        for name, measure in add_errors(runs[400], [("steps", errors)]).items():
            if name in truth and name != "energy_balance":
                held.append(truth[name] <= measure.error + measure.floor)
    return float(np.mean(held))


def test_always_stated_errors_hold_the_true_error():
    assert coverage(6, 5, 6400) >= 0.95


def values_at(*steps, order, size=1e-3):
    """Runs whose value is 1 with an error of size * h**order at each step h."""
    return [{NAME: 1 + size * h**order} for h in steps]


@pytest.mark.parametrize("order", [1.0, 1.5, 2.0])
@pytest.mark.parametrize("size", [1e-3, -1e-3])
@pytest.mark.parametrize("count", [3, 4, 5])
def test_exact_a_sequence_of_known_order_has_its_error(order, size, count):
    """Three runs or more show the order, whatever the sign: the stated error is SAFETY times the true one."""
    runs = values_at(*2.0 ** np.arange(count), order=order, size=size)
    assert convergence_errors(*runs)[NAME] == pytest.approx(SAFETY_FACTOR * abs(size), rel=1e-9)


@pytest.mark.parametrize("order", [0.5, 0.8, 3.0, 4.0])
def test_always_the_error_of_another_order_is_held(order):
    """From an order of 1/2 to one of 4, of which no more than the second is believed."""
    assert convergence_errors(*values_at(1, 2, 4, order=order))[NAME] >= 1e-3


@pytest.mark.parametrize("seed", range(20))
def test_always_an_irregular_sequence_is_held(seed):
    """Errors of either sign of up to h^p, as reversals between two steps leave them: 95 % of the errors hold."""
    rng = np.random.default_rng(seed)
    errors = 2.0 ** (rng.uniform(1, 2, 400) * np.arange(3)[:, None]) * rng.uniform(-1, 1, (3, 400))
    assert (
        np.mean(
            np.abs(errors[0]) <= convergence_error(errors[0] - errors[1], errors[1] - errors[2])
        )
        >= 0.95
    )


@pytest.mark.parametrize(("ratio", "order"), [(2.0, 1.0), (2.0, 2.0), (4.0, 2.0), (30.0, 1.0)])
def test_exact_two_runs_take_the_order_that_is_declared(ratio, order):
    """The largest of several changes counts; a measure that a coarser run does not have gets no error."""
    fine, coarse = values_at(1.0, ratio, order=order)
    found = coarser_errors(fine | {"loop_area": 1.0}, coarse, fine, ratio=ratio, order=order)
    assert found == {NAME: pytest.approx(SAFETY_FACTOR * 1e-3)}


def test_exact_instants_of_events_are_of_first_order_in_the_cells_and_other_measures_of_second():
    fine = {"stick_fraction": 0.2, "loop_area": 1.0}
    coarse = {"stick_fraction": 0.21, "loop_area": 1.15}
    found = merged_cell_errors(fine, coarse, fine)
    assert found == {"stick_fraction": pytest.approx(0.01), "loop_area": pytest.approx(0.03)}


def test_exact_a_phase_is_compared_modulo_pi():
    found = absolute_change({"slip_start_phase": 0.01}, {"slip_start_phase": np.pi - 0.01})
    assert found["slip_start_phase"] == pytest.approx(0.02)


def test_exact_what_counts_samples_has_their_resolution():
    """Runs that agree to the last digit: a share of time still hangs on the samples of a cycle."""
    same = {"open_fraction": 0.25, "slip_start_phase": 0.6, "stick_fraction": 0.2, NAME: 1.0}
    assert step_errors(same, same, same, steps=128) == pytest.approx(
        {
            "open_fraction": 4 / 128,
            "slip_start_phase": 1 / 128,
            "stick_fraction": 0.35 / 128,
            NAME: 0.0,
        }
    )


RUBBING = """[normal]
load = "{load} N"
[friction]
law = "coulomb"
static = 0.3
[structure]
moving_mass = "1 kg"
[[structure.mode]]
name = "one"
frequency = "143 Hz"
damping = 0.02
slide = 1.0
[drive]
kind = "base"
frequency = "120 Hz"
acceleration = "{size} g"
cycles = 30
[accuracy]
method = "march"
"""


def test_exact_a_small_drive_is_met_as_a_large_one():
    """Drive and load a billion times smaller: the same steps and the same relative errors. With 1e-10 m beside 6e-14 m
    any error was small enough."""
    large, small = (
        run(scene.loads(RUBBING.format(load=30 * size, size=5 * size))) for size in (1.0, 1e-9)
    )
    assert small.extra["steps_per_cycle"] == large.extra["steps_per_cycle"]
    one = small.measures[NAME]
    other = large.measures[NAME]
    assert one.value == pytest.approx(1e-9 * other.value, rel=1e-9)
    assert one.error == pytest.approx(1e-9 * other.error, rel=1e-3) and one.error < 1e-3 * one.value
    assert other.floor == 1e-10 and one.floor == pytest.approx(
        1e-5 * 5e-9 * 9.80665 / (2 * np.pi * 120) ** 2, rel=1e-12
    )
    assert error_floor(NAME, 0.0) == error_floor(NAME) == 1e-10
    assert error_floor("loop_area", 1e-12) == 1e-10


def test_exact_errors_depend_on_the_kind_of_measure():
    """Error of the parts and a share of the value; a phase modulo pi is at most a quarter turn off; a balance is 0 but
    for its error; a drift is a difference of means with digits of the amplitude."""
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


def test_exact_orders_are_those_that_the_changes_show():
    """h^p for p of 1, 2 and 4, which counts as 2; what does not fall, or does not change, has none."""

    def at(h):
        return {
            "one": 1 + h,
            "two": 1 + h**2,
            "four": 1 + h**4,
            "grows": 1 - np.log2(h),
            "none": 1.0,
            "slow": h**0.3,
        }

    found = observed_orders(at(1.0), at(2.0), at(4.0))
    assert found == {
        "one": pytest.approx(1.0),
        "two": pytest.approx(2.0),
        "four": pytest.approx(2.0),
    }
