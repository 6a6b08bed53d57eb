"""Heights of a trace as a contribution to the gap at the nodes of the interface."""

from dataclasses import replace

import numpy as np

from ..core import PatchfemError, frozen_array, say
from .profile import Profile

FITS = "the trace is as long as the patch"
CENTRED = "the trace is centred on the patch"
ROUNDED = "is rounded to"
NOTES = (FITS, CENTRED, ROUNDED)  # a sentence with these words says how a trace was read and doubts no number
ROUND_OFF = 1e-3  # spacings of samples; a shorter length is round-off of the file's x and is not printed


def is_note(text: str) -> bool:
    """Whether a sentence on a trace is a note, not a warning."""
    return any(words in text for words in NOTES)


def placed(profile: Profile, x: np.ndarray, how: str = "auto") -> Profile:
    """The part of a trace over a patch with nodes x (m,) [m], in the coordinate of the patch.

    how: "own": the file's x is the patch coordinate (0 in the middle); "centred": the middle of the trace comes to the
    middle of the patch; "auto": own where the trace covers the patch so, else centred, which is said. What is
    missing at its ends is not counted as trace. Up to half an element may be short at either end. PatchfemError with
    both lengths where the trace does not cover the patch.
    """
    if how not in ("auto", "own", "centred"):
        raise PatchfemError(f"unknown placing '{how}' of a profile; use auto, own or centred")
    x = _nodes(x)
    there = profile.x[~profile.missing]
    if there.size < 2:
        raise PatchfemError(f"{profile.source}: {there.size} heights; a trace needs at least two")
    shift, notes = 0.0, profile.notes
    if how == "centred" or (how == "auto" and not _covers(there, x)):
        shift = float(x[0] + x[-1] - there[0] - there[-1]) / 2
        if how == "auto" and abs(np.ptp(there) - np.ptp(x)) <= sum(_slack(x)):
            notes += (f"{profile.source}: {FITS}, {say(np.ptp(x))}, and is centred on it, which adds {say(shift)} to "
                      "x",)
        elif how == "auto":
            digit = 10.0 ** np.floor(np.log10(ROUND_OFF * np.median(np.diff(there))))
            first, last, added = (say(digit * round(length / digit)) for length in (there[0], there[-1], shift))
            notes += (f"{profile.source}: x runs from {first} to {last} in the file and does not cover the patch, from "
                      f"{say(x[0])} to {say(x[-1])}; {CENTRED}, which adds {added} to x",)
    there = there + shift
    _demand(profile.source, there, x)
    first = max(int(np.searchsorted(there, x[0], "right")) - 1, 0)
    last = min(int(np.searchsorted(there, x[-1], "left")), there.size - 1)
    moved = profile.x + shift
    keep = (moved >= there[first]) & (moved <= there[last])
    apart, element = float(np.median(np.diff(moved[keep]))), float(np.diff(x).max())
    if apart > 1.5 * element:
        notes += (f"{profile.source}: samples lie {say(apart)} apart, but elements are only {say(element)} long; "
                  "between samples the surface is taken as straight",)
    return replace(profile, x=frozen_array(moved[keep]), z=frozen_array(profile.z[keep]), notes=notes)


def on_nodes(profile: Profile, x: np.ndarray, integral=None) -> np.ndarray:
    """Gap contribution (m,) [m] of a trace in the coordinate of the patch (`placed`) at its nodes x (m,) [m].

    The heights count as gap, as written: a larger z is more open. Each node takes the mean of the trace, straight lines
    between samples, over its tributary length (half the way to its neighbours). The mean is integrated exactly, so that
    waves shorter than an element do not pass for long ones: a wave of two elements enters with 64 % of its height, of
    four with 90 %, of one with nothing. The mean is carried from the middle of the tributary length to the node along
    the slope of the neighbouring means, so that straight profiles are exact on any nodes and smooth ones to second
    order (h^2 z''/24 inside even nodes). Beyond the trace it goes on flat, over half an element at most. integral:
    function of places [m] -> [m2] of another curve through the samples, which ends where the trace does.

    PatchfemError for missing heights and a trace that does not cover the patch.
    """
    x = _nodes(x)
    if profile.missing.any():
        raise PatchfemError(f"{profile.source}: {profile.missing.sum()} heights are missing; clean the trace first")
    _demand(profile.source, profile.x, x)
    edges = np.concatenate([x[:1], (x[1:] + x[:-1]) / 2, x[-1:]])
    mean = np.diff(_primitive(profile, edges) if integral is None else integral(edges)) / np.diff(edges)
    middle = (edges[1:] + edges[:-1]) / 2
    low, high = np.maximum(np.arange(x.size) - 1, 0), np.minimum(np.arange(x.size) + 1, x.size - 1)
    slope = (mean[high] - mean[low]) / (middle[high] - middle[low])
    return frozen_array(mean + slope * (x - middle))


def _primitive(profile: Profile, at) -> np.ndarray:
    """Exact integral of the trace from its first sample to `at` [m2], flat beyond its ends."""
    x, z = profile.x, profile.z
    steps = np.diff(x)
    whole = np.concatenate([[0.0], np.cumsum(steps * (z[1:] + z[:-1]) / 2)])
    within = np.clip(at, x[0], x[-1])
    cell = np.clip(np.searchsorted(x, within, "right") - 1, 0, steps.size - 1)
    t = (within - x[cell]) / steps[cell]
    inside = whole[cell] + steps[cell] * t * (z[cell] + t * (z[cell + 1] - z[cell]) / 2)
    return inside + (at - within) * np.where(at < within, z[0], z[-1])


def _nodes(x) -> np.ndarray:
    x = np.asarray(x, dtype=np.float64)
    if x.ndim != 1 or x.size < 2 or not (np.diff(x) > 0).all():
        raise PatchfemError("a profile needs two or more nodes with rising x")
    return x


def _covers(there, x) -> bool:
    return bool(there[0] <= x[0] + _slack(x)[0] and there[-1] >= x[-1] - _slack(x)[1])


def _slack(x) -> tuple:
    """Half an element at either end, with some room for round-off."""
    return 0.5000001 * float(x[1] - x[0]), 0.5000001 * float(x[-1] - x[-2])


def _demand(source: str, there, x) -> None:
    if _covers(there, x):
        return
    length, patch = float(there[-1] - there[0]), float(x[-1] - x[0])
    if length < patch:
        raise PatchfemError(f"{source}: the profile is {say(length)} long, but the patch is {say(patch)} long; "
                            f'measure a longer trace or set contact.length = "{say(length)}"')
    raise PatchfemError(f"{source}: the profile runs from {say(there[0])} to {say(there[-1])}, but the patch reaches "
                        f"from {say(x[0])} to {say(x[-1])}; shift x so that the profile covers the patch")
