"""Displacement path that drives the model of a loop fit: a lead-in and the record."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...core import PatchfemError
from ...inputs.loops import Loop
from ...scene.ranges import Range

OFFSETS = ("force", "displacement")
POSITION_TOL = 1e-6  # Fraction of the range of the record below which two positions are equal.


@dataclass(frozen=True, eq=False, slots=True)
class Offset:
    """Constant that is fitted in addition to the keys of the scene.

    Attributes
    ----------
    name : {"force", "displacement"}
        A force [N] or friction ratio [1] that the record adds to the reading, or the displacement
        [m] of the first row from the position without stress.
    range : Range
        Its bounds: the size of the record to either side.
    """

    name: str
    range: Range


@dataclass(frozen=True, eq=False, slots=True)
class LoopOptions:
    """Names of fitted OFFSETS, and whether the record is driven once beforehand."""

    offsets: tuple = ()
    warm: bool = False


DEFAULT_OPTIONS = LoopOptions()


def read_offsets(names: Sequence, loop: Loop) -> list:
    """Return the offsets of a fit by name; PatchfemError for a name not in OFFSETS."""
    requested = []
    for text in names:
        requested += [name.strip() for name in text.split(",")]
    offsets = []
    for name in dict.fromkeys(requested):
        if name not in OFFSETS:
            raise PatchfemError(
                f"--offset {name}: not a possible offset; use {' or '.join(OFFSETS)}"
            )
        size = float(np.ptp(loop.displacement))
        kind = "length"
        if name == "force":
            size = float(np.abs(loop.reading).max())
            kind = "force" if loop.quantity == "force" else None
        offsets.append(Offset(name, Range(f"offset.{name}", -size, size, kind)))
    return offsets


def count_whole_cycles(loop: Loop) -> int:
    """Count the rows of the complete cycles at the start of a recorded loop.

    These rows end where the record last passes its first displacement in the first direction. The
    first row counts. PatchfemError for a record that does not return there.
    """
    displacement = loop.displacement
    direction = np.sign(displacement[np.flatnonzero(displacement)[0]])
    behind = displacement * direction < -POSITION_TOL * np.ptp(displacement)
    returns = np.flatnonzero(behind[:-1] & ~behind[1:])
    if not returns.size:
        raise PatchfemError(
            f"{loop.path}: --warm-up needs a record of at least one whole cycle, in which the "
            "displacement returns to its first value and passes it in the same direction as at "
            "the start; give such a record, or leave --warm-up out"
        )
    return int(returns[-1]) + 1


class DrivenPath(NamedTuple):
    """Displacement path that drives the model of a loop fit.

    time: (n,) [s]; displacement: (n,) [m]; n_before: number of points before the record.
    """

    time: np.ndarray
    displacement: np.ndarray
    n_before: int


def prepend_warm_up(time, recorded, n_warm_up_rows: int, offset: float) -> DrivenPath:
    """Return a path that begins at displacement 0 and continues as recorded.

    Parameters
    ----------
    time, recorded : (r,) array
        Times [s] and displacements [m] of the record; the first displacement is 0.
    n_warm_up_rows : int
        Number of leading rows that form complete cycles and are driven once before the record; 0 for none.
    offset : float
        Displacement of the first row [m]; it is reached at the mean speed of the record.

    Returns
    -------
    DrivenPath
    """
    speed = np.abs(np.diff(recorded)).sum() / (time[-1] - time[0])
    displacement = recorded + offset
    lead_in = []
    lead_in_times = []
    if offset:
        lead_in.append(0.0)
        lead_in_times.append(-abs(offset) / speed)
    start = 0.0
    if n_warm_up_rows:
        # The last of these rows comes before the first displacement is reached again; the record
        # gives the time from there to the first displacement.
        before, after = recorded[n_warm_up_rows - 1 : n_warm_up_rows + 1]
        step = time[n_warm_up_rows] - time[n_warm_up_rows - 1]
        return_time = time[n_warm_up_rows - 1] + step * (0.0 - before) / (after - before)
        lead_in = [*lead_in, *displacement[:n_warm_up_rows]]
        lead_in_times = [*lead_in_times, *(time[:n_warm_up_rows] - time[0])]
        start = return_time - time[0]
    times = np.concatenate([lead_in_times, time - time[0] + start])
    return DrivenPath(times - times[0], np.concatenate([lead_in, displacement]), len(lead_in))
