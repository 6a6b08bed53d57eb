"""March of cases in lanes, their measures, and the errors of these.

In: `Cases` of one friction law, with steps per cycle. Out: `LaneRuns`. The errors follow from
marches with half and, if it is known, a quarter of the steps (`response.errors`).
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ....dynamics.lanes import reading
from ....dynamics.lanes import run as march
from ....dynamics.lanes.rows_kernels import Row
from ....model.model import Model
from ....model.similar_models import collect_columns
from ....response.errors import SUM_ROUND_OFF, convergence_error, signed_change
from ....response.measures import energy_balance
from ....response.settling import window_amplitude_means
from ...rig.event_driven import compute_event_measures
from .columns import N_FINAL_WINDOWS, Runs
from .lane_numbers import Scales, count_evaluated_cycles, find_lane_law
from .lane_ringing import find_ringing
from .lane_settling import SETTLING_LAWS, march_until_settled

# smallest relative error of a measure, a hundredth of the smallest tolerance, because both marches may
# miss the same event
MIN_RELATIVE_ERROR = 1e-6
# largest relative size of a loop that the limited memory of a lane has dropped; larger ones need an exact run
DROPPED_LOOP_RATIO = 1e-2


class MeasuredMarch(NamedTuple):
    """Vectorized march of n cases with equal time steps, and its measures.

    - steps, cycles, window: steps per cycle, cycles, and those at the end that are evaluated.
    - values: measures (n,) by name.
    - energies: of the run by name, (n,) each [J].
    - marched: result of `dynamics.lanes`.
    - extremes: of the output in each cycle (n, c, 2) [m].
    - force_rise: increase of the friction force (n,) [N].
    """

    steps: int
    cycles: int
    window: int
    values: dict
    energies: dict
    marched: march.LaneResults
    extremes: np.ndarray
    force_rise: np.ndarray


class LaneRuns(NamedTuple):
    """Runs of n cases from a vectorized march, with a mask of cases that need another run.

    - runs: Runs with their errors.
    - is_exact: which cases (n,) must be computed by the exact engine.
    - needs_more_steps: which cases (n,) need more steps.
    """

    runs: Runs
    is_exact: np.ndarray
    needs_more_steps: np.ndarray


def march_and_measure(law: str, cases, scales: Scales, cycles: int, steps: int) -> MeasuredMarch:
    """March cases in parallel lanes of a kernel, and evaluate their last cycles.

    Parameters
    ----------
    law : str
        Law of `dynamics.lanes`.
    cases : Cases
    scales : Scales
    cycles, steps : int
        Cycles, and steps per cycle.
    """
    window = count_evaluated_cycles(cycles)
    marched = march.march(law, cases, cycles, window, steps)
    extremes = marched.history[:, :, :2] * scales.ratio[:, None, None]
    is_reversed = scales.ratio < 0
    extremes[is_reversed] = extremes[is_reversed, :, ::-1]
    energies = reading.run_energies(law, cases, marched, scales.energy)
    run_reading = reading.reading_of_runs(
        law, cases, marched, scales.energy, scales.omega, extremes[:, -window:]
    )
    with np.errstate(all="ignore"):
        values = compute_event_measures(
            run_reading,
            energies,
            sine=True,
            whole=True,
            stiffness=scales.stiffness,
            size=scales.acceleration,
        )
    values |= {
        "normal_load": scales.load,
        "friction_work": energies["friction"],
        "energy_dissipated": energies.pop("lost"),
        "energy_created": np.zeros(len(scales.load)),
        "energy_balance": energy_balance(energies),
    }
    return MeasuredMarch(
        steps, cycles, window, values, energies, marched, extremes, run_reading.rise
    )


def step_errors(values: dict, coarser: list) -> dict:
    """Estimate the error (n,) of each measure from marches with half and a quarter of the steps.

    Parameters
    ----------
    values : dict
        Measures by name, (n,) each.
    coarser : list of dict
        The same at half the steps and, if it is known, at a quarter of them.
    """
    errors = {}
    with np.errstate(over="ignore", invalid="ignore"):  # a march with half the steps may diverge
        changes = [signed_change(fine, coarse) for fine, coarse in pairwise([values, *coarser])]
        for name in values:
            error = convergence_error(*(change[name] for change in changes))
            errors[name] = np.nan_to_num(error, posinf=np.inf)
    return errors


def collect_runs(
    models: Sequence[Model],
    cases: tuple[march.Cases, Scales],
    measured: MeasuredMarch,
    coarser: list,
    mesh_errors: dict,
) -> LaneRuns:
    """Combine the marches of a group of models with different steps to runs with errors.

    Parameters
    ----------
    models : sequence of Model
    cases : tuple
        Cases and Scales of the models.
    measured : MeasuredMarch
    coarser : list of dict
        Measures with half, and perhaps a quarter, of the steps.
    mesh_errors : dict
        Errors due to the mesh, (n,) by name.
    """
    law = find_lane_law(models[0])
    cases, scales = cases
    values = measured.values
    marched = measured.marched
    errors = step_errors(values, coarser)
    for name in errors.keys() & mesh_errors.keys():
        errors[name] = errors[name] + mesh_errors[name]
    slips = marched.reading("MAX_SLIP") - marched.reading("MIN_SLIP")
    round_off = SUM_ROUND_OFF * np.abs(marched.history[:, :, :2]).max(axis=(1, 2))
    is_stuck = slips / 2 <= np.maximum(scales.held, round_off)
    is_stuck &= (cases.spring > 0) | (law == "rigid")
    # a case is computed exactly if only one of both marches has a measure
    has_other_measures = [np.isnan(values[name]) != np.isnan(coarser[0][name]) for name in values]
    is_exact = np.any(has_other_measures, axis=0)
    ringing = find_ringing(law, cases, scales, measured, is_stuck)
    is_exact |= ringing.needs_single_run
    steady = None
    if law in SETTLING_LAWS:
        amplitudes = window_amplitude_means(measured.extremes, measured.window)[0]
        settled = march_until_settled(law, cases, measured, amplitudes, ~is_stuck)
        ratio = np.abs(scales.ratio)
        steady = ratio * settled.value, ratio * settled.error
        is_exact |= settled.is_open
    if law in march.MASING_LAWS:
        is_exact |= march.law_state(law, marched.motion, "MAX_DROPPED_GAP") > DROPPED_LOOP_RATIO
    phasors = (marched.history[:, :, 2:] @ [1, 1j]) * scales.ratio[:, None]
    ends = np.arange(measured.cycles - 1, -1, -measured.window)[::-1][-N_FINAL_WINDOWS:]
    (tolerance,) = collect_columns(models, lambda model: (model.accuracy.tolerance,))
    runs = Runs(
        measured.cycles,
        measured.window,
        values | ringing.values,
        measured.energies,
        measured.extremes,
        phasors[:, ends],
        is_stuck,
        np.zeros(len(models), bool),  # lost cases are returned in needs_more_steps
        errors | ringing.errors,
        MIN_RELATIVE_ERROR,
        np.inf,
        is_stuck & (measured.force_rise > tolerance * values["friction_force_peak"]),
        steady,
        again=False,
    )
    is_finite = np.isfinite(marched.motion[:, Row.SLIDE] + coarser[0]["friction_work"])
    return LaneRuns(runs, is_exact, ringing.needs_more_steps | ~is_finite)
