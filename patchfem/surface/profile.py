"""One measured or made trace of heights, and the levelling and cleaning that every trace goes through first."""

from dataclasses import dataclass, replace

import numpy as np

from ..core import PatchfemError, frozen_array, say

WINDOW = 7  # samples of the running median; what is three samples wide or less can be a spike
SPIKE = 8.0  # robust standard deviations from the running median
WIDE, FOOT = (15, 31), 3.0  # samples of the medians that wider specks stand above; deviations at which their feet end
_BLOCK = 1 << 17  # windows sorted at a time
_MOST = 1 << 21  # samples of an evened trace


@dataclass(frozen=True, eq=False, slots=True)
class Profile:
    """A trace of heights z (n,) [m], NaN where none was measured, at increasing x (n,) [m]; straight lines between
    them.

    source: a name of the trace for messages; notes: what was done to it on the way, one sentence each, for the
    warnings.
    """

    x: np.ndarray
    z: np.ndarray
    source: str
    notes: tuple = ()

    @property
    def missing(self) -> np.ndarray:
        """Whether no height was measured at each sample, (n,) bool."""
        return np.isnan(self.z)

    @property
    def length(self) -> float:
        """Distance from the first to the last sample [m]."""
        return float(self.x[-1] - self.x[0])


def level(profile: Profile) -> Profile:
    """Level a trace: its least-squares line over the measured samples, which all count alike, is subtracted."""
    there = ~profile.missing
    x, z = profile.x, profile.z
    if there.sum() < 2:
        return replace(profile, z=frozen_array(z - z[there].mean() if there.any() else z))
    s = (x - x[there].mean()) / profile.length
    z = z - z[there].mean()
    return replace(profile, z=frozen_array(z - s * (s[there] @ z[there] / (s[there] @ s[there]))))


def even(profile: Profile) -> Profile:
    """A trace without gaps on an even step, which filter and spectrum want; the notes tell what that took.

    A trace that is even and whole comes back as it is. Missing heights are bridged by straight lines. An uneven trace
    is read off along its straight lines at its 10th percentile step, so that nothing between its samples is lost.
    """
    there, steps = ~profile.missing, np.diff(profile.x)
    whole, regular = bool(there.all()), bool(np.ptp(steps) <= 1e-6 * steps.mean())
    if whole and regular:
        return profile
    known, heights = profile.x[there], profile.z[there]
    if known.size < 2:
        raise PatchfemError(f"{profile.source}: {known.size} heights; a trace needs at least two")
    x, notes = profile.x[(profile.x >= known[0]) & (profile.x <= known[-1])], profile.notes
    if not whole:
        notes += (f"{profile.source}: {(~there).sum()} of {there.size} heights are missing; the gaps are bridged by "
                  f"straight lines, of which the longest spans {say(float(np.diff(known).max()))}",)
    if not regular:
        step = max(float(np.percentile(steps, 10)), float(x[-1] - x[0]) / _MOST)
        count = int(np.ceil((x[-1] - x[0]) / step * (1 - 1e-9))) + 1
        x = np.linspace(x[0], x[-1], count)
        notes += (f"{profile.source}: samples lie {say(float(steps.min()))} to {say(float(steps.max()))} apart; the "
                  f"trace is resampled at every {say(float(x[1] - x[0]))} by linear interpolation",)
    return replace(profile, x=frozen_array(x), z=frozen_array(np.interp(x, known, heights)), notes=notes)


def cleaned(profile: Profile, longest: float) -> Profile:
    """Clean a trace of spikes (`spikes`) and missing heights.

    Straight lines stand in their place; missing ends are cut off. longest: the distance that a line may bridge [m],
    from one good sample to the next, such as two elements. The notes tell the counts. PatchfemError where a run is
    longer or fewer than two heights are left.
    """
    lost = profile.missing
    peaked = spikes(profile)
    bad = lost | peaked
    good = np.flatnonzero(~bad)
    if good.size < 2:
        raise PatchfemError(f"{profile.source}: {good.size} usable heights; a trace needs at least two")
    if good.size == bad.size:
        return profile
    x = profile.x[good]
    bridged = np.where(np.diff(good) > 1, np.diff(x), 0.0)
    worst = int(np.argmax(bridged))
    if bridged[worst] > longest * (1 + 1e-9):
        raise PatchfemError(
            f"{profile.source}: no usable height between x = {say(x[worst])} and {say(x[worst + 1])}, and a straight "
            f"line may bridge at most {say(longest)}; measure this part of the trace anew or use a larger "
            "contact.element_size")
    keep = slice(good[0], good[-1] + 1)
    z = np.interp(profile.x[keep], x, profile.z[good])
    notes = tuple(_counts(profile, lost, peaked, float(bridged[worst])))
    return replace(profile, x=frozen_array(profile.x[keep]), z=frozen_array(z), notes=profile.notes + notes)


