"""Gap of a measured profile."""

from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..core import PatchfemError, frozen_array
from ..exceptions import UnresolvedTrace
from ..formatting import format_length
from ..surface.areal import level
from ..surface.files.read import read_profile
from ..surface.nodes import MEANS_OVER_WAVES_NOTE, average_at_nodes, place_over_patch
from ..surface.profile import Profile, clean, resample_evenly
from ..surface.roughness.filter import mean_line
from ..surface.spectrum import MIN_ELEMENTS_PER_WAVE, describe_lost_waves, wave_spectrum
from .source import cache_by_file, name_key

CURVE_POINTS_PER_CELL = 16  # number of line segments per cell that represent a smooth profile


class _LevelledProfile(NamedTuple):
    """Levelled profile over the interface, constant beyond its ends.

    `is_straight` tells that levelling leaves nothing of it; `notes` are sentences for the user.
    """

    profile: Profile
    notes: tuple[str, ...]
    is_straight: bool


def compute_profile_gap(
    path: Path,
    x,
    lengths: tuple[float | None, float | None],
    cell: float,
    *,
    is_rough: bool,
    is_material: bool = False,
) -> tuple[np.ndarray, tuple[str, ...]]:
    """Return the gap that a measured profile adds, and notes for the user.

    The profile is levelled and freed of spikes. A smooth curve goes through its means over
    the average length, or through its samples without an average; each node takes the mean of the
    curve over its cells. The smallest gap, where flat pieces touch first, is 0.

    Parameters
    ----------
    path : Path
        File to read.
    x : (m,) ndarray
        Coordinates of the nodes [m].
    lengths : gap.ProfileLengths
        Lengths (average, limit) [m]. `average` is that of the means, None for the samples themselves. `limit` is the
        length of cells than which too much of the heights must not be finer, 0 for the longest cell between the nodes,
        None for no limit.
    cell : float
        Cell length [m] of an even mesh; it limits how much of the trace may be missing.
    is_rough : bool
        Whether asperities represent the waves shorter than ``MIN_ELEMENTS_PER_WAVE`` average lengths.
        The curve is then the waviness for this cut-off.
    is_material : bool
        Whether the heights are those of a surface: a peak of either piece closes the gap.

    Returns
    -------
    gap : (m,) ndarray
        [m]
    notes : tuple of str

    Raises
    ------
    UnresolvedTrace
        If too much of the profile is finer than the limit.
    PatchfemError
        If the cut-off is longer than the interface.
    """
    average, limit = lengths
    # The trace may lack no more than about the length over which it is averaged.
    resolution = average or cell
    if is_rough:
        resolution = min(average, cell)
    trace, notes, is_straight = level_profile(path, x, resolution, is_material=is_material)

    # A trace with too much of its height in waves that the cells do not resolve is refused.
    if limit is not None and not is_straight:
        lost_waves = describe_lost_waves(trace, limit or float(np.diff(x).max()))
        if lost_waves is not None:
            raise UnresolvedTrace(lost_waves, "contact.profile.file")

    # The asperities represent the waves below the cut-off, so that the waviness above it is the gap.
    if is_rough:
        cutoff = MIN_ELEMENTS_PER_WAVE * average
        shape = _filter_waviness(trace, cutoff)
        if not is_straight:
            notes = (*notes, *_describe_short_waves(trace, cutoff))
        return average_at_nodes(shape, x) - shape.z.min(), notes

    # Without a length for means, the curve is the spline through all samples.
    if average is None:
        heights = average_at_nodes(trace, x, _fit_spline(trace).antiderivative())
        return heights - heights.min(), notes

    # Otherwise it is the spline through means over this length. If the nodes have this spacing, they take the means
    # themselves.
    nodes = x
    curve = trace
    if not _is_evenly_spaced(x, average):
        n_means = max(2, round(float(x[-1] - x[0]) / average) + 1)
        nodes = np.linspace(x[0], x[-1], n_means)
        curve = _smooth_profile(trace, nodes)
    return average_at_nodes(curve, x) - average_at_nodes(trace, nodes).min(), notes


def read_trace(path: Path) -> Profile:
    """Read the trace in the file `path`, with its heights unchanged.

    A PatchfemError names the key of the file.
    """
    with name_key("contact.profile.file"):
        return _read_profile(path)


def find_sample_spacing(path: Path) -> float:
    """Return the median distance [m] between samples of the trace in the file `path`."""
    return float(np.median(np.diff(read_trace(path).x)))


def _filter_waviness(trace: Profile, cutoff: float) -> Profile:
    """Return the waves of a trace that are longer than `cutoff` [m], extended to the ends of the trace."""
    if cutoff >= trace.length:
        raise PatchfemError(
            f"{format_length(cutoff)} is longer than the patch ({format_length(trace.length)}), so no "
            "wave would remain in the profile; take a shorter cut-off, or leave [contact.profile] out",
            "contact.asperities.cutoff",
        )
    samples = resample_evenly(trace)
    # Smallest number of samples per cut-off with which a trace is filtered
    n_samples = int(np.ceil(16 * samples.length / cutoff)) + 1
    x = np.linspace(samples.x[0], samples.x[-1], max(samples.x.size, n_samples))
    samples_per_cutoff = cutoff * (x.size - 1) / samples.length
    line = mean_line(np.interp(x, samples.x, samples.z), samples_per_cutoff)
    return replace(trace, x=frozen_array(x), z=frozen_array(line), notes=())


