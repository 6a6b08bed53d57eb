"""Laws along the flanks of grooves for the harmonic balance: forces and slopes over one cycle of a periodic slide.

The vertical force V = N + m (t q'' + t' q'^2) follows from the slide alone. A law of the speed has F = V (t + phi)/(1
- phi t) at every instant. Elastic-plastic elements are slid along the cycle until it closes, and so are the derivatives
that Newton's method takes. Multipliers have those of one spring between the limits of the flank, whose stick begins
where the slide last turned in slip: what the normal force changes in a stick is left out of them.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

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


def _waves(grooves: Grooves, amplitude: float) -> int:
    """Samples of a cycle for the grooves that it passes."""
    return int(WAVES * min(grooves.wave * amplitude, 1000.0))


class Lift(NamedTuple):
    """Vertical force (N,) [N] at the samples, and its slopes over the slide [N/m], its rate [N s/m] and its
    acceleration [kg]."""

    force: np.ndarray
    slope: np.ndarray
    by_rate: np.ndarray
    by_bend: np.ndarray


def _lift(grooves: Grooves, load: float, track: Track) -> Lift:
    """What flanks carry upwards under a load [N]: V = N + m (t q'' + t' q'^2)."""
    m, t, turn = grooves.lifted_mass, grooves.slope(track.q), grooves.bend(track.q)
    if not m:
        return Lift(np.full(track.samples, load), 0 * t, 0 * t, 0 * t)
    v, a = track.omega * track.rate, track.omega**2 * track.bend
    return Lift(load + m * (t * a + turn * v**2), m * (turn * a - grooves.wave**2 * t * v**2), 2 * m * turn * v, m * t)


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
        lift, ratio, gain = _lift(g, self.load, track), (t + phi) / (1 - phi * t), 1 / (1 - phi * t)**2
        to_slide = gain * (bend * (1 + phi**2) + (1 + t**2) * rise * v * t * bend / path)
        to_rate = gain * (1 + t**2) * rise * path
        heavy = g.lifted_mass > 0
        return Sampled(lift.force * ratio, lift.force * to_slide + ratio * lift.slope,
                       lift.force * to_rate + ratio * lift.by_rate, None, self.static * self.load,
                       np.zeros(track.samples), None, ratio * lift.by_bend if heavy else None,
                       lift.force if heavy else None)


@dataclass(frozen=True, eq=False)
class ElasticFlank:
    """Elastic-plastic elements along the flank: those of a `climbing.ClimbingModel`."""

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
        kernels, states = compiled("dynamics.grooves.cycle_kernels"), np.empty((track.samples + 1, 3))
        num = np.array([self.model.load, g.wave, g.amplitude, g.phase, mu, self.length])
        lift, heavy, q = _lift(g, self.model.load, track), g.lifted_mass > 0, np.ascontiguousarray(track.q)
        turns = kernels.cycle(num, q, lift.force, states, MOST, ROUND * self.limit, np.empty(3))
        along, springs, normal = mu * states[:n, 0], states[:n, 1], states[:n, 2]
        t, bend = g.slope(track.q), g.bend(track.q)
        path, stiff = np.sqrt(1 + t**2), mu / self.length * springs

        def tangent():
            to_slide, to_vertical = self._varied(track, lift)
            out, room = np.empty_like(to_slide), np.empty((2, 3, to_slide.shape[1]))
            kernels.tangents(num, q, lift.force, states, turns, to_slide, to_vertical, np.empty((n, 3, 6)), np.empty(3),
                             *room, out)
            out *= (mu * path)[:, None]
            out += to_vertical * t[:, None] + to_slide * (lift.force * bend + along * t * bend / path)[:, None]
            return out[:, :-1], out[:, -1]

        full, way = np.abs(along) >= (1 - CLOSE) * mu * normal, np.sign(along)
        slips = _to_the_turn(full & (way * track.rate > 0), track.turning[2])
        stuck = lift.force * bend + along * t * bend / path + stiff * path**2
        slid = lift.force * bend * (1 + mu**2) / (1 - way * mu * t)**2
        share = np.where(slips, (t + way * mu) / (1 - way * mu * t), t)  # of the vertical force in the force
        slope, hold = np.where(slips, slid, stuck) + share * lift.slope, self._held(track, lift, slips, way, stiff)
        with np.errstate(divide="ignore", invalid="ignore"):
            stretch = np.where(springs > 0, self.length * states[:n, 0] / springs, 0.0)
        return Sampled(lift.force * t + along * path, slope, share * lift.by_rate if heavy else None, hold, self.limit,
                       self.limit * stretch / path, tangent, share * lift.by_bend if heavy else None,
                       lift.force if heavy else None)

    def _varied(self, track: Track, lift: Lift) -> tuple:
        """Derivatives (N, 2 H + 2) of slide [m] and vertical force [N] to the harmonics of the slide, real parts and
        then imaginary ones, and to the frequency."""
        k, angle = np.arange(track.x.size), np.arange(track.samples) * (2 * np.pi / track.samples)
        turned = np.exp(1j * np.outer(angle, k))
        waves = [np.concatenate([z.real, -z.imag[:, 1:]], axis=1) for z in (turned, 1j * k * turned, -k**2 * turned)]
        none = np.zeros((track.samples, 1))
        to_slide, to_rate, to_bend = (np.append(track.omega**order * wave, none, axis=1)
                                      for order, wave in enumerate(waves))
        to_rate[:, -1], to_bend[:, -1] = track.rate, 2 * track.omega * track.bend
        to_vertical = lift.slope[:, None] * to_slide + lift.by_rate[:, None] * to_rate + lift.by_bend[:, None] * to_bend
        return to_slide, to_vertical

    def _held(self, track: Track, lift: Lift, slips, way, spring) -> np.ndarray:
        """Derivatives (r, N) of the force to the places of the turning points, of a stick that began at one."""
        _, places, cells, _ = track.turning
        n, g, mu = track.samples, self.model.grooves, self.model.law.static
        hold = np.zeros((places.size, n))
        if not places.size or not slips.any():
            return hold
        t, bend = g.slope(places), g.bend(places)
        path, sign = np.sqrt(1 + t**2), way[cells]
        limit = sign * mu * lift.force[cells] * bend * (t + sign * mu) / (path * (1 - sign * mu * t)**2)  # of R over q
        limit += sign * mu * path / (1 - sign * mu * t) * lift.slope[cells]
        own = np.sqrt(1 + g.slope(track.q)**2)
        for k, cell in enumerate(cells):
            if not slips[cell]:
                continue
            after = (cell + 1 + np.arange(n)) % n
            end = int(np.argmax(slips[after])) if slips[after].any() else n
            held = after[:end]
            hold[k, held] = own[held] * (limit[k] - spring[after[0]] * path[k])
        return hold
