"""A measured profile as its share of the gap."""

from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from ..core import PatchfemError, frozen_array, say
from ..surface.files.read import read_profile
from ..surface.fine import ELEMENTS_PER_WAVE, describe_lost_waves, fine_fraction
from ..surface.nodes import average_at_nodes, place_over_patch
from ..surface.profile import Profile, clean, even, level
from ..surface.roughness.filter import mean_line

SPLIT = 16  # straight pieces of a cell of a smooth profile
NOISE = 1e-10  # m: heights below it are digits
CELLS = 200  # of an even mesh over the interface
DENSE = 16  # samples of a cut-off at least, on which a trace is filtered


def profile_gap(path: Path, x, lengths: tuple, rough: bool, material: bool = False) -> tuple:
    """Gap (m,) [m] that a profile in a file adds at the nodes x (m,) [m], and notes for the user.

    The profile is levelled and freed of spikes. lengths: (average, limit) [m]. It is averaged over `average` and a
    smooth curve goes through the means, or, where that is None, through the samples of the file; every node sees the
    mean of the curve over its own cells. limit: cells that too much of the heights may not be finer than, 0: those of
    the nodes, None: all may. The gap counts from its least, where flat pieces touch first. rough: asperities stand for
    the waves shorter than ELEMENTS_PER_WAVE times `average`, and the curve is the waviness of this cut-off; material:
    heights of a surface, on either piece measured outwards, so that a peak closes the gap. PatchfemError where too
    much of the profile is finer than `limit`, or the cut-off longer than the interface.
    """
    average, limit = lengths
    cell = float(x[-1] - x[0]) / CELLS
    trace, notes, straight = _levelled(
        path, x, min(average, cell) if rough else average or cell, material
    )
    if (
        limit is not None
        and not straight
        and (said := describe_lost_waves(trace, limit or float(np.diff(x).max()))) is not None
    ):
        raise PatchfemError(said, "contact.profile.file")
    if rough:
        shape, said = _waviness(trace, ELEMENTS_PER_WAVE * average)
        return average_at_nodes(shape, x) - shape.z.min(), notes if straight else (*notes, *said)
    if average is None:
        heights = average_at_nodes(trace, x, _curve(trace).antiderivative())
        return heights - heights.min(), notes
    places, shape = x, trace
    if not _even(x, average):
        places = np.linspace(x[0], x[-1], max(2, round(float(x[-1] - x[0]) / average) + 1))
        shape = _smooth(trace, places)
    return average_at_nodes(shape, x) - average_at_nodes(trace, places).min(), notes


def _waviness(trace: Profile, cutoff: float) -> tuple:
    """The waves of a trace longer than a cut-off [m], whole to its ends, and a sentence, as a tuple, where it has
    shorter ones."""
    if cutoff >= trace.length:
        raise PatchfemError(
            f"{say(cutoff)} is longer than the patch ({say(trace.length)}), so no wave would remain in "
            "the profile; take a shorter cut-off, or leave [contact.profile] out",
            "contact.asperities.cutoff",
        )
    same = even(trace)
    x = np.linspace(
        same.x[0], same.x[-1], max(same.x.size, int(np.ceil(DENSE * same.length / cutoff)) + 1)
    )
    line = mean_line(np.interp(x, same.x, same.z), cutoff * (x.size - 1) / same.length, tilted=True)
    share = fine_fraction(trace, cutoff)
    said = (
        (
            f"{trace.source}: waves longer than {say(cutoff)} give the shape of the gap; the shorter waves "
            f"({100 * share:.2g} % of the rms height) are represented by [contact.asperities], whose key `cutoff` sets "
            "this limit",
        )
        if share > 0
        else ()
    )
    return replace(trace, x=frozen_array(x), z=frozen_array(line), notes=()), said


def _levelled(path: Path, x, cell: float, material: bool) -> tuple:
    """The levelled Profile of a file over the nodes x (m,) [m], flat beyond its ends, notes for the user, and whether
    it is what levelling leaves of a straight line. cell [m]: half of it may lack at either end, two in between."""
    long = float(x[-1] - x[0])
    whole = _whole(path, np.linspace(x[0], x[-1], max(1, round(long / cell)) + 1), 2 * cell)
    if material:
        whole = replace(whole, z=frozen_array(-whole.z))
    trace = level(whole)
    slope, notes = float(np.polyfit(whole.x, whole.z - trace.z, 1)[0]), trace.notes
    if abs(slope) * trace.length > 1e-2 * np.ptp(trace.z):
        notes = (
            *notes,
            f"{trace.source}: the slope of {slope:.3g} rad was subtracted from the heights; to include a "
            "tilt, give [contact.tilt]",
        )
    straight = bool(np.std(trace.z) <= max(NOISE, 1e-5 * np.ptp(whole.z)))
    before, after = int(trace.x[0] > x[0]), int(trace.x[-1] < x[-1])
    places = np.concatenate([x[:1][:before], trace.x, x[-1:][:after]])
    heights = np.concatenate([trace.z[:1][:before], trace.z, trace.z[-1:][:after]])
    return replace(trace, x=frozen_array(places), z=frozen_array(heights)), notes, straight


def _even(x, size: float) -> bool:
    """Whether the nodes x (m,) [m] are as far apart as `size` [m] says."""
    return np.ptp(np.diff(x)) <= 1e-9 * np.ptp(x) and abs(x[1] - x[0] - size) <= 1e-2 * size


def _curve(trace: Profile):
    """The cubic spline through the heights of a trace."""
    from scipy.interpolate import CubicSpline

    return CubicSpline(trace.x, trace.z, bc_type="natural")


def _smooth(trace: Profile, even) -> Profile:
    """The cubic spline through the means of a trace over even nodes (k,) [m], SPLIT points a cell."""
    fine = np.interp(np.arange(SPLIT * (even.size - 1) + 1) / SPLIT, np.arange(even.size), even)
    heights = _curve(replace(trace, x=frozen_array(even), z=average_at_nodes(trace, even)))(fine)
    return replace(trace, x=frozen_array(fine), z=frozen_array(heights), notes=())


def trace_of(path: Path) -> Profile:
    """The trace in a file, heights as they stand there; a file is read once. PatchfemError with the key of the file."""
    stamp = path.stat().st_mtime_ns if path.exists() else 0
    try:
        return _read(path, stamp)
    except PatchfemError as error:
        raise type(error)(str(error), "contact.profile.file") from None


def spacing_of(path: Path) -> float:
    """Distance [m] between most samples of the trace in a file."""
    return float(np.median(np.diff(trace_of(path).x)))


def _whole(path: Path, x, longest: float) -> Profile:
    """The clean part of a trace over the nodes; a line may bridge `longest` [m]."""
    found = trace_of(path)
    try:
        return clean(place_over_patch(found, x), longest)
    except PatchfemError as error:
        raise type(error)(str(error), error.key or "contact.profile.file") from None


@lru_cache(maxsize=4)
def _read(path, stamp):
    return read_profile(path)
