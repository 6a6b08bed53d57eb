"""Stated errors compared with true errors: sequences of known order, and a march with few steps."""

import numpy as np
import pytest
from scene_texts import DRIVE, KILOGRAM, POINT, make_friction_table

import patchfem as pf
from patchfem.convergence import ERROR_SAFETY_FACTOR
from patchfem.measures import estimate_convergence_errors
from patchfem.measures.errors import add_errors, add_run_error_estimates

NAME = "relative_displacement_amplitude"


def make_sequence(*steps, order, size=1e-3):
    """Return runs whose value is 1 with an error of size * h**order at each step h."""
    return [{NAME: 1 + size * h**order} for h in steps]


@pytest.mark.parametrize("order", [1.0, 2.0])
@pytest.mark.parametrize("size", [1e-3, -1e-3])
@pytest.mark.parametrize("count", [3, 5])
def test_exact_error_of_sequence_of_known_order(order, size, count):
    """For three or more runs of a known order, the stated error is ERROR_SAFETY_FACTOR times the true error."""
    runs = make_sequence(*2.0 ** np.arange(count), order=order, size=size)
    assert estimate_convergence_errors(*runs)[NAME] == pytest.approx(
        ERROR_SAFETY_FACTOR * abs(size), rel=1e-9
    )


@pytest.mark.parametrize("order", [0.5, 4.0])
def test_always_errors_cover_orders_from_half_to_four(order):
    """The stated error covers the true one for orders from 1/2 to 4, although orders above 2 count as 2."""
    assert estimate_convergence_errors(*make_sequence(1, 2, 4, order=order))[NAME] >= 1e-3


@pytest.mark.parametrize(("ratio", "order"), [(4.0, 2.0), (30.0, 1.0)])
def test_exact_two_runs_use_given_order(ratio, order):
    """For two runs the given order determines the error; a measure absent from the coarser run gets none."""
    fine, coarse = make_sequence(1.0, ratio, order=order)
    found = estimate_convergence_errors(fine | {"loop_area": 1.0}, coarse, ratio=ratio, order=order)
    assert found == {NAME: pytest.approx(ERROR_SAFETY_FACTOR * 1e-3)}


def test_exact_time_fractions_have_sampling_error():
    """Fractions of time and phases have an error of the sampling interval, even if all runs agree."""
    same = {"open_fraction": 0.25, "slip_start_phase": 0.6, "stick_fraction": 0.2, NAME: 1.0}
    assert estimate_convergence_errors(same, same, same, steps=128) == pytest.approx(
        {
            "open_fraction": 4 / 128,
            "slip_start_phase": 1 / 128,
            "stick_fraction": 0.35 / 128,
            NAME: 0.0,
        }
    )


@pytest.mark.parametrize("law", ["coulomb", "elastic-plastic"])
@pytest.mark.parametrize("steps, cycles", [(40, 10.31225), (40, 7.51225), (400, 7.511225)])
def test_always_errors_of_march_that_ends_between_whole_steps(law, steps, cycles):
    """Measures of a march whose end is half a step beyond a whole step agree with the exact ones within their errors."""
    text = POINT + make_friction_table(law) + KILOGRAM
    text += DRIVE.replace("cycles = 30", f"cycles = {cycles}")
    march = pf.run(text, **{"accuracy.method": "march", "accuracy.steps_per_cycle": steps})
    exact = pf.run(text, **{"accuracy.method": "exact"})
    assert march.response.time[-1] == pytest.approx(cycles / 143, rel=1e-12)
    for name, measure in march.measures.items():
        truth = exact.measures[name]
        if measure.error is not None and truth.value is not None:
            allowed = measure.error + truth.error + measure.floor
            assert abs(measure.value - truth.value) <= allowed, name


def test_exact_stick_fraction_has_error_of_instants_at_which_slip_starts():
    """The error of the stick fraction is at least that of the phase at which slip starts, divided by pi, by source."""
    values = {"stick_fraction": 0.4774, "slip_start_phase": 1.8666}
    errors = [
        ("mesh", {"stick_fraction": 5.6e-4, "slip_start_phase": 2.8e-3}),
        ("own", dict.fromkeys(values, 1e-6)),
    ]
    measures = add_errors(values, errors)
    assert measures["stick_fraction"].error == pytest.approx(2.8e-3 / np.pi + 1e-6)
    assert measures["slip_start_phase"].error == pytest.approx(2.801e-3)

    # So are the errors that the run itself shows, and the relative error of all measures.
    measures = add_run_error_estimates(measures, {"slip_start_phase": 0.1})
    assert measures["stick_fraction"].error == pytest.approx(0.102801 / np.pi)
    measures = add_errors(values, min_relative_error=1e-9)
    assert measures["stick_fraction"].error >= measures["slip_start_phase"].error / np.pi


def test_exact_secant_stiffness_of_zero_has_round_off_of_forces():
    """The secant stiffness of a law of the velocity, 0 up to the round-off of the forces, has an error that contains 0."""
    values = {
        "relative_displacement_amplitude": 4.6e-5,
        "friction_force_peak": 7.9,
        "secant_stiffness": 7.6e-13,
    }
    measure = add_errors(values, [("own", dict.fromkeys(values, 1.4e-13))])["secant_stiffness"]
    assert measure.value < measure.error < 1e-6
