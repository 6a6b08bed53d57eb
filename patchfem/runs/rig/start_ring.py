"""What the ringing of the start leaves in the cycles of an interface that holds.

A joint that sticks has little damping of its own, so what the drive set off at its start rings on. The interface stores
energy of that ring and gives it back, and a window need not hold as much of either: its work per cycle is then no loss.
"""

from dataclasses import replace
from math import ceil, log, log10, pi
from typing import NamedTuple

from ...core import Measure, Outcome
from ...response.rows import of_first
from ...structure.drive_sizes import is_periodic, whole

LEAST_DAMPING = 1e-6  # of a ring, below which no number of cycles is named
OF_WORK = ("loop_area", "equivalent_damping")


class StartRing(NamedTuple):
    """Measures with what the stored energy leaves open of them; remedies: by name of those that miss the tolerance for
    it; notes: the sentence on it, in a list."""

    measures: dict
    remedies: dict
    notes: list


def start_ring(outcome, measures: dict, window, drive, cycles: float, tolerance: float) -> StartRing:
    """StartRing of a run: the change of the stored energy per cycle belongs to the error of the work per cycle.

    outcome; measures: by name; window: Response of the last cycles; drive; cycles: of the run. Only an interface that
    holds under a periodic drive has it: where it slips the work is mostly loss.
    """
    ledger, loop = window.extra.get("ledger"), measures.get("loop_area")
    span = window.time[-1] - window.time[0]
    if outcome is not Outcome.STUCK or ledger is None or loop is None or not loop.value or loop.error is None \
            or not is_periodic(drive) or not whole(span, drive):
        return StartRing(measures, {}, [])
    change = abs(float(ledger[1][-1] - ledger[1][0])) * drive.period / span
    wide = {name: _wider(one, change / abs(work)) for name, one in measures.items() if of_first(name) in OF_WORK
            and (work := measures[name.replace("equivalent_damping", "loop_area")].value) and one.error is not None}
    missed = {name: one for name, one in wide.items()
              if one.beyond(tolerance) > 1 and one.error > 2 * measures[name].error}  # most of it by the change
    if not missed:
        return StartRing(measures | wide, {}, [])
    until = max(_until(one, measures, drive, cycles) for one in missed.values())
    remedy = f"set drive.cycles = {until:g} to let the free vibration that began at the start decay" if until else \
        "the free vibration that began at the start has not decayed; raise the damping of the modes in " \
        "[[structure.mode]]"
    ring = measures.get("ring_frequency")
    pitch = f" at {ring.value:.5g} Hz (damping {measures['ring_damping'].value:.2g})" if ring is not None else ""
    note = (f"the free vibration that began at the start has not decayed{pitch}: loop_area contains not only the "
            f"energy that the interface dissipates but also energy that it stores and gives back; {remedy}")
    return StartRing(measures | wide, dict.fromkeys(missed, remedy), [note])


def _wider(one: Measure, share: float) -> Measure:
    """A Measure whose error has a share of its value more."""
    return replace(one, error=one.error + share * abs(one.value))


def _until(one: Measure, measures: dict, drive, cycles: float) -> float:
    """Cycles, to two digits, after which the ring leaves its floor of a Measure open; 0 where it does not decay."""
    ring, damping = (measures.get(f"ring_{name}") for name in ("frequency", "damping"))
    if ring is None or damping.value <= LEAST_DAMPING:
        return 0.0
    seconds = log(2 * one.error / one.floor) / (2 * pi * ring.value * damping.value)
    least = cycles + max(seconds, 0.0) / drive.period
    unit = 10.0 ** max(0, ceil(log10(least)) - 2)
    return ceil(least / unit) * unit