def list_short_wave_heights(path: Path, x, cutoff: float, *, is_material: bool) -> np.ndarray:
    """Return the heights (k,) [m] of the waves of a profile shorter than a cut-off; larger heights are more material.

    Parameters
    ----------
    path : Path
        File to read.
    x : (m,) ndarray
        Coordinates [m] whose ends are those of the interface.
    cutoff : float
        Cut-off [m]; longer waves are the shape of the gap (`compute_profile_gap`).
    is_material : bool
        Whether the heights in the file are those of a surface, and not of the gap.
    """
    cell = min(cutoff / MIN_ELEMENTS_PER_WAVE, float(x[-1] - x[0]))
    trace = level_profile(path, x, cell, is_material=is_material).profile
    waves = _filter_waviness(trace, cutoff)
    return waves.z - np.interp(waves.x, trace.x, trace.z)


def _describe_short_waves(trace: Profile, cutoff: float) -> tuple[str, ...]:
    """Return sentences about the waves of a trace shorter than `cutoff` [m], or () if there are none."""
    fraction = wave_spectrum(trace).lost_fraction(cutoff)
    if not fraction > 0:
        return ()
    return (
        f"{trace.source}: waves longer than {format_length(cutoff)} give the shape of the gap; the shorter "
        f"waves ({100 * fraction:.2g} % of the rms height) are represented by [contact.asperities], whose "
        "key `cutoff` sets this limit",
        f"{trace.source}: pressure_peak and contact_fraction are {MEANS_OVER_WAVES_NOTE} shorter than "
        f"{format_length(cutoff)}; the real contacts are smaller, and their pressure is higher",
    )


def level_profile(path: Path, x, cell: float, *, is_material: bool) -> _LevelledProfile:
    """Read a profile from a file, and subtract its least-squares line over an interface.

    Parameters
    ----------
    path : Path
        File to read.
    x : (m,) ndarray
        Coordinates of the nodes [m].
    cell : float
        Length [m]; half of it may be missing at either end, and twice of it in between.
    is_material : bool
        Whether the heights are those of a surface.

    Returns
    -------
    _LevelledProfile
    """
    length = float(x[-1] - x[0])
    nodes = np.linspace(x[0], x[-1], max(1, round(length / cell)) + 1)
    raw = _read_without_spikes(path, nodes, 2 * cell)
    # Here larger heights are a wider gap, so that the heights of a surface change their sign.
    if is_material:
        raw = replace(raw, z=frozen_array(-raw.z))
    trace = level(raw)

    # A slope that was subtracted may have been a tilt that the user meant.
    slope = float(np.polyfit(raw.x, raw.z - trace.z, 1)[0])
    notes = trace.notes
    # Ratio (removed slope x length of the trace) / (range of the heights) above which a note
    # reports the slope.
    if abs(slope) * trace.length > 1e-2 * np.ptp(trace.z):
        notes = (
            *notes,
            f"{trace.source}: the slope of {slope:.3g} rad was subtracted from the heights; to include a "
            "tilt, give [contact.tilt]",
        )
    # Deviations below 1e-10 m, or 1e-5 of the range, are round-off of a straight line
    is_straight = np.std(trace.z) <= max(1e-10, 1e-5 * np.ptp(raw.z))

    # Beyond its ends the trace is continued at constant height.
    n_before = int(trace.x[0] > x[0])
    n_after = int(trace.x[-1] < x[-1])
    places = np.concatenate([x[:n_before], trace.x, x[x.size - n_after :]])
    heights = np.pad(trace.z, (n_before, n_after), mode="edge")
    trace = replace(trace, x=frozen_array(places), z=frozen_array(heights))
    return _LevelledProfile(trace, notes, bool(is_straight))


def _is_evenly_spaced(x, size: float) -> bool:
    """Return whether the nodes x (m,) [m] are evenly spaced by a size [m]."""
    # Largest difference of equal node spacings, as a fraction of the interface length.
    is_uniform = np.ptp(np.diff(x)) <= 1e-9 * np.ptp(x)
    # Largest relative difference of the node spacing from the averaging length
    return is_uniform and abs(x[1] - x[0] - size) <= 1e-2 * size


def _fit_spline(trace: Profile):
    """Return the natural cubic spline through the heights of a trace."""
    from scipy.interpolate import CubicSpline

    return CubicSpline(trace.x, trace.z, bc_type="natural")


def _smooth_profile(trace: Profile, nodes) -> Profile:
    """Return the cubic spline through local means of a trace at evenly spaced nodes (k,) [m]."""
    n_points = CURVE_POINTS_PER_CELL * (nodes.size - 1) + 1
    x = np.interp(np.arange(n_points) / CURVE_POINTS_PER_CELL, np.arange(nodes.size), nodes)
    means = replace(trace, x=frozen_array(nodes), z=average_at_nodes(trace, nodes))
    return replace(trace, x=frozen_array(x), z=frozen_array(_fit_spline(means)(x)), notes=())


def _read_without_spikes(path: Path, x, max_gap: float) -> Profile:
    """Read the trace in the file `path`, remove spikes and interpolate gaps up to `max_gap` [m].

    The trace is placed over the nodes x (m,) [m], and must cover them.
    """
    with name_key("contact.profile.file"):
        return clean(place_over_patch(read_trace(path), x), max_gap)


_read_profile = cache_by_file(read_profile)
