"""Laws along the flanks of grooves for the harmonic balance: forces and slopes over one cycle of a periodic slide.

No mass is lifted: the vertical force is the load N. A law of the speed has F = N (t + phi)/(1 - phi t) at every
instant. Elastic-plastic elements are slid along the cycle until it closes; the slopes that Newton's method takes are
those of one spring mu R/eps between the limits of the flank, whose stick begins where the slide last turned in slip.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...compiled import load as compiled
from ...friction.grooves import Grooves
from ..harmonic.laws import SHARPEST, Sampled, Track
from .climbing import ClimbingModel

WAVES = 24  # samples over a groove, where the slide is fastest
MOST = 12  # cycles until the law repeats
CLOSE = 1e-9  # share of the limit within which an element slips
ROUND = 1e-12  # of the limit, to which the law repeats


def _to_the_turn(slips, cells) -> np.ndarray:
    """Slips (N,) that go on, once begun, to the next turning point: cells (r,), the samples before these."""
    out, n = slips.copy(), slips.size
    for first, last in zip(np.roll(cells, 1), cells):
        part = (first + 1 + np.arange((last - first - 1) % n + 1)) % n
        out[part] = np.logical_or.accumulate(slips[part])
    return out


def _springs(normal, slips, cells) -> np.ndarray:
    """Load (N,) [N] of the springs that stand: the largest normal force (N,) [N] since a stick began, which a falling
    one leaves as they are."""
    out, n = normal.copy(), slips.size
    for cell in cells:
        after = (cell + np.arange(n)) % n
        end = 1 + int(np.argmax(slips[after[1:]])) if slips[after[1:]].any() else n
        out[after[:end]] = np.maximum.accumulate(normal[after[:end]])
    return out


def _waves(grooves: Grooves, amplitude: float) -> int:
    """Samples of a cycle for the grooves that it passes."""
    return int(WAVES * min(grooves.wave * amplitude, 1000.0))


@dataclass(frozen=True, eq=False, slots=True)
class PacedFlank:
    """mu tanh(sqrt(1 + t^2) v/v_0) along the flank, under a load [N]; static: mu; speed: v_0 [m/s]."""

    grooves: Grooves
    load: float
    static: float
    speed: float

    @property
    def total(self) -> float:
        """Stiffness at rest [N/m]: of the grooves alone."""
        return self.grooves.stiffness(self.load)

    def sharpness(self, amplitude: float) -> int:
        """Samples for the grooves that a cycle passes."""
        return _waves(self.grooves, amplitude)

    def sample(self, track: Track) -> Sampled:
        """Force and slopes at the samples."""
        g, v = self.grooves, track.omega * track.rate
        t, bend = g.slope(track.q), g.bend(track.q)
        path = np.sqrt(1 + t**2)
        phi = self.static * np.tanh(path * v / self.speed)
        rise = (self.static - phi**2 / self.static if self.static > 0 else 0 * phi) / self.speed  # over the path's rate
        gain = self.load / (1 - phi * t)**2
        slope = gain * (bend * (1 + phi**2) + (1 + t**2) * rise * v * t * bend / path)
        return Sampled(self.load * (t + phi) / (1 - phi * t), slope, gain * (1 + t**2) * rise * path, None,
                       self.static * self.load, np.zeros(track.samples))


@dataclass(frozen=True, eq=False)
class ElasticFlank:
    """Elastic-plastic elements along the flank: a `climbing.ClimbingModel` without a lifted mass."""

    model: ClimbingModel

    @property
    def length(self) -> float:
        """Slide over which they stretch before they slip [m]."""
        return self.model.length

    @cached_property
    def limit(self) -> float:
        """Friction limit mu N [N] at the bottom."""
        return self.model.law.static * self.model.load

    @property
    def total(self) -> float:
        """Tangent stiffness at rest [N/m]."""
        return self.model.grooves.stiffness(self.model.load) + self.limit / self.length

    def sharpness(self, amplitude: float) -> int:
        """Samples of a cycle that resolve a stick, and the grooves that it passes."""
        angle = np.arccos(max(1 - 2 * self.length / max(amplitude, 1e-300), -1.0))
        return max(int(min(SHARPEST * 2 * np.pi / max(angle, 1e-9), 65536)), _waves(self.model.grooves, amplitude))

    def sample(self, track: Track) -> Sampled:
        """The periodic state that a virgin contact reaches, and its slopes."""
        n, g, mu = track.samples, self.model.grooves, self.model.law.static
        along, normal, stretch = np.zeros((3, n))
        compiled("dynamics.grooves.cycle_kernels").cycle(np.ascontiguousarray(track.q), self.model.build()[0], along,
                                                         normal, stretch, MOST, ROUND * self.limit)
        t, bend = g.slope(track.q), g.bend(track.q)
        path = np.sqrt(1 + t**2)
        full, way = np.abs(along) >= (1 - CLOSE) * mu * normal, np.sign(along)
        slips = _to_the_turn(full & (way * track.rate > 0), track.turning[2])
        spring = mu / self.length * _springs(normal, slips, track.turning[2])
        stuck = self.model.load * bend + along * t * bend / path + spring * path**2
        slid = self.model.load * bend * (1 + mu**2) / (1 - way * mu * t)**2
        slope, hold = np.where(slips, slid, stuck), self._held(track, slips, way, spring)
        return Sampled(self.model.load * t + along * path, slope, None, hold, self.limit,
                       self.limit * stretch / path)

    def _held(self, track: Track, slips, way, spring) -> np.ndarray:
        """Derivatives (r, N) of the force to the places of the turning points, of a stick that began at one."""
        _, places, cells, _ = track.turning
        n, g, mu = track.samples, self.model.grooves, self.model.law.static
        hold = np.zeros((places.size, n))
        if not places.size or not slips.any():
            return hold
        t, bend = g.slope(places), g.bend(places)
        path, sign = np.sqrt(1 + t**2), way[cells]
        limit = sign * mu * self.model.load * bend * (t + sign * mu) / (path * (1 - sign * mu * t)**2)  # of R over q
        own = np.sqrt(1 + g.slope(track.q)**2)
        for k, cell in enumerate(cells):
            if not slips[cell]:
                continue
            after = (cell + 1 + np.arange(n)) % n
            end = int(np.argmax(slips[after])) if slips[after].any() else n
            held = after[:end]
            hold[k, held] = own[held] * (limit[k] - spring[after[0]] * path[k])
        return hold
