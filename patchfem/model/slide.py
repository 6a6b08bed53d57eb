"""The prescribed slide of a bench as samples of time and slide, and how finely it is cut."""

from dataclasses import dataclass
from functools import lru_cache
from math import ceil, sqrt

import numpy as np

from ..core import Missing, PatchfemError
from ..inputs import slides
from ..scene.keys.quantities import KINDS
from ..scene.rules.limits import refuse_lateral_slide

LEAST = 8  # steps between two rows of a path file: two of them are left in the coarsest run of the error estimate
REST = 4
MOST = 20_000  # steps per cycle
MOST_SAMPLES = 20_000_000  # of a path


@dataclass(frozen=True, eq=False, slots=True)
class SlidePath:
    """A prescribed slide. kind: "sine" and "triangle" repeat, "constant", "dwell" and "file" go once through corners.

    amplitude [m] half the range of one that returns, the distance of one that does not; frequency [Hz] of a sine; speed
    [m/s]; run_in [m] slid before a triangle starts; cycles; corners: (time (k,) [s], slide (k,) [m]) of straight legs
    or None; across: (k,) lateral slide [m] at the corners or None.
    """

    kind: str
    amplitude: float
    frequency: float | None
    speed: float | None
    run_in: float
    cycles: float | None
    corners: tuple | None
    across: np.ndarray | None

    @property
    def peak_speed(self) -> float:
        """Largest speed [m/s]."""
        if self.kind == "sine":
            return 2 * np.pi * self.frequency * self.amplitude
        if self.kind == "file":
            time, place = self.corners
            return float((_lengths(place, self.across) / np.diff(time)).max())
        return self.speed

    @property
    def period(self) -> float | None:
        """Period of the motion [s], None where it does not repeat."""
        if self.kind == "sine":
            return 1 / self.frequency
        return 4 * self.amplitude / self.speed if self.kind == "triangle" else None

    def samples(self, steps: int) -> tuple:
        """Samples of the slide at `steps` per cycle: (time, slide, first sample of the last cycle, drive omega).

        A constant slide, a dwell and a file count as one cycle. A triangle with a run-in first slides it, then goes
        back. Starts, ends and reversals are samples. A file is straight between its rows, and all of its rows are
        samples. Missing where the cycles take more than MOST_SAMPLES steps.
        """
        if self.kind == "constant":
            part = np.linspace(0, 1, steps + 1)
            return part * self.amplitude / self.speed, part * self.amplitude, 0, 0.0
        if self.corners is not None:
            return *_cut(*self.corners, steps, self.across), 0, 0.0
        count = max(1, round(self.cycles * steps))
        if count > MOST_SAMPLES:
            raise Missing(
                f"slide.cycles = {self.cycles:g} needs {count:.3g} steps, but at most "
                f"{MOST_SAMPLES:.0e} are possible; lower slide.cycles or accuracy.steps_per_cycle",
                "",
            )
        number = np.arange(count + 1)
        if self.kind == "sine":
            phase = 2 * np.pi * (number % steps) / steps
            time = number / (steps * self.frequency)
            return (
                time,
                self.amplitude * np.sin(phase),
                max(0, count - steps),
                2 * np.pi * self.frequency,
            )
        return self._triangle(number, steps)

    def _triangle(self, number, steps: int) -> tuple:
        quarter = (number % steps) / steps * 4
        wave = (
            np.where(quarter < 1, quarter, np.where(quarter < 3, 2 - quarter, quarter - 4))
            * self.amplitude
        )
        period = 4 * self.amplitude / self.speed
        time = number * period / steps
        if self.run_in:
            rows = max(2, ceil(steps * self.run_in / (4 * self.amplitude)))
            lead = np.linspace(0, self.run_in, rows + 1)
            time = np.concatenate([lead / self.speed, time[1:] + self.run_in / self.speed])
            wave = np.concatenate([lead, self.run_in - wave[1:]])
            return time, wave, max(0, wave.size - 1 - steps), 2 * np.pi / period
        return time, wave, max(0, number.size - 1 - steps), 2 * np.pi / period

    def steps(self, tolerance: float, pinned: int | None, length: float | None) -> int:
        """Steps per cycle that the tolerance asks for, or those that are pinned.

        A constant slide, a dwell and a file count them over the whole slide. They are a multiple of four, so that
        reversals are samples. length: of bonds [m] or None. A file counts as many cycles as its path has strokes there
        and back.
        """
        time, place = (None, None) if self.kind in ("sine", "triangle") else self._legs()
        legs = 0 if time is None or self.kind == "constant" else time.size - 1
        if pinned is not None:
            return 4 * ceil(max(pinned, LEAST * legs) / 4)
        # errors fall with the square of the step; 400 a cycle give about 1e-3
        base, cycles = 400 * sqrt(1e-3 / tolerance), 1.0
        if time is not None:
            path = float(_lengths(place, self.across).sum())
            cycles = max(
                1.0,
                path / (2 * (2 * self.amplitude if self.kind == "file" else float(np.ptp(place)))),
            )
            if length:
                base = max(base, 20 * min(path / cycles / length, 1000))
        return 4 * ceil(max(cycles * min(max(base, 100), MOST), LEAST * legs) / 4)

    def _legs(self) -> tuple:
        """Corners (time, slide) of a slide of straight legs."""
        if self.corners is not None:
            return self.corners
        return np.array([0.0, self.amplitude / self.speed]), np.array([0.0, self.amplitude])


