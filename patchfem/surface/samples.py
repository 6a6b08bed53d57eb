"""The numbers of a file made a trace: finite, plausible, in order, one height per place."""

import numpy as np

from ..core import PatchfemError, frozen_array, say
from .profile import Profile

LONGEST = 10.0  # [m] beyond which a unit must be wrong
SHORTEST = 1e-9  # [m]
ATOM = 1e-10  # [m], the width of one: heights that span less were not measured
TRIMMED = 10, 100  # heights from which on, and of how many, the highest and the lowest may stand out
METRES = "in the file, heights and length are in metres"  # who says the units
GIVEN = "heights and length were read in the given units"


def checked(path, x, z, at, factors: tuple, stated: str = "") -> Profile:
    """Turn samples of a file into a trace in order of growing x, one height per place; the notes tell what that took.

    x, z: (n,) in the units of the file, with their factors to metres; at: (n,) their lines, None where the file has
    none; stated: who says the units, METRES or GIVEN. PatchfemError names line and value.
    """
    bounded(path, (x, z), ("x", "z"), at, factors)
    if x[-1] < x[0]:
        x, z, at = x[::-1], z[::-1], None if at is None else at[::-1]
    x, notes = evened(path, x, factors[0])
    x, z, more = _single(path, x, z, at, factors[0])
    x, z = x * factors[0], z * factors[1]
    more += plausible(path, x, z, stated)
    return Profile(frozen_array(x), frozen_array(z), str(path), notes + more)


def bounded(path, columns: tuple, names: tuple, at, factors: tuple) -> None:
    """Refuse columns of a file that are not finite or too large for a surface; a height z may be NaN.

    columns: (n,) each, in the units of the file, with their factors to metres; at: (n,) lines or None.
    """
    if names[-1] == "z" and np.isfinite(columns[-1]).sum() < 2:
        raise PatchfemError(f"{path}: {np.isfinite(columns[-1]).sum()} heights; a trace needs at least two")
    for name, values in zip(names, columns):
        bad = np.isinf(values) if name == "z" else ~np.isfinite(values)
        if bad.any():
            first = int(np.argmax(bad))
            raise PatchfemError(f"{_where(path, at, first)}: {name} is {values[first]:g}; finite numbers are needed")
    for name, values, factor in zip(names, columns, factors):
        worst = int(np.nanargmax(np.abs(values)))
        if abs(values[worst]) > LONGEST / factor:
            raise PatchfemError(f"{_where(path, at, worst)}: {name} is {float(values[worst]) * factor:.4g} m; is the "
                                "unit right? write a missing height as nan")


def _where(path, at, k: int) -> str:
    return f"{path}: sample {k + 1}" if at is None else f"{path}:{at[k]}"


def evened(path, x, factor: float, name: str = "x") -> tuple:
    """Places x without the rounding of their printed digits, where even spacing explains every one of them.

    A step of 0.15625 um printed to 0.1 um makes the slopes 14 % too large.
    """
    if x.size < 10:  # too few to judge the spacing by
        return x, ()
    count = np.arange(x.size) - (x.size - 1) / 2
    step = float(count @ x / (count @ count))
    even = float(x.mean()) + step * count
    off = float(np.abs(x - even).max())
    if not off > 1e-6 * step > 0 or not x[-1] > x[0]:
        return x, ()
    largest = int(np.floor(np.log10((x[-1] - x[0]) / 5)))
    digits = 10.0 ** np.arange(largest, largest - 8, -1)
    # the coarsest power of ten of which every x is a multiple
    digit = next((one for one in digits if np.abs(x / one - np.rint(x / one)).max() < 1e-4), 0.0)
    if off > 0.75 * digit:  # half a digit about the true line, a little more about the fitted one
        return x, ()
    return even, (f"{path}: {name} is rounded to {say(digit * factor)} in the file; the samples are taken as evenly "
                  f"spaced by {say(step * factor)}",)


def _single(path, x, z, at, factor: float) -> tuple:
    """Places x strictly growing: neighbours at one place become their mean."""
    step = np.diff(x)
    same = 1e-6 * (x[-1] - x[0]) / x.size
    if (step < -same).any():
        back = int(np.argmax(step < -same))
        one, other = back, back + 1
        if at is not None and at[one] > at[other]:
            one, other = other, one
        raise PatchfemError(f"{_where(path, at, other)}: x reverses: {say(x[one] * factor)} and then "
                            f"{say(x[other] * factor)}; x of a trace must only rise or only fall, so keep only one "
                            "trace per file")
    if x[-1] == x[0]:
        raise PatchfemError(f"{path}: every sample lies at x = {say(x[0] * factor)}; a trace needs at least two "
                            "different x")
    if (step > same).all():
        return x, z, ()
    group = np.concatenate([[0], np.cumsum(step > same)])
    heights = np.bincount(group, np.isfinite(z))
    with np.errstate(invalid="ignore"):
        mean = np.bincount(group, np.nan_to_num(z)) / heights
    first = int(np.argmax(step <= same)) + 1
    place = f"sample {first + 1}" if at is None else f"line {at[first]}"
    note = (f"{path}: {x.size - mean.size} samples have the same x as another sample (the first in {place}); the mean "
            "of their heights is used")
    return np.bincount(group, x) / np.bincount(group), mean, (note,)


def plausible(path, x, z, stated: str = "") -> tuple:
    """Refuse heights z [m] without two numbers and, where no unit is `stated`, too high for their length x [m].

    Notes tell of heights that are too high where their units are stated, of a few that stand out so far, and of heights
    that span less than an atom.
    """
    there = np.sort(z[np.isfinite(z)], axis=None)
    if there.size < 2:
        raise PatchfemError(f"{path}: {there.size} heights; a trace needs at least two")
    length, span = float(x[-1] - x[0]), float(there[-1] - there[0])
    if length < SHORTEST:
        raise PatchfemError(f"{path}: the profile is {say(length, 3)} long; is the unit of x right?")
    if 0 < span < ATOM:
        return (f"{path}: heights span {say(span)}, which is less than the width of an atom; is the unit of the "
                "heights right?",)
    if span <= length:
        return ()
    steep = f"{path}: heights span {say(span)} over a length of {say(length)}"
    few = max(1, there.size // TRIMMED[1]) if there.size >= TRIMMED[0] else 0
    most = float(there[-1 - few] - there[few])
    if most <= length:
        return (f"{steep}, but only {say(most)} without the {few} highest and the {few} lowest of {there.size}; write "
                "nan for each of these heights that is a fault of the measurement",)
    if not stated:
        raise PatchfemError(f"{steep}; is the unit of z right? If not, correct the header or give --units to profile "
                            "and compare; write a missing height as nan")
    return (f"{steep}: {stated}",)
