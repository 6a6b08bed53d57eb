"""Dust and dropouts that only the other trace shows: narrow places with walls that no surface has."""

from dataclasses import replace

import numpy as np

from ...core import frozen_array, say
from ..profile import Profile, runs_of
from .registration import Registration

MEDIAN, WIDEST, SCRATCH = 41, 12, 3  # samples of the running median, of the widest speck, of a hollow that may be one
STEEP = 5.0  # robust deviations of the steps of the surface, and of the noise, that both walls are steeper than


def without_specks(found: Registration, before: Profile, after: Profile) -> tuple:
    """Both traces without what stands out of their registered difference as no surface does; the same where nothing.

    A speck is 12 samples wide or less, and the difference climbs and falls at it by steps larger than five deviations
    of those of the first trace: tops that wore off have the slopes of the surface. It is left out of the trace that
    has the larger steps there. A hollow of more than 3 samples in the trace after stays: it may
    be a scratch.
    """
    rest, first = np.asarray(found.rest), np.asarray(found.first)
    if rest.size < 2 * MEDIAN:
        return before, after
    off = rest - _median(rest)
    steep = STEEP * (1.4826 * float(np.median(np.abs(np.diff(first)))) + 1.5 * found.noise)
    sides = first, first - rest
    marked = [np.zeros(before.x.size, bool), np.zeros(after.x.size, bool)]
    scale = 1 + (found.stretch[0] if found.stretch[2] else 0.0)
    for low, high in runs_of(np.abs(off) > 3 * found.noise):
        if high - low >= WIDEST:
            continue
        here = slice(max(low - 1, 0), high + 2)
        walls = np.diff(rest[here])
        if min(walls.max(), -walls.min()) < steep:
            continue
        which = int(np.argmax([np.abs(np.diff(side[here])).max() for side in sides]))
        if which and off[(low + high) // 2] > 0 and high - low >= SCRATCH:
            continue
        ends = found.x[max(low - 1, 0)], found.x[min(high + 1, rest.size - 1)]
        if not which:
            ends = [found.middle + (end - found.middle) / scale - found.shift for end in ends]
        x = (before, after)[which].x
        slack = 0.5 * float(x[1] - x[0])
        marked[which] |= (x >= ends[0] - slack) & (x <= ends[1] + slack)
    return tuple(_left_out(*one) for one in zip((before, after), marked))


def _median(z) -> np.ndarray:
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(z, MEDIAN // 2, "reflect"), MEDIAN)
    return np.median(windows, axis=1)


def _left_out(profile: Profile, marked) -> Profile:
    marked &= ~profile.missing
    if not marked.any():
        return profile
    z = np.where(marked, np.nan, profile.z)
    note = (f"{profile.source}: {marked.sum()} of {z.size} heights stand out with walls that the surface has nowhere "
            f"else (the first at x = {say(profile.x[np.argmax(marked)])}): dust or dropouts, left out; --keep-spikes "
            "keeps them")
    return replace(profile, z=frozen_array(z), notes=(*profile.notes, note))
