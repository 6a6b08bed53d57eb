"""Half swings of a measured decay, one after the other, by a sine fitted to each.

A half swing lies between two turns. About its middle it is a sine beside a level of its own: of dry friction exactly,
m + S/2 sin(w (t - t_k)), of a viscous decay with a factor exp(-s (t - t_k)) before the sine. Either is followed through
the record from its beginning, and the one that leaves less is taken.
"""

from typing import NamedTuple

import numpy as np

from ..core import PatchfemError
from ..response.decay_curve import HalfSwings, smooth_slopes

FEWEST = 5  # samples of a half swing
SINE = 3e-5  # of half a period and of a half swing, what a sine fitted to few samples leaves without noise
FAINT = 0.25  # standard deviation over the size of a half swing, from which on it is lost in noise
PASSES = 3  # over all half swings, each with the half periods and rates of the one before
TURNS = 4  # passes over a half swing until its middle stays
AWAY = 0.35  # of half a period, by which a middle may lie elsewhere than foreseen
BESIDE = 8  # half swings on both sides whose remainders make the noise of one
# of the highest line, frequencies of the first cycle that are tried
GRID = np.linspace(0.75, 1.3, 56)
UNEVEN = 10.0  # times the step of a record at its dense places, beyond which its gaps are named
STEADY = 0.3  # by which the next half period may differ from the last


class _Half(NamedTuple):
    """One half swing: middle [s], size with its sign, half period [s], standard deviations of middle and size per unit
    of noise, sum of squares left over and degrees of freedom."""

    middle: float
    size: float
    length: float
    middle_share: float
    size_share: float
    left: float
    free: int


def half_swings(time, value) -> HalfSwings:
    """Half swings of a trace, value (k,) at times (k,) [s] from where nothing drives any more; sizes in its unit.

    PatchfemError for a trace in which nothing swings, or with fewer than FEWEST samples of a half swing.
    """
    if time.size < 4 * FEWEST:
        raise PatchfemError(
            f"the free decay has {time.size} samples; at least {4 * FEWEST} are needed"
        )
    tracked = _followed(time, value, _first(time, value))
    tries = [tracked, tracked]
    for _ in range(PASSES if len(tracked) > 2 else 0):
        tries = [
            _again(time, value, one, viscous) for viscous, one in enumerate(tries) if len(one) > 2
        ]
    best = min(tries, key=lambda one: _noise(one).mean() if len(one) > 2 else np.inf, default=[])
    if len(best) < 3:
        middle, length = _first(time, value)
        if why := next(
            filter(None, (_sparse(time, middle + k * length, length) for k in range(3))), ""
        ) or _uneven(time):
            raise PatchfemError(
                f"fewer than three half cycles of a free decay have samples enough: {why}"
            )
        raise PatchfemError(
            "fewer than three half cycles of a free decay rise above the noise; begin the record after "
            "the drive has ended (--begin), and take at least 10 samples per cycle"
        )
    noise = _noise(best)
    columns = np.array([one[:5] for one in best]).T
    size = np.abs(columns[1])
    return HalfSwings(
        columns[0],
        size,
        np.maximum(noise * columns[3], SINE * columns[2]),
        np.maximum(noise * columns[4], SINE * size),
    )


def sparse_after(time, swings: HalfSwings) -> str:
    """Why half swings end before the record of times (k,) [s] does, where it has too few samples behind them, else
    ""."""
    length = swings.middle[-1] - swings.middle[-2]
    return _sparse(time, float(swings.middle[-1] + length), float(length))


def _sparse(time, middle: float, length: float) -> str:
    """Words on a half cycle [s] about a middle [s] with fewer than FEWEST samples; "" of another, and at the end."""
    low, high = middle - length / 2, middle + length / 2
    count = int(np.diff(np.searchsorted(time, (low, high)))[0])
    if count >= FEWEST or high > time[-1]:
        return ""
    return f"the half cycle from {low:.4g} s to {high:.4g} s has {count} samples, and at least {FEWEST} are needed"


def _uneven(time) -> str:
    """Words on a record whose samples lie UNEVEN times as far apart at some places as at others; "" of any other."""
    near, far = np.quantile(np.diff(time), (0.1, 1.0))
    return (
        f"the samples lie up to {far:.3g} s apart, elsewhere {near:.3g} s"
        if far > UNEVEN * near
        else ""
    )


