"""Imposed displacement path in the fit of a friction loop: optional lead-in, then the record."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...core import PatchfemError
from ...inputs.loops import Loop
from ...scene.assignments import Range

OFFSETS = ("force", "displacement")
# Largest difference of positions that count as equal, relative to the displacement range.
POSITION_TOL = 1e-6


@dataclass(frozen=True, eq=False, slots=True)
class Offset:
    """Constant offset that is fitted in addition to the scene parameters.

    Attributes
    ----------
    name : {"force", "displacement"}
        "force": constant error of the measured force [N] or friction ratio [1]; "displacement":
        distance [m] of the first row from the stress-free position.
    range : Range
        Bounds of the offset, which are minus and plus the size of the record.
    """

    name: str
    range: Range


@dataclass(frozen=True, eq=False, slots=True)
class LoopOptions:
    """Options of a loop fit: names of the fitted offsets, and whether to add warm-up cycles."""

    offsets: tuple = ()
    warm: bool = False


DEFAULT_OPTIONS = LoopOptions()


def make_offsets(names: Sequence, loop: Loop) -> list:
    """Return the offsets of a fit by name, with bounds from the record."""
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


def count_warm_up_rows(loop: Loop) -> int:
    """Return the number of leading rows of a measured loop that form complete cycles.

    The rows end at the last passage of the first displacement in the initial direction. Raises
    PatchfemError if the record does not contain a complete cycle.
    """
    displacement = loop.displacement
    direction = np.sign(displacement[np.flatnonzero(displacement)[0]])
    is_behind = displacement * direction < -POSITION_TOL * np.ptp(displacement)
    returns = np.flatnonzero(is_behind[:-1] & ~is_behind[1:])
    if not returns.size:
        raise PatchfemError(
            f"{loop.path}: --warm-up needs a record of at least one whole cycle, in which the "
            "displacement returns to its first value and passes it in the same direction as at "
            "the start; give such a record, or leave --warm-up out"
        )
    return int(returns[-1]) + 1


class ImposedPath(NamedTuple):
    """Displacement path that is imposed on the model in a loop fit.

    time: (n,) [s]; displacement: (n,) [m]; n_before: number of lead-in points before the record.
    """

    time: np.ndarray
    displacement: np.ndarray
    n_before: int


def prepend_warm_up(time, recorded, n_warm_up_rows: int, offset: float) -> ImposedPath:
    """Return the imposed path: start at displacement 0, optional warm-up cycles, then the record.

    Parameters
    ----------
    time, recorded : (r,) array
        Times [s] and displacements [m] of the record; the first displacement is 0.
    n_warm_up_rows : int
        Number of leading rows that form complete cycles and are repeated before the record; 0 for none.
    offset : float
        Displacement of the first row [m], which is approached at the mean speed of the record.

    Returns
    -------
    ImposedPath
    """
    speed = np.abs(np.diff(recorded)).sum() / (time[-1] - time[0])
    displacement = recorded + offset
    lead_in = []
    lead_in_times = []
    if offset:
        lead_in.append(0.0)
        lead_in_times.append(-abs(offset) / speed)
    record_start = 0.0
    if n_warm_up_rows:
        # The displacement returns to its first value between the last of these rows and the next
        # one; the time of the return is interpolated.
        before, after = recorded[n_warm_up_rows - 1 : n_warm_up_rows + 1]
        step = time[n_warm_up_rows] - time[n_warm_up_rows - 1]
        return_time = time[n_warm_up_rows - 1] + step * (0.0 - before) / (after - before)
        lead_in = [*lead_in, *displacement[:n_warm_up_rows]]
        lead_in_times = [*lead_in_times, *(time[:n_warm_up_rows] - time[0])]
        record_start = return_time - time[0]
    times = np.concatenate([lead_in_times, time - time[0] + record_start])
    return ImposedPath(times - times[0], np.concatenate([lead_in, displacement]), len(lead_in))
