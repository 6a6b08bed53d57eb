"""Fit of a bench scene with a prescribed displacement to a measured friction loop.

The model is free of stress in the first row of the record and follows the measured displacement,
which is interpolated linearly between rows. If the force depends on the time steps, they are halved
until the fit converges.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter

import numpy as np

from ...core import NotConverged
from ...effects import law_has_trait
from ...inputs.loops import Loop, read_loop
from ...scene.scene import Scene, SceneError
from .loop_model import BenchModel
from .loop_path import DEFAULT_OPTIONS, LoopOptions, make_offsets
from .problem import FittedKeys, FreeKeys, parse_ranges

# Smallest fraction of independent rows for which no warning about correlation is issued.
MIN_INDEPENDENT = 0.6
# Ratio of the residual to the peak force up to which round-off dominates the residual.
MIN_RMS = 1e-6
# Largest ratio of the force in the first row to the peak force for a record that begins at rest.
MAX_FIRST_FORCE = 0.2


@dataclass(frozen=True, eq=False, slots=True)
class FittedLoop:
    """Fit of a scene to a measured friction loop.

    Attributes
    ----------
    keys : FittedKeys
        Fitted values of the free parameters, followed by those of `offsets`.
    loop : Loop
        Measured loop.
    offsets : list of Offset
    held_out : (k,) bool
        Mask of the rows that were predicted but not fitted.
    model : (k,) array
        Computed force or friction ratio at the rows of `loop`.
    step_error : float
        Largest change of `model` when the time steps are halved.
    steps_per_row : int
        Number of time steps between two rows.
    """

    keys: FittedKeys
    loop: Loop
    offsets: list
    held_out: np.ndarray
    model: np.ndarray
    step_error: float
    steps_per_row: int

    @property
    def rms(self) -> float:
        """Root mean square residual of the fitted rows, in the unit of the reading."""
        return self._residual_rms(~self.held_out)

    @property
    def held_out_rms(self) -> float | None:
        """Root mean square residual of the held-out rows; None if there are none."""
        return self._residual_rms(self.held_out) if self.held_out.any() else None

    def _residual_rms(self, mask) -> float:
        """Return the root mean square residual of the rows in a mask (k,)."""
        residual = self.model - self.loop.reading
        return float(np.sqrt(np.mean(residual[mask] ** 2)))


def fit_hysteresis_loop(
    scene: Scene,
    loop_file: Path,
    free_parameters: Sequence,
    held_out_rows: Sequence = (),
    say: Callable | None = None,
    options: LoopOptions = DEFAULT_OPTIONS,
) -> FittedLoop:
    """Fit free parameters of a bench scene to the measured friction loop in a file.

    Parameters
    ----------
    scene : Scene
    loop_file : Path
        File of the measured loop.
    free_parameters : sequence of str
        Free parameters with their ranges, "table.key=low..high".
    held_out_rows : sequence of str
        Selectors "column=value,value" of rows that are predicted but not fitted.
    say : Callable, optional
        Called with a line of text that reports the progress.
    options : LoopOptions
        Fitted offsets and warm-up cycles.

    Returns
    -------
    FittedLoop

    Raises
    ------
    SceneError, PatchfemError
        If the input is invalid.
    NotConverged
        If the model cannot be evaluated at any starting point.
    """
    begin = perf_counter()
    if scene.kind != "bench":
        raise SceneError(
            [
                f"{scene.path}: fit: to fit a measured loop the scene must prescribe the motion "
                f"with [slide], but this is a {scene.kind} scene; add [slide]"
            ]
        )
    ranges = parse_ranges(free_parameters)
    loop = read_loop(loop_file)
    held_out = np.zeros(loop.reading.size, bool)
    for selector in held_out_rows:
        held_out |= loop.select_rows(selector)
    offsets = make_offsets(options.offsets, loop)

    # least squares of the deviations, as fractions of the largest force
    bench = BenchModel(scene, loop, ranges, offsets, warm_up=options.warm, say=say)
    scale = float(np.abs(loop.reading[~held_out]).max(initial=0.0))
    offset_ranges = [offset.range for offset in offsets]
    keys = FreeKeys(scene, ranges, offset_ranges, bench.assignments, bench.notes)
    keys.require_enough_rows(loop_file, np.count_nonzero(~held_out), "rows")
    problem = keys.make_problem(lambda values: (bench(values) - loop.reading)[~held_out] / scale)
    try:
        if bench.is_exact:
            fit = problem.solve(interval_kind="series")
        else:
            # the steps are chosen at the result of a fit with the largest steps
            first = problem.solve(interval_kind="")
            bench.refine_steps(first.values)
            fit = replace(problem, start=first.values).solve(1, "series")
            fit = fit.count_earlier_search(first)
    except NotConverged as error:
        if bench.n_computed == 0:
            raise bench.first_error or error from None
        raise
    step_error = 0.0 if bench.is_exact else bench.measure_step_error(fit.values)
    fitted = FittedLoop(
        keys=keys.make_fitted_keys(fit, begin),
        loop=loop,
        offsets=offsets,
        held_out=held_out,
        model=bench(fit.values),
        step_error=step_error,
        steps_per_row=bench.steps_per_row,
    )
    has_lead_in = bool(offsets) or options.warm
    doubts = _warn_of_doubtful_fit(fitted, scene, has_lead_in=has_lead_in)
    warnings = [*fitted.keys.warnings, *doubts]
    return replace(fitted, keys=replace(fitted.keys, warnings=warnings))


def _warn_of_doubtful_fit(fitted: FittedLoop, scene: Scene, *, has_lead_in: bool) -> list:
    """Return warnings about correlated residuals, the initial state and the time steps.

    `has_lead_in`: whether the model may carry stress in the first row.
    """
    loop = fitted.loop
    peak = float(np.abs(loop.reading).max())
    n_used = np.count_nonzero(~fitted.held_out)
    n_independent = fitted.keys.fit.intervals.rows
    warnings = []
    if fitted.rms > MIN_RMS * peak and n_independent < MIN_INDEPENDENT * n_used:
        warnings.append(
            "the deviations of neighbouring rows are correlated, so the intervals are computed as "
            f"if the {n_used} rows were {max(n_independent, 1):.3g} independent rows; a part of the deviation "
            "is systematic"
        )
    first_force = abs(loop.reading[0])
    starts_at_rest = (
        fitted.held_out[0] or has_lead_in or law_has_trait(scene.friction.law, "memoryless")
    )
    if first_force > MAX_FIRST_FORCE * peak and not starts_at_rest:
        warnings.append(
            f"the force in the first row is {first_force / peak:.0%} of the largest force, but the model "
            "starts without force: use --warm-up, hold out the first cycle, or give a record that "
            "begins at rest"
        )
    if fitted.step_error > scene.accuracy.tolerance * peak:
        warnings.append(
            "if the time steps are halved, the force of the model changes by "
            f"{fitted.step_error / peak:.1g} of its peak, more than the tolerance"
        )
    return warnings
