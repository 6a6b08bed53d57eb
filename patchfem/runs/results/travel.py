"""Slide of the pieces compared with the length in contact and the length of the piece.

In: kept samples of the slide and the pressed patch. Out: a warning, or the outcome of a run
that leaves the contact.
"""

import numpy as np

from ...formatting import format_length
from ...response.outcome import check_piece_length

# Fraction of the contact length above which an unchanged pressure is inaccurate.
MAX_SLIDE_FRACTION = 0.1


def find_largest_slide(slide) -> float:
    """Return the largest |slide| [m] of samples (k,); inf if the motion overflowed."""
    largest = float(np.abs(slide).max(initial=0.0))
    return largest if np.isfinite(largest) else np.inf


def contact_length(patch) -> float:
    """Return the distance [m] between the ends of the contact of a patch."""
    touching = np.flatnonzero(patch.active)
    if not touching.size:
        return 0.0
    middle = (patch.x[1:] + patch.x[:-1]) / 2
    ends = np.concatenate([patch.x[:1], middle, patch.x[-1:]])
    return float(ends[touching[-1] + 1] - ends[touching[0]])


def warn_of_large_slide(patch, slide) -> list:
    """Return a warning if the slide (k,) [m] is large compared with the contact length."""
    largest = find_largest_slide(slide)
    contact = contact_length(patch)
    if not contact > 0 or largest < MAX_SLIDE_FRACTION * contact:
        return []
    return [
        f"the slide amplitude, {format_length(largest, 3)}, is {largest / contact:.2g} of the "
        f"contact length {format_length(contact)} "
        f"(limit {MAX_SLIDE_FRACTION:g}): the computation keeps the pressure unchanged and "
        "neglects that the ends of the pieces "
        "no longer overlap"
    ]


def judge_outcome_on_piece(outcome, patch_model, patch, slide, lateral=None):
    """Return the outcome of a run, or LEAVES_CONTACT if a piece slides off the other.

    See `response.outcome.check_piece_length`.

    Parameters
    ----------
    outcome : Outcome or None
    patch_model : PatchModel
    patch : Patch or None
        None for [normal], which has no length.
    slide : (k,)
        [m].
    lateral : (k,), optional
        Slide in the lateral direction [m].
    """
    if patch is None:
        return outcome
    pieces = patch_model.pieces
    mean_length = (pieces.lower.length + pieces.upper.length) / 2
    outcome = check_piece_length(outcome, find_largest_slide(slide), mean_length)
    if lateral is None:
        return outcome
    return check_piece_length(outcome, find_largest_slide(lateral), pieces.width)