def _first(time, value) -> tuple:
    """(middle [s], half period [s]) of the first half swing of the highest line of a record."""
    even = np.linspace(time[0], time[-1], time.size)
    lines = np.abs(
        np.fft.rfft(
            np.interp(even, time, value - value.mean()) * np.hanning(2 * even.size)[even.size :],
            8 * even.size,
        )
    )
    lines[:8] = 0.0
    line = int(np.argmax(lines)) / (8 * even.size * (even[1] - even[0]))
    if not line > 0 or not np.ptp(value) > 0:
        raise PatchfemError("the record contains no oscillation")
    best = None
    for f in line * GRID:
        part = time - time[0] <= 1 / f
        if np.count_nonzero(part) < 2 * FEWEST:
            raise PatchfemError(
                f"the record has {np.count_nonzero(part)} samples per cycle of {f:.4g} Hz; at least "
                f"{2 * FEWEST} are needed"
            )
        turn = 2 * np.pi * f * (time[part] - time[0])
        columns = np.stack([np.ones(turn.size), np.cos(turn), np.sin(turn)], axis=1)
        x = np.linalg.lstsq(columns, value[part], rcond=None)[0]
        left = float(np.mean((columns @ x - value[part]) ** 2))
        if best is None or left < best[0]:
            best = left, f, float(np.arctan2(-x[1], x[2]))  # a sine of this phase
    _, f, phase = best
    start = phase / (2 * np.pi * f) % (0.5 / f)
    return time[0] + start + (0.5 / f if start < 0.24 / f else 0.0), 0.5 / f


def _followed(time, value, first: tuple) -> list:
    """The `_Half`s of a record from the first one on, until one is lost."""
    middle, length = first
    out = []
    while middle + length / 2 <= time[-1]:
        found = _fitted(time, value, middle, length, 0.0)
        if found is None or (out and found.size * out[-1].size > 0):
            break
        spread = np.sqrt(found.left / found.free) * found.size_share
        if spread > FAINT * abs(found.size):
            break
        out.append(found)
        if len(out) > 2:
            near = out[-6:]
            length = (near[-1].middle - near[0].middle) / (len(near) - 1)
        elif len(out) == 2 and abs(out[1].middle - out[0].middle - length) < STEADY * length:
            length = out[1].middle - out[0].middle
        middle = found.middle + length
    return out


def _again(time, value, found: list, viscous) -> list:
    """The half swings fitted with the half periods and rates that their neighbours tell, whose noise is small."""
    noise = _noise(found)
    middle, size, share, wide = (
        np.array([getattr(one, name) for one in found])
        for name in ("middle", "size", "middle_share", "size_share")
    )
    lengths = smooth_slopes(middle, noise * share)
    rates = (
        -smooth_slopes(np.log(np.abs(size)), noise * wide / np.abs(size)) / lengths
        if viscous
        else 0 * lengths
    )
    out = [
        _fitted(time, value, one.middle, length, rate)
        for one, length, rate in zip(found, lengths, rates)
    ]
    return out[: next((k for k, one in enumerate(out) if one is None), len(out))]


def _fitted(time, value, middle: float, length: float, rate: float) -> _Half | None:
    """The half swing about a middle, which moves by AWAY of half a period at most; None where there is none."""
    begin = middle
    for _ in range(TURNS):
        part = slice(*np.searchsorted(time, (middle - length / 2, middle + length / 2)))
        t = time[part] - middle
        if t.size < FEWEST:
            return None
        turn, fall = np.pi * t / length, np.exp(-rate * t)
        columns = np.stack([np.ones(t.size), fall * np.sin(turn), fall * np.cos(turn)], axis=1)
        x = np.linalg.lstsq(columns, value[part], rcond=None)[0]
        move = -float(np.arctan2(x[2] * np.sign(x[1]), abs(x[1]))) * length / np.pi
        if not abs(middle + move - begin) <= AWAY * length:
            return None
        if abs(move) < 1e-9 * length:
            break
        middle += move
    spread = np.sqrt(np.diag(np.linalg.pinv(columns.T @ columns)))
    left = columns @ x - value[part]
    size = float(np.hypot(x[1], x[2]) * np.sign(x[1]))
    return _Half(
        middle,
        2 * size,
        length,
        float(spread[2]) / max(abs(size), 1e-300) * length / np.pi,
        2 * float(spread[1]),
        float(left @ left),
        t.size - 3,
    )


def _noise(found: list) -> np.ndarray:
    """Standard deviation (k,) of the samples about each half swing, from what it and its neighbours leave over."""
    left, free = (
        np.array([getattr(one, name) for one in found], float) for name in ("left", "free")
    )
    ends = np.arange(len(found))
    low, high = np.maximum(ends - BESIDE, 0), np.minimum(ends + BESIDE + 1, len(found))
    whole, many = (np.concatenate([[0.0], np.cumsum(one)]) for one in (left, free))
    return np.sqrt((whole[high] - whole[low]) / (many[high] - many[low]))
