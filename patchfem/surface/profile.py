"""Measured or simulated trace of heights, and its levelling, resampling and cleaning."""

from dataclasses import replace

import numpy as np

from ..core import PatchfemError, array_dataclass, frozen_array
from ..formatting import format_length

# Number of samples in the running median; groups of up to three samples can be spikes
MEDIAN_WINDOW_SAMPLES = 7
# Numbers of samples in the running medians that find wider specks of dust
SPECK_WINDOWS_SAMPLES = (15, 31)
# Smallest height of a spike in robust standard deviations; heights of rough surfaces stay within 6.
MIN_SPIKE_DEVIATIONS = 8.0
# Ratio of the standard deviation to the median absolute deviation of normal values.
MAD_TO_DEVIATION = 1.4826
# Number of medians that are computed at a time, which limits the memory
MEDIANS_PER_CHUNK = 131_072
# Largest number of samples in a resampled trace, which limits the memory
MAX_TRACE_SAMPLES = 2_097_152


@array_dataclass
class Profile:
    """Trace of a surface, which is straight between its samples.

    - x (n,): increasing positions [m].
    - z (n,): heights [m], or NaN where one was not measured.
    - source: name of the trace for messages.
    - notes: sentences on its treatment.
    """

    x: np.ndarray
    z: np.ndarray
    source: str
    notes: tuple[str, ...] = ()

    @property
    def missing(self) -> np.ndarray:
        """Mask (n,) of the samples without a measured height."""
        return np.isnan(self.z)

    @property
    def length(self) -> float:
        """Distance from the first to the last sample [m]."""
        return float(self.x[-1] - self.x[0])

    @property
    def step(self) -> float:
        """Mean distance of neighbouring samples [m]."""
        return measure_step(self.x)


def measure_step(axis: np.ndarray) -> float:
    """Return the mean distance [m] of neighbouring positions (n,) [m] along an axis."""
    return float(axis[-1] - axis[0]) / (axis.size - 1)


def resample_evenly(profile: Profile) -> Profile:
    """Resample a profile to a constant sampling interval, with gaps closed, for filters and spectra.

    Missing heights are bridged by straight lines. An uneven trace is resampled at the 10th
    percentile of its steps, so that nothing between its samples is lost. The notes state both.
    """
    profile = _bridge(profile, ~profile.missing)
    steps = np.diff(profile.x)
    # Largest relative range of the steps of an evenly sampled trace
    if np.ptp(steps) <= 1e-6 * steps.mean():
        return profile
    length = profile.length
    step = max(float(np.percentile(steps, 10)), length / MAX_TRACE_SAMPLES)
    x = np.linspace(profile.x[0], profile.x[-1], int(np.ceil(length / step * (1 - 1e-9))) + 1)
    note = (
        f"{profile.source}: samples lie {format_length(float(steps.min()))} to {format_length(float(steps.max()))} "
        f"apart; the trace is resampled at every {format_length(float(x[1] - x[0]))} by linear "
        "interpolation"
    )
    z = np.interp(x, profile.x, profile.z)
    return replace(profile, x=frozen_array(x), z=frozen_array(z), notes=(*profile.notes, note))


def _bridge(profile: Profile, usable, max_gap: float = np.inf) -> Profile:
    """Replace the heights of a profile that are not usable by straight lines between those that are.

    The profile then reaches from the first to the last usable height. If it has missing heights, a note counts them.

    Parameters
    ----------
    profile : Profile
        Profile with n heights.
    usable : (n,) array of bool
        Whether a height is kept.
    max_gap : float
        Longest line [m].

    Raises
    ------
    PatchfemError
        If there are fewer than two usable heights, or if a line would be longer than `max_gap`.
    """
    places = profile.x[usable]
    if places.size < 2:
        raise PatchfemError(
            f"{profile.source}: {places.size} usable heights; a trace needs at least two"
        )
    if usable.all():
        return profile

    # A gap reaches from one usable height to the next.
    gaps = np.where(np.diff(np.flatnonzero(usable)) > 1, np.diff(places), 0.0)
    first = int(np.argmax(gaps))
    longest = float(gaps[first])
    if longest > max_gap * (1 + 1e-9):
        raise PatchfemError(
            f"{profile.source}: no usable height between x = {format_length(places[first])} and "
            f"{format_length(places[first + 1])}, and a straight line may bridge at most {format_length(max_gap)}; "
            "measure this part of the trace anew or use a larger contact.element_size"
        )

    notes = profile.notes
    if profile.missing.any():
        notes += (
            f"{profile.source}: {profile.missing.sum()} of {profile.z.size} heights are missing; the gaps are bridged "
            f"by straight lines, of which the longest spans {format_length(longest)}",
        )
    x = profile.x[(profile.x >= places[0]) & (profile.x <= places[-1])]
    z = np.interp(x, places, profile.z[usable])
    return replace(profile, x=frozen_array(x), z=frozen_array(z), notes=notes)


