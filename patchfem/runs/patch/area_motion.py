"""State of a face after a motion: which cells stick at the last reversal, and how far each slips in a cycle.

In: a `Result` of a bench or a rig with [contact.area]. Out: a `ReversalState`, and the measure stick_area_fraction.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...effects import law_has_trait
from ...friction.record import make_law
from ...measures.errors import estimate_convergence_errors
from ...partial_slip import first_loading
from ..results.patch_rows import CELLS_SOURCE, make_measure
from . import jenkins_elements, store
from .area import AreaPatch


def find_face_reversal(result, patch: AreaPatch) -> "first_loading.ReversalState | None":
    """Find the state of a face at the last reversal of the slide.

    Laws of parallel elements follow Masing's rule from the first loading. Under laws with bonds, a cell sticks that hardly
    slips in the frames of the last cycle.

    Parameters
    ----------
    result : Result
        Run with [contact.area].
    patch : AreaPatch
        Face of the result, or the face on another grid.

    Returns
    -------
    ReversalState or None
        None without a cycle, without contact, or if the face slips as a whole.
    """
    model = result.plan.model
    window = result.window
    if window is None or not model.partial_slip or not patch.pressure.load > 0:
        return None

    # Half the range of the slide in the last cycle
    period = model.slide.period if model.rig is None else result.histories.period
    if not period:
        return None
    is_last = window.time >= window.time[-1] - period * (1 + 1e-9)
    amplitude = float(np.ptp(window.slide[is_last])) / 2
    if not amplitude > 0:
        return None
    if law_has_trait(model.friction.law, "bonds"):
        return _find_in_frames(result) if patch is result.patch else None
    length = make_law(model.friction, patch.pressure.load).length
    key = ("reversal", patch, model.friction.static, length, amplitude)
    cells = jenkins_elements.soften_cells(patch, model.friction.static, length)
    return store.get_or_compute(key, lambda: first_loading.find_reversal(*cells, amplitude))


def _find_in_frames(result) -> "first_loading.ReversalState | None":
    """Return the state of the cells from the frames of the last cycle of a run; None without their slip."""
    slip = result.fields.get("slip")
    if slip is None:
        return None
    model = result.plan.model
    frames = slip[1:] if result.wear is None else slip[1 + result.wear.n_frames :]
    if model.rig is None and model.slide.cycles:
        frames = frames[-max(2, round(len(frames) / model.slide.cycles)) :]
    active = result.patch.active
    path = np.where(active, np.abs(np.diff(frames, axis=0)).sum(axis=0), 0.0)
    # Slip of a cell in a cycle, relative to the largest one, below which the cell sticks.
    slips = path > 1e-2 * path.max()
    status = np.where(active, first_loading.STICK + slips, first_loading.OPEN)
    return first_loading.ReversalState(status.astype(np.int8), path)


def add_reversal_measure(result, coarse: Sequence[AreaPatch | None]):
    """Return the result of a run with [contact.area] with the measure stick_area_fraction, if a part of the face slips.

    Parameters
    ----------
    result : Result
        Run of a bench or a rig.
    coarse : sequence of AreaPatch or None
        Face on the coarser grids, whose changes give the error.
    """
    name = "stick_area_fraction"
    states = [find_face_reversal(result, patch) for patch in (result.patch, *coarse) if patch]
    known = [{name: state.stick_fraction} for state in states if state is not None]
    if states[0] is None:
        return result
    errors = estimate_convergence_errors(*known) if len(known) > 1 else {}
    measure = make_measure(name, known[0][name], errors.get(name), CELLS_SOURCE)
    if not errors:
        measure = replace(
            measure, reason="error unknown: the state is that of the frames of a cycle"
        )
    return replace(result, measures=result.measures | {name: measure})
