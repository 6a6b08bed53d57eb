"""The load of [normal]: constant or N = max(0, load + amplitude cos(2 pi f t + phase)), and a bench's samples of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core import Missing
from ..friction import grooves
from .slide import SlidePath

MOST_SAMPLES = 5_000_000


@dataclass(frozen=True, slots=True)
class PointLoad:
    """A load on one point.

    load [N]; amplitude [N] of its oscillation, or 0; frequency [Hz]; phase [rad]; width [m] across the path or None.
    """

    load: float
    amplitude: float = 0.0
    frequency: float | None = None
    phase: float = 0.0
    width: float | None = None

    def at(self, time) -> np.ndarray:
        """Load (k,) [N], >= 0, at the times (k,) [s]: max(0, load + amplitude cos(2 pi f t + phase))."""
        load = self.load + self.amplitude * np.cos(
            2 * np.pi * self.frequency * np.asarray(time) + self.phase
        )
        # round-off carries nothing
        return np.where(load > 1e-12 * (self.load + self.amplitude), load, 0.0)

    def refined(self, slide: SlidePath, time, place, steps: int) -> tuple:
        """Samples of a slide, (time, slide), that are fine enough for the load as well.

        There are `steps` to a period of the load; its extremes and the instants at which the contact is lost or made
        are samples. Missing where that is too many.
        """
        period, span = 1 / self.frequency, time[-1] - time[0]
        if span / period * steps + time.size > MOST_SAMPLES:
            raise Missing(
                f"the load oscillates {span / period:.3g} times during the slide, which {MOST_SAMPLES} "
                "samples cannot resolve; lower normal.frequency, slide.cycles or slide.hold",
                "",
            )
        lag = self.phase / (2 * np.pi)
        marks = np.arange(np.floor(time[0] / period + lag) - 1, time[-1] / period + lag + 2)
        inner = [marks[:, None] + np.arange(steps) / steps]
        if self.amplitude > self.load:
            edge = np.arccos(-self.load / self.amplitude) / (2 * np.pi)
            inner += [marks[:, None] + np.array([edge, 1 - edge])]
        extra = (np.concatenate([part.ravel() for part in inner]) - lag) * period
        grid = np.union1d(time, extra[(extra > time[0]) & (extra < time[-1])])
        kept = np.append(True, np.diff(grid) > 1e-9 * period) | np.isin(grid, time)
        grid = grid[kept]
        if slide.kind == "sine":
            return grid, slide.amplitude * np.sin(2 * np.pi * slide.frequency * grid)
        return grid, np.interp(grid, time, place)


def build_grooves(scene) -> grooves.Grooves | None:
    """The grooves of [contact] or [normal] that the load climbs; None without them, and where they are flat."""
    for name in ("contact", "normal"):
        table = getattr(scene, name)
        if table is not None and table.grooves is not None and table.grooves.amplitude:
            g = table.grooves
            return grooves.Grooves(
                g.wavelength, g.amplitude, g.phase, g.lifted_mass, f"{name}.grooves"
            )
    return None


def build_point_load(scene) -> PointLoad | None:
    """The load of [normal], or of the first [[structure.interface]].

    None where a patch carries it or nothing does.
    """
    if scene.structure is not None and scene.structure.interface:
        return PointLoad(scene.structure.interface[0].normal_load)
    normal = scene.normal
    if normal is None:
        return None
    return PointLoad(
        normal.load, normal.amplitude or 0.0, normal.frequency, normal.phase or 0.0, normal.width
    )
