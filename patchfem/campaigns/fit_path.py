"""What a fit drives the model along: the measured rows, and what comes before the first of them."""

from dataclasses import dataclass

import numpy as np

from ..core import PatchfemError
from ..inputs.loops import Loop
from ..scene.ranges import Range

OFFSETS = ("force", "displacement")
SAME = 1e-6  # of the range of the record: places closer than that are one


@dataclass(frozen=True, eq=False, slots=True)
class Offset:
    """A nuisance value of a fit: what the record adds to the reading, or where its first row lies.

    what: "force": the reading is that of the model and this [N or 1]; "displacement": the model is unstressed this far
    [m] before the first row, towards smaller slides. range: bounds, the size of the record to either side.
    """

    what: str
    range: Range


@dataclass(frozen=True, eq=False, slots=True)
class LoopOptions:
    """What a fit settles besides the values of the scene: names of OFFSETS, and whether it warms up (`lead_in`)."""

    offsets: tuple = ()
    warm: bool = False


NOTHING = LoopOptions()


def offsets_of(names, loop: Loop) -> list:
    """The Offsets by name, once each. PatchfemError for a name that is none of OFFSETS."""
    out = []
    for name in dict.fromkeys(part.strip() for one in names for part in one.split(",")):
        if name not in OFFSETS:
            raise PatchfemError(f"--offset {name}: not a possible offset; use {' or '.join(OFFSETS)}")
        if name == "force":
            size, kind = float(np.abs(loop.reading).max()), "force" if loop.quantity == "force" else None
        else:
            size, kind = float(np.ptp(loop.displacement)), "length"
        out.append(Offset(name, Range(f"offset.{name}", -size, size, kind)))
    return out


def whole_cycles(loop: Loop) -> int:
    """Number of rows, the first included, until the record last passes its first displacement the way it left it.

    PatchfemError for a record that does not come back there: it has no cycle to begin with.
    """
    place = loop.displacement
    moved = np.flatnonzero(place != 0)
    way = np.sign(place[moved[0]])
    behind = place * way < -SAME * np.ptp(place)
    back = np.flatnonzero(behind[:-1] & ~behind[1:])
    if not back.size:
        raise PatchfemError(f"{loop.path}: --warm-up needs a record of at least one whole cycle, in which the "
                            "displacement returns to its first value and passes it in the same direction as at the "
                            "start; give such a record, or leave --warm-up out")
    return int(back[-1]) + 1


def lead_in(time, place, warm: int, offset: float) -> tuple:
    """(time (k + r,) [s], slide (k + r,) [m], k): the rows (r,) after the k corners that are driven before them.

    warm: leading rows that are whole cycles, driven once before, 0 for none; offset [m]: slide of the first row. The
    slide starts at 0, reaches the first row at the mean speed of the record, and goes on as recorded.
    """
    speed = np.abs(np.diff(place)).sum() / (time[-1] - time[0])
    slide, before, begin = place + offset, [], []
    if offset:
        before.append(0.0)
        begin.append(-abs(offset) / speed)
    if warm:
        # the last of its rows lies behind the first place; from there on it reaches it as the record does
        left, right = place[warm - 1:warm + 1]
        turn = time[warm - 1] + (time[warm] - time[warm - 1]) * (0.0 - left) / (right - left)
        before, begin = [*before, *slide[:warm]], [*begin, *(time[:warm] - time[0])]
        start = turn - time[0]
    else:
        start = 0.0
    whole = np.concatenate([begin, time - time[0] + start])
    return whole - whole[0], np.concatenate([before, slide]), len(before)
