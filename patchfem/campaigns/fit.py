"""Identification of a measured friction loop: scene values whose bench force follows the measured one."""

from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter

import numpy as np

from ..core import NotConverged, Outcome, PatchfemError
from ..effects import has
from ..identify.least_squares import Fit, fit
from ..identify.words import remarks
from ..inputs.loops import Loop, read_loop
from ..scene.keys.quantities import KINDS
from ..scene.lines import pieces_of
from ..scene.ranges import ranges
from ..scene.scene import Scene, SceneError
from .fit_model import BenchModel
from .fit_path import NOTHING, LoopOptions, offsets_of

MOST_PIECES = 64  # steps between two rows
FEWER = 0.6  # share of the rows below which their correlation is said
LOAD_UNITS = {"time": KINDS["time"], "displacement": KINDS["length"],
              "force": KINDS["force"], "friction_ratio": {"": 1.0, "1": 1.0}}


@dataclass(frozen=True, eq=False, slots=True)
class Fitted:
    """A fitted loop.

    free: the ranges; offsets: nuisance values; found: the fit in the order of both; model: (k,) fitted reading at the
    rows of `loop`; held: (k,); rms and held_rms (None where no row is held) in the unit of the reading; step_error:
    largest change of the model when its steps are halved; sets: the --set strings that make the scene fitted; warnings:
    sentences.
    """

    scene: Scene
    loop: Loop
    free: list
    offsets: list
    found: Fit
    model: np.ndarray
    held: np.ndarray
    rms: float
    held_rms: float | None
    step_error: float
    pieces: int
    sets: list
    warnings: list
    seconds: float

    @property
    def outcome(self) -> Outcome:
        """How the fit ended: done, or not_converged where the descent ran out of evaluations and no other found its
        valley."""
        return self.found.outcome


def fit_loop(scene: Scene, to: Path, free, hold=(), say=None, options: LoopOptions = NOTHING) -> Fitted:
    """Fit the keys `free` ("table.key=low..high" texts) of a bench scene to the loop in the file `to`.

    The model starts unstressed in the first row and follows the measured rows, straight between them; rows named by
    hold ("column=value,value") are driven through but only predicted. beside: offsets that are free
    as well, and whether the whole cycles of the record are driven once before it. SceneError and PatchfemError name bad
    input.
    """
    begin = perf_counter()
    if scene.kind != "bench":
        raise SceneError([f"{scene.path}: fit: to fit a measured loop the scene must prescribe the motion with "
                          f"[slide], but this is a {scene.kind} scene; add [slide]"])
    wanted, wrong = ranges(free)
    if wrong:
        raise SceneError(wrong)
    loop = read_loop(to, LOAD_UNITS)
    held = np.zeros(loop.reading.size, bool)
    for one in hold:
        held |= loop.rows_of(one)
    used = np.count_nonzero(~held)
    offsets = offsets_of(options.offsets, loop)
    everything = [*wanted, *(one.range for one in offsets)]
    if used <= len(everything):
        raise PatchfemError(f"{to}: only {used} rows are used for the fit (rows that are held out do not count), too "
                            f"few to determine {len(everything)} values and their intervals")
    bench = BenchModel(scene, loop, wanted, offsets, options.warm, say)
    scale = float(np.abs(loop.reading[~held]).max())

    def residual(values):
        return (bench(values) - loop.reading)[~held] / scale

    try:
        found, step_error = _refined(bench, residual, everything, say)
    except NotConverged as error:
        if bench.made == 0:
            raise bench.refused or error from None
        raise
    model = bench(found.values)
    miss = model - loop.reading
    rms = [float(np.sqrt(np.mean(miss[rows]**2))) if rows.any() else None for rows in (~held, held)]
    sets = [*bench.sets, *(one.assigned(value) for one, value in zip(wanted, found.values))]
    warnings = [*scene.remarks, *bench.notes, *remarks(found, [one.key for one in everything])]
    fitted = Fitted(scene, loop, wanted, offsets, found, model, held, rms[0], rms[1], step_error, bench.pieces, sets,
                    warnings, perf_counter() - begin)
    return replace(fitted, warnings=[*warnings, *_doubts(fitted, bool(offsets) or options.warm)])


