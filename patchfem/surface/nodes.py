"""Heights of a trace as a contribution to the gap at the nodes of the interface."""

from dataclasses import replace

import numpy as np

from ..core import PatchfemError, frozen_array
from ..formatting import format_length
from .profile import Profile

MEANS_OVER_WAVES_NOTE = "means over the waves of the trace"
# Parts of the notes that cast no doubt on a result.
HARMLESS_NOTE_PARTS = (
    "the trace is centred on the patch",
    MEANS_OVER_WAVES_NOTE,
    "is rounded to",
    "heights of spikes were removed",
)
# Largest number of elements that a trace may lack at either end, with round-off.
MAX_MISSING_END_ELEMENTS = 0.5000001


def is_note(text: str) -> bool:
    """Return whether a sentence about a trace is a note, not a warning."""
    return any(words in text for words in HARMLESS_NOTE_PARTS)


def place_over_patch(profile: Profile, x: np.ndarray) -> Profile:
    """Return the part of a trace that lies over a patch, with positions relative to the patch.

    x of the file is the coordinate of the patch, 0 in its middle, if the trace covers the patch so. Else the middle of
    the trace comes to the middle of the patch, with a note.

    Parameters
    ----------
    profile : Profile
        Missing heights at its ends do not count.
    x : (m,) array [m]
        Nodes.

    Returns
    -------
    Profile
    """
    known = profile.x[~profile.missing]

    # A trace that does not cover the patch is centred on it.
    shift = 0.0
    notes = profile.notes
    if not _covers(known, x):
        shift = float(x[0] + x[-1] - known[0] - known[-1]) / 2
        # Number of digits of x [m] in notes, which state no round-off
        rounded = np.round([known[0], known[-1], shift], 11)
        first, last, added = map(format_length, rounded.tolist())
        notes += (
            f"{profile.source}: x runs from {first} to {last} in the file and does not cover the patch, from "
            f"{format_length(x[0])} to {format_length(x[-1])}; {HARMLESS_NOTE_PARTS[0]}, which adds {added} to x",
        )
    known = known + shift
    _require_cover(profile.source, known, x)

    # One sample beyond each end of the patch stays, if there is one.
    first = max(int(np.searchsorted(known, x[0], "right")) - 1, 0)
    last = min(int(np.searchsorted(known, x[-1], "left")), known.size - 1)
    places = profile.x + shift
    is_kept = (places >= known[first]) & (places <= known[last])

    step = float(np.median(np.diff(places[is_kept])))
    element = float(np.diff(x).max())
    # Largest sample spacing in elements without a note
    if step > 1.5 * element:
        notes += (
            f"{profile.source}: samples lie {format_length(step)} apart, but elements are only "
            f"{format_length(element)} long; the surface between samples is interpolated",
        )
    return replace(
        profile, x=frozen_array(places[is_kept]), z=frozen_array(profile.z[is_kept]), notes=notes
    )


def average_at_nodes(profile: Profile, x: np.ndarray, integral=None) -> np.ndarray:
    """Average a trace over the tributary lengths of the interface nodes.

    A larger z is more open. The mean over half the way to both neighbours is integrated exactly, so
    that waves shorter than an element do not pass for long ones: a wave of two elements enters with
    64 % of its height, of four with 90 %, of one with nothing. The mean is carried from the middle
    of the tributary length to the node along the slope of the neighbouring means, so straight
    profiles are exact on any nodes and smooth ones to second order (h^2 z''/24 inside even nodes).
    Beyond the trace it goes on flat, over half an element at most.

    Parameters
    ----------
    profile : Profile
        Without missing heights, in the coordinate of the patch (`place_over_patch`).
    x : (m,) array [m]
        Nodes.
    integral : callable, optional
        Places [m] -> [m2] of another curve through the samples, which ends where the trace does.

    Returns
    -------
    (m,) array [m]
    """
    _require_cover(profile.source, profile.x, x)
    edges = np.concatenate([x[:1], (x[1:] + x[:-1]) / 2, x[-1:]])
    if integral is None:
        from scipy.interpolate import make_interp_spline

        integral = make_interp_spline(profile.x, profile.z, k=1).antiderivative()
    inside = np.clip(edges, profile.x[0], profile.x[-1])
    ends = np.where(edges < inside, profile.z[0], profile.z[-1])
    area = integral(inside) + (edges - inside) * ends
    mean = np.diff(area) / np.diff(edges)
    middle = (edges[1:] + edges[:-1]) / 2
    low = np.maximum(np.arange(x.size) - 1, 0)
    high = np.minimum(np.arange(x.size) + 1, x.size - 1)
    slope = (mean[high] - mean[low]) / (middle[high] - middle[low])
    return frozen_array(mean + slope * (x - middle))


def _covers(places, x) -> bool:
    """Return whether a trace covers a patch, except for half an element at each end.

    `places` [m] are the samples of the trace, and x (m,) [m] the nodes of the patch.
    """
    first = x[0] + MAX_MISSING_END_ELEMENTS * (x[1] - x[0])
    last = x[-1] - MAX_MISSING_END_ELEMENTS * (x[-1] - x[-2])
    return bool(places[0] <= first and places[-1] >= last)


def _require_cover(source: str, places, x) -> None:
    """Raise PatchfemError if a trace does not cover the patch.

    `source` names the trace, `places` [m] are its samples, and x (m,) [m] are the nodes of the patch.
    """
    if _covers(places, x):
        return
    if np.ptp(places) < np.ptp(x):
        length = format_length(np.ptp(places))
        raise PatchfemError(
            f"{source}: the profile is {length} long, but the patch is {format_length(np.ptp(x))} long; "
            f'measure a longer trace or set contact.length = "{length}"'
        )
    raise PatchfemError(
        f"{source}: the profile runs from {format_length(places[0])} to {format_length(places[-1])}, but the patch "
        f"reaches from {format_length(x[0])} to {format_length(x[-1])}; shift x so that the profile covers the patch"
    )
