"""The normal load on a contact point, constant or oscillating, and the grooves on which the point climbs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core import Missing
from ..friction import grooves
from ..scene.rules.methods import find_climbed_grooves
from .slide import SlidePath

MAX_SLIDE_SAMPLES = 5_000_000  # largest number of samples in a slide; more take too much memory
# Fraction of the largest load below which a load is round-off of zero, so that the contact is lost.
MIN_LOAD_FRACTION = 1e-12
# Smallest time between two samples in periods of the load; closer samples are the
# same instant apart from round-off.
MIN_SAMPLE_SPACING = 1e-9


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
        return np.where(load > MIN_LOAD_FRACTION * (self.load + self.amplitude), load, 0.0)

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
        grid = np.union1d(time, inner[distance > MIN_SAMPLE_SPACING * period])
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


def build_grooves(scene) -> grooves.Grooves | None:
    """Build the grooves of [contact] or [normal] in a scene, or None if there are none or they are flat."""
    key = find_climbed_grooves(scene).strip("[]")
    if not key:
        return None
    keys = getattr(scene, key.partition(".")[0]).grooves
    return grooves.Grooves(keys.wavelength, keys.amplitude, keys.phase, keys.lifted_mass, key)


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
