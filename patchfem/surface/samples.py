"""Checks of samples from a file: finite and plausible, with increasing x."""

from typing import NamedTuple

import numpy as np

from ..core import PatchfemError, frozen_array
from ..formatting import format_length
from .profile import Profile

MAX_LENGTH = 10.0  # length [m] above which a trace or a coordinate has a wrong unit
MIN_LENGTH = 1e-9  # length [m] below which a trace has a wrong unit
ATOM_WIDTH = 1e-10  # span of heights [m] below which they have a wrong unit
OUTLIER_FRACTION = 0.01  # fraction of the heights at either end that may be measurement faults
# Smallest number of positions that shows whether they are even apart from rounding.
MIN_ROUNDED = 10
# Largest distance of a position from the fitted line in printed digits, half of which is rounding.
MAX_ROUNDING = 0.75
DIGIT_TOL = 1e-4  # largest deviation from a multiple of a digit, relative to it, that is round-off
METRES_NOTE = "in the file, heights and length are in metres"  # sentence on the origin of the units
GIVEN_UNITS_NOTE = "heights and length were read in the given units"


class Places(NamedTuple):
    """Positions x (n,) of samples in the unit of the file, with notes."""

    x: np.ndarray
    notes: tuple = ()


def make_trace(path, x, z, lines, factors: tuple, stated: str = "") -> Profile:
    """Convert samples of a file to a trace with increasing positions.

    Its notes state every change of the samples.

    Parameters
    ----------
    path : Path
        For messages.
    x, z : (n,) arrays
        In the units of the file.
    lines : (n,) array or None
        Line of each sample in the file.
    factors : tuple
        Factors of x and z to metres.
    stated : str
        Who states the units, METRES_NOTE or GIVEN_UNITS_NOTE.

    Returns
    -------
    Profile
    """
    require_finite(path, (x, z), ("x", "z"), lines, factors)
    if x[-1] < x[0]:
        x = x[::-1]
        z = z[::-1]
        lines = None if lines is None else lines[::-1]
    x, notes = undo_rounding(path, x, factors[0])
    _require_increasing(path, x, lines, factors[0])
    x, z, more = _merge_equal_places(path, x, z, lines)
    x = x * factors[0]
    z = z * factors[1]
    notes = (*notes, *more, *check_span(path, x, z, stated))
    return Profile(frozen_array(x), frozen_array(z), str(path), notes)


def require_finite(path, columns: tuple, names: tuple, lines, factors: tuple) -> None:
    """Raise PatchfemError if a column contains values that are non-finite or too large.

    A height z may be NaN.

    Parameters
    ----------
    path : Path
        For messages.
    columns : tuple of (n,) arrays
        In the units of the file.
    names : tuple of str
    lines : (n,) array or None
        Line of each sample in the file.
    factors : tuple
        Factors of the columns to metres.
    """
    if names[-1] == "z" and np.isfinite(columns[-1]).sum() < 2:
        raise PatchfemError(
            f"{path}: {np.isfinite(columns[-1]).sum()} heights; a trace needs at least two"
        )
    for name, values in zip(names, columns):
        is_bad = np.isinf(values) if name == "z" else ~np.isfinite(values)
        if is_bad.any():
            first = int(np.argmax(is_bad))
            raise PatchfemError(
                f"{_sample_place(path, lines, first)}: {name} is {values[first]:g}; finite numbers "
                "are needed"
            )
    for name, values, factor in zip(names, columns, factors):
        largest = int(np.nanargmax(np.abs(values)))
        if abs(values[largest]) > MAX_LENGTH / factor:
            raise PatchfemError(
                f"{_sample_place(path, lines, largest)}: {name} is "
                f"{float(values[largest]) * factor:.4g} m; is the unit right? write a missing "
                "height as nan"
            )


def _sample_place(path, lines, number: int) -> str:
    return f"{path}: sample {number + 1}" if lines is None else f"{path}:{lines[number]}"


def undo_rounding(path, x, factor: float, name: str = "x") -> Places:
    """Replace positions by equally spaced ones if they differ from these only by rounding.

    A step of 0.15625 um printed to 0.1 um makes the slopes 14 % too large.

    Parameters
    ----------
    path : Path
        For messages.
    x : (n,) array
        Places in the unit of the file.
    factor : float
        To metres.
    name : str

    Returns
    -------
    Places
    """
    if x.size < MIN_ROUNDED or not x[-1] > x[0]:
        return Places(x)
    count = np.arange(x.size) - (x.size - 1) / 2
    step = float(count @ x / (count @ count))
    even = float(x.mean()) + step * count
    distance = float(np.abs(x - even).max())
    if not distance > 1e-6 * step > 0:
        return Places(x)
    digit = printed_digit(x)
    if distance > MAX_ROUNDING * digit:
        return Places(x)
    note = (
        f"{path}: {name} is rounded to {format_length(digit * factor)} in the file; the samples are taken as "
        f"evenly spaced by {format_length(step * factor)}"
    )
    return Places(even, (note,))


