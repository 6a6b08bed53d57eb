"""Bench from its plan to its result: slide, errors, and warnings on law and overhang.

In: a plan of kind bench and its pressed patch. Out: a Result.
"""

from dataclasses import replace

import numpy as np

from ...core import Outcome
from ...effects import law_has_trait
from ...formatting import format_quantity
from ...response.errors import add_errors
from ...response.outcome import OPEN_LOOP
from ...response.rows import set_final_floors
from ..results.notes import (
    climbing_as_one,
    growth_notes,
    note_on_heating,
    unbounded_bonds,
    warn_of_unformed_bonds,
    work_check_warning,
)
from ..results.result import (
    FRAMES,
    Result,
    has_known_mesh_error,
    interface_frames,
    remove_unknown_errors,
)
from ..results.travel import (
    MAX_SLIDE_FRACTION,
    largest_slide,
    outcome_on_piece,
    warn_of_large_slide,
)
from . import bench, shear
from .engine import steps_per_cycle
from .errors import estimate_pass_errors
from .ledger import PassOptions

MAX_EXTRA_CYCLES = 4  # further cycles in which a steady loop is searched for
MOST_TRIED = 2e6  # most evaluations (points times samples) of this search


def run_prescribed(what, patch, coarse, seconds, warnings, say, progress, estimate) -> Result:
    """Run a plan of kind bench; the parameters are those of `run.run`."""
    model = what.model
    f = what.model.friction
    if law_has_trait(f.law, "bonds"):
        warnings = [
            *warnings,
            *unbounded_bonds(model.bonds),
            *warn_of_unformed_bonds(model.bonds, model.speed_scale),
        ]
        if f.reading == "report" and model.load_varies:
            warnings = [
                *warnings,
                "in the law as printed in the report, a bond keeps the pressure at which it formed, "
                "so while the load falls the friction force may exceed mu_s N; set friction.reading "
                '= "stretch" to avoid this',
            ]
    steps = steps_per_cycle(model)
    frames = FRAMES if patch is not None else 0
    fine = bench.run(model, patch, steps, frames, watch=PassOptions(None, say, progress))
    seconds["bench"] = fine.seconds
    others = []
    left = None
    if estimate:
        patches = [patch, *(one for one in coarse if one is not None)]
        others, seconds["error"], left = estimate_pass_errors(model, patches, fine, steps, say)
    found = add_errors(fine.values, *others, min_relative_error=1e-10)
    fields = {}
    created = fine.values["energy_created"]
    power = np.abs(np.diff(fine.ledger[0])).sum()
    if f.reading == "report" and created > 1e-6 * power:
        warnings = [
            *warnings,
            f"the law as printed in the report created {created:.3g} J, "
            f"which is {100 * created / power:.2g} % of the work exchanged; with friction.reading = "
            '"stretch" no energy is created',
        ]
    warnings = [
        *warnings,
        *note_on_heating(model, patch, fine),
        *work_check_warning(found, steps),
        *_warn_if_open(model, patch, fine, steps),
    ]
    if patch is not None:
        warnings = [*warnings, *_overhang(model.patch, patch, fine)]
        fields = interface_frames(
            patch, fine.time[fine.frames], fine.tau, fine.local, fine.slide[fine.frames]
        )
    outcome = outcome_on_piece(Outcome.DONE, model.patch, patch, fine.slide, fine.lateral)
    notes = []
    if law_has_trait(f.law, "bonds"):
        peak = (
            fine.values["friction_ratio_peak"] / f.static
            if f.static > 0 and not model.load_varies
            else None
        )
        notes = growth_notes(model.bonds, peak)
    notes = [*notes, *climbing_as_one(model, patch)]
    known = estimate and has_known_mesh_error(model, patch, coarse)
    found = remove_unknown_errors(found, known)
    found = set_final_floors(found, model.accuracy.tolerance)
    count = shear.count_shear_modes(model, patch) if model.partial_slip else None
    return Result(
        what,
        outcome,
        found,
        fine,
        fine,
        patch,
        fields,
        seconds,
        warnings,
        {"engine": fine.engine.name, "steps": steps, "notes": notes, "left_open": left}
        | ({"shear_modes": count} if count else {}),
    )


def _miss(fine) -> float:
    """Return by how much the last cycle does not close [1].

    It is the larger of two changes over the cycle: that of the force over its peak, and that of the
    stored energy over the work.
    """
    force, (work, stored, *_) = fine.force[fine.first :], fine.ledger[:, fine.first :]
    shares = (
        (force[-1] - force[0], np.abs(force).max()),
        (stored[-1] - stored[0], work[-1] - work[0]),
    )
    return max(abs(float(change / size)) if size else 0.0 for change, size in shares)


def _warn_if_open(model, patch, fine, steps: int) -> list:
    """Return a warning, as a list, if the last loop does not close and is not the steady one.

    It names the number of cycles after which the loop is steady, if MAX_EXTRA_CYCLES cycles with at most
    MOST_TRIED evaluations show it.
    """
    period = model.slide.period
    tolerance = model.accuracy.tolerance
    cycles = model.slide.cycles
    if period is None or cycles < 1 or not fine.values.get("loop_area"):
        return []
    if (miss := _miss(fine)) <= tolerance:
        return []
    text = (
        f"{OPEN_LOOP}: it misses by {100 * miss:.2g} % (limit {100 * tolerance:g} %), so loop_area, the friction "
        "work of the last cycle, is not the energy dissipated in a steady loop"
    )
    if (
        fine.time.size
        * (1 if patch is None else patch.x.size)
        * (cycles + MAX_EXTRA_CYCLES)
        / cycles
        > MOST_TRIED
    ):
        return [f"{text}; raise slide.cycles"]
    longer = bench.run(
        replace(model, slide=replace(model.slide, cycles=cycles + MAX_EXTRA_CYCLES)), patch, steps
    )
    ends = longer.time[-1] - period * np.arange(MAX_EXTRA_CYCLES + 1, -1, -1)
    loops = np.diff(np.interp(ends, longer.time, longer.ledger[0]))
    near = np.abs(loops - loops[-1]) <= tolerance * np.abs(loops[-1])
    if near[0]:
        return []
    if not near[-2]:
        return [f"{text}; no steady loop is reached within {cycles + MAX_EXTRA_CYCLES:g} cycles"]
    count = int(np.flatnonzero(~near)[-1]) + 1
    return [
        f"{text}, which is {format_quantity(float(loops[-1]), 'J', 4)}; set slide.cycles = {cycles + count:g}"
    ]


def _overhang(asked, patch, fine) -> list:
    """Return warnings of a bench whose slide leaves the patch."""
    out = []
    if (
        fine.lateral is not None
        and (aside := largest_slide(fine.lateral) / asked.pieces.width) > MAX_SLIDE_FRACTION
    ):
        out.append(
            f"the slide across the sliding direction is {aside:.2g} of the width of the pieces, but the "
            "computation assumes that the pieces still overlap over their whole width"
        )
    lost = 1 - float(fine.load.min() / fine.load[0]) if fine.load[0] > 0 else 0.0
    if lost > 0.01:
        out.append(
            "the upper piece slides off the pressed area: at worst the computed contact carries "
            f"{100 * lost:.0f} % less than the given load"
        )
    return [*out, *warn_of_large_slide(patch, fine.slide)]
