"""What a scene prescribes at a contact: the slide of a bench with its samples, the normal load, and grooves."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, sqrt
from pathlib import Path
from typing import NamedTuple

import numpy as np

from .. import friction, inputs
from ..core import Missing, array_dataclass
from ..scene.rules.methods import find_climbed_grooves
from .source import cache_by_file, name_key

MAX_BENCH_STEPS_PER_CYCLE = 20_000  # largest number of steps per cycle; more would take too long
MAX_PATH_SAMPLES = 20_000_000  # largest number of samples in a path; more take too much memory
MAX_SLIDE_SAMPLES = 5_000_000  # largest number of samples in a slide; more take too much memory


class SlideSamples(NamedTuple):
    """Samples of a prescribed slide.

    - time: times (k,) [s].
    - rel_disp: relative displacement (k,) [m].
    - last_cycle: index of the first sample of the last cycle.
    - omega: circular frequency [rad/s] of the cycle, 0 for a slide that does not repeat.
    """

    time: np.ndarray
    rel_disp: np.ndarray
    last_cycle: int = 0
    omega: float = 0.0


@array_dataclass
class SlidePath:
    """Relative displacement that a bench prescribes over time.

    - kind: "sine" and "triangle" repeat; "constant", "dwell" and "file" run once through corners.
    - amplitude: half the range [m] of a slide that returns, the length [m] of one that does not.
    - frequency: frequency [Hz] of a sine, else None.
    - speed: speed [m/s] of a triangle, a constant slide or a dwell, else None.
    - run_in: distance [m] before a triangle starts.
    - cycles: number of cycles of a sine or a triangle, else None.
    - corners: time (k,) [s] and relative displacement (k,) [m] at the ends of straight legs, or None.
    """

    kind: str
    amplitude: float
    frequency: float | None
    speed: float | None
    run_in: float
    cycles: float | None
    corners: tuple | None

    @property
    def peak_speed(self) -> float:
        """Largest speed [m/s]."""
        if self.kind == "sine":
            return 2 * np.pi * self.frequency * self.amplitude
        if self.kind == "file":
            time, rel_disp = self.corners
            return float((np.abs(np.diff(rel_disp)) / np.diff(time)).max())
        return self.speed

    @property
    def period(self) -> float | None:
        """Period [s] of the motion, or None if it does not repeat."""
        if self.kind == "sine":
            return 1 / self.frequency
        return 4 * self.amplitude / self.speed if self.kind == "triangle" else None

    def samples(self, steps: int) -> SlideSamples:
        """Sample the slide with a number of steps per cycle.

        Starts, ends, reversals and the rows of a file are samples. A constant slide, a dwell and a
        file count as one cycle.

        Parameters
        ----------
        steps : int
            Number of steps per cycle.

        Returns
        -------
        SlideSamples
            Times [s] and relative displacements [m] (k,) of the samples, and the start of the last cycle.

        Raises
        ------
        Missing
            If the cycles take more than `MAX_PATH_SAMPLES` steps.
        """
        if self.corners is not None:
            return _sample_legs(*self.corners, steps)
        n_steps = max(1, round(self.cycles * steps))
        if n_steps > MAX_PATH_SAMPLES:
            raise Missing(
                f"slide.cycles = {self.cycles:g} needs {n_steps:.3g} steps, but at most "
                f"{MAX_PATH_SAMPLES:.0e} are possible; lower slide.cycles or accuracy.steps_per_cycle",
                "",
            )
        index = np.arange(n_steps + 1)
        if self.kind == "triangle":
            return self._sample_triangle(index, steps)
        phase = 2 * np.pi * (index % steps) / steps
        return SlideSamples(
            time=index / (steps * self.frequency),
            rel_disp=self.amplitude * np.sin(phase),
            last_cycle=max(0, n_steps - steps),
            omega=2 * np.pi * self.frequency,
        )

    def _sample_triangle(self, index, steps: int) -> SlideSamples:
        """Sample a triangle wave with a number of steps per cycle.

        `index` (k,) counts the samples from 0. After a run-in of the length `run_in` [m] the wave starts in the
        opposite direction.
        """
        quarter = index % steps / steps * 4
        rel_disp = self.amplitude * np.interp(quarter, (0, 1, 3, 4), (0, 1, -1, 0))
        period = 4 * self.amplitude / self.speed
        time = index * period / steps
        if self.run_in:
            n_run_in = max(2, ceil(steps * self.run_in / (4 * self.amplitude)))
            run_in = self.run_in * np.arange(n_run_in) / n_run_in
            time = np.concatenate([run_in, time * self.speed + self.run_in]) / self.speed
            rel_disp = np.concatenate([run_in, self.run_in - rel_disp])
        return SlideSamples(time, rel_disp, max(0, time.size - 1 - steps), 2 * np.pi / period)

    def steps(self, tolerance: float, pinned_steps: int | None, length: float | None) -> int:
        """Return the number of steps per cycle that is needed for a tolerance.

        It is a multiple of four, so that reversals are samples. A constant slide, a dwell and a file
        count as one cycle; a file gets as many times the steps of a cycle as its path has strokes
        there and back.

        Parameters
        ----------
        tolerance : float
            Relative error that is allowed.
        pinned_steps : int or None
            Number of steps that the scene gives instead.
        length : float or None
            Length [m] of the bonds.
        """
        legs = self.corners
        # Smallest number of steps per straight leg; the coarsest run of the error estimate keeps
        # two of them.
        min_steps = 0 if legs is None else 8 * (legs[0].size - 1)
        if pinned_steps is not None:
            return 4 * ceil(max(pinned_steps, min_steps) / 4)
        # 400 steps give an error of about 1e-3, which falls with the square of the time step
        per_cycle = 400 * sqrt(1e-3 / tolerance)
        cycles = 1.0
        if legs is not None:
            path = float(np.abs(np.diff(legs[1])).sum())
            cycles = max(1.0, path / (2 * float(np.ptp(legs[1]))))
            if length:
                # 20 steps resolve the length of a bond, for at most 1000 lengths per cycle
                bond_lengths = min(path / cycles / length, 1000)
                per_cycle = max(per_cycle, 20 * bond_lengths)
        # Smallest number of steps per cycle, which resolves the loop at any tolerance.
        per_cycle = min(max(per_cycle, 100), MAX_BENCH_STEPS_PER_CYCLE)
        return 4 * ceil(max(cycles * per_cycle, min_steps) / 4)


def build_slide(scene) -> SlidePath:
    """Build the prescribed slide of a scene with [slide].

    Parameters
    ----------
    scene : Scene
        Checked scene with [slide].

    Returns
    -------
    SlidePath

    Raises
    ------
    PatchfemError
        If a path file cannot be used.
    """
    keys = scene.slide
    corners = None
    amplitude = keys.amplitude or keys.distance
    if keys.kind == "file":
        with name_key("slide.file"):
            corners = read_path_file(scene.resolve_path(keys.file))
        amplitude = float(np.ptp(corners[1])) / 2
    elif keys.kind in ("constant", "dwell"):
        corners = _list_corners(keys)
    run_in = (keys.distance or 0.0) if keys.kind == "triangle" else 0.0
    return SlidePath(
        kind=keys.kind,
        amplitude=amplitude,
        frequency=keys.frequency,
        speed=keys.speed,
        run_in=run_in,
        cycles=keys.cycles,
        corners=corners,
    )


def _list_corners(keys) -> tuple[np.ndarray, np.ndarray]:
    """Return time (k,) [s] and displacement (k,) [m] at the corners of a constant slide or a dwell.

    Legs of no duration are left out.

    `keys` is the table [slide]: first leg, hold, and a second leg after a dwell.
    """
    length = np.array([keys.distance, 0.0, keys.distance_after or 0.0])
    duration = np.array([keys.distance / keys.speed, keys.hold or 0.0, length[2] / keys.speed])
    is_leg = duration > 0
    time = np.append(0.0, np.cumsum(duration[is_leg]))
    return time, np.append(0.0, np.cumsum(length[is_leg]))


@cache_by_file
def read_path_file(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Read time (k,) [s] and displacement (k,) [m] of a path file (`inputs.slides.read_slide`)."""
    return inputs.slides.read_slide(path)


