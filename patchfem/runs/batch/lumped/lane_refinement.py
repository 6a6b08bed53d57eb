"""Refinement of the steps of cases in lanes until their errors meet the tolerance.

In: `LaneCases` of models, and the initial steps per cycle of each case. Out: `RefinedCases`.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ....dynamics.lanes import run as march
from ....model.model import Model
from ....model.similar_models import collect_columns, select_models
from ....response.errors import convergence_errors
from ....response.rows import larger_term
from ..case_results import CaseResults
from . import lane_runs
from .columns import MAIN_MEASURE, assemble_results
from .lane_numbers import LaneCases, find_lane_law, select_rows
from .lane_ringing import RINGING_MEASURES
from .lane_runs import MeasuredMarch, march_and_measure
from .lane_settling import SETTLING_LAWS
from .lane_steps import POINT_STEPS, STRETCH_STEPS

# Smallest ratio of loop area to (peak force x slide amplitude) of a slipping case.
MIN_LOOP_AREA = 1e-6
# Largest relative mesh error of each measure that is not computed again with more steps. The loop area of a
# small slip may be completely uncertain.
MAX_MESH_CHANGES = ((MAIN_MEASURE, 0.1), ("friction_force_peak", 0.1), ("loop_area", 10.0))


class RefinedCases(NamedTuple):
    """Results of n cases in lanes, with the steps per cycle that each case needed.

    - results: CaseResults.
    - needs_exact: mask (n,) of the cases that need the exact engine.
    - steps: final steps per cycle (n,).
    - reach: largest absolute output (n,) [m].
    """

    results: CaseResults
    needs_exact: np.ndarray
    steps: np.ndarray
    reach: np.ndarray


def march_with_refinement(models: Sequence[Model], cases: LaneCases, steps) -> RefinedCases:
    """Integrate models in lanes, and refine the steps until the errors meet the tolerance.

    All cases with the same number of steps are integrated together, including coarse runs for error
    estimates. With a stretch law, an error that is too large is estimated again from a quarter of the
    steps, which shows the order of convergence. The mesh error is computed with the fewest steps. It is
    computed again with more steps if it exceeds MAX_MESH_CHANGES or if the case sticks, because the
    remaining third harmonic then depends on both steps and mesh.

    Parameters
    ----------
    models : sequence of Model
    cases : LaneCases
    steps : (n,)
        Initial steps per cycle.
    """
    return _Refinement(models, cases, steps).refine()


class _Refinement:
    """Step refinement of a batch: measures of n cases for increasing numbers of steps."""

    def __init__(self, models: Sequence[Model], cases: LaneCases, steps):
        n = len(models)
        self.models = models
        self.cases = cases
        self.steps = steps.copy()
        self.min_steps = steps // 2
        self.law = find_lane_law(models[0])
        self.cycles = int(models[0].rig.drive.cycles)
        self.has_one_stretch = march.has_one_stretch(self.law)
        self.results = CaseResults.blank(n)
        self.needs_exact = np.zeros(n, bool)
        self.reach = np.zeros(n)
        self.mesh_errors = {}
        self.values = {}  # measures (n,) by steps per cycle and name

    def refine(self) -> RefinedCases:
        """Repeat the march with twice the steps until the errors of all cases are small enough."""
        steps = int(self.min_steps.min())
        while (self.steps >= steps).any():
            self._march(steps)
            steps *= 2
        return RefinedCases(self.results, self.needs_exact, self.steps, self.reach)

    def _march(self, steps: int) -> None:
        """Integrate the cases that need a given number of steps per cycle."""
        marching = np.flatnonzero((self.min_steps <= steps) & (self.steps >= steps))
        if not marching.size:
            return
        measured = self._measure(marching, steps)
        rows = np.flatnonzero(self.steps[marching] == steps)
        final = marching[rows]
        final_measured = select_rows(measured, rows)
        if self.cases.coarse is not None:
            needs_mesh_errors = self.min_steps[marching] == steps
            if self.mesh_errors and rows.size:
                needs_mesh_errors[rows] |= self._needs_mesh_errors(final, final_measured.values)
            if needs_mesh_errors.any():
                values = select_rows(measured.values, needs_mesh_errors)
                self._compute_mesh_errors(marching[needs_mesh_errors], values, steps)
        if final.size:
            self.reach[final] = np.abs(final_measured.extremes).max(axis=(1, 2))
            self._judge(final, final_measured)

    def _measure(self, indices, steps: int) -> MeasuredMarch:
        """Integrate selected cases with a given number of steps, and store their measures."""
        cases = select_rows(self.cases[:2], indices)
        measured = march_and_measure(self.law, *cases, self.cycles, steps)
        columns = self.values.setdefault(steps, {})
        for name, values in measured.values.items():
            columns.setdefault(name, np.full(len(self.models), np.nan))[indices] = values
        return measured

    def _needs_mesh_errors(self, indices, values: dict) -> np.ndarray:
        """Return a mask of the cases whose mesh error must be computed again.

        values: measures of the cases, (n,) by name.
        """
        max_area = values["friction_force_peak"] * np.abs(values[MAIN_MEASURE])
        is_needed = ~(np.abs(values["loop_area"]) > MIN_LOOP_AREA * max_area)
        for name, change in MAX_MESH_CHANGES:
            if name in self.mesh_errors:
                error = self.mesh_errors[name][indices]
                is_needed |= ~(error <= change * np.abs(values[name]))
        return is_needed

    def _compute_mesh_errors(self, indices, values: dict, steps: int) -> None:
        """Compute the mesh errors of selected cases by a march on the coarser mesh.

        The error of a measure that does not exist on the coarser mesh is its absolute value.
        """
        cases = select_rows(self.cases.coarse, indices)
        coarse = march_and_measure(self.law, *cases, self.cycles, steps).values
        with np.errstate(all="ignore"):
            errors = convergence_errors(values, coarse)
        for name, error in errors.items():
            column = self.mesh_errors.setdefault(name, np.zeros(len(self.models)))
            column[indices] = np.where(np.isnan(error), np.abs(values[name]), error)

    def _judge(self, indices, measured: MeasuredMarch) -> None:
        """Store the results of selected cases, and double the steps where errors are too large."""
        steps = measured.steps
        is_wide = self._evaluate(indices, measured, [steps // 2])
        if self.has_one_stretch and is_wide.any():
            without_quarter = indices[is_wide & (2 * self.min_steps[indices] == steps)]
            if without_quarter.size:
                self._measure(without_quarter, steps // 4)
            wide_measured = select_rows(measured, is_wide)
            is_wide[is_wide] = self._evaluate(
                indices[is_wide], wide_measured, [steps // 2, steps // 4]
            )
        is_smooth = self.has_one_stretch or self.law in march.MASING_LAWS
        max_steps = STRETCH_STEPS[-1] if is_smooth else POINT_STEPS[-1][-1]
        is_refined = is_wide & (2 * steps <= max_steps) & (is_smooth | ~self.needs_exact[indices])
        self.steps[indices[is_refined]] = 2 * steps
        self.needs_exact[indices[is_wide]] = ~is_refined[is_wide]

    def _evaluate(self, indices, measured: MeasuredMarch, coarser_steps: list) -> np.ndarray:
        """Store the results of selected cases, and return a mask of those with too large errors.

        coarser_steps: steps per cycle of the coarser marches for the error estimate.
        """
        models = select_models(self.models, indices)
        mesh_errors = select_rows(self.mesh_errors, indices)
        cases = select_rows(self.cases[:2], indices)
        coarser = [select_rows(self.values[steps], indices) for steps in coarser_steps]
        runs, needs_exact, needs_more_steps = lane_runs.collect_runs(
            models, cases, measured, coarser, mesh_errors
        )

        def is_wide(results: CaseResults) -> np.ndarray:
            """Return a mask of the cases with an error above the tolerance."""
            return has_excessive_error(models, results, mesh_errors)

        numerics = {"engine": "exact", "window_cycles": measured.window}
        assembled = assemble_results(models, runs, numerics, is_wide)
        results = assembled.results
        lane_numerics = {
            "engine": "lanes",
            "steps_per_cycle": measured.steps,
            "window_cycles": measured.window,
        }
        results.numerics.update(dict.fromkeys(range(len(models)), lane_numerics))
        self.needs_exact[indices] = needs_exact | (results.outcome == "grows")
        self.results.remove(indices)  # replace the results with fewer steps
        self.results.insert(indices, results)
        return is_wide(results) | needs_more_steps | assembled.needs_single_run


def has_excessive_error(
    models: Sequence[Model], results: CaseResults, mesh_errors: dict | None = None
) -> np.ndarray:
    """Return a mask (n,) of the cases with an error above the tolerance of the case.

    The tolerance is relative to the measure, or to the larger terms whose difference it is. Mesh errors
    are not counted, because no other engine reduces them.

    Parameters
    ----------
    models : sequence of Model
    results : CaseResults
    mesh_errors : dict, optional
        Mesh errors (n,) by name.
    """
    tolerance = collect_columns(models, lambda model: (model.accuracy.tolerance,))[0]
    is_large = np.zeros(len(models), bool)
    for name, values in results.values.items():
        if name in RINGING_MEASURES:  # the ringing fit of a single run is no more accurate
            continue
        if name.endswith("_steady") and find_lane_law(models[0]) not in SETTLING_LAWS:
            # neither finer steps nor the exact engine reduce the error of an extrapolation
            continue
        mesh_error = (mesh_errors or {}).get(name.removesuffix("_steady"), 0.0)
        floors = np.fmax(results.floors[name], tolerance * larger_term(name, results.values))
        # the equivalent damping is proportional to the loop area and not more accurate
        if name == "equivalent_damping" and "loop_area" in results.values:
            floors = np.fmax(floors, results.floors["loop_area"] * _damping_per_area(results))
        is_large |= results.errors[name] - mesh_error > tolerance * np.abs(values) + floors
    return is_large


def _damping_per_area(results: CaseResults) -> np.ndarray:
    """Return the ratio (n,) [1/J] of equivalent damping to loop area; 0 for an area of 0."""
    area = np.abs(results.values["loop_area"])
    damping = np.abs(results.values["equivalent_damping"])
    return np.divide(damping, area, out=0 * area, where=area != 0)
