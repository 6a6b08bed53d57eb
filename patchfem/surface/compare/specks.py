"""Dust and dropouts that only the other trace shows: narrow places with walls that no surface has."""

from dataclasses import replace

import numpy as np

from ...core import frozen_array, say
from ..profile import Profile, runs_of
from .alignment import Alignment
from .section import sure_of

N_AROUND = 101  # samples whose jumps tell the roughness around a speck
MEDIAN, WIDEST = 41, 12  # samples of the running median, and of the widest speck at half of its height
STEEP, SOME = 5.0, 1.5  # robust deviations of the steps of the surface, and of noise, that both walls are steeper than
GROWN, FALLEN = 9.0, 2.0  # such parts of the height is a step of the walls of what stands above, or of a hollow


def without_specks(found: Alignment, before: Profile, after: Profile) -> tuple:
    """Both traces without what stands out of their registered difference as no surface does; the same where nothing.

    A speck is 12 samples wide or less at half of its height, and the difference climbs and falls at it by steps
    larger than four deviations of those of the first trace: tops that wore off have the slopes of the surface.
    Nothing that wears stands above the first trace, nor below all of it nearby: there less will do, a ninth of the
    height of what grew, half of a hollow. None is so low that noise alone would bring it (`edges.sure_of`). It is
    left out of the trace that has the larger steps there.
    """
    from scipy.ndimage import median_filter

    rest, first = np.asarray(found.depth), np.asarray(found.first)
    if rest.size < 2 * MEDIAN:
        return before, after
    off, sure = rest - _median(rest), sure_of(2 * rest.size, 1)  # above or below
    steps = 1.4826 * float(np.median(np.abs(np.diff(first)))) + 1.5 * found.noise
    # where most neighbours jump, as on a rough floor, a jump is roughness
    jumps = np.abs(np.diff(rest, append=rest[-1]))
    steps = np.maximum(steps, 1.4826 * median_filter(jumps, N_AROUND, mode="nearest"))
    sides = first, first - rest
    marked = [np.zeros(before.x.size, bool), np.zeros(after.x.size, bool)]
    for low, high in runs_of(np.abs(off) > 3 * found.noise):
        here, size = slice(max(low - 1, 0), high + 2), np.abs(off[low:high + 1])
        walls, height, at = np.diff(rest[here]), float(size.max()), low + int(np.argmax(size))
        is_wide = (size > height / 2).sum() > WIDEST or size.size > 3 * WIDEST
        if height < sure * float(found.noise_at[at]) or is_wide or \
                min(walls.max(), -walls.min()) < _least(found, at, off[at] > 0, height, float(steps[at])):
            continue
        which = int(np.argmax([np.abs(np.diff(side[here])).max() for side in sides]))
        ends = found.x[max(low - 1, 0)], found.x[min(high + 1, rest.size - 1)]
        if not which:
            ends = [found.back(end) for end in ends]
        x = (before, after)[which].x
        slack = 0.5 * float(x[1] - x[0])
        marked[which] |= (x >= ends[0] - slack) & (x <= ends[1] + slack)
    return tuple(_left_out(*one) for one in zip((before, after), marked))


def _least(found: Alignment, at: int, missing: bool, height: float, steps: float) -> float:
    """The least step [m] of both walls of a speck of a height [m]; missing: less is there than beside it."""
    if not missing:  # unworn heights between worn tops are none
        return max(SOME * steps, height / GROWN) if found.depth[at] < -height / 2 else float("inf")
    near = found.first[max(at - MEDIAN, 0):at + MEDIAN + 1]
    stands = found.first[at] - float(np.median(near)) > height / 2  # in the first trace itself, over a track
    if found.first[at] - found.depth[at] < near.min() - 3 * found.noise and not stands:
        return max(SOME * steps, height / FALLEN)
    return STEEP * steps


def _median(z) -> np.ndarray:
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(z, MEDIAN // 2, "reflect"), MEDIAN)
    return np.median(windows, axis=1)


def _left_out(profile: Profile, marked) -> Profile:
    marked &= ~profile.missing
    if not marked.any():
        return profile
    z = np.where(marked, np.nan, profile.z)
    count = len(runs_of(marked))
    note = (f"{profile.source}: {count} place{'s' * (count > 1)} with walls much steeper than the rest of the trace "
            f"(the first at x = {say(profile.x[np.argmax(marked)])}) {'are' if count > 1 else 'is'} taken as dust or "
            f"dropouts and left out, {marked.sum()} of {z.size} heights with their neighbours; use --keep-spikes to "
            "keep them")
    return replace(profile, z=frozen_array(z), notes=(*profile.notes, note))
