"""Time integration of cases in lanes, with measures and errors.

In: `Cases` of one friction law, and their steps per cycle. Out: `LaneRuns`. Errors are estimated
from marches with half and, if available, a quarter of the steps (`response.errors`).
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ....dynamics.lanes import reading
from ....dynamics.lanes import run as march
from ....dynamics.lanes.rows_kernels import Row
from ....model.model import Model
from ....model.similar_models import collect_columns
from ....response.errors import SUM_ROUND_OFF, convergence_errors
from ....response.measures import energy_balance
from ....response.settling import window_amplitude_means
from .columns import N_FINAL_WINDOWS, Runs
from .event_driven import compute_event_measures
from .lane_numbers import Scales, count_evaluated_cycles, find_lane_law
from .lane_ringing import find_ringing
from .lane_settling import SETTLING_LAWS, march_until_settled

# Smallest relative error of a measure, a hundredth of the smallest tolerance: the difference of two marches
# does not show an event that both miss.
MIN_RELATIVE_ERROR = 1e-6
# Largest relative size of a friction loop that the limited memory of a lane may drop.
DROPPED_LOOP_RATIO = 1e-2


class MeasuredMarch(NamedTuple):
    """Time integration of n cases in lanes with equal steps per cycle, and its measures.

    - steps, cycles, window: steps per cycle, number of cycles, and number of evaluated last cycles.
    - values: measures (n,) by name.
    - marched: result of `dynamics.lanes`.
    - extremes: smallest and largest output of each cycle (n, c, 2) [m].
    - force_rise: increase of the friction force in the evaluated cycles (n,) [N].
    """

    steps: int
    cycles: int
    window: int
    values: dict
    marched: march.LaneResults
    extremes: np.ndarray
    force_rise: np.ndarray


class LaneRuns(NamedTuple):
    """Runs of n cases in lanes, with masks of cases that need another run.

    - runs: Runs with error estimates.
    - needs_exact: mask (n,) of the cases that need the exact engine.
    - needs_more_steps: mask (n,) of the cases that need more steps.
    """

    runs: Runs
    needs_exact: np.ndarray
    needs_more_steps: np.ndarray


def march_and_measure(law: str, cases, scales: Scales, cycles: int, steps: int) -> MeasuredMarch:
    """Integrate cases in lanes, and compute the measures of their last cycles.

    Parameters
    ----------
    law : str
        Name of the law in `dynamics.lanes`.
    cases : Cases
    scales : Scales
    cycles, steps : int
        Number of cycles, and steps per cycle.
    """
    window = count_evaluated_cycles(cycles)
    marched = march.march(law, cases, cycles, window, steps)
    extremes = marched.history[:, :, :2] * scales.ratio[:, None, None]
    is_reversed = scales.ratio < 0
    extremes[is_reversed] = extremes[is_reversed, :, ::-1]
    energies = reading.run_energies(law, cases, marched, scales.energy)
    run_reading = reading.measure_runs(
        law, cases, marched, scales.energy, scales.omega, extremes[:, -window:]
    )
    with np.errstate(all="ignore"):
        values = compute_event_measures(
            run_reading,
            energies,
            is_sine=True,
            is_complete=True,
            stiffness=scales.stiffness,
            acceleration=scales.acceleration,
        )
    values |= {
        "normal_load": scales.load,
        "friction_work": energies["friction"],
        "energy_dissipated": energies.pop("lost"),
        "energy_created": np.zeros(len(scales.load)),
        "energy_balance": energy_balance(energies),
    }
    return MeasuredMarch(
        steps, cycles, window, values, marched, extremes, run_reading.force_increase
    )


def collect_runs(
    models: Sequence[Model],
    cases: tuple[march.Cases, Scales],
    measured: MeasuredMarch,
    coarser: list,
    mesh_errors: dict,
) -> LaneRuns:
    """Combine a march with its coarser marches to runs with error estimates.

    Parameters
    ----------
    models : sequence of Model
    cases : tuple
        Cases and Scales of the models.
    measured : MeasuredMarch
    coarser : list of dict
        Measures with half and, if available, a quarter of the steps.
    mesh_errors : dict
        Errors due to the mesh, (n,) by name.
    """
    law = find_lane_law(models[0])
    cases, scales = cases
    values = measured.values
    marched = measured.marched
    with np.errstate(over="ignore", invalid="ignore"):  # a march with half the steps may diverge
        errors = convergence_errors(values, *coarser)
    errors = {name: np.nan_to_num(error, posinf=np.inf) for name, error in errors.items()}
    for name in errors.keys() & mesh_errors.keys():
        errors[name] = errors[name] + mesh_errors[name]
    slip_ranges = marched.get_measure("MAX_SLIP") - marched.get_measure("MIN_SLIP")
    round_off = SUM_ROUND_OFF * np.abs(marched.history[:, :, :2]).max(axis=(1, 2))
    is_stuck = slip_ranges / 2 <= np.maximum(scales.max_stick_slip, round_off)
    is_stuck &= (cases.spring > 0) | (law == "rigid")
    # a case needs the exact engine if a measure exists in only one of the two marches
    has_other_measures = [np.isnan(values[name]) != np.isnan(coarser[0][name]) for name in values]
    needs_exact = np.any(has_other_measures, axis=0)
    ringing = find_ringing(law, cases, scales, measured, is_stuck)
    needs_exact |= ringing.needs_single_run
    steady = None
    if law in SETTLING_LAWS:
        amplitudes = window_amplitude_means(measured.extremes, measured.window)[0]
        steady_ranges = march_until_settled(law, cases, measured, amplitudes, ~is_stuck)
        ratio = np.abs(scales.ratio)
        steady = ratio * steady_ranges.value, ratio * steady_ranges.error
        needs_exact |= steady_ranges.is_open
    if law in march.MASING_LAWS:
        needs_exact |= march.law_state(law, marched.motion, "MAX_DROPPED_GAP") > DROPPED_LOOP_RATIO
    phasors = (marched.history[:, :, 2:] @ [1, 1j]) * scales.ratio[:, None]
    ends = np.arange(measured.cycles - 1, -1, -measured.window)[::-1][-N_FINAL_WINDOWS:]
    (tolerance,) = collect_columns(models, lambda model: (model.accuracy.tolerance,))
    runs = Runs(
        measured.cycles,
        measured.window,
        values | ringing.values,
        measured.extremes,
        phasors[:, ends],
        is_stuck,
        np.zeros(len(models), bool),  # LaneRuns has the masks of cases that need another run
        errors | ringing.errors,
        MIN_RELATIVE_ERROR,
        np.inf,
        is_stuck & (measured.force_rise > tolerance * values["friction_force_peak"]),
        steady,
        refines_steps=False,
    )
    is_finite = np.isfinite(marched.motion[:, Row.SLIDE] + coarser[0]["friction_work"])
    return LaneRuns(runs, needs_exact, ringing.needs_more_steps | ~is_finite)
