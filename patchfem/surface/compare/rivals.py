"""The other reading of a registration, where two explain the traces: a bow or a scar, flanks that grew or a worn floor,
wear or a datum that drifts.

Which of the first two a registration is, and whether its flanks tell them apart, is decided in `registration`.
"""

import numpy as np

from ...core import PatchfemError, say
from ...scales import plain
from ..profile import Profile
from . import depth as worn_depth
from .carried import Carried, median_of_five, raised
from .flanks import Flanks
from .registration import ENDS, PARTS, Registration, register, slow_of

BENT, GREW, NOISE, DRIFT = (f"a scar or {what}, both are possible" for what in
                            ("a bent datum", "material that grew at the ends", "noise", "a datum that drifts"))
CURVED = 0.1  # of the depth of a track, slow differences of the traces beside it that show these flanks to be worn
DEEPER = 12.0  # standard deviations of the slow variation of unworn parts that a worn depth needs: 3 of its widths
SLOW = 0.5  # share of the variance of the unworn parts, at least, that neighbouring parts do not have
SHOWN = 1.25  # times the differences that the traces show, what a bow may be at most
WAVES, ALIKE = 8, 1.3  # half waves along the traces that a drift may have, and noises that they leave of a drift alone


def readings(found: Registration, by: Carried, before: Profile, after: Profile) -> tuple:
    """(headline, reason) where two readings explain the traces, ("", "") where there is one: those of a rival that the
    flanks do not tell apart, or in which no part is long enough to be known as unworn, and those of a datum that
    drifts. A bow is no datum's where it is larger than what the traces differ by: wear must just fill it then."""
    if found.bend and abs(found.bend) > SHOWN * _shown(found):
        return DRIFT, _drift(found, before, after)
    if found.rival is not None and not (found.rival.told_apart and by.by):
        bow, line = (found, found.rival.found)[::-1 if found.rival.told_apart else 1]
        return (BENT if bow.bend else GREW if _changed(bow) else NOISE), bow_or_scar(bow, line)
    if (by.by or raised(found)) and _drifts(found):
        return DRIFT, _drift(found, before, after)
    return "", ""


def bow_or_scar(bow: Registration, line: Registration) -> str:
    """Why there is no worn depth where both are possible, with the numbers of both."""
    if bow.bend:
        one = f"the datum bent by {say(bow.bend, 3)} (sag over the common length) and {_worn(bow)} at the ends"
    elif _changed(bow):
        above = plain(1e12 * worn_depth.of_registration(bow).deposited, 3)
        one = f"{above} um^2 of material grew at the ends, where it lies above the first " \
              f"trace (before wear), and {_worn(bow)} elsewhere"
    else:
        one = f"nothing grew and nothing wore off, and the traces differ by noise of {say(bow.noise, 3)}"
    return (f"two readings explain both traces alike: either {one}, or the ends are unworn and in a scar over most of "
            f"the trace {_worn(line)}, if the datum is straight; the flanks beside the scar are too short, or "
            "not on one straight line, to tell these readings apart; measure longer flanks, or the datum on a flat")


def _changed(found: Registration) -> bool:
    """Whether anything that can be printed grew or wore off in a reading."""
    worn = worn_depth.of_registration(found)
    return any(plain(1e12 * area, 3) != "0" for area in (worn.deposited, worn.area.value))


def _shown(found: Registration) -> float:
    """Largest less smallest [m] of the slow differences of the traces about a line, with a bow that was taken out put
    back."""
    along = np.linspace(-1, 1, found.rest.size)
    return float(np.ptp(slow_of(np.asarray(found.rest) - found.bend * along**2)))


def _drifts(found: Registration) -> bool:
    """Whether what looks worn may be a datum that drifts.

    What is taken as unworn varies slowly then, by a third of the differences or more, or a bow was taken out and waves
    as slow as a drift leave nothing but noise of the whole difference, so that it shows no edge of a scar. What the
    traces differ by counts, about one line through all of it or as a narrow scar, not the depth below another line.
    """
    rest, unworn = np.asarray(found.rest), slow_of(np.asarray(found.rest), found.used)
    power = float(np.mean(unworn**2)) if unworn.size > 6 else 0.0
    slow = power - float(np.mean(np.diff(unworn) ** 2)) / 2 if unworn.size > 6 else 0.0
    place = (np.arange(rest.size) + 0.5) / rest.size
    waves = np.column_stack([place, *(np.cos(np.pi * k * place) for k in range(WAVES + 1))])
    left = rest - waves @ np.linalg.lstsq(waves, rest, rcond=None)[0]
    deep = max(float(np.abs(slow_of(rest)).max()), float(median_of_five(left).max()))
    return (slow > SLOW * power and deep < DEEPER * np.sqrt(slow)) or \
        (found.bend != 0 and float(np.std(left)) < ALIKE * found.noise)


