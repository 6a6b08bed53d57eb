"""Fit of a scene with a prescribed displacement to a measured friction loop.

The model starts without stress in the first row of the record and follows the measured displacement,
which is linear between two rows. Where the force depends on the time steps, they are halved until they
no longer change the fit.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import NamedTuple

import numpy as np

from ...core import NotConverged, PatchfemError
from ...effects import law_has_trait
from ...identify.least_squares import Fit, Problem, SearchCounts
from ...inputs.loops import Loop, read_loop
from ...scene.keys.quantities import UNIT_FACTORS
from ...scene.scene import Scene, SceneError
from .loop_model import BenchModel
from .loop_path import DEFAULT_OPTIONS, LoopOptions, read_offsets
from .problem import FittedKeys, FreeKeys, parse_ranges

# Number of time steps between two rows above which the steps are not halved any more.
MAX_PIECES = 64
# Change of the force over the tolerance below which it has no effect on a fit.
STEP_FRACTION = 0.1
MIN_INDEPENDENT = 0.6  # Fraction of independent rows below which a warning states the correlation.
# Residual over peak force below which rounding, not correlation, dominates the residual.
MIN_RMS = 1e-6
# Force in the first row over the peak above which the record cannot begin at rest.
MAX_FIRST_FORCE = 0.2
LOAD_UNITS = {
    "time": UNIT_FACTORS["time"],
    "displacement": UNIT_FACTORS["length"],
    "force": UNIT_FACTORS["force"],
    "friction_ratio": {"": 1.0, "1": 1.0},
}


@dataclass(frozen=True, eq=False, slots=True)
class FittedLoop:
    """Fit of a scene to a measured friction loop.

    Attributes
    ----------
    keys : FittedKeys
        Its values are those of the free keys, then those of `offsets`.
    loop : Loop
        The measured loop.
    offsets : list of Offset
    held_out : (k,) bool
        Rows that were only predicted.
    model : (k,) array
        Fitted force or friction ratio at the rows of `loop`.
    step_error : float
        Largest change of the model when its time steps are halved.
    pieces : int
        Time steps between two rows.
    """

    keys: FittedKeys
    loop: Loop
    offsets: list
    held_out: np.ndarray
    model: np.ndarray
    step_error: float
    pieces: int

    @property
    def rms(self) -> float:
        """Root mean square of the residual in the fitted rows, in the unit of the reading."""
        return self._rms(~self.held_out)

    @property
    def held_rms(self) -> float | None:
        """Root mean square of the residual in the rows held out; None if there are none."""
        return self._rms(self.held_out) if self.held_out.any() else None

    def _rms(self, rows) -> float:
        """Return the root mean square of the residual in some rows."""
        residual = self.model - self.loop.reading
        return float(np.sqrt(np.mean(residual[rows] ** 2)))


def fit_loop(
    scene: Scene,
    to: Path,
    free: Sequence,
    hold: Sequence = (),
    say: Callable | None = None,
    options: LoopOptions = DEFAULT_OPTIONS,
) -> FittedLoop:
    """Fit keys of a scene with a prescribed displacement to the friction loop in a file.

    Parameters
    ----------
    scene : Scene
    to : Path
        File of the loop.
    free : sequence of str
        Free keys with their ranges, "table.key=low..high".
    hold : sequence of str
        Rows that are predicted without being fitted, "column=value,value".
    say : Callable, optional
        Takes a line of progress.
    options : LoopOptions
        Offsets that are fitted as well, and whether the record is driven once beforehand.

    Returns
    -------
    FittedLoop

    Raises
    ------
    SceneError, PatchfemError
        For input that cannot be used.
    NotConverged
        If the model fails at all starting points.
    """
    begin = perf_counter()
    if scene.kind != "bench":
        raise SceneError(
            [
                f"{scene.path}: fit: to fit a measured loop the scene must prescribe the motion "
                f"with [slide], but this is a {scene.kind} scene; add [slide]"
            ]
        )
    ranges = parse_ranges(free)
    loop = read_loop(to, LOAD_UNITS)
    held_out = np.zeros(loop.reading.size, bool)
    for selector in hold:
        held_out |= loop.select_rows(selector)
    offsets = read_offsets(options.offsets, loop)
    n_values = len(ranges) + len(offsets)
    n_used = np.count_nonzero(~held_out)
    if n_used <= n_values:
        raise PatchfemError(
            f"{to}: only {n_used} rows are used for the fit (rows that are held out do not count), "
            f"too few to determine {n_values} values and their intervals"
        )
    bench = BenchModel(scene, loop, ranges, offsets, warm=options.warm, say=say)
    scale = float(np.abs(loop.reading[~held_out]).max())

    def residual(values) -> np.ndarray:
        """Return the residual over the largest force (r,) in the fitted rows."""
        return (bench(values) - loop.reading)[~held_out] / scale

    offset_ranges = [offset.range for offset in offsets]
    keys = FreeKeys(scene, ranges, offset_ranges, bench.sets, bench.notes)
    try:
        refined = _solve_with_refined_steps(keys.make_problem(residual), bench, say)
    except NotConverged as error:
        if bench.n_computed == 0:
            raise bench.first_error or error from None
        raise
    model = bench(refined.fit.values)
    fitted = FittedLoop(
        keys=keys.conclude(refined.fit, begin),
        loop=loop,
        offsets=offsets,
        held_out=held_out,
        model=model,
        step_error=refined.step_error,
        pieces=bench.pieces,
    )
    has_lead_in = bool(offsets) or options.warm
    doubts = _warn_of_doubtful_fit(fitted, scene, has_lead_in=has_lead_in)
    warnings = [*fitted.keys.warnings, *doubts]
    return replace(fitted, keys=replace(fitted.keys, warnings=warnings))


class RefinedFit(NamedTuple):
    """Fit with the largest change of its model when the time steps are halved."""

    fit: Fit
    step_error: float


def _solve_with_refined_steps(problem: Problem, bench: BenchModel, say) -> RefinedFit:
    """Fit with time steps that are halved until the change of the force is negligible."""
    if bench.exact:
        return RefinedFit(problem.solve(interval_kind="series"), 0.0)
    fit = problem.solve(interval_kind="")
    agreed = fit.agreed
    while True:
        coarse = bench(fit.values)
        bench.pieces *= 2
        fine = bench(fit.values)
        change = float(np.abs(fine - coarse).max())
        peak = float(np.abs(fine).max())
        tolerance = STEP_FRACTION * bench.scene.accuracy.tolerance * peak
        problem = replace(problem, start=fit.values)
        if bench.pinned or change <= tolerance or bench.pieces >= MAX_PIECES:
            bench.pieces //= 2
            last = _add_counts(problem.solve(1, "series"), fit)
            return RefinedFit(replace(last, agreed=agreed), change)
        if say:
            say(f"{bench.pieces} time steps between neighbouring rows of the record")
        fit = _add_counts(problem.solve(1, ""), fit)


def _add_counts(fit: Fit, before: Fit) -> Fit:
    """Add the numbers of evaluations and failures of an earlier fit to a fit."""
    counts = SearchCounts(
        fit.counts.evaluations + before.counts.evaluations,
        fit.counts.failures + before.counts.failures,
        before.counts.reason or fit.counts.reason,
    )
    return replace(fit, counts=counts)


def _warn_of_doubtful_fit(fitted: FittedLoop, scene: Scene, *, has_lead_in: bool) -> list:
    """Return warnings if the rows differ from the model by more than independent noise.

    `has_lead_in`: the model does not start without stress in the first row.
    """
    loop = fitted.loop
    peak = float(np.abs(loop.reading).max())
    n_used = np.count_nonzero(~fitted.held_out)
    rows = fitted.keys.fit.intervals.rows
    warnings = []
    if fitted.rms > MIN_RMS * peak and rows < MIN_INDEPENDENT * n_used:
        warnings.append(
            "the deviations of neighbouring rows are correlated, so the intervals are computed as "
            f"if the {n_used} rows were {max(rows, 1):.3g} independent rows; a part of the deviation "
            "is systematic"
        )
    first = abs(loop.reading[0])
    starts_at_rest = (
        fitted.held_out[0] or has_lead_in or law_has_trait(scene.friction.law, "memoryless")
    )
    if first > MAX_FIRST_FORCE * peak and not starts_at_rest:
        warnings.append(
            f"the force in the first row is {first / peak:.0%} of the largest force, but the model "
            "starts without force: use --warm-up, hold out the first cycle, or give a record that "
            "begins at rest"
        )
    if fitted.step_error > scene.accuracy.tolerance * peak:
        warnings.append(
            "if the time steps are halved, the force of the model changes by "
            f"{fitted.step_error / peak:.1g} of its peak, more than the tolerance"
        )
    return warnings
