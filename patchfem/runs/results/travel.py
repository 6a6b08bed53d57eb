"""How far the pieces slide on one another, against the length in contact and the length of the piece."""

import numpy as np

from ...formatting import format_length
from ...response.outcome import off_the_piece

FAR = 0.1  # of the contact length; from there on the fixed pressure is doubtful


def largest_slide(slide) -> float:
    """Largest |slide| [m] of kept samples (k,) [m]; infinite where the motion left the numbers."""
    largest = float(np.abs(slide).max(initial=0.0))
    return largest if np.isfinite(largest) else np.inf


def contact_length(patch) -> float:
    """Length [m] from one end of the contact to the other, each end half way between its nodes."""
    touching = np.flatnonzero(patch.active)
    if not touching.size:
        return 0.0
    middle = (patch.x[1:] + patch.x[:-1]) / 2
    ends = np.concatenate([patch.x[:1], middle, patch.x[-1:]])
    return float(ends[touching[-1] + 1] - ends[touching[0]])


def travelled(patch, slide) -> list:
    """A warning, as a list, where the slide (k,) [m] is a tenth of the contact length or more."""
    largest, contact = largest_slide(slide), contact_length(patch)
    if not contact > 0 or largest < FAR * contact:
        return []
    return [
        f"the slide amplitude, {format_length(largest, 3)}, is {largest / contact:.2g} of the "
        f"contact length {format_length(contact)} "
        f"(limit {FAR:g}): the computation keeps the pressure unchanged and neglects that the ends of the pieces "
        "no longer overlap"
    ]


def outcome_on_piece(outcome, asked, patch, slide, lateral=None):
    """The outcome of a run, or that the slide passed the end of the piece (`response.outcome.off_the_piece`).

    patch: None for [normal], which has no length; lateral (k,) [m]: slide across, or None.
    """
    if patch is None:
        return outcome
    pieces = asked.pieces
    mean_length = (pieces.lower.length + pieces.upper.length) / 2
    found = off_the_piece(outcome, largest_slide(slide), mean_length)
    return found if lateral is None else off_the_piece(found, largest_slide(lateral), pieces.width)
