"""Frequency and damping of a released rig over its amplitude, with the errors of its coarser runs."""

import numpy as np

from ...response import decay_curve, ring_down
from ...response.decay_curve import FEWEST, DecayCurve
from .solution import Solution


def decay_of(raw: Solution) -> DecayCurve | None:
    """The curve of the output of a release; None where it does not swing FEWEST half swings down.

    What coarser runs change at the same amplitudes is added to what the reading leaves open; where a coarser run does
    not reach, the error is infinite.
    """
    found = _read(raw)
    if found is None:
        return None
    frequency, damping = found.frequency_error, found.damping_error
    for run, beside in raw.coarser:
        one, other = _read(run), found if beside is None else _read(beside)
        for name in ("frequency", "damping"):
            change = np.abs(_at(one, name, found.amplitude) - _at(other, name, found.amplitude))
            if name == "frequency":
                frequency = frequency + change
            else:
                damping = damping + change
    return found._replace(frequency_error=frequency, damping_error=damping)


def _read(run: Solution) -> DecayCurve | None:
    motion = run.response
    swings = decay_curve.of_turns(*ring_down.turns(motion.time, motion.output, motion.output_rate))
    found = decay_curve.curve_of(swings) if swings.size.size >= FEWEST else None
    return found if found is not None and found.time.size else None


def _at(one: DecayCurve | None, name: str, amplitude) -> np.ndarray:
    """A column of a curve at amplitudes (k,) [m], straight over their logarithms; infinite outside it."""
    if one is None:
        return np.full(amplitude.size, np.inf)
    order, close = np.argsort(one.amplitude), 1e-6
    inside = (amplitude > one.amplitude.min() * (1 - close)) & (amplitude < one.amplitude.max() * (1 + close))
    return np.where(inside, np.interp(np.log(amplitude), np.log(one.amplitude[order]), getattr(one, name)[order]),
                    np.inf)