def printed_digit(x) -> float:
    """Return the largest power of ten that divides all positions (n,), or 0 if there is none."""
    largest = int(np.floor(np.log10((x[-1] - x[0]) / 5)))
    for digit in 10.0 ** np.arange(largest, largest - 8, -1):
        if np.abs(x / digit - np.rint(x / digit)).max() < DIGIT_TOL:
            return float(digit)
    return 0.0


def _min_step(x) -> float:
    """Return the distance below which two positions count as equal."""
    return 1e-6 * (x[-1] - x[0]) / x.size


def _require_increasing(path, x, lines, factor: float) -> None:
    """Raise PatchfemError if positions (n,) decrease or are all the same."""
    steps = np.diff(x)
    reverses = steps < -_min_step(x)
    if reverses.any():
        first = int(np.argmax(reverses))
        second = first + 1
        if lines is not None and lines[first] > lines[second]:
            first, second = second, first
        raise PatchfemError(
            f"{_sample_place(path, lines, second)}: x reverses: {format_length(x[first] * factor)} and then "
            f"{format_length(x[second] * factor)}; x of a trace must only rise or only fall, so keep only "
            "one trace per file"
        )
    if x[-1] == x[0]:
        raise PatchfemError(
            f"{path}: every sample lies at x = {format_length(x[0] * factor)}; a trace needs at least two "
            "different x"
        )


class Merged(NamedTuple):
    """Strictly increasing positions and heights in the units of the file, with notes."""

    x: np.ndarray
    z: np.ndarray
    notes: tuple


def _merge_equal_places(path, x, z, lines) -> Merged:
    """Replace samples at equal positions by their mean."""
    is_new = np.diff(x) > _min_step(x)
    if is_new.all():
        return Merged(x, z, ())
    group = np.concatenate([[0], np.cumsum(is_new)])
    counts = np.bincount(group, np.isfinite(z))
    with np.errstate(invalid="ignore"):
        heights = np.bincount(group, np.nan_to_num(z)) / counts
    first = int(np.argmin(is_new)) + 1
    place = f"sample {first + 1}" if lines is None else f"line {lines[first]}"
    note = (
        f"{path}: {x.size - heights.size} samples have the same x as another sample (the first in "
        f"{place}); the mean of their heights is used"
    )
    return Merged(np.bincount(group, x) / np.bincount(group), heights, (note,))


def check_span(path, x, z, stated: str = "") -> tuple:
    """Raise PatchfemError if the heights span more than the length of the trace.

    Parameters
    ----------
    path : Path
        For messages.
    x, z : arrays [m]
    stated : str
        Who states the units, METRES_NOTE or GIVEN_UNITS_NOTE.

    Returns
    -------
    tuple of str
        Notes on heights that span more than the length, or less than an atom.
    """
    heights = np.sort(z[np.isfinite(z)], axis=None)
    if heights.size < 2:
        raise PatchfemError(f"{path}: {heights.size} heights; a trace needs at least two")
    length = float(x[-1] - x[0])
    span = float(heights[-1] - heights[0])
    if length < MIN_LENGTH:
        raise PatchfemError(
            f"{path}: the profile is {format_length(length, 3)} long; is the unit of x right?"
        )
    if 0 < span < ATOM_WIDTH:
        return (
            f"{path}: heights span {format_length(span)}, which is less than the width of an atom; is the "
            "unit of the heights right?",
        )
    if span <= length:
        return ()
    text = f"{path}: heights span {format_length(span)} over a length of {format_length(length)}"
    count = max(1, int(OUTLIER_FRACTION * heights.size)) if heights.size >= MIN_ROUNDED else 0
    span_without_outliers = float(heights[-1 - count] - heights[count])
    if span_without_outliers <= length:
        return (
            f"{text}, but only {format_length(span_without_outliers)} without the {count} highest and the {count} lowest of "
            f"{heights.size}; write nan for each of these heights that is a fault of the "
            "measurement",
        )
    if not stated:
        raise PatchfemError(
            f"{text}; is the unit of z right? If not, correct the header or give --units to "
            "profile and compare; write a missing height as nan"
        )
    return (f"{text}: {stated}",)