def _sample_legs(time, rel_disp, steps: int) -> SlideSamples:
    """Sample the straight segments (legs) between corners at given times [s] and displacements [m].

    Half of the steps are spread by length, half evenly over the legs that move. A leg at rest gets four steps, because the
    growth of bonds at rest, eq. (2.10), is exact for any step.

    `time` and `rel_disp` (k,) are those of the corners, and `steps` is the number of steps in all.
    """
    length = np.abs(np.diff(rel_disp))
    fraction = length / length.sum() / 2 + 1 / (2 * np.count_nonzero(length))
    # A number of steps that is exactly an integer has a relative round-off below 1e-12.
    moving_steps = np.maximum(1, np.ceil(steps * fraction * (1 - 1e-12)))
    leg_steps = np.where(length > 0, moving_steps, 4).astype(int)
    corner_index = np.concatenate([[0], np.cumsum(leg_steps)])
    index = np.arange(corner_index[-1] + 1)
    return SlideSamples(
        np.interp(index, corner_index, time), np.interp(index, corner_index, rel_disp)
    )


@dataclass(frozen=True, slots=True)
class PointLoad:
    """Normal load on a point, which may oscillate: N(t) = max(0, load + amplitude cos(...)).

    - load: mean load [N].
    - amplitude: amplitude [N] of the oscillation, 0 for a constant load.
    - frequency: frequency [Hz] of the oscillation, or None.
    - phase: phase [rad] of the oscillation at t = 0.
    - width: width [m] of the pad across the path, or None.
    """

    load: float
    amplitude: float = 0.0
    frequency: float | None = None
    phase: float = 0.0
    width: float | None = None

    def evaluate(self, time) -> np.ndarray:
        """Evaluate the load (k,) [N] at times (k,) [s]; it is never negative."""
        load = self.load + self.amplitude * np.cos(
            2 * np.pi * self.frequency * np.asarray(time) + self.phase
        )
        # Fraction of the largest load below which a load is round-off of zero, so that the contact
        # is lost.
        return np.where(load > 1e-12 * (self.load + self.amplitude), load, 0.0)

    def refine_samples(
        self, slide: SlidePath, time, rel_disp, steps: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Add samples to a prescribed slide until they also resolve the oscillation of the load.

        The extremes of the load and the instants at which the contact is lost or made become samples.

        Parameters
        ----------
        slide : SlidePath
            Prescribed slide; the samples that are added follow its motion.
        time : (k,) array_like
            Times [s] of the samples of the slide.
        rel_disp : (k,) array_like
            Relative displacement [m] at these times.
        steps : int
            Number of samples per period of the load.

        Returns
        -------
        tuple of numpy.ndarray
            Time (j,) [s] and relative displacement (j,) [m], j >= k.

        Raises
        ------
        Missing
            If more than `MAX_SLIDE_SAMPLES` samples were needed.
        """
        period = 1 / self.frequency
        duration = time[-1] - time[0]
        if duration / period * steps + time.size > MAX_SLIDE_SAMPLES:
            raise Missing(
                f"the load oscillates {duration / period:.3g} times during the slide, which "
                f"{MAX_SLIDE_SAMPLES} samples cannot resolve; lower normal.frequency, slide.cycles or "
                "slide.hold",
                "",
            )
        inner = np.unique(self._times_in_periods(time, steps))
        inner = inner[(inner > time[0]) & (inner < time[-1])]

        # An added sample is no sample of the slide and no other added sample apart from round-off.
        after = np.searchsorted(time, inner)
        distance = np.minimum(inner - time[after - 1], time[after] - inner)
        distance = np.minimum(distance, np.diff(inner, prepend=-np.inf))
        # Smallest time between two samples in periods of the load; closer samples are the same
        # instant apart from round-off.
        grid = np.union1d(time, inner[distance > 1e-9 * period])
        if slide.kind == "sine":
            return grid, slide.amplitude * np.sin(2 * np.pi * slide.frequency * grid)
        return grid, np.interp(grid, time, rel_disp)

    def _times_in_periods(self, time, steps: int) -> np.ndarray:
        """Compute the times [s] of `steps` phases per load period, and of loss and start of contact.

        The periods cover the range of `time`.
        """
        period = 1 / self.frequency
        lag = self.phase / (2 * np.pi)
        first = np.floor(time[0] / period + lag) - 1
        periods = np.arange(first, time[-1] / period + lag + 2)
        parts = [periods[:, None] + np.arange(steps) / steps]
        if self.amplitude > self.load:
            zero = np.arccos(-self.load / self.amplitude) / (2 * np.pi)
            parts.append(periods[:, None] + np.array([zero, 1 - zero]))
        return (np.concatenate([part.ravel() for part in parts]) - lag) * period


def build_grooves(scene) -> friction.grooves.Grooves | None:
    """Build the grooves of [contact] or [normal] in a scene, or None if there are none or they are flat."""
    key = find_climbed_grooves(scene).strip("[]")
    if not key:
        return None
    keys = getattr(scene, key.partition(".")[0]).grooves
    return friction.grooves.Grooves(
        keys.wavelength, keys.amplitude, keys.phase, keys.lifted_mass, key
    )


def build_point_load(scene, rig=None) -> PointLoad | None:
    """Build the load of [normal] of a scene or of the first interface of its Rig, or None if neither gives one."""
    if rig is not None and scene.structure.interface:
        return PointLoad(rig.friction.interfaces[0].load)
    keys = scene.normal
    if keys is None:
        return None
    return PointLoad(
        keys.load, keys.amplitude or 0.0, keys.frequency, keys.phase or 0.0, keys.width
    )
