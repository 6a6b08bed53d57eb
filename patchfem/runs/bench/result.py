"""A bench from its plan to its result: the slide, its errors, and the warnings on law and overhang."""

import numpy as np

from ...core import Outcome
from ...effects import has
from ...response.errors import with_errors
from ...response.rows import judged
from ..results.notes import climbing_as_one, of_growth, unbounded_bonds, unripe, warming, work_check_warning
from ..results.result import FRAMES, Result, frames_of, on_a_mesh_of_known_error, without_errors
from ..results.travel import FAR, largest_slide, outcome_on_piece, travelled
from . import bench, shear
from .engine import steps_of
from .errors import errors_of
from .ledger import Watch


def prescribed(what, patch, coarse, seconds, warnings, say, progress, per_point, estimate) -> Result:
    """Run a plan of kind bench; arguments as `run.run` has them."""
    model, f = what.model, what.model.friction
    if has(f.law, "bonds"):
        warnings = [*warnings, *unbounded_bonds(model.bonds), *unripe(model.bonds, model.speed)]
        if f.reading == "report" and model.load_varies:
            warnings = [*warnings, 'in the law as printed in the report, a bond keeps the pressure at which it formed, '
                                   'so while the load falls the friction force may exceed mu_s N; set friction.reading '
                                   '= "stretch" to avoid this']
    steps = steps_of(model)
    frames = FRAMES if patch is not None else 0
    fine = bench.run(model, patch, steps, frames, watch=Watch(None, say, progress))
    seconds["bench"] = fine.seconds
    others, left = [], None
    if estimate:
        others, seconds["error"], left = errors_of(model, patch, coarse[0], fine, steps, say)
    found = with_errors(fine.values, *others, least=1e-10)
    fields, created, power = {}, fine.values["energy_created"], np.abs(np.diff(fine.ledger[0])).sum()
    if f.reading == "report" and created > 1e-6 * power:
        warnings = [*warnings, f"the law as printed in the report created {created:.3g} J, "
                               f'which is {100 * created / power:.2g} % of the work exchanged; with friction.reading = '
                               '"stretch" no energy is created']
    warnings = [*warnings, *warming(model, patch, fine), *work_check_warning(found, steps)]
    if patch is not None:
        warnings = [*warnings, *_overhang(model.patch, patch, fine)]
        fields = frames_of(patch, fine.time[fine.frames], fine.tau, fine.local, fine.slide[fine.frames])
    outcome, notes = outcome_on_piece(Outcome.DONE, model.patch, patch, fine.slide, fine.lateral), []
    if has(f.law, "bonds"):
        peak = fine.values["friction_ratio_peak"] / f.static if f.static > 0 and not model.load_varies else None
        notes = of_growth(model.bonds, peak)
    notes = [*notes, *climbing_as_one(model, patch)]
    known = estimate and on_a_mesh_of_known_error(model, patch, coarse)
    found = judged(without_errors(found, known), model.accuracy.tolerance)
    count = shear.modes_of(model, patch) if model.soft else None
    return Result(what, outcome, found, fine, fine, patch, fields, seconds, warnings,
                  {"engine": fine.engine.name, "steps": steps, "notes": notes, "left_open": left}
                  | ({"shear_modes": count} if count else {}))


def _overhang(asked, patch, fine) -> list:
    """Warnings of a bench whose slide leaves the patch."""
    out = []
    if fine.lateral is not None and (aside := largest_slide(fine.lateral) / asked.width) > FAR:
        out.append(f"the slide across the sliding direction is {aside:.2g} of the width of the pieces, but the "
                   "computation assumes that the pieces still overlap over their whole width")
    lost = 1 - float(fine.load.min() / fine.load[0]) if fine.load[0] > 0 else 0.0
    if lost > 0.01:
        out.append("the upper piece slides off the pressed area: at worst the computed contact carries "
                   f"{100 * lost:.0f} % less than the given load")
    return [*out, *travelled(patch, fine.slide)]
