"""The other reading of a registration, where two explain the traces: a bow or a scar, flanks that grew or a worn floor.

Which of both a registration is, and whether its flanks tell them apart, is decided in `registration`.
"""

from ...core import say
from ...scales import plain
from . import depth as worn_depth
from .registration import Registration


def undecided(found: Registration | None) -> bool:
    """Whether the traces show a bow and a scar alike."""
    return found is not None and found.rival is not None and not found.rival.told_apart and found.bend > 0


def bow_or_scar(found: Registration) -> str:
    """Why there is no worn depth where both are possible, with the numbers of both."""
    line = found.rival.found
    scar = f"{_area(line)}, {_depth(line)} on average and {say(_deepest(line), 3)} at the deepest place"
    return (f"two readings explain both traces alike: either the datum bent by {say(found.bend, 3)} (sag over the "
            f"common length) and {_area(found)} wore off at the ends, or the ends are unworn and a scar over most of "
            f"the trace wore off {scar}, if the datum is straight; the flanks beside the scar are too short, or not on "
            "one straight line, to tell these readings apart; measure longer flanks, or the datum on a flat")


def other_reading(found: Registration | None) -> list:
    """What the other reading of the traces is, with its numbers, as a sentence; nothing without one."""
    if found is None or found.rival is None or undecided(found):
        return []
    other = found.rival.found
    if not found.rival.told_apart:
        return [f"Other reading: if the ends of the traces are unworn and the middle is not, {_area(other)} wore off "
                f"between them, {_depth(other)} on average over the common length; the flanks are too short to tell."]
    if other.bend:
        return [f"Other reading: a datum bent by {say(other.bend, 3)} over the common length, with {_area(other)} worn "
                "off at its ends. This reading is not taken, because both flanks lie on one straight line; a bow would "
                "have left this line only if the ends had worn off to it."]
    above = worn_depth.of_registration(other).deposited
    return [f"Other reading: if the middle is unworn, {plain(1e12 * above, 3)} um^2 of material lie above the first "
            "trace (before wear) at both ends. This reading is not taken, because both flanks agree with the first "
            "trace on one straight line and all heights between them lie lower."]


def _area(found: Registration) -> str:
    area = worn_depth.of_registration(found).area
    return f"{plain(1e12 * area.value, 3)} um^2"


def _deepest(found: Registration) -> float:
    return worn_depth.of_registration(found).largest.value


def _depth(found: Registration) -> str:
    return say(worn_depth.of_registration(found).mean.value, 3)
