"""Heights of a trace as a contribution to the gap at the nodes of the interface."""

from dataclasses import replace

import numpy as np

from ..core import PatchfemError, frozen_array
from ..formatting import format_length
from .profile import Profile

AS_LONG = "the trace is as long as the patch"
CENTRED_NOTE = "the trace is centred on the patch"
MEANS_OVER_WAVES = "means over the waves of the trace"
NOTES = (
    AS_LONG,
    CENTRED_NOTE,
    MEANS_OVER_WAVES,
    "is rounded to",
)  # parts of the notes that cast no doubt on a result
ROUND_OFF = 1e-3  # digit to which notes state x, relative to its step; smaller digits are round-off
# Largest number of elements that a trace may lack at either end, with round-off.
MAX_MISSING_ELEMENTS = 0.5000001
MAX_STEP_ELEMENTS = 1.5  # largest sample spacing in elements without a note


def is_note(text: str) -> bool:
    """Return whether a sentence on a trace is a note rather than a warning."""
    return any(words in text for words in NOTES)


def place_over_patch(profile: Profile, x: np.ndarray, how: str = "auto") -> Profile:
    """Return the part of a trace that lies over a patch, with positions relative to the patch.

    Parameters
    ----------
    profile : Profile
        Missing heights at its ends do not count.
    x : (m,) array [m]
        Nodes.
    how : str
        "own": x of the file is the coordinate of the patch, 0 in its middle; "centred": the middle
        of the trace comes to the middle of the patch; "auto": own if the trace covers the patch so,
        else centred with a note.

    Returns
    -------
    Profile
    """
    if how not in ("auto", "own", "centred"):
        raise PatchfemError(f"unknown placing '{how}' of a profile; use auto, own or centred")
    x = _check_nodes(x)
    known = profile.x[~profile.missing]
    if known.size < 2:
        raise PatchfemError(f"{profile.source}: {known.size} heights; a trace needs at least two")
    shift = 0.0
    notes = profile.notes
    if how == "centred" or (how == "auto" and not _covers(known, x)):
        shift = float(x[0] + x[-1] - known[0] - known[-1]) / 2
        if how == "auto":
            notes += (_describe_centring(profile.source, known, x, shift),)
    known = known + shift
    _require_cover(profile.source, known, x)
    first = max(int(np.searchsorted(known, x[0], "right")) - 1, 0)
    last = min(int(np.searchsorted(known, x[-1], "left")), known.size - 1)
    places = profile.x + shift
    kept = (places >= known[first]) & (places <= known[last])
    step = float(np.median(np.diff(places[kept])))
    element = float(np.diff(x).max())
    if step > MAX_STEP_ELEMENTS * element:
        notes += (
            f"{profile.source}: samples lie {format_length(step)} apart, but elements are only "
            f"{format_length(element)} long; the surface between samples is interpolated",
        )
    return replace(
        profile, x=frozen_array(places[kept]), z=frozen_array(profile.z[kept]), notes=notes
    )


def _describe_centring(source: str, known, x, shift: float) -> str:
    if abs(np.ptp(known) - np.ptp(x)) <= sum(_max_missing(x)):
        return (
            f"{source}: {AS_LONG}, {format_length(np.ptp(x))}, and is centred on it, which adds "
            f"{format_length(shift)} to x"
        )
    digit = 10.0 ** np.floor(np.log10(ROUND_OFF * np.median(np.diff(known))))
    first, last, added = (
        format_length(digit * round(length / digit)) for length in (known[0], known[-1], shift)
    )
    return (
        f"{source}: x runs from {first} to {last} in the file and does not cover the patch, from "
        f"{format_length(x[0])} to {format_length(x[-1])}; {CENTRED_NOTE}, which adds {added} to x"
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
    x = _check_nodes(x)
    if profile.missing.any():
        raise PatchfemError(
            f"{profile.source}: {profile.missing.sum()} heights are missing; clean the trace first"
        )
    _require_cover(profile.source, profile.x, x)
    edges = np.concatenate([x[:1], (x[1:] + x[:-1]) / 2, x[-1:]])
    area = _integrate(profile, edges) if integral is None else integral(edges)
    mean = np.diff(area) / np.diff(edges)
    middle = (edges[1:] + edges[:-1]) / 2
    low = np.maximum(np.arange(x.size) - 1, 0)
    high = np.minimum(np.arange(x.size) + 1, x.size - 1)
    slope = (mean[high] - mean[low]) / (middle[high] - middle[low])
    return frozen_array(mean + slope * (x - middle))


def _integrate(profile: Profile, places) -> np.ndarray:
    """Integrate the heights of a trace from its first sample to given positions [m2]."""
    x = profile.x
    z = profile.z
    steps = np.diff(x)
    total = np.concatenate([[0.0], np.cumsum(steps * (z[1:] + z[:-1]) / 2)])
    within = np.clip(places, x[0], x[-1])
    cell = np.clip(np.searchsorted(x, within, "right") - 1, 0, steps.size - 1)
    t = (within - x[cell]) / steps[cell]
    inside = total[cell] + steps[cell] * t * (z[cell] + t * (z[cell + 1] - z[cell]) / 2)
    return inside + (places - within) * np.where(places < within, z[0], z[-1])


def _check_nodes(x) -> np.ndarray:
    x = np.asarray(x, dtype=np.float64)
    if x.ndim != 1 or x.size < 2 or not (np.diff(x) > 0).all():
        raise PatchfemError("a profile needs two or more nodes with rising x")
    return x


def _max_missing(x) -> tuple[float, float]:
    """Return the length [m] by which a trace may end inside the patch, half an element."""
    return MAX_MISSING_ELEMENTS * float(x[1] - x[0]), MAX_MISSING_ELEMENTS * float(x[-1] - x[-2])


def _covers(places, x) -> bool:
    first, last = _max_missing(x)
    return bool(places[0] <= x[0] + first and places[-1] >= x[-1] - last)


def _require_cover(source: str, places, x) -> None:
    """Raise PatchfemError if a trace does not cover the patch."""
    if _covers(places, x):
        return
    length = float(places[-1] - places[0])
    patch = float(x[-1] - x[0])
    if length < patch:
        raise PatchfemError(
            f"{source}: the profile is {format_length(length)} long, but the patch is {format_length(patch)} long; "
            "measure a longer trace or "
            f'set contact.length = "{format_length(length)}"'
        )
    raise PatchfemError(
        f"{source}: the profile runs from {format_length(places[0])} to {format_length(places[-1])}, but the patch "
        f"reaches from {format_length(x[0])} to {format_length(x[-1])}; shift x so that the profile covers the patch"
    )
