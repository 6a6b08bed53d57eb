"""Frequency and damping of a released rig over its amplitude, with the errors of its coarser runs."""

from ...response.decay_curve import DecayCurve, curve_of, of_turns, turns
from .solution import Solution


def decay_of(raw: Solution) -> DecayCurve | None:
    """The curve of the output of a release; None where it does not swing three half swings down.

    What coarser runs change at the same amplitudes is added to what the reading leaves open; where a coarser run does
    not reach, the error is infinite.
    """
    found = _read(raw)
    if not found.time.size:
        return None
    for run, beside in raw.coarser:
        one, other = _read(run).over(found.amplitude), found if beside is None else _read(beside).over(found.amplitude)
        found = found.widened(one, other)
    return found


def _read(run: Solution) -> DecayCurve:
    motion = run.response
    return curve_of(of_turns(*turns(motion.time, motion.output, motion.output_rate)))
