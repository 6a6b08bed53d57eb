"""Coulomb friction exactly from event to event: any modes, any number of interfaces, sines, constants and free motion.

Between events the motion is the exponential of its linear system, summed to round-off piece by piece (signals). The
first root of a slip velocity or of a margin to sliding is isolated by Bernstein coefficients, which prove the rest of
the piece free of roots, so no event can be missed. A stuck interface keeps its slide to the last bit; one that has just
been released has no acceleration, to the last bit too. Time is a number of cycles and the offset in the cycle, and the
phase of the drive is counted modulo 2 pi from the cycle, so neither loses digits in long runs.
"""

from dataclasses import dataclass
from fractions import Fraction
from math import asin, cos, inf, pi, sin

import numpy as np

from ..core import ModalBasis, NotConverged, PatchfemError, Start
from .event_list import BORDER, Recorder, kind_of
from .signals import EPS, ORDER, TERMS, Signal, combine, first_root
from .stick_sets import NOISE, StickSet, System, settle

__all__ = ["Engine", "Phase", "Piece", "Signal", "combine", "run"]

TURN = 2 * pi


@dataclass(frozen=True, eq=False, slots=True)
class Piece:
    """A stretch of motion `span` [s] long from `time`: z(t) = sum coefs[k] ((t - time)/unit)^k, coefs (TERMS, n).

    drive: (constant, amplitude, omega), theta its phase at the start; signs (i,) of slip, 0 stuck (at `held` [m]);
    forces (i,) [N] of the faces that do not stick; push (n,) [m/s2] as in StickSet; flow: the StickSet; first: an
    event stands at its start.
    """

    time: float
    cycle: int
    theta: float
    span: float
    unit: float
    coefs: np.ndarray
    drive: tuple
    signs: tuple
    held: np.ndarray
    forces: np.ndarray
    push: np.ndarray
    flow: StickSet
    first: bool


@dataclass(frozen=True, eq=False, slots=True)
class Phase:
    """From one event to the next, `span` [s] long: slip (directions (i,) +1, -1) or stick (0) from `time` [s] and drive
    phase `theta`. modal: a Signal of every coordinate; forces: a Signal of every interface's friction [N]."""

    time: float
    theta: float
    span: float
    directions: tuple
    modal: list
    forces: list

    @property
    def direction(self) -> int:
        """Of the first interface."""
        return self.directions[0]

    @property
    def force(self) -> Signal:
        """Of the first interface."""
        return self.forces[0]


class Clock:
    """Cycle and offset in it [s]; the drive's segments and the end as borders on them."""

    def __init__(self, drive, cycles: float):
        if not drive.segments:
            raise PatchfemError("accuracy.method: this drive has no closed form, so there is no exact solution; use "
                                "method = \"march\"")
        self.period, self.cycle, self.offset = drive.period, 0, 0.0
        self.segments = [(self.place(s.start), s) for s in drive.segments]
        if self.segments[0][0] != (0, 0.0):
            raise PatchfemError("drive: the first segment must start at 0 s")
        self.end = self.place(cycles * self.period)
        self.begin(0)

    def place(self, time: float) -> tuple:
        """(cycle, offset) of a time [s]."""
        share = time / self.period
        near = round(share)
        if abs(share - near) <= 4e-15 * max(1.0, abs(share)):
            return near, 0.0
        cycle = int(share)
        return cycle, max(time - cycle * self.period, 0.0)

    def begin(self, number: int) -> None:
        """Enter a segment."""
        self.number = number
        (self.from_cycle, self.from_offset), part = self.segments[number]
        self.omega = part.omega if part.amplitude != 0 else 0.0
        steady = part.constant + (part.amplitude * sin(part.phase) if self.omega == 0 else 0.0)
        self.constant, self.amplitude = steady, part.amplitude if self.omega else 0.0
        turns = self.omega * self.period / TURN
        self.turns = None if abs(turns - round(turns)) < 4e-15 * max(turns, 1.0) else Fraction(turns)
        self.phase0 = part.phase - self.omega * self.from_offset
        nxt = self.segments[number + 1][0] if number + 1 < len(self.segments) else None
        self.border = min(nxt, self.end) if nxt else self.end
        self.base_phase()

    def base_phase(self) -> None:
        """Phase at the start of the cycle, the whole turns since the segment's start left out exactly."""
        extra = 0.0
        if self.turns is not None:
            gone = (self.cycle - self.from_cycle) * self.turns
            extra = TURN * float(gone - int(gone))
        self.cycle_phase = (self.phase0 + extra) % TURN

    @property
    def theta(self) -> float:
        """Phase of the drive."""
        return (self.cycle_phase + self.omega * self.offset) % TURN

    @property
    def time(self) -> float:
        """Seconds since the start."""
        return self.cycle * self.period + self.offset

    @property
    def left(self) -> float:
        """Seconds to the next border or the end of the cycle."""
        return max((self.border[1] if self.border[0] == self.cycle else self.period) - self.offset, 0.0)

    @property
    def over(self) -> bool:
        """Whether the end is reached."""
        return (self.cycle, self.offset) >= self.end

    def arrive(self) -> bool:
        """Step onto the border or the end of the cycle just reached; True where a new segment starts."""
        if self.border[0] == self.cycle:
            self.offset = self.border[1]
        else:
            self.cycle, self.offset = self.cycle + 1, 0.0
        here = (self.cycle, self.offset)
        if here == self.border and here < self.end and self.number + 1 < len(self.segments):
            self.begin(self.number + 1)
            return True
        self.base_phase()
        return False


