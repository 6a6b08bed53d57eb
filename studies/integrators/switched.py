"""The three problems as smooth pieces with events, for integrators of others: plain Python, nothing of patchfem.

A problem has slip phases (+1, -1) and perhaps stick (0); `follow` takes any integrator from event to event. What an
integrator must bring: `advance(rhs, event, t, y, end, longest, wanted)` -> (t, y, states at the wanted times up to t),
stopping where the event function falls through zero; no step longer than `longest`, else a stick shorter than a step is
stepped over without a word.
"""

from math import pi, sin

import numpy as np
from switched_patch import Patch


class Block:
    """Block with m = k = 1 on a moving base, released from rest at `place`.

    q'' + 2 xi q' + q = -size sin t - F, |F| <= limit.
    """

    def __init__(self, limit: float, xi: float, size: float = 1.0, place: float = 0.0):
        self.limit = limit
        self.damper = 2 * xi
        self.period = 2 * pi
        self.size = size
        self.place = place

    def start(self):
        """Return the phase and the state at the start."""
        return (0 if abs(self.place) <= self.limit else -1 if self.place > 0 else 1), np.array(
            [self.place, 0.0]
        )

    def rhs(self, phase):
        """Return dy/dt as a list."""
        if phase == 0:
            return lambda t, y: [0.0, 0.0]
        force = phase * self.limit
        c = self.damper
        a = self.size

        def slip(t, y):
            q, v = y.tolist()
            return [v, -a * sin(t) - c * v - q - force]

        return slip

    def event(self, phase):
        """Return a function that is positive while the phase lasts."""
        if phase == 0:
            return lambda t, y: self.limit - abs(self.size * sin(t) + y[0])
        return lambda t, y: phase * y[1]

    def switch(self, phase, t, y):
        """Return the phase and the state after an event.

        Parameters
        ----------
        phase : int
        t : float
            Time of the event.
        y : array
            State at the event.
        """
        need = -self.size * sin(t) - y[0]
        if phase != 0:
            y = np.array([y[0], 0.0])
            if abs(need) <= self.limit:
                return 0, y
        return (1 if need > 0 else -1), y

    def slide(self, y):
        """Return the slide of the interface from the states (k, n)."""
        return y[:, 0]


class TwoMasses:
    """Two free masses and a spring, all equal to 1 (Fig. 16).

    The force sin(omega t) acts on the first mass and friction on the second.
    """

    def __init__(self, limit: float, omega: float):
        self.limit = limit
        self.omega = omega
        self.period = 2 * pi / omega

    def start(self):
        """Return the phase and the state at the start."""
        return 0, np.zeros(4)

    def rhs(self, phase):
        """Return dy/dt as a list."""
        w = self.omega
        force = phase * self.limit

        def stick(t, y):
            a, b, va, _ = y.tolist()
            return [va, 0.0, sin(w * t) - a + b, 0.0]

        def slip(t, y):
            a, b, va, vb = y.tolist()
            return [va, vb, sin(w * t) - a + b, a - b - force]

        return slip if phase else stick

    def event(self, phase):
        """Return a function that is positive while the phase lasts."""
        if phase == 0:
            return lambda t, y: self.limit - abs(y[0] - y[1])
        return lambda t, y: phase * y[3]

    def switch(self, phase, t, y):
        """Return the phase and the state after an event.

        Parameters
        ----------
        phase : int
        t : float
            Time of the event.
        y : array
            State at the event.
        """
        need = y[0] - y[1]
        if phase != 0:
            y = np.array([y[0], y[1], y[2], 0.0])
            if abs(need) <= self.limit:
                return 0, y
        return (1 if need > 0 else -1), y

    def slide(self, y):
        """Return the slide of the interface from the states (k, n)."""
        return y[:, 1]


PROBLEMS = {"decay": Block, "block": Block, "two": TwoMasses, "patch": Patch}


def follow(problem, advance, times, share: float):
    """Follow a problem from event to event; return the slide at given times and the number of events.

    Parameters
    ----------
    problem : problem with events
    advance : callable
        Integrator of a stretch.
    times : (k,) array
        Ascending [s].
    share : float
        Longest step / drive period.

    Raises
    ------
    RuntimeError
        If events follow each other without progress.
    """
    phase, y = problem.start()
    t = 0.0
    end = float(times[-1])
    events = 0
    at = 0
    parts = []
    stalls = 0
    while True:
        before = t
        t, y, states = advance(
            problem.rhs(phase), problem.event(phase), t, y, end, share * problem.period, times[at:]
        )
        if len(states):
            parts.append(problem.slide(np.asarray(states)))
            at += len(states)
        if t >= end:
            return np.concatenate(parts), events
        events = events + 1
        stalls = stalls + 1 if t - before < 1e-10 * problem.period else 0
        if stalls > 50:
            raise RuntimeError(f"events pile up at t = {t:.9g}")
        phase, y = problem.switch(phase, t, y)
