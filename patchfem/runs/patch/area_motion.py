"""State of a face after a motion: which cells stick at the last reversal, and how far each slips in a cycle.

In: a `Result` of a bench or a rig with [contact.area]. Out: a `FaceReversal`, and the measure stick_area_fraction.
"""

from dataclasses import replace

import numpy as np

from ...convergence import convergence_error
from ...effects import law_has_trait
from ...friction.record import make_law
from ..results.patch_rows import CELLS_SOURCE, make_measure
from . import jenkins_elements, store
from .area import AreaPatch
from .area_slip import FaceReversal, find_reversal

# Slip of a cell in a cycle, relative to the largest one, below which the cell sticks.
MAX_STUCK_SLIP_FRACTION = 1e-2


def find_face_reversal(result, patch: AreaPatch | None = None) -> FaceReversal | None:
    """Find the state of a face at the last reversal of the slide.

    Laws of parallel elements follow Masing's rule from the first loading. Under laws with bonds, a cell sticks that hardly
    slips in the frames of the last cycle.

    Parameters
    ----------
    result : Result
        Run with [contact.area].
    patch : AreaPatch, optional
        Face on another grid; by default that of the result.

    Returns
    -------
    FaceReversal or None
        None without a cycle, without contact, or if the face slips as a whole.
    """
    model = result.plan.model
    patch = patch or result.patch
    if result.window is None or not model.partial_slip or not patch.pressure.load > 0:
        return None
    amplitude = _find_amplitude(result)
    if not amplitude > 0:
        return None
    if not law_has_trait(model.friction.law, "bonds"):
        length = make_law(model.friction, patch.pressure.load).length
        key = ("reversal", patch, model.friction.static, length, amplitude)
        elements = jenkins_elements.elements(patch, model.friction.static, length)
        return store.get_or_compute(key, lambda: find_reversal(elements, amplitude))
    return _find_in_frames(result) if patch is result.patch else None


def _find_amplitude(result) -> float:
    """Return half the range [m] of the slide in the last cycle of a run; 0 for a motion without cycles."""
    window = result.window
    model = result.plan.model
    if model.rig is None:
        if model.slide.period is None:
            return 0.0
        return float(np.ptp(window.slide[window.first :])) / 2
    period = result.motion.period
    if not period:
        return 0.0
    is_last = window.time >= window.time[-1] - period * (1 + 1e-9)
    return float(np.ptp(window.slide[is_last])) / 2


def _find_in_frames(result) -> FaceReversal | None:
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
    slips = path > MAX_STUCK_SLIP_FRACTION * path.max()
    status = np.where(active, 1 + slips, 0).astype(np.int8)
    return FaceReversal(status, path, float((~slips[active]).mean()))


def add_reversal_measure(result, coarse: AreaPatch | None):
    """Return the result of a run with [contact.area] with the measure stick_area_fraction, if a part of the face slips.

    Parameters
    ----------
    result : Result
        Run of a bench or a rig.
    coarse : AreaPatch or None
        Face on the next coarser grid, whose change is the error.
    """
    reversal = find_face_reversal(result)
    if reversal is None:
        return result
    error = None
    other = None if coarse is None else find_face_reversal(result, coarse)
    if other is not None:
        error = float(convergence_error(reversal.stick_fraction - other.stick_fraction))
    name = "stick_area_fraction"
    measure = make_measure(name, reversal.stick_fraction, error, CELLS_SOURCE)
    if error is None:
        measure = replace(
            measure, reason="error unknown: the state is that of the frames of a cycle"
        )
    return replace(result, measures=result.measures | {name: measure})
