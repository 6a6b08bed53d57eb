"""Runs from event to event: pieces of motion as series, the event that ends each, the state of stick and slip after it.

The first root of a slip velocity or of a margin to sliding is isolated by Bernstein coefficients, which prove the rest
of the piece free of roots, so no event can be missed. A stuck interface keeps its slide to the last bit; of one just
released the terms that are zero there (velocity; acceleration too, at the kinetic limit) are left out of the search.
"""

from dataclasses import dataclass
from math import asin, inf, pi

import numpy as np

from ...core import ModalBasis, NotConverged, PatchfemError, Start
from .clock import TURN, clock_of
from .event_list import BORDER, Recorder, kind_of
from .following import Follower, sine_series, watched
from .signals import BERNSTEIN, EPS, ONE, ORDER, TERMS, first_root
from .stick_sets import NOISE, Entry, StickSet, System, settle


@dataclass(frozen=True, eq=False, slots=True)
class Piece:
    """A stretch of motion `span` [s] long from `time`: z(t) = sum coefs[k] ((t - time)/unit)^k, coefs (TERMS, n).

    drive: (constant, amplitude, omega) of a sine, or its series (TERMS,) [m/s2]; theta its phase at the start; signs
    (i,) of slip, 0 stuck (at `held` [m]); forces (i,) [N] of the faces that do not stick; push (n,) [m/s2] as in
    StickSet; flow: the StickSet; first: an event stands at its start; ends: the event at its end, (face, sign of the
    slip that a release starts, 0: a stop), or None.
    """

    time: float
    cycle: int
    theta: float
    span: float
    unit: float
    coefs: np.ndarray
    drive: tuple | np.ndarray
    signs: tuple
    held: np.ndarray
    forces: np.ndarray
    push: np.ndarray
    flow: StickSet
    first: bool
    ends: tuple | None