class Engine:
    """A run from event to event; static, kinetic: friction forces [N] of every interface, kinetic <= static."""

    def __init__(self, modes: ModalBasis, drive, static, kinetic, cycles: float, start: Start | None = None):
        faces = np.asarray(modes.interfaces, float)
        self.static = np.broadcast_to(np.asarray(static, float), (len(faces),)).copy()
        self.kinetic = np.broadcast_to(np.asarray(kinetic, float), (len(faces),)).copy()
        if np.any(self.kinetic > self.static) or np.any(self.kinetic < 0):
            raise PatchfemError("friction.kinetic: it must lie between 0 and static")
        if np.any((np.abs(faces).max(axis=1) == 0) & (self.static > 0)):
            raise PatchfemError("structure.mode.slide: no mode moves the interface, so friction cannot act")
        self.live = np.flatnonzero(self.static > 0)
        self.faces = faces[self.live]
        self.limit = self.static[self.live]
        self.system = System(modes, self.faces, self.limit, self.kinetic[self.live])
        self.clock, self.recorder, self.modes = Clock(drive, cycles), Recorder(), modes
        n = modes.omega.size
        self.n = n
        self.z, self.v = (np.zeros(n), np.zeros(n)) if start is None else (np.array(start.z, float),
                                                                           np.array(start.v, float))
        self.entry = np.zeros(3 * n + 2)
        self.held = self.faces @ self.z
        speed = self.faces @ self.v
        tiny = NOISE * (np.abs(self.faces) @ np.abs(self.v))
        self.signs = tuple(int(np.sign(s)) if abs(s) > t else 0 for s, t in zip(speed, tiny))
        self.idle = 0

    def pieces(self):
        """Yield the pieces in order. NotConverged after 1000 events without progress."""
        clock = self.clock
        self._enter(self.signs, [c for c, s in enumerate(self.signs) if s == 0])
        first = True
        while not clock.over:
            piece, event = self._piece(first)
            yield piece
            self.z, self.v, first = self._state(piece), self._rate(piece), True
            if event:
                clock.offset += piece.span
                self._event(event)
            elif piece.span == clock.left:
                self.idle = 0
                before = self.signs
                if first := clock.arrive():
                    self.recorder.add(clock.time, clock.theta, -1, BORDER, 0.0)
                    self._enter(before, self._resting())
            else:
                clock.offset, first, self.idle = clock.offset + piece.span, False, 0
            self._keep()

    def _fill(self) -> None:
        n = self.n
        self.entry[:n], self.entry[n:2 * n] = self.z, self.v
        self.entry[3 * n:] = self._sine()

    def _sine(self) -> tuple:
        clock = self.clock
        theta = clock.cycle_phase + clock.omega * clock.offset
        return clock.amplitude * sin(theta), clock.amplitude * cos(theta)

    def _resting(self) -> list:
        """Faces without slip velocity: the stuck ones and those whose velocity is lost in its round-off."""
        speed, size = self.faces @ self.v, np.abs(self.faces) @ np.abs(self.v)
        return [c for c, s in enumerate(self.signs)
                if s == 0 or self.choice.held[c] or s * speed[c] <= NOISE * size[c]]

    def _enter(self, guess, resting) -> None:
        """Choose what every face does from here on, the ones `resting` having no slip velocity."""
        n, clock, before = self.n, self.clock, self.signs
        if resting:
            rows = self.faces[resting]
            self.v = self.v - np.linalg.pinv(rows, rcond=1e-10) @ (rows @ self.v) if n > 1 else 0.0 * self.v
        self.unit = self.system.unit(clock.omega, clock.period)
        self._fill()
        self.entry[2 * n:3 * n] = -self.modes.base * clock.constant
        self.choice = settle(self.system, self.entry, guess, resting, clock.omega, self.unit)
        signs = tuple(0 if h else s for s, h in zip(self.choice.signs, self.choice.held))
        self.flow = self.system.stick_set(tuple(s == 0 for s in self.choice.signs), clock.omega, self.unit)
        self.push = self.entry[2 * n:3 * n] + self.system.push(self.choice.signs, self.choice.forces)
        slide = self.faces @ self.z
        for c, (old, new) in enumerate(zip(before, signs)):
            what = kind_of(old, new)
            if old or new:
                self.held[c] = slide[c]
            if what is not None:
                self.recorder.add(clock.time, clock.theta, int(self.live[c]), what, float(self.held[c]))
        self.signs = signs
        self.orders = dict(self.choice.orders)

    def _keep(self) -> None:
        """Take the round-off of the stuck slides out of the coordinates."""
        flow = self.flow
        if flow.stuck and not flow.frozen:
            rows = self.faces[flow.stuck]
            self.z = self.z + flow.pinv @ (self.held[flow.stuck] - rows @ self.z)
            self.v = self.v - flow.pinv @ (rows @ self.v)

    def _event(self, event) -> None:
        face, sign = event
        guess = list(self.choice.signs)
        guess[face] = sign
        resting = self._resting()
        if face not in resting:
            resting = sorted([*resting, face])
        self.idle += 1
        if self.idle > 1000:
            raise NotConverged(f"dynamics: events pile up at t = {self.clock.time:.9g} s")
        self._enter(tuple(guess), resting)

    def _piece(self, first: bool) -> tuple:
        """(Piece, event): event is (face, sign of its slip after it as first guess) or None."""
        clock, flow, n = self.clock, self.flow, self.n
        self._fill()
        entry = self.entry.copy()
        entry[2 * n:3 * n] = self.push
        span, event = min(self.unit, clock.left), None
        if flow.frozen:
            coefs = np.zeros((TERMS, n))
            coefs[0] = self.z
            wait, face, sign = self._release(entry)
            if wait < span:
                span, event = wait, (face, sign)
        else:
            out = flow.flat @ entry
            coefs = out[:TERMS * n].reshape(TERMS, n)
            hull = out[TERMS * n:].reshape(-1, TERMS)
            for c, s in enumerate(self.choice.signs):
                if self.choice.held[c]:
                    continue
                if s == 0:
                    b = hull[c]
                    clear = -self.limit[c] < b.min() and b.max() < self.limit[c]
                else:
                    clear = hull[c].min() > 0 if s > 0 else hull[c].max() < 0
                if not clear or (c, 1) in self.orders or (c, -1) in self.orders:
                    when, sign = self._root(c, s, flow.watch[c] @ entry, span)
                    if when < span or (when == span and event is None):
                        span, event = when, (c, sign)
            if first and self.orders:
                coefs = self._no_acceleration(coefs)
        piece = Piece(clock.time, clock.cycle, clock.theta, span, self.unit, coefs,
                      (clock.constant, clock.amplitude, clock.omega), self.signs, self.held.copy(),
                      np.asarray(self.choice.signs) * self.choice.forces, self.push, flow, first)
        self.orders = {}
        return piece, event

    def _release(self, entry) -> tuple:
        """(time to it, face, sign) of the next release while nothing can move: the phase at which a sine passes."""
        clock, n, best = self.clock, self.n, (inf, 0, 0)
        if clock.amplitude == 0:
            return best
        for c in self.flow.stuck:
            row, limit = self.flow.watch[c][0], self.limit[c]
            level, swing = float(row[:3 * n] @ entry[:3 * n]), float(row[3 * n]) * clock.amplitude
            if abs(level) + abs(swing) <= limit:
                continue
            for sign in (1, -1):
                height = (sign * limit - level) / swing
                if abs(height) <= 1:
                    angle = asin(height) if swing * sign > 0 else pi - asin(height)
                    wait = ((angle - clock.cycle_phase - clock.omega * clock.offset) % TURN) / clock.omega
                    best = min(best, (wait, c, sign))
        return best

    def _root(self, c: int, sign: int, coefs, span: float) -> tuple:
        """(time in the piece, sign guessed after it) of the first event of a face; (inf, 0) if there is none."""
        shrink = (span / self.unit)**ORDER
        if sign:
            found = self._first(coefs * (sign * shrink), self.orders.get((c, sign), 0), 0.0)
            return (found * span, 0) if found < inf else (inf, 0)
        best = (inf, 0)
        for side in (1, -1):
            margin = coefs * (-side * shrink)
            margin[0] += self.limit[c]
            found = self._first(margin, self.orders.get((c, side), 0), self.limit[c])
            if found < inf:
                best = min(best, (found * span, side))
        return best

    @staticmethod
    def _first(coefs, order: int, size: float) -> float:
        noise = 0.0
        if order:
            coefs = np.concatenate([coefs[order:], np.zeros(order)])
        else:
            noise = 4 * EPS * (size + np.abs(coefs).sum())
            if coefs[0] <= noise:
                coefs[0] = max(coefs[0], 0.0)
        return first_root(coefs, noise)

    def _no_acceleration(self, coefs):
        """Acceleration of faces just released at their kinetic limit set to what it is, zero."""
        rows = [c for (c, side), order in self.orders.items() if order >= 2 and self.choice.signs[c]]
        if rows:
            faces = self.faces[rows]
            coefs = coefs.copy()
            coefs[2] -= np.linalg.pinv(faces, rcond=1e-10) @ (faces @ coefs[2])
        return coefs

    def _state(self, piece):
        return piece.coefs[0] if piece.flow.frozen else (piece.span / piece.unit)**ORDER @ piece.coefs

    def _rate(self, piece):
        if piece.flow.frozen:
            return np.zeros(self.n)
        u = piece.span / piece.unit
        return (ORDER[1:] * u**ORDER[:-1]) @ piece.coefs[1:] / piece.unit


