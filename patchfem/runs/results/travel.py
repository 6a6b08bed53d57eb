"""Relative displacement of the pieces compared with the lengths of contact and pieces.

In: stored samples of the displacement and the solved patch. Out: a warning, or the outcome of a run
in which the pieces leave the contact.
"""

import numpy as np

from ...core import Outcome
from ...formatting import format_length

# Largest ratio of displacement to contact length at which the unchanged pressure is accurate.
MAX_SLIDE_TO_LENGTH_RATIO = 0.1


def find_max_displacement(slide) -> float:
    """Return the largest |displacement| [m] of samples (k,); inf if the motion overflowed."""
    largest = float(np.abs(slide).max(initial=0.0))
    return largest if np.isfinite(largest) else np.inf


def measure_contact_length(patch) -> float:
    """Return the distance [m] between the outermost contact edges of a patch."""
    # The cells of a face share their positions along x.
    x = np.unique(patch.x)
    loaded_nodes = np.unique(np.searchsorted(x, patch.x[patch.active]))
    if not loaded_nodes.size:
        return 0.0
    middle = (x[1:] + x[:-1]) / 2
    ends = np.concatenate([x[:1], middle, x[-1:]])
    return float(ends[loaded_nodes[-1] + 1] - ends[loaded_nodes[0]])


def warn_of_large_slide(patch, slide) -> list[str]:
    """Return a list with a warning if the displacement is large compared with the contact length.

    `slide` (k,) [m] is the relative displacement.
    """
    largest = find_max_displacement(slide)
    contact = measure_contact_length(patch)
    if not contact > 0 or largest < MAX_SLIDE_TO_LENGTH_RATIO * contact:
        return []
    return [
        f"the slide amplitude, {format_length(largest, 3)}, is {largest / contact:.2g} of the "
        f"contact length {format_length(contact)} "
        f"(limit {MAX_SLIDE_TO_LENGTH_RATIO:g}): the computation keeps the pressure unchanged and "
        "neglects that the ends of the pieces "
        "no longer overlap"
    ]


def check_pieces_overlap(outcome, patch_model, patch, slide):
    """Return LEAVES_CONTACT if one piece slides off the other, else the given outcome.

    Parameters
    ----------
    outcome : Outcome or None
        Outcome if the pieces overlap throughout.
    patch_model : PatchModel
        Patch with the length of the pieces; None without one.
    patch : Patch or None
        None for [normal], which has no length.
    slide : (k,)
        Relative displacement [m].
    """
    if patch is None:
        return outcome
    pieces = patch_model.pieces
    mean_length = (pieces.lower.length + pieces.upper.length) / 2
    # The displacement of a motion that did not converge has no meaning.
    if find_max_displacement(slide) > mean_length and outcome is not Outcome.NOT_CONVERGED:
        return Outcome.LEAVES_CONTACT
    return outcome