class Engine:
    """A run of Coulomb friction from event to event.

    static, kinetic: friction forces [N] of every interface, (i,) or one for all, 0 <= kinetic <= static; cycles:
    length; start: None for rest; long: whether pieces as long as a slow drive allows are taken where the motion merely
    follows it (`following`). PatchfemError for other forces and for an interface that no mode moves.
    """

    def __init__(self, modes: ModalBasis, drive, static, kinetic, cycles: float, start: Start | None = None,
                 long: bool = False):
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
        self.clock, self.recorder, self.modes = clock_of(drive, cycles), Recorder(), modes
        self.system = System(modes, self.faces, self.limit, self.kinetic[self.live], self.clock.entries)
        self.sine, self.long, self.follower, self.followers = bool(drive.segments), long, None, {}
        n = modes.omega.size
        self.n = n
        self.z, self.v = (np.zeros(n), np.zeros(n)) if start is None else (np.array(start.z, float),
                                                                           np.array(start.v, float))
        self.held = self.faces @ self.z
        speed = self.faces @ self.v
        tiny = NOISE * (np.abs(self.faces) @ np.abs(self.v))
        self.signs = tuple(int(np.sign(s)) if abs(s) > t else 0 for s, t in zip(speed, tiny))
        self.idle = 0

    def pieces(self):
        """Yield the pieces in order of time, to the end of the run.

        NotConverged after 1000 events in a row without progress, and where no state of stick and slip holds.
        """
        clock = self.clock
        self._enter(self.signs, [c for c, s in enumerate(self.signs) if s == 0])
        first = True
        while not clock.over:
            piece, event = self._piece(first)
            yield piece
            self._advance(piece)
            first = True
            if event:
                clock.offset += piece.span
                self._event(event, piece)
            elif piece.span == clock.left:
                before = self.signs
                if first := clock.arrive():
                    self.recorder.add(clock.time, clock.theta, -1, BORDER, 0.0)
                    self._enter(before, self._resting(piece))
            else:
                clock.offset, first = clock.offset + piece.span, False
            self._keep()

    @property
    def omega(self) -> float | None:
        """Angular frequency [rad/s] of a sine, None for a drive that gives its series."""
        return self.clock.omega if self.sine else None

    def _resting(self, piece) -> list:
        """Faces without slip velocity after a piece: the stuck ones and those whose velocity is round-off."""
        if len(self.signs) == 1 and self.signs[0] == 0:
            return [0]
        speed = self.faces @ self.v
        u = piece.span / piece.unit
        size = np.abs(self.faces) @ ((ORDER[1:] * u**ORDER[:-1]) @ np.abs(piece.coefs[1:])) / piece.unit
        return [c for c, s in enumerate(self.signs)
                if s == 0 or self.choice.held[c] or s * speed[c] <= NOISE * size[c]]

    def _enter(self, guess, resting) -> None:
        """Choose what every face does from here on, the ones `resting` having no slip velocity."""
        clock, before, system = self.clock, self.signs, self.system
        self.unit = system.unit(clock.rate)
        if resting:
            rest = system.stick_set(tuple(c in resting for c in range(len(guess))), self.omega, self.unit)
            self.v = rest.project @ self.v
            resting = [c for c, tied in enumerate(rest.tied) if tied or c in resting]
        entry = Entry(system, self.z, self.v, *clock.drive_now(self.unit))
        self.choice = settle(system, entry, guess, resting, self.omega, self.unit)
        signs = tuple(0 if h else s for s, h in zip(self.choice.signs, self.choice.held))
        self.flow = system.stick_set(tuple(s == 0 for s in self.choice.signs), self.omega, self.unit)
        self.push = system.push(self.choice.given) - system.base * clock.constant
        slide, self.held = self.faces @ self.z, self.held.copy()
        for c, (old, new) in enumerate(zip(before, signs)):
            what = kind_of(old, new)
            if old or new:
                self.held[c] = slide[c]
            if what is not None:
                self.recorder.add(clock.time, clock.theta, int(self.live[c]), what, float(self.held[c]))
        self.signs = signs
        self.orders = dict(self.choice.orders)
        if self.long and self.sine:
            self._slowly()

    def _slowly(self) -> None:
        """Look for long pieces from here on, where the drive is slow beside the modes."""
        key = self.clock.omega, self.unit
        if key not in self.followers:
            self.followers[key] = Follower(self.system, self.clock, self.unit)
        self.follower = self.followers[key] if self.followers[key].useful else None
        if self.follower is not None:
            self.follower.begin()

    def _keep(self) -> None:
        """Take the round-off of the stuck slides out of the coordinates."""
        flow = self.flow
        if flow.stuck and not flow.frozen:
            rows = self.faces[flow.stuck]
            self.z = self.z + flow.pinv @ (self.held[flow.stuck] - rows @ self.z)
            self.v = self.v - flow.pinv @ (rows @ self.v)

    def _event(self, event, piece) -> None:
        face, sign = event
        guess = list(self.choice.signs)
        guess[face] = sign
        resting = self._resting(piece) if len(guess) > 1 else [0]
        if face not in resting:
            resting = sorted([*resting, face])
        self.idle = self.idle + 1 if piece.span < 1e-12 * self.clock.period else 0  # no progress
        if self.idle > 1000:
            raise NotConverged(f"dynamics: events pile up at t = {self.clock.time:.9g} s; lower the drive, "
                               "or use method = \"march\"", "accuracy.method")
        self._enter(tuple(guess), resting)

    def _fill(self):
        """Current vector (v, pull, drive) of the motion."""
        return self.system.rows @ np.concatenate((self.z, self.v, self.clock.drive_now(self.unit), self.choice.given))

    def _piece(self, first: bool) -> tuple:
        """Next Piece and the event at its end: (face, sign of its slip after it as first guess) or None."""
        clock, unit = self.clock, self.unit
        forced = self.follower.follows(self) if self.follower is not None and not self.flow.frozen else None
        if self.flow.frozen and self.sine:
            unit = self.unit if self.follower is None else self.follower.long
            coefs, span, event = np.zeros((TERMS, self.n)), min(unit, clock.left), None
            wait, face, sign = self._release()
            if wait < span:
                span, event = wait, (face, sign)
        elif forced is not None:
            unit = self.follower.long
            coefs = forced.coefs(self.push, self.held, clock.amplitude, clock.theta, unit)
            base = sine_series(clock.amplitude, clock.theta, clock.omega * unit)
            signals = watched(coefs, unit, base, self.push, self.system, self.flow)
            span, event = self._next(unit, signals @ BERNSTEIN.T, signals.__getitem__)
        else:
            entry = self._fill()
            out = self.flow.flat @ entry
            coefs = out[:TERMS * self.n].reshape(TERMS, self.n)
            span, event = self._next(unit, out[TERMS * self.n:].reshape(-1, TERMS),
                                     lambda c: self.flow.watch[c] @ entry)
        coefs[0] = self.z
        drive = (clock.constant, clock.amplitude, clock.omega) if self.sine else clock.drive_now(unit)
        piece = Piece(clock.time, clock.cycle, clock.theta, span, unit, coefs, drive, self.signs, self.held,
                      self.choice.given, self.push, self.flow, first, event)
        self.orders = {}
        return piece, event

    def _next(self, unit: float, hull, signal) -> tuple:
        """Span of a piece of `unit` [s], and the event at its end or None.

        hull (i, TERMS): what is watched of every face in Bernstein form; signal(face): its series (TERMS,).
        """
        span, event = min(unit, self.clock.left), None
        for c, s in enumerate(self.choice.signs):
            if self.choice.held[c]:
                continue
            if s == 0:
                b = hull[c]
                clear = -self.limit[c] < b.min() and b.max() < self.limit[c]
            else:
                clear = hull[c].min() > 0 if s > 0 else hull[c].max() < 0
            if not clear or (c, 1) in self.orders or (c, -1) in self.orders:
                when, sign = self._root(c, s, signal(c), span / unit)
                when *= span
                if when < span or (when == span and event is None):
                    span, event = when, (c, sign)
        return span, event

    def _release(self) -> tuple:
        """Next release while nothing can move: (time to it, face, sign), from the phase at which a sine passes the
        limit."""
        clock, system, best = self.clock, self.system, (inf, 0, 0)
        if clock.amplitude == 0:
            return best
        still = self.push - system.square * self.z
        for c in self.flow.stuck:
            row, limit = self.flow.react[c], self.limit[c]
            level, swing = float(row @ still), -float(row @ system.base) * clock.amplitude
            if abs(level) + abs(swing) <= limit:
                continue
            for sign in (1, -1):
                height = (sign * limit - level) / swing
                if abs(height) <= 1:
                    angle = asin(height) if swing * sign > 0 else pi - asin(height)
                    wait = ((angle - clock.cycle_phase - clock.omega * clock.offset) % TURN) / clock.omega
                    best = min(best, (wait, c, sign))
        return best

    def _root(self, c: int, sign: int, coefs, share: float) -> tuple:
        """First event of a face in the first `share` of a series: (part of the share, sign guessed after it).

        (inf, 0) if there is none.
        """
        shrink = ONE if share == 1 else share**ORDER
        if sign:
            return self._first(coefs * (sign * shrink), self.orders.get((c, sign), 0), 0.0), 0
        best = (inf, 0)
        for side in (1, -1):
            margin = coefs * (-side * shrink)
            margin[0] += self.limit[c]
            found = self._first(margin, self.orders.get((c, side), 0), self.limit[c])
            if found < inf:
                best = min(best, (found, side))
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

    def _advance(self, piece) -> None:
        """Coordinates and rates at the end of a piece."""
        if piece.flow.frozen:
            self.z, self.v = piece.coefs[0], np.zeros(self.n)
            return
        power = ONE if piece.span == piece.unit else (piece.span / piece.unit)**ORDER
        self.z = power @ piece.coefs
        self.v = (power[:-1] * ORDER[1:]) @ piece.coefs[1:] / piece.unit