def _phase(pieces, count: int, live) -> Phase:
    """Pieces from one event to the next as signals."""
    times = np.cumsum([0.0, *(p.span for p in pieces)])
    unit = np.array([p.unit for p in pieces])
    coefs = np.stack([p.coefs for p in pieces])
    modal = [Signal(times, unit, coefs[:, :, i]) for i in range(coefs.shape[2])]
    forces, directions = [Signal(times, unit, np.zeros((len(pieces), TERMS)))] * count, [1] * count
    for row, c in enumerate(live):
        directions[c] = pieces[0].signs[row]
        series = np.zeros((len(pieces), TERMS))
        for k, p in enumerate(pieces):
            series[k, 0] = p.forces[row]
            if p.flow.mask[row]:
                sine = p.drive[1] * np.array([sin(p.theta), cos(p.theta)])
                series[k] = p.flow.watch[row] @ np.concatenate([p.coefs[0], p.coefs[1] / p.unit, p.push, sine])
        forces[c] = Signal(times, unit, series)
    return Phase(pieces[0].time, pieces[0].theta, float(times[-1]), tuple(directions), modal, forces)


def run(modes: ModalBasis, drive, static, kinetic, duration: float, start: Start | None = None):
    """Yield the phases of a run in order, from rest or `start`, up to `duration` [s]; the last one is cut there.

    static, kinetic [N] >= 0: one for all interfaces or (i,). NotConverged after 1000 phases without progress.
    """
    engine, kept = Engine(modes, drive, static, kinetic, duration / drive.period, start), []
    for piece in engine.pieces():
        if piece.first and kept:
            yield _phase(kept, len(engine.static), engine.live)
            kept = []
        kept.append(piece)
    if kept:
        yield _phase(kept, len(engine.static), engine.live)
