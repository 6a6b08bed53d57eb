"""A drive as numbers for compiled code: pieces on which it is smooth, and where they end."""

from typing import NamedTuple

import numpy as np

SINES, SWEEP, ROWS = range(3)  # as in `step_kernels`


class Wave(NamedTuple):
    """A drive in pieces.

    kind: SINES, SWEEP or ROWS; pieces (p, 6): begin of each [s], then of SINES constant and amplitude [m s-2], omega
    [rad/s], phase [rad]; of SWEEP frequency [Hz], its rate ([Hz/s], of a logarithmic one [1/s]), size [m s-2] or, below
    zero, displacement [m], phase, 1 for logarithmic; of ROWS value [m s-2] and slope [m s-3]. ends (p,) [s], the last
    infinite.
    """

    kind: int
    pieces: np.ndarray
    ends: np.ndarray


def wave_of(drive) -> Wave:
    """The Wave of a drive of `core` or `structure.drives`."""
    if drive.segments:
        rows = [(s.start, s.constant, s.amplitude, s.omega, s.phase, 0.0) for s in drive.segments]
        return _wave(SINES, rows)
    if hasattr(drive, "low"):
        size = drive.acceleration if drive.displacement is None else -drive.displacement
        log = drive.logarithmic and drive.high != drive.low
        rate = np.log(drive.high / drive.low) if log else drive.high - drive.low
        turned = float(drive.phase(drive.duration))
        rows = [(0.0, drive.low, rate / drive.duration, size, 0.0, float(log)),
                (drive.duration, drive.high, 0.0, size, turned, 0.0)]
        return _wave(SWEEP, rows)
    time, value = np.asarray(drive.time, float), np.asarray(drive.value, float)
    rows = np.zeros((time.size, 6))
    rows[:, 0], rows[:-1, 1], rows[:-1, 2] = time, value[:-1], np.diff(value) / np.diff(time)
    return _wave(ROWS, rows)


def _wave(kind: int, rows) -> Wave:
    pieces = np.array(rows, float)
    return Wave(kind, pieces, np.append(pieces[1:, 0], np.inf))
