"""The prescribed slide of a bench as samples of time and slide, and how finely it is cut."""

from functools import lru_cache
from math import ceil, sqrt

import numpy as np

from ..core import Missing
from ..inputs.paths import read_path
from ..scene.quantities import KINDS

LEAST = 8  # steps between two rows of a path file: two of them are left in the coarsest run of the error estimate
REST = 4
MOST = 20_000  # steps per cycle
MOST_SAMPLES = 20_000_000  # of a path


def path_of(scene, steps: int) -> tuple:
    """(time, slide, first sample of the last cycle, drive omega): the prescribed path at `steps` per cycle.

    A constant slide, a dwell and a file count as one cycle. A triangle with a run-in first slides `distance`, then goes
    back. Starts, ends and reversals are samples; a file is straight between its rows, which are samples all.
    """
    slide = scene.slide
    if slide.kind == "constant":
        part = np.linspace(0, 1, steps + 1)
        return part * slide.distance / slide.speed, part * slide.distance, 0, 0.0
    if slide.kind == "dwell":
        return *_cut(*_dwell_corners(slide), steps), 0, 0.0
    if slide.kind == "file":
        return *_cut(*file_corners(scene), steps, _across(scene)), 0, 0.0
    count = max(1, round(slide.cycles * steps))
    if count > MOST_SAMPLES:
        raise Missing(f"{scene.path}: slide.cycles = {slide.cycles:g} takes {count:.3g} steps, more than "
                      f"{MOST_SAMPLES:.0e}; lower slide.cycles or accuracy.steps_per_cycle")
    number = np.arange(count + 1)
    if slide.kind == "sine":
        phase = 2 * np.pi * (number % steps) / steps
        time = number / (steps * slide.frequency)
        return time, slide.amplitude * np.sin(phase), max(0, count - steps), 2 * np.pi * slide.frequency
    quarter = (number % steps) / steps * 4
    wave = np.where(quarter < 1, quarter, np.where(quarter < 3, 2 - quarter, quarter - 4)) * slide.amplitude
    period = 4 * slide.amplitude / slide.speed
    time = number * period / steps
    if slide.distance:
        run_in = max(2, ceil(steps * slide.distance / (4 * slide.amplitude)))
        lead = np.linspace(0, slide.distance, run_in + 1)
        time = np.concatenate([lead / slide.speed, time[1:] + slide.distance / slide.speed])
        wave = np.concatenate([lead, slide.distance - wave[1:]])
        return time, wave, max(0, wave.size - 1 - steps), 2 * np.pi / period
    return time, wave, max(0, count - steps), 2 * np.pi / period


def _dwell_corners(slide) -> tuple:
    """(time, slide) of the ends of the legs of a dwell; a leg without duration is left out."""
    length = np.array([slide.distance, 0.0, slide.distance_after or 0.0])
    span = np.array([slide.distance / slide.speed, slide.hold, length[2] / slide.speed])
    kept = span > 0
    return np.append(0.0, np.cumsum(span[kept])), np.append(0.0, np.cumsum(length[kept]))


def file_corners(scene) -> tuple:
    """(time [s], slide [m]) as the path file of the scene has them."""
    return _table(scene)[:2]


def lateral_corners(scene) -> tuple | None:
    """(time [s], lateral slide [m]) where the scene slides by a path file with that column, else None."""
    found = _table(scene) if scene.slide is not None and scene.slide.kind == "file" else ()
    return (found[0], found[2]) if len(found) == 3 else None


def _across(scene):
    """(k,) lateral slide [m] at the corners of a path file, None for a slide along x alone."""
    corners = lateral_corners(scene)
    return None if corners is None else corners[1]


def _lengths(slide, across=None) -> np.ndarray:
    """Lengths [m] of straight legs between corners."""
    return np.abs(np.diff(slide)) if across is None else np.hypot(np.diff(slide), np.diff(across))


def _table(scene) -> tuple:
    path = scene.beside(scene.slide.file)
    return _read(path, path.stat().st_mtime_ns if path.exists() else 0)


@lru_cache(maxsize=4)
def _read(path, stamp):
    return read_path(path, {"time": KINDS["time"], "displacement": KINDS["length"], "lateral": KINDS["length"]})


def _cut(time, slide, steps: int, across=None) -> tuple:
    """The corners with straight samples between them: half the steps by path, half evenly over the legs that move;
    across: lateral slide at the corners.

    A rest is REST steps however long it is: growth at rest (2.10) is exact in a step of any duration.
    """
    path = _lengths(slide, across)
    share = path / path.sum() / 2 + 1 / (2 * np.count_nonzero(path))
    pieces = np.where(path > 0, np.maximum(1, np.ceil(steps * share * (1 - 1e-12))), REST).astype(int)
    corner = np.concatenate([[0], np.cumsum(pieces)])
    number = np.arange(corner[-1] + 1)
    return np.interp(number, corner, time), np.interp(number, corner, slide)


def peak_speed(scene) -> float:
    """Largest speed of the path [m/s]."""
    slide = scene.slide
    if slide.kind == "sine":
        return 2 * np.pi * slide.frequency * slide.amplitude
    if slide.kind == "file":
        time, place = file_corners(scene)
        return float((_lengths(place, _across(scene)) / np.diff(time)).max())
    return slide.speed


def amplitude(scene) -> float:
    """Half the range of a slide that returns, the distance of one that does not [m]; for a file half the range."""
    slide = scene.slide
    return _range(scene) / 2 if slide.kind == "file" else slide.amplitude or slide.distance


def _range(scene) -> float:
    """Range of the path of a file [m], of the wider one of its two directions."""
    return float(max(np.ptp(column) for column in _table(scene)[1:]))


def steps_of(scene) -> int:
    """Steps per cycle (of the whole slide for a constant one, a dwell, a file), even quarters so that reversals are
    samples. A file counts as many cycles as its path has strokes there and back over its range."""
    pinned, slide = scene.accuracy.steps_per_cycle, scene.slide
    time, place = (None, None) if slide.kind in ("sine", "triangle") else path_corners(scene)
    legs = 0 if time is None or slide.kind == "constant" else time.size - 1
    if pinned is not None:
        return 4 * ceil(max(pinned, LEAST * legs) / 4)
    base, cycles = 400 * sqrt(1e-3 / scene.accuracy.tolerance), 1.0
    if time is not None:
        path = float(_lengths(place, _across(scene)).sum())
        cycles = max(1.0, path / (2 * (_range(scene) if slide.kind == "file" else float(np.ptp(place)))))
        if scene.friction.bond_length:
            base = max(base, 20 * min(path / cycles / scene.friction.bond_length, 1000))
    return 4 * ceil(max(cycles * min(max(base, 100), MOST), LEAST * legs) / 4)


def path_corners(scene) -> tuple:
    """(time, slide) of the corners of a slide of straight legs."""
    slide = scene.slide
    if slide.kind == "file":
        return file_corners(scene)
    if slide.kind == "dwell":
        return _dwell_corners(slide)
    return np.array([0.0, slide.distance / slide.speed]), np.array([0.0, slide.distance])