def clean(profile: Profile, max_gap: float) -> Profile:
    """Bridge spikes and missing heights by straight lines, and cut off missing ends.

    The notes of the new trace count the spikes and the missing heights.

    Parameters
    ----------
    profile : Profile
        Measured trace.
    max_gap : float
        Longest distance [m] between good samples that a line may bridge.

    Raises
    ------
    PatchfemError
        For a longer gap, and for fewer than two good heights.
    """
    is_spike = find_spikes(profile)
    if is_spike.any():
        note = (
            f"{profile.source}: {is_spike.sum()} of {profile.x.size} heights are spikes (the first "
            f"at x = {format_length(profile.x[np.argmax(is_spike)])}), which lie more than "
            f"{MIN_SPIKE_DEVIATIONS:g} robust standard deviations from the median of {MEDIAN_WINDOW_SAMPLES} samples; "
            "straight lines replace these heights"
        )
        profile = replace(profile, notes=(*profile.notes, note))
    return _bridge(profile, ~(profile.missing | is_spike), max_gap)


def _compare_with_neighbours(z, window: int, floor: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Compare heights (n,) with their running median.

    Parameters
    ----------
    z : (n,) array [m]
        Heights without gaps.
    window : int
        Number of samples of the median; those at an end have the first or the last window.
    floor : float
        Smallest median absolute deviation [m].

    Returns
    -------
    distance, deviation : (n,) array [m]
        Distance from the median, and the standard deviation that follows from the median absolute deviation in the
        window, at least that of a typical window.
    """
    windows = np.lib.stride_tricks.sliding_window_view(z, window)
    median = np.empty(len(windows))
    spread = np.empty(len(windows))
    for start in range(0, len(windows), MEDIANS_PER_CHUNK):
        part = slice(start, start + MEDIANS_PER_CHUNK)
        median[part] = np.median(windows[part], axis=1)
        spread[part] = np.median(np.abs(windows[part] - median[part, None]), axis=1)
    place = np.clip(np.arange(z.size) - window // 2, 0, z.size - window)
    deviation = MAD_TO_DEVIATION * np.maximum(spread, max(float(np.median(spread)), floor))
    return z - median[place], deviation[place]


def find_spikes(profile: Profile) -> np.ndarray:
    """Return a mask (n,) of heights of a profile far from the median of their neighbours.

    The standard deviation is 1.4826 times the largest of the median absolute deviation in the
    window, its median over all windows, and the smallest step between two heights (coarse digits).
    A feature of more than half the window stays. Hampel, J. Am. Stat. Assoc. 69 (1974) 383.
    """
    is_spike = np.zeros(profile.x.size, bool)
    known = np.flatnonzero(~profile.missing)
    if known.size < MEDIAN_WINDOW_SAMPLES:
        return is_spike
    z = profile.z[known]
    digit = np.diff(np.unique(z)).min(initial=np.ptp(z))
    distance, deviation = _compare_with_neighbours(z, MEDIAN_WINDOW_SAMPLES, digit)
    is_spike[known] = np.abs(distance) > MIN_SPIKE_DEVIATIONS * deviation
    return is_spike


def remove_spikes(profile: Profile) -> Profile:
    """Mark spikes, dropouts and specks of dust of a profile as not measured.

    Spikes and dropouts are those of `find_spikes`. A speck stands as far above the median of 15 or 31
    samples, and both of its walls are as many deviations steeper than the steps of the trace. A
    hollow as wide stays, as it may be a scratch.
    """
    known = np.flatnonzero(~profile.missing)
    if known.size < max(SPECK_WINDOWS_SAMPLES):
        return profile
    z = profile.z[known]
    is_spike = find_spikes(profile)[known]
    min_wall = MIN_SPIKE_DEVIATIONS * robust_deviation(z[2:] - z[:-2]) / 2

    # A group goes with one sample on each side, which its flank may touch.
    removed = is_spike.copy()
    for window in (MEDIAN_WINDOW_SAMPLES, *SPECK_WINDOWS_SAMPLES):
        distance, deviation = _compare_with_neighbours(z, window)
        # Height in robust standard deviations down to which a speck is removed, so that its foot
        # goes with it.
        for first, last in find_runs(np.abs(distance) > 3.0 * deviation):
            group = slice(first, last + 1)
            walls = np.diff(z[max(first - 2, 0) : last + 3])
            has_walls = min(walls.max(initial=0.0), -walls.min(initial=0.0)) > min_wall
            is_high = distance[group].max() > MIN_SPIKE_DEVIATIONS * deviation[group].max()
            is_speck = is_high and has_walls and last - first < window // 2
            if is_speck or is_spike[group].any():
                removed[max(first - 1, 0) : last + 2] = True

    if not removed.any():
        return profile
    heights = np.array(profile.z)
    heights[known[removed]] = np.nan
    return replace(profile, z=frozen_array(heights))


def robust_deviation(values) -> float:
    """Estimate the standard deviation of values about zero from their median absolute value."""
    return MAD_TO_DEVIATION * float(np.median(np.abs(values)))


def find_runs(flags) -> list[tuple[int, int]]:
    """Return the first and the last index of each run of true values in `flags` (n,)."""
    changes = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(np.int8), [0]])))
    return [(first, stop - 1) for first, stop in changes.reshape(-1, 2).tolist()]
