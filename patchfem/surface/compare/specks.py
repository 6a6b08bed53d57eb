"""Dust and dropouts in one of two aligned traces: narrow features with very steep walls.

A dip of a few samples may be a dropout of the instrument or a scratch. It is left out, and the upper
end of the worn area contains it.
"""

from dataclasses import replace

import numpy as np

from ...core import frozen_array
from ...formatting import format_length
from ..profile import MAD_TO_DEVIATION, Profile, find_runs
from .alignment import Alignment
from .section import Section, noise_threshold

N_AROUND = 101  # number of samples whose height differences give the roughness around a speck
N_MEDIAN = 41  # number of samples in the running median from which specks deviate
# Largest width of a speck at half its height, in samples; wider ones are features of the surface.
MAX_WIDTH = 12
# Quantile of the jumps between neighbouring heights that gives their deviation, and this quantile of
# normal values of deviation 1.
WALL_QUANTILE = 0.99
NORMAL_WALL = 2.576
# Smallest jump at both edges of a speck relative to the deviation of the jumps along the surface.
MIN_WALL = 5.0
# Smallest such ratio at heights that wear cannot explain, where smaller edges suffice.
MIN_OUTSIDE_WALL = 1.5
MAX_DUST_STEPS = 9.0  # largest height of a dust particle relative to the jump at its edge
MAX_DROPOUT_STEPS = 2.0  # largest depth of a dropout relative to the jump at its edge


def remove_specks(alignment: Alignment, before: Profile, after: Profile) -> tuple:
    """Mark dust and dropouts of two aligned traces as missing.

    Returns the same traces if there are none.

    A speck is at most 12 samples wide at half of its height, and the difference of the traces climbs and
    falls at it by steps larger than five deviations of the steps of the first trace: tops that wore off
    have the slopes of the surface. Wear does not stand above the first trace, nor below all of it nearby;
    smaller steps are enough there. Noise alone brings no such height (`section.noise_threshold`). The speck is
    removed from the trace that has the larger steps.

    Parameters
    ----------
    alignment : Alignment
    before, after : Profile
        The traces that were aligned.
    """
    from scipy.ndimage import median_filter

    depth = np.asarray(alignment.depth)
    first = np.asarray(alignment.first)
    if depth.size < 2 * N_MEDIAN:
        return before, after
    deviation = depth - _running_median(depth)
    # Each height may be above or below, so there are two tests per height.
    threshold = noise_threshold(2 * depth.size, 1)
    # The steepest hundredth of the steps counts, because walls of pits and crests are rare but no specks.
    step = float(np.quantile(np.abs(np.diff(first)), WALL_QUANTILE)) / NORMAL_WALL
    step += 1.5 * alignment.noise
    # A jump is roughness if most of its neighbours jump too, as on a rough floor.
    jumps = np.abs(np.diff(depth, append=depth[-1]))
    steps = np.maximum(step, MAD_TO_DEVIATION * median_filter(jumps, N_AROUND, mode="nearest"))
    surfaces = (first, first - depth)
    profiles = (before, after)
    is_speck = [np.zeros(profile.x.size, bool) for profile in profiles]
    for low, high in find_runs(np.abs(deviation) > 3 * alignment.noise):
        around = slice(max(low - 1, 0), high + 2)
        sizes = np.abs(deviation[low : high + 1])
        height = float(sizes.max())
        at = low + int(np.argmax(sizes))
        is_wide = (sizes > height / 2).sum() > MAX_WIDTH or sizes.size > 3 * MAX_WIDTH
        if is_wide or height < threshold * float(alignment.noise_at[at]):
            continue
        walls = np.diff(depth[around])
        is_deep = bool(deviation[at] > 0)
        min_step = _min_edge_jump(alignment, at, height, float(steps[at]), is_deep=is_deep)
        if min(walls.max(), -walls.min()) < min_step:
            continue
        side = int(np.argmax([np.abs(np.diff(z[around])).max() for z in surfaces]))
        ends = [alignment.x[max(low - 1, 0)], alignment.x[min(high + 1, depth.size - 1)]]
        if side == 0:
            ends = [alignment.map_to_first(end) for end in ends]
        x = profiles[side].x
        margin = 0.5 * float(x[1] - x[0])
        is_speck[side] |= (x >= ends[0] - margin) & (x <= ends[1] + margin)
    return tuple(_mark_missing(profile, marked) for profile, marked in zip(profiles, is_speck))


def limit_left_out_wear(
    alignment: Alignment, section: Section, before: Profile, after: Profile, heights
) -> float:
    """Return the area [m2] of the dips of the second trace that were left out as specks.

    Parameters
    ----------
    alignment : Alignment
    section : Section
        Section of the same traces.
    before, after : Profile
        The traces that were aligned.
    heights : (n,) array [m]
        Heights of the second trace before any was left out.
    """
    is_dip = after.missing & np.isfinite(heights)
    is_dip &= (after.x > section.x[0]) & (after.x < section.x[-1])
    x = after.x[is_dip]
    known = ~after.missing
    aligned = np.interp(section.x, after.x[known], after.z[known])
    datum = np.interp(x, section.x, section.depth - alignment.first + aligned)
    first = np.interp(
        alignment.map_to_first(x), before.x[~before.missing], before.z[~before.missing]
    )
    counted = np.maximum(np.interp(x, section.x, section.depth), 0.0)
    lost = np.maximum(first + datum - heights[is_dip] - counted, 0.0)
    return float(lost.sum() * np.median(np.diff(after.x)))


def _min_edge_jump(
    alignment: Alignment, at: int, height: float, step: float, *, is_deep: bool
) -> float:
    """Return the smallest jump [m] at both edges that makes a peak or dip a speck.

    The jump is between neighbouring samples; height [m] is that of the peak or dip. step [m]: robust
    deviation of the differences of neighbouring heights around it.
    """
    depth = alignment.depth[at]
    first = alignment.first[at]
    if not is_deep:  # unworn heights between worn tops are not dust
        is_dust = depth < -height / 2
        return max(MIN_OUTSIDE_WALL * step, height / MAX_DUST_STEPS) if is_dust else float("inf")
    near = alignment.first[max(at - N_MEDIAN, 0) : at + N_MEDIAN + 1]
    is_top_of_first = first - float(np.median(near)) > height / 2
    if first - depth < near.min() - 3 * alignment.noise and not is_top_of_first:
        return max(MIN_OUTSIDE_WALL * step, height / MAX_DROPOUT_STEPS)
    return MIN_WALL * step


def _running_median(z) -> np.ndarray:
    padded = np.pad(z, N_MEDIAN // 2, "reflect")
    return np.median(np.lib.stride_tricks.sliding_window_view(padded, N_MEDIAN), axis=1)


def _mark_missing(profile: Profile, marked) -> Profile:
    """Mark heights (n,) bool of a trace as missing, with a note."""
    marked &= ~profile.missing
    if not marked.any():
        return profile
    count = len(find_runs(marked))
    places = f"{count} place" if count == 1 else f"{count} places"
    note = (
        f"{profile.source}: {places} with walls much steeper than the rest of the trace "
        f"(the first at x = {format_length(profile.x[np.argmax(marked)])}) {'is' if count == 1 else 'are'} taken as dust or "
        f"dropouts and left out, {marked.sum()} of {marked.size} heights with their neighbours; use --keep-spikes to "
        "keep them"
    )
    z = frozen_array(np.where(marked, np.nan, profile.z))
    return replace(profile, z=z, notes=(*profile.notes, note))
