"""Result of a bench run with error estimates, warnings and notes.

In: a plan of kind bench and its Patch. Out: a Result.
"""

from dataclasses import replace

import numpy as np

from ...core import NotConverged, Outcome
from ...formatting import format_quantity
from ...response.errors import add_errors
from ...response.outcome import OPEN_LOOP_MESSAGE, remove_errors
from ...response.rows import set_final_floors
from ..results.interfaces import check_pieces_overlap, warn_of_large_slide
from ..results.notes import LawFacts, list_law_notes, list_law_warnings
from ..results.result import (
    N_INTERFACE_FRAMES,
    MotionData,
    Result,
    RunInputs,
    Settings,
    SlipRule,
    make_interface_frames,
)
from . import bench
from .engine import nodal_element_limit, steps_per_cycle
from .errors import BenchErrors, estimate_bench_errors

N_STEADY_CHECK_CYCLES = 4  # Cycles that are added to see whether the last loop is steady.


def run_prescribed(inputs: RunInputs) -> Result:
    """Run a bench plan with prescribed displacement and return its Result."""
    model = inputs.plan.model
    patch = inputs.patch
    steps = steps_per_cycle(model)
    frames = N_INTERFACE_FRAMES if patch is not None else 0
    fine = bench.run_bench(model, patch, steps, frames, say=inputs.say, progress=inputs.progress)
    inputs.seconds["bench"] = fine.seconds

    # The errors follow from coarser runs on the same path.
    error_estimates = BenchErrors([], 0.0, [])
    if inputs.estimate:
        patches = [mesh for mesh in inputs.patches if mesh is not None] or [None]
        error_estimates = estimate_bench_errors(model, patches, fine, steps, inputs.say)
        inputs.seconds["error"] = error_estimates.seconds
    measures = add_errors(fine.values, error_estimates.errors, min_relative_error=1e-10)

    # The friction ratio has one limit only under a constant load.
    settings = Settings(fine.engine.name, steps_per_cycle=steps, shear_modes=fine.shear_modes)
    peak_ratio = None
    if model.friction.static > 0 and not model.load_varies:
        peak_ratio = fine.values["friction_ratio_peak"] / model.friction.static

    # What the law shows in this motion decides on its warnings and notes.
    facts = LawFacts(
        model=model,
        patch=patch,
        measures=measures,
        outcome=Outcome.DONE,
        speed=model.speed_scale,
        force_ratio=peak_ratio,
        created=fine.values["energy_created"],
        exchanged=float(np.abs(np.diff(fine.ledger[0])).sum()),
        settings=settings,
        time=fine.time,
        slide=fine.slide,
        slip=fine.slip,
    )
    warnings = [
        *inputs.warnings,
        *list_law_warnings(facts),
        *_warn_of_open_loop(model, patch, fine, steps),
    ]

    # A node slips in a frame where its shear stress reaches its limit, or else where its slip changes.
    fields = {}
    if patch is not None:
        warnings += _warn_of_overhang(patch, fine)
        fields = make_interface_frames(
            patch,
            fine.time[fine.frames],
            fine.tau,
            fine.local,
            fine.slide[fine.frames],
            SlipRule(nodal_element_limit(model, patch), starts_at_rest=True),
        )

    # A missing mesh error would make every stated error too small.
    if not (inputs.estimate and inputs.has_error_meshes):
        measures = remove_errors(measures)
    return Result(
        plan=inputs.plan,
        outcome=check_pieces_overlap(Outcome.DONE, model.patch, patch, fine.slide),
        measures=set_final_floors(measures, model.accuracy.tolerance),
        seconds=inputs.seconds,
        warnings=warnings,
        notes=[*inputs.notes, *list_law_notes(facts)],
        patch=patch,
        fields=fields,
        response=fine,
        window=fine,
        settings=settings,
        motion=MotionData(step_runs=tuple(error_estimates.step_runs)),
    )


def _compute_loop_closing_error(fine) -> float:
    """Return the relative difference between start and end of the last cycle.

    It is the larger of the change of the force over its peak and the change of the stored energy
    over the work.
    """
    force = fine.force[fine.first :]
    work, stored, *_ = fine.ledger[:, fine.first :]
    gap = 0.0
    for change, size in (
        (force[-1] - force[0], np.abs(force).max()),
        (stored[-1] - stored[0], work[-1] - work[0]),
    ):
        if size:
            gap = max(gap, abs(float(change / size)))
    return gap


def _warn_of_open_loop(model, patch, fine, steps: int) -> list[str]:
    """Return a list with a warning if the last friction loop is not closed, and its area is not that of a longer run.

    Parameters
    ----------
    model : Model
        Model of the bench.
    patch : Patch or None
        Solved patch.
    fine : BenchRun
        The run.
    steps : int
        Steps per cycle of the longer run.
    """
    tolerance = model.accuracy.tolerance
    slide = model.slide
    if slide.period is None or slide.cycles < 1 or not fine.values.get("loop_area"):
        return []
    gap = _compute_loop_closing_error(fine)
    if gap <= tolerance:
        return []
    text = (
        f"{OPEN_LOOP_MESSAGE}: it misses by {100 * gap:.2g} % (limit {100 * tolerance:g} %), so loop_area, the friction "
        "work of the last cycle, is not the energy dissipated in a steady loop"
    )

    # The comparison must not end a run that is complete.
    cycles = slide.cycles + N_STEADY_CHECK_CYCLES
    try:
        longer = bench.run_bench(replace(model, slide=replace(slide, cycles=cycles)), patch, steps)
    except NotConverged:
        return [f"{text}; raise slide.cycles"]

    # The loop is steady if the last two cycles of the longer run do the same work.
    ends = longer.time[-1] - slide.period * np.arange(2, -1, -1)
    before, area = np.diff(np.interp(ends, longer.time, longer.ledger[0])).tolist()
    if abs(area - fine.values["loop_area"]) <= tolerance * abs(area):
        return []
    if abs(area - before) > tolerance * abs(area):
        return [f"{text}; no steady loop is reached within {cycles:g} cycles"]
    return [f"{text}, which is {format_quantity(area, 'J', 4)}; set slide.cycles = {cycles:g}"]


def _warn_of_overhang(patch, fine) -> list[str]:
    """Return warnings if the upper piece slides off the loaded area, or slides far compared with the contact.

    `patch` is the pressed patch, and `fine` is the run with the finest resolution, with its loads and slides over time.
    """
    warnings = []
    load_loss = 1 - float(fine.load.min() / fine.load[0]) if fine.load[0] > 0 else 0.0
    if load_loss > 0.01:
        warnings.append(
            "the upper piece slides off the pressed area: at worst the computed contact carries "
            f"{100 * load_loss:.0f} % less than the given load"
        )
    return [*warnings, *warn_of_large_slide(patch, fine.slide)]
