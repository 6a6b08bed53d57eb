"""Pieces and tones of a drive signal, or of a prescribed slide, for the engine."""

from typing import NamedTuple

import numpy as np

from ..core import SineDrive
from .records import Piece


class Signal(NamedTuple):
    """Drive in the form that the engine takes.

    - pieces (P, 9), tones (Q, 3): see `records.Rig`
    - period: duration [s] of a cycle
    - shortest_period: of the highest frequency [s]
    - repeat: cycles after which it repeats, 0 if never
    """

    pieces: np.ndarray
    tones: np.ndarray
    period: float
    shortest_period: float
    repeat: int


def make_signal(drive) -> Signal:
    """Return the Signal of a drive of `structure.drives`, `structure.tones` or `structure.noise`."""
    if isinstance(drive, SineDrive):
        tones = [(drive.acceleration, drive.omega, 0.0)]
        return make_tones(tones, drive.period)
    if drive.segments:
        pieces = [
            _make_piece(
                s.start, constant=s.constant, amplitude=s.amplitude, omega=s.omega, phase=s.phase
            )
            for s in drive.segments
        ]
        return Signal(np.array(pieces), np.zeros((0, 3)), drive.period, drive.period, 1)
    if hasattr(drive, "low"):
        return make_sweep(drive)
    if hasattr(drive, "tones"):
        return make_tones(drive.tones, drive.period, repeat=0)
    return make_record(drive.time, drive.value, drive.period)


def make_tones(tones, period: float, repeat: int = 1) -> Signal:
    """Return the Signal of a sum of sines.

    Parameters
    ----------
    tones : (Q, 3) array_like
        Amplitude [m s-2], circular frequency [rad/s] and phase [rad] of each sine.
    period : float
        Duration [s] of a cycle.
    repeat : int
        Number of cycles after which all sines repeat; 0 for never.
    """
    tones = np.array(tones, float).reshape(-1, 3)
    shortest = 2 * np.pi / max(tones[:, 1].max(initial=0.0), 2 * np.pi / period)
    return Signal(np.zeros((0, len(Piece))), tones, period, shortest, repeat)


def make_record(time, value, period: float) -> Signal:
    """Return the Signal of rows (k,) of times [s] and values, linear between them and 0 afterwards.

    Parameters
    ----------
    time : (k,) array_like
        Times [s].
    value : (k,) array_like
        Values at these times.
    period : float
        Duration of a cycle [s].
    """
    time = np.asarray(time, float)
    value = np.asarray(value, float)
    slopes = np.diff(value) / np.diff(time)
    pieces = np.zeros((time.size, len(Piece)))
    pieces[:, Piece.START] = time
    pieces[:-1, Piece.CONSTANT] = value[:-1]
    pieces[:-1, Piece.SLOPE] = slopes
    return Signal(pieces, np.zeros((0, 3)), period, period, 0)


def make_sweep(drive) -> Signal:
    """Return the Signal of a `structure.drives.SweepDrive`."""
    low = 2 * np.pi * drive.low
    high = 2 * np.pi * drive.high
    growth = chirp = 0.0
    if drive.logarithmic:
        growth = np.log(high / low) / drive.duration
    else:
        chirp = (high - low) / drive.duration
    amplitude = drive.acceleration if drive.displacement is None else drive.displacement
    squared = drive.displacement is not None
    phase = float(drive.phase(drive.duration))
    pieces = [
        _make_piece(
            0.0, amplitude=amplitude, omega=low, chirp=chirp, growth=growth, squared=squared
        ),
        _make_piece(drive.duration, amplitude=amplitude, omega=high, phase=phase, squared=squared),
    ]
    shortest = 2 * np.pi / max(low, high)
    return Signal(np.array(pieces), np.zeros((0, 3)), drive.period, shortest, 0)


def _make_piece(start: float, **columns) -> np.ndarray:
    """Return a piece of a drive from its columns by their names in `records.Piece`; the others are 0."""
    piece = np.zeros(len(Piece))
    piece[Piece.START] = start
    for name, value in columns.items():
        piece[Piece[name.upper()]] = value
    return piece