def _drift(found: Registration, before: Profile, after: Profile) -> str:
    """Why there is no worn depth where the datum may drift, with the numbers of each reading."""
    seen, straight = _shown(found), ""
    if found.bend:
        try:
            straight = f", or {_worn(register(before, after, found.shift, bow=False))} if the datum is straight"
        except PatchfemError:
            straight = ""
        straight = f" and the datum bent by {say(abs(found.bend), 3)} (over the common length){straight}"
    return (f"the traces differ slowly along x, by {say(seen, 3)} from the lowest to the highest place about a line, "
            "and what would be unworn differs in the same way, as with an instrument whose datum drifts; two readings "
            f"explain both traces: either nothing wore off and the datum drifted, or {_worn(found)}{straight}; measure "
            "the datum on a flat, or each trace twice to see the drift")


def flanks_differ(before: Profile, after: Profile, shift: float, flanks: Flanks, straight: bool) -> str:
    """Why flanks of the trace after are not unworn, with the reading of a straight datum; "" where they may be.
    straight: whether the datum is known to be.

    At the shift [m] at which the traces agree most, their difference must be straight over unworn flanks: slow
    differences of a tenth of the depth are wear, or a datum that bends.
    """
    x = np.asarray(after.x)
    at = x - shift
    both = (at >= before.x[0]) & (at <= before.x[-1]) & ~after.missing
    x, off = x[both], np.interp(at[both], before.x[~before.missing], before.z[~before.missing]) - after.z[both]
    beside = (x < flanks.start) | (x > flanks.end)
    means = slow_of(off, beside)
    slow = float(means.max() - means.min()) if means.size else 0.0
    if slow < CURVED * flanks.largest[0]:
        return ""
    ends = np.minimum(np.arange(x.size), np.arange(x.size)[::-1]) < max(int(ENDS[1] * x.size), 1)
    deep = off - np.polyval(np.polyfit(x[ends], off[ends], 1), x)
    edges = np.linspace(0, x.size, PARTS + 1).astype(int)
    means = np.add.reduceat(deep, edges[:-1]) / np.diff(edges)
    worn = f"{say(float(deep.mean()), 3)} wore off on average over the common length and " \
           f"{say(float(means.max()), 3)} at the deepest place"
    two = f"if both outermost ends are unworn, {worn}; measure longer flanks" if straight else \
        "two readings explain both traces: either the datum bent, or, if it is straight and both outermost ends are " \
        f"unworn, {worn}; measure longer flanks, or the datum on a flat"
    return (f"beside a track that looks like one, the traces differ slowly along x by {say(slow, 3)}, so these parts "
            f"are not known to be unworn; {two}")


def other_reading(found: Registration | None) -> list:
    """What the other reading of the traces is, with its numbers, as a sentence; nothing without one."""
    if found is None or found.rival is None or found.declared:
        return []
    other = found.rival.found
    if other.bend:
        area = plain(1e12 * worn_depth.of_registration(other).area.value, 3)
        return [f"Other reading: a datum bent by {say(other.bend, 3)} over the common length, with {area} um^2 worn "
                "off at its ends. This reading is not taken, because both flanks lie on one straight line; a bow would "
                "have left this line only if the ends had worn off to it."]
    above = worn_depth.of_registration(other).deposited
    return [f"Other reading: if the middle is unworn, {plain(1e12 * above, 3)} um^2 of material lie above the first "
            "trace (before wear) at both ends. This reading is not taken, because both flanks agree with the first "
            "trace on one straight line and all heights between them lie lower."]


def _worn(found: Registration) -> str:
    """The wear of a reading as words, without an interval."""
    worn = worn_depth.of_registration(found)
    return (f"{plain(1e12 * worn.area.value, 3)} um^2 wore off, {say(worn.mean.value, 3)} on average over the common "
            f"length and {say(worn.largest.value, 3)} at the deepest place")