def _counts(profile: Profile, lost, peaked, widest: float):
    n, name = profile.x.size, profile.source
    if peaked.any():
        first = profile.x[np.argmax(peaked)]
        yield (f"{name}: {peaked.sum()} of {n} heights are spikes (the first at x = {say(first)}), which lie more than "
               f"{SPIKE:g} robust standard deviations from the median of {WINDOW} samples; straight lines replace "
               "these heights")
    if lost.any():
        yield (f"{name}: {lost.sum()} of {n} heights are missing; the gaps are bridged by straight lines, of which the "
               f"longest spans {say(widest)}")


def spikes(profile: Profile) -> np.ndarray:
    """Spikes of a trace, (n,) bool: heights more than SPIKE robust standard deviations off the median around them.

    The median is that of WINDOW samples. The standard deviation is 1.4826 times the largest of: the median deviation
    inside the window, its median over all windows, and the smallest step between two heights (coarse digits). A feature
    of more than half the window stays. Hampel, J. Am. Stat. Assoc. 69 (1974) 383.
    """
    out, there = np.zeros(profile.x.size, bool), np.flatnonzero(~profile.missing)
    if there.size < WINDOW:
        return out
    z = profile.z[there]
    middle, spread = _running(z)
    place = np.clip(np.arange(z.size) - WINDOW // 2, 0, z.size - WINDOW)
    off = np.abs(z - middle[place])
    digits = np.diff(np.unique(z)).min(initial=np.inf)
    scale = np.maximum(spread[place], max(float(np.median(spread)), digits if np.isfinite(digits) else 0.0))
    out[there] = off > SPIKE * 1.4826 * scale
    return out


def despiked(profile: Profile) -> Profile:
    """A trace without its spikes, dropouts and specks of dust: they count as not measured, and a note tells how many.

    Spikes and dropouts are those of `spikes`. A speck stands as far above the median of 15 or 31 samples, and both of
    its walls are as many deviations steeper than the steps of the trace: up to 15 samples wide. A hollow as wide is
    none: a scratch may look so. All are left out with their feet, down to 3 deviations.
    """
    there = np.flatnonzero(~profile.missing)
    if there.size < max(WIDE):
        return profile
    z, struck = profile.z[there], spikes(profile)[there]
    step = np.abs(z[2:] - z[:-2])
    steep = SPIKE * 1.4826 * float(np.median(step))
    out = np.zeros(z.size, bool)
    for window in (WINDOW, *WIDE):
        middle, spread = _running(z, window)
        place = np.clip(np.arange(z.size) - window // 2, 0, z.size - window)
        off = z - middle[place]
        scale = 1.4826 * np.maximum(spread[place], float(np.median(spread)))
        for first, last in runs_of(np.abs(off) > FOOT * scale):
            low, high = max(first - 2, 0), min(last + 3, z.size)
            walls = np.diff(z[low:high])
            speck = off[first:last + 1].max() > SPIKE * scale[first:last + 1].max() and last - first < window // 2 \
                and walls.max(initial=0.0) > steep / 2 and -walls.min(initial=0.0) > steep / 2
            if struck[first:last + 1].any() or speck:
                out[max(first - 1, 0):last + 2] = True
    out |= struck
    if not out.any():
        return profile
    heights = np.array(profile.z)
    heights[there[out]] = np.nan
    count = len(runs_of(out))
    note = (f"{profile.source}: spikes, dropouts or dust at {count} place{'s' * (count > 1)} (the first at x = "
            f"{say(profile.x[there[np.argmax(out)]])}) are left out, {out.sum()} of {z.size} heights with their "
            "neighbours; use --keep-spikes to keep them")
    return replace(profile, z=frozen_array(heights), notes=(*profile.notes, note))


def runs_of(flags) -> list:
    """First and last index of each run of true flags (n,)."""
    change = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(np.int8), [0]])))
    return list(zip(change[::2].tolist(), (change[1::2] - 1).tolist()))


def _running(z, window: int = WINDOW) -> tuple:
    """Median and median deviation of every full window."""
    windows, half = np.lib.stride_tricks.sliding_window_view(z, window), window // 2
    middle, spread = np.empty(len(windows)), np.empty(len(windows))
    for start in range(0, len(windows), _BLOCK):
        part = slice(start, start + _BLOCK)
        middle[part] = np.partition(windows[part], half, axis=1)[:, half]
        spread[part] = np.partition(np.abs(windows[part] - middle[part, None]), half, axis=1)[:, half]
    return middle, spread
