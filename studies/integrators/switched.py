"""The three problems as smooth pieces with events, for integrators of others: plain Python, nothing of patchfem.

A problem has slip phases (+1, -1) and perhaps stick (0); `follow` takes any integrator from event to event. What an
integrator must bring: `advance(rhs, event, t, y, end, longest, wanted)` -> (t, y, states at the wanted times up to t),
stopping where the event function falls through zero; no step longer than `longest`, else a stick shorter than a step is
stepped over without a word.
"""

from math import pi, sin

import numpy as np


class Block:
    """m = k = 1 on a moving base: q'' + 2 xi q' + q = -size sin t - F, |F| <= limit, from rest at `place`."""

    def __init__(self, limit: float, xi: float, size: float = 1.0, place: float = 0.0):
        self.limit, self.damper, self.period, self.size, self.place = limit, 2 * xi, 2 * pi, size, place

    def start(self):
        """(phase, state)."""
        return (0 if abs(self.place) <= self.limit else -1 if self.place > 0 else 1), np.array([self.place, 0.0])

    def rhs(self, phase):
        """dy/dt as a list."""
        if phase == 0:
            return lambda t, y: [0.0, 0.0]
        force, c, a = phase * self.limit, self.damper, self.size

        def slip(t, y):
            q, v = y.tolist()
            return [v, -a * sin(t) - c * v - q - force]

        return slip

    def event(self, phase):
        """Positive while the phase lasts."""
        if phase == 0:
            return lambda t, y: self.limit - abs(self.size * sin(t) + y[0])
        return lambda t, y: phase * y[1]

    def switch(self, phase, t, y):
        """(phase, state) after the event."""
        need = -self.size * sin(t) - y[0]
        if phase != 0:
            y = np.array([y[0], 0.0])
            if abs(need) <= self.limit:
                return 0, y
        return (1 if need > 0 else -1), y

    def slide(self, y):
        """Slide of the interface from the states (k, n)."""
        return y[:, 0]


class TwoMasses:
    """Two free masses and a spring, all 1; sin(omega t) on the first, friction under the second (Fig 16)."""

    def __init__(self, limit: float, omega: float):
        self.limit, self.omega, self.period = limit, omega, 2 * pi / omega

    def start(self):
        """(phase, state x1, x2, v1, v2)."""
        return 0, np.zeros(4)

    def rhs(self, phase):
        """dy/dt as a list."""
        w, force = self.omega, phase * self.limit

        def stick(t, y):
            a, b, va, _ = y.tolist()
            return [va, 0.0, sin(w * t) - a + b, 0.0]

        def slip(t, y):
            a, b, va, vb = y.tolist()
            return [va, vb, sin(w * t) - a + b, a - b - force]

        return slip if phase else stick

    def event(self, phase):
        """Positive while the phase lasts."""
        if phase == 0:
            return lambda t, y: self.limit - abs(y[0] - y[1])
        return lambda t, y: phase * y[3]

    def switch(self, phase, t, y):
        """(phase, state) after the event."""
        need = y[0] - y[1]
        if phase != 0:
            y = np.array([y[0], y[1], y[2], 0.0])
            if abs(need) <= self.limit:
                return 0, y
        return (1 if need > 0 else -1), y

    def slide(self, y):
        """Slide of the interface from the states (k, n)."""
        return y[:, 1]


class Patch:
    """Modes under a sine with parallel elastic-plastic elements: between two reversals of the slide the force is a
    function of the slide, so the reversals are the only events; a yield is a bend that the step control has to see."""

    def __init__(self, omega, zeta, slide, base, mass, drive, drive_omega, stiffness, yields):
        self.stiff, self.damp = np.array(omega)**2, 2 * np.array(zeta) * np.array(omega)
        self.row, self.base, self.mass = np.array(slide), np.array(base), mass
        self.drive, self.omega, self.period = drive, drive_omega, 2 * pi / drive_omega
        self.k, self.yields = np.array(stiffness), np.array(yields)
        self.stretch, self.at = np.zeros(self.k.size), 0.0

    def start(self):
        """(phase, state z..., v...); the base moves against +x first."""
        return (1 if self.row @ self.base * self.drive < 0 else -1), np.zeros(2 * self.row.size)

    def stretches(self, q):
        """Stretch of all elements at the slide q since the last reversal."""
        return np.minimum(np.maximum(self.stretch + (q - self.at), -self.yields), self.yields)

    def rhs(self, phase):
        """dy/dt."""
        n, pull, push = self.row.size, self.base * self.drive, self.row / self.mass

        def free(t, y):
            force = self.k @ self.stretches(self.row @ y[:n])
            return np.concatenate([y[n:], -pull * sin(self.omega * t) - self.stiff * y[:n] - self.damp * y[n:]
                                   - push * force])

        return free

    def event(self, phase):
        """Positive until the slide reverses."""
        n = self.row.size
        return lambda t, y: phase * (self.row @ y[n:])

    def switch(self, phase, t, y):
        """(phase, state) after a reversal."""
        q = float(self.row @ y[:self.row.size])
        self.stretch, self.at = self.stretches(q), q
        return -phase, np.array(y)

    def slide(self, y):
        """Slide of the interface from the states (k, n)."""
        return y[:, :self.row.size] @ self.row


PROBLEMS = {"block": Block, "two": TwoMasses, "patch": Patch}


def follow(problem, advance, times, share: float):
    """(slide at `times` (k,) ascending, number of events) from the start to the last of them, no step longer than
    `share` of the drive period. RuntimeError where events pile up."""
    phase, y = problem.start()
    t, end, events, at, parts, stalls = 0.0, float(times[-1]), 0, 0, [], 0
    while True:
        before = t
        t, y, states = advance(problem.rhs(phase), problem.event(phase), t, y, end, share * problem.period, times[at:])
        if len(states):
            parts.append(problem.slide(np.asarray(states)))
            at += len(states)
        if t >= end:
            return np.concatenate(parts), events
        events, stalls = events + 1, stalls + 1 if t - before < 1e-10 * problem.period else 0
        if stalls > 50:
            raise RuntimeError(f"events pile up at t = {t:.9g}")
        phase, y = problem.switch(phase, t, y)