def build_slide(scene) -> SlidePath:
    """The slide of a scene with [slide]; PatchfemError names what a path file lacks, or what in the scene cannot stand
    beside the lateral column of one."""
    slide, corners, across, amplitude = (
        scene.slide,
        None,
        None,
        scene.slide.amplitude or scene.slide.distance,
    )
    if slide.kind == "file":
        try:
            found = rows_of(scene.beside(slide.file))
        except PatchfemError as error:
            raise type(error)(f"{scene.where('slide.file')}: {error}") from None
        corners, across = found[:2], found[2] if len(found) == 3 else None
        amplitude = float(max(np.ptp(column) for column in found[1:])) / 2
        if across is not None and (reason := refuse_lateral_slide(scene.tables())):
            raise PatchfemError(f"{scene.where('slide.file')}: {reason}")
    elif slide.kind == "dwell":
        corners = _dwell_corners(slide)
    run_in = (slide.distance or 0.0) if slide.kind == "triangle" else 0.0
    return SlidePath(
        slide.kind, amplitude, slide.frequency, slide.speed, run_in, slide.cycles, corners, across
    )


def _dwell_corners(slide) -> tuple:
    """Ends (time, slide) of the legs of a dwell; a leg without duration is left out."""
    length = np.array([slide.distance, 0.0, slide.distance_after or 0.0])
    span = np.array([slide.distance / slide.speed, slide.hold, length[2] / slide.speed])
    kept = span > 0
    return np.append(0.0, np.cumsum(span[kept])), np.append(0.0, np.cumsum(length[kept]))


def _lengths(slide, across=None) -> np.ndarray:
    """Lengths [m] of straight legs between corners."""
    return np.abs(np.diff(slide)) if across is None else np.hypot(np.diff(slide), np.diff(across))


def rows_of(path) -> tuple:
    """Columns of a path file (`read_slide`), read once."""
    return _read(path, path.stat().st_mtime_ns if path.exists() else 0)


@lru_cache(maxsize=4)
def _read(path, stamp):
    return slides.read_slide(
        path, {"time": KINDS["time"], "displacement": KINDS["length"], "lateral": KINDS["length"]}
    )


def _cut(time, slide, steps: int, across=None) -> tuple:
    """Corners with straight samples between them: half the steps by path, half evenly over the legs that move.

    across: lateral slide at the corners. A rest is REST steps however long it is, because growth at rest (2.10) is
    exact in a step of any duration.
    """
    path = _lengths(slide, across)
    share = path / path.sum() / 2 + 1 / (2 * np.count_nonzero(path))
    pieces = np.where(path > 0, np.maximum(1, np.ceil(steps * share * (1 - 1e-12))), REST).astype(
        int
    )
    corner = np.concatenate([[0], np.cumsum(pieces)])
    number = np.arange(corner[-1] + 1)
    return np.interp(number, corner, time), np.interp(number, corner, slide)
