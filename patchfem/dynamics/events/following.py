"""The motion that is left under a slow sine once the free motion of a stick set has died out: long pieces of it.

A drive far below the modes takes thousands of short pieces a cycle, though after some hundred periods of the modes all
of the motion follows the drive. From there on it is its particular solution, whose series reaches as far as the drive's
own.
"""

from functools import cached_property
from math import log

import numpy as np

from .signals import EPS, ORDER, REACH

DEAD = 64 * EPS  # free motion over the forced one below which it is round-off
WORTH = 2.0  # how much longer than a short piece a long one must be
FIRST = 8  # short pieces after an event before the free motion is looked at


class Forced:
    """Particular solution of a stick set under constant + amplitude sin(omega t).

    inside (n, r): a basis of the motions that the stuck faces leave; per (n,) complex: coordinates per amplitude, as a
    multiple of exp(i phase); rest (n, n): constant pull to coordinates; decay [1/s] of the slowest free motion. dies:
    whether all free motion dies out, which a rigid or an undamped one does not.
    """

    def __init__(self, system, flow, omega: float):
        rows, n = system.faces[flow.stuck], system.n
        _, sizes, right = np.linalg.svd(rows) if len(rows) else (None, np.zeros(0), np.eye(n))
        self.inside = right[int(np.count_nonzero(sizes > 1e-9 * max(sizes.max(initial=0.0), 1e-300))):].T
        self.system, self.flow, self.omega = system, flow, omega
        stiff, damp = self._within(np.diag(system.square)), self._within(system.dampers)
        self.decay = self._slowest(stiff, damp)
        self.dies = self.inside.shape[1] > 0 and self.decay > 0
        if self.dies:
            dynamic = stiff - omega**2 * np.eye(len(stiff)) + 1j * omega * damp
            self.per = self.inside @ np.linalg.solve(dynamic, -(self.inside.T @ system.base))
            self.rest = self.inside @ np.linalg.solve(stiff, self.inside.T)

    def _within(self, matrix):
        return self.inside.T @ matrix @ self.inside

    def _slowest(self, stiff, damp) -> float:
        """Slowest decay [1/s] of the free motion, 0 where some of it stays."""
        r = len(stiff)
        if r == 0:
            return 0.0
        scale = max(float(np.sqrt(np.abs(stiff).max())), 1e-300)
        rates = np.linalg.eigvals(np.block([[np.zeros((r, r)), np.eye(r)], [-stiff / scale**2, -damp / scale]]))
        slowest = -float(rates.real.max()) * scale
        return slowest if slowest > 1e-9 * scale else 0.0

    def _still(self, push, held):
        """Coordinates (n,) under the constant part alone; push (n,) as in a Piece, held (i,) slides of stuck faces."""
        place = self.flow.pinv @ held[self.flow.stuck]
        return place + self.rest @ (push - self.system.square * place)

    def coefs(self, push, held, amplitude: float, theta: float, unit: float):
        """Series (TERMS, n) of the coordinates from drive phase theta on."""
        turn = amplitude * np.exp(1j * theta) * self.per
        powers = np.cumprod(np.concatenate([[1.0], 1j * self.omega * unit / ORDER[1:]]))
        out = (powers[:, None] * turn).imag
        out[0] += self._still(push, held)
        return out

    def left(self, z, v, push, held, amplitude: float, theta: float) -> float:
        """Free motion over the forced one at drive phase theta, by energy.

        What drive and friction would move in a time of the fastest mode counts with the forced motion: beside it the
        round-off of a motion that the drive does not touch is nothing.
        """
        still, stiff = self._still(push, held), np.sqrt(self.system.square)
        turn = amplitude * np.exp(1j * theta) * self.per
        free = np.hypot(np.linalg.norm(v - self.omega * turn.real), np.linalg.norm(stiff * (z - still - turn.imag)))
        size = np.hypot(np.linalg.norm(self.omega * np.abs(turn)),
                        np.linalg.norm(stiff * (np.abs(still) + np.abs(turn))))
        size += (abs(amplitude) * np.linalg.norm(self.system.base) + np.linalg.norm(push)) / self.system.fastest
        return float(free / max(size, 1e-300))


class Follower:
    """Whether the motion of an engine merely follows its sine, asked again from piece to piece.

    long [s]: the reach of a long piece, as long as the drive allows. `begin` after every event.
    """

    def __init__(self, system, clock, short: float):
        self.system, self.omega, self.short = system, clock.omega, short
        self.long = REACH / clock.rate
        self.found, self.on, self.wait = {}, False, FIRST

    @cached_property
    def useful(self) -> bool:
        """Whether long pieces are longer than short ones."""
        return self.long > WORTH * self.short

    def begin(self) -> None:
        """Start anew after an event."""
        self.on, self.wait = False, FIRST

    def follows(self, engine) -> Forced | None:
        """The forced motion of an engine where nothing else is left of it, None otherwise."""
        forced = self.found.get(engine.flow.mask)
        if self.on:
            return forced
        self.wait -= 1
        if self.wait > 0:
            return None
        if forced is None:
            forced = self.found[engine.flow.mask] = Forced(self.system, engine.flow, self.omega)
        if not forced.dies:
            self.wait = 10**9
            return None
        clock = engine.clock
        theta = clock.cycle_phase + clock.omega * clock.offset
        left = forced.left(engine.z, engine.v, engine.push, engine.held, clock.amplitude, theta)
        self.on = left <= DEAD
        pieces = 0.9 * log(min(max(left / DEAD, 1.0), 1e300)) / (forced.decay * self.short)  # until it has died out
        self.wait = max(FIRST, int(min(pieces, 1e9)))
        return forced if self.on else None


def watched(piece_coefs, unit: float, base, push, system, flow):
    """Series (i, TERMS) of what is watched of every face: reaction [N] of a stuck one, slip rate [m/s] of another.

    base (TERMS,): series of the drive without its constant, which push (n,) has.
    """
    rate = np.zeros_like(piece_coefs)
    rate[:-1] = piece_coefs[1:] * ORDER[1:, None] / unit
    pull = -piece_coefs * system.square - rate @ system.dampers.T - np.outer(base, system.base)
    pull[0] += push
    return np.where(np.array(flow.mask)[:, None], flow.react @ pull.T, system.faces @ rate.T)


def sine_series(amplitude: float, theta: float, turn: float):
    """Series (TERMS,) of amplitude sin(theta + turn u) in u."""
    powers = np.cumprod(np.concatenate([[1.0], 1j * turn / ORDER[1:]]))
    return (amplitude * np.exp(1j * theta) * powers).imag
