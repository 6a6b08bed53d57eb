"""Motions of one mode under sines from their start to their last cycles, many in one call: what `run.simulate` does."""

from typing import NamedTuple

import numpy as np

from .arrays import Kept, Moving
from .lanes import OF_KEPT, OF_MOVING, advance, loops_of
from .run import (
    BEGIN,
    END,
    FINISHED,
    FULL,
    HELD,
    POWER,
    SAMPLE,
    SAMPLES,
    STORED,
    WANTED,
    WAVES,
    asked,
    started,
)
from .waves import wave_of

TURNING = 3  # reversals of a cycle for which there is room, beside those of the first ones
AT_REST = 128


class Motions(NamedTuple):
    """What n motions of c cycles leave behind.

    moving, kept: as they stand, kept.samples (n, s, 9) of the last cycles and kept.turns (n, r, 9), of which the first
    kept.tally[TURNS] are there; begin, end (n, 4): as `Run.ends`, where the last cycles begin and end; begun, stored
    (n,): energy [J] at the start and at the end; lost (n,): whether one did not come to its end.
    """

    moving: Moving
    kept: Kept
    begin: np.ndarray
    end: np.ndarray
    begun: np.ndarray
    stored: np.ndarray
    lost: np.ndarray


def together(cases, cycles: int, window: int, tolerances) -> Motions:
    """Motions of n cases (modes, drive, element, core.Start or None), each with the tolerances (t, n) of its steps.

    All elements name the same kernels, all cases `lanes.fits`; the motions of the first tolerance come first.
    """
    count, law = len(cases), cases[0][2].kernels
    pairs = [started(modes, drive, wave_of(drive), element, cycles, start) for modes, drive, element, start in cases]
    moving = _stacked(Moving, [pair[0] for pair in pairs], OF_MOVING, len(tolerances))
    kept = _stacked(Kept, [pair[1] for pair in pairs], (*OF_KEPT, "turns"), len(tolerances))
    period = np.array([drive.period for _, drive, _, _ in cases] * len(tolerances))
    number, tolerance = period.size, np.ravel(tolerances)
    kept = kept._replace(turns=np.zeros((number, int(TURNING * cycles) + AT_REST, 9)))
    kept.cycles[:, 2:, ~asked(cycles, window)] = np.nan
    loops, stored, row = loops_of(law), np.zeros(number), np.zeros(9)
    for j in range(count):
        loops.advance(*_one(moving, kept, j), 0.0, np.inf, tolerance[j], np.inf)
    for array in (*(array for name, array in moving._asdict().items() if name not in OF_MOVING), kept.tally):
        array.reshape(len(tolerances), -1)[1:] = array[:count].reshape(1, -1)
    begun, until = kept.tally[:, STORED].copy(), cycles * period
    kept, codes = _moved(law, moving, kept, until - window * period, tolerance)
    begin = _ends(moving)
    samples = np.zeros((number, window * SAMPLES + 1, 9))
    samples[:, :, 0] = np.linspace(moving.now[:, 0], until, window * SAMPLES + 1, axis=1)
    kept.tally[:, :WAVES], kept.tally[:, WAVES:POWER], kept.tally[:, HELD:] = -np.inf, 0.0, 0.0
    kept.tally[:, SAMPLE], kept.tally[:, WANTED], kept.tally[:, BEGIN], kept.tally[:, END] = 0, 1, begin[:, 0], until
    kept, ended = _moved(law, moving, kept._replace(samples=samples), until, tolerance)
    end = _ends(moving)
    for j in range(number):
        stored[j] = loops.settled(*_one(moving, kept, j), row)
    return Motions(moving, kept, begin, end, begun, stored, (codes != FINISHED) | (ended != FINISHED))


def _moved(law: str, moving, kept, until, tolerance) -> tuple:
    """Motions moved on to the times `until` (n,) [s], with room for all their reversals: (kept, codes)."""
    codes = advance(law, moving, kept, until, tolerance)
    while (codes == FULL).any():
        kept = _wider(kept)
        codes = advance(law, moving, kept, until, tolerance)
    return kept, codes


def _wider(kept: Kept) -> Kept:
    """Kept of motions with twice the room for reversals."""
    return kept._replace(turns=np.concatenate([kept.turns, np.zeros_like(kept.turns)], axis=1))


def _stacked(kind, parts, shared, times: int):
    """One Moving or Kept of many, each of `parts` as often as `times`."""
    return kind(*(getattr(parts[0], name) if name in shared else np.stack([getattr(one, name) for one in parts] * times)
                  for name in kind._fields))


def _one(moving, kept, j: int) -> tuple:
    """Moving and Kept of one of many motions, in the same memory."""
    return (Moving(*(array if name in OF_MOVING else array[j] for name, array in moving._asdict().items())),
            Kept(*(array if name in OF_KEPT else array[j] for name, array in kept._asdict().items())))


def _ends(moving, part=slice(None)) -> np.ndarray:
    y, output = moving.y[part], moving.rows[part, 4, 0]
    return np.stack([moving.now[part, 0], output * y[:, 0], output * y[:, 1], y[:, -1]], axis=1)