def _refined(bench, residual, wanted, say) -> tuple:
    """The fit, and the change of the model when its steps are halved; steps are halved until they change the fit too
    little."""
    low, high = [one.low for one in wanted], [one.high for one in wanted]
    start, starts, before, agreed = own_values(bench.scene, wanted), 3, (0, 0, ""), 0
    while True:
        found = fit(residual, low, high, start=start, starts=starts, bars="series" if bench.exact else "")
        agreed = found.agreed if starts > 1 else agreed
        found = _counted(found, before)
        before = (found.evaluations, found.failures, found.reason)
        if bench.exact:
            return found, 0.0
        coarse = bench(found.values)
        bench.pieces *= 2
        fine = bench(found.values)
        change, peak = float(np.abs(fine - coarse).max()), float(np.abs(fine).max())
        # a tenth of the tolerance: the steps are not to show in the fit
        if bench.pinned or change <= 0.1 * bench.scene.accuracy.tolerance * peak or bench.pieces >= MOST_PIECES:
            bench.pieces //= 2
            last = _counted(fit(residual, low, high, start=found.values, starts=1, bars="series"), before)
            return replace(last, agreed=agreed), change
        if say:
            say(f"{bench.pieces} time steps between neighbouring rows of the record")
        start, starts = found.values, 1


def _counted(found: Fit, before: tuple) -> Fit:
    """The fit with the evaluations, failures and first reason of the fits before it."""
    return replace(found, evaluations=found.evaluations + before[0], failures=found.failures + before[1],
                   reason=before[2] or found.reason)


def own_values(scene: Scene, wanted: list) -> list:
    """Starting values: what the scene itself says, or the middle of the range; held inside the range."""
    out = []
    for one in wanted:
        value = scene
        for part in pieces_of(one.key):
            value = _item(value, part) if isinstance(value, tuple) else getattr(value, part, None)
        if not isinstance(value, float):
            wide = one.low > 0 and one.high > 10 * one.low
            value = np.sqrt(one.low * one.high) if wide else (one.low + one.high) / 2
        out.append(float(np.clip(value, one.low, one.high)))
    return out


def _item(items: tuple, word: str):
    """The table of an array by its name or its number from 0; None where there is none."""
    named = [one for one in items if getattr(one, "name", None) == word]
    return named[0] if named else items[int(word)] if word.isdecimal() and int(word) < len(items) else None


def _doubts(fitted: Fitted, led: bool) -> list:
    """Warnings where the rows are no sample of the model with independent noise.

    led: the model does not start unstressed in the first row.
    """
    loop, held, rows, scene = fitted.loop, fitted.held, fitted.found.rows, fitted.scene
    rms, step_error = fitted.rms, fitted.step_error
    out, peak, used = [], float(np.abs(loop.reading).max()), np.count_nonzero(~held)
    if rms > 1e-6 * peak and rows < FEWER * used:
        out.append("the deviations of neighbouring rows are correlated, so the intervals are computed as if the "
                   f"{used} rows were {max(rows, 1):.3g} independent rows; a part of the deviation is systematic")
    if abs(loop.reading[0]) > 0.2 * peak and not has(scene.friction.law, "memoryless") and not held[0] and not led:
        out.append(f"the force in the first row is {abs(loop.reading[0]) / peak:.0%} of the largest force, but the "
                   "model starts without force: use --warm-up, hold out the first cycle, or give a record that begins "
                   "at rest")
    if step_error > scene.accuracy.tolerance * peak:
        out.append(f"if the time steps are halved, the force of the model changes by {step_error / peak:.1g} of its "
                   "peak, more than the tolerance")
    return out
