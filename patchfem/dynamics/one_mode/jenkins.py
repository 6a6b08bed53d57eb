"""One mode with one elastic-plastic (Jenkins) spring under a sine: exact map over half a period, and its fixed point.

Elastic stretches and slips are both linear, so each is one closed form of `slip_kernels`; the force is continuous, so
the tangent jumps only in the spring's own share, which a yield forgets.
"""

from math import cos, inf, pi, sin

import numpy as np

from .orbit_kernels import impulse, sliding_guess
from .slip_kernels import first_leap, leap, motion, oscillator, stop


class Jenkins:
    """A mode with an elastic-plastic spring under a sine.

    w, decay [1/s]; stiffness of the spring over the mass [1/s2]; limit and drive b sin(om t) over the mass.
    """

    def __init__(self, w: float, decay: float, stiffness: float, limit: float, b: float, om: float):
        self.w, self.decay, self.kt, self.limit, self.b, self.om = w, decay, stiffness, limit, b, om
        self.free = oscillator(w, decay, om)
        self.held = oscillator((w * w + stiffness)**0.5, decay, om)

    def elastic(self, v, g0, bc, bs, pull, limit):
        """First time up to `limit` at which the spring yields, inf if it does not.

        v: speed at first; g0, bc, bs: as in `slip_kernels`; pull: force of the spring over the mass at first.
        """
        beta, alpha, om = self.held[0], self.held[1], self.om
        size = abs(self.b)
        stride = min(1 / om, 1.1 / (alpha + (alpha * alpha + 1.1 * beta)**0.5))
        u, shift, speed, gain = 0.0, 0.0, v, g0 - alpha * v
        for _ in range(200_000):
            jerk = om * (bc * cos(om * u) - bs * sin(om * u)) - alpha * gain - beta * speed
            h = min(stride, limit - u)
            rest = 1 - alpha * h - 0.5 * beta * h * h
            second = (om * size + alpha * abs(gain) + beta * (abs(speed) + h * abs(gain))) / rest
            third = self.kt * (om * om * size + alpha * second + beta * (abs(gain) + h * second))
            step = h
            for way in (-self.kt, self.kt):
                room = self.limit + way * shift + (pull if way > 0 else -pull)
                part = (way * speed, way * gain, way * jerk, third, h)
                if u > 0 and room <= 1e-14 * self.limit and part[0] < 0:
                    return u - room / part[0]
                step = min(step, leap(room, *part) if room > 1e-14 * self.limit else first_leap(*part))
            if step >= limit - u:
                return inf
            if u + step == u:
                return u
            u += step
            shift, speed, gain = motion(u, v, g0, bc, bs, self.held)
        return inf

    def half(self, theta, state, tops):
        """State (z, v, spring) half a period after drive phase theta, and its tangent (3, 3); turning points go to
        `tops`."""
        z, v, pull = state
        tangent, left, way = np.eye(3), pi / self.om, 0.0
        if abs(pull) >= self.limit and pull * v > 0:
            way = 1.0 if v > 0 else -1.0
        while left > 0:
            bs, bc = self.b * sin(theta), self.b * cos(theta)
            if way == 0:
                g0 = bs - self.w**2 * z - pull
                span = self.elastic(v, g0, bc, bs, pull, left)
                ends = span < inf
                span = span if ends else left
                shift, v, _ = motion(span, v, g0, bc, bs, self.held)
                h, h1, one = impulse(span, self.held)
                b2, k = self.w**2, self.kt
                step = np.array([[1 - b2 * one, h, -one], [-b2 * h, h1, -h], [-k * b2 * one, k * h, 1 - k * one]])
                z, pull = z + shift, pull + k * shift
                if ends:
                    way = 1.0 if pull > 0 else -1.0
                    pull = way * self.limit
            else:
                g0 = way * (bs - self.w**2 * z) - self.limit
                span = stop(way * v, g0, way * bc, way * bs, self.free, left)[0]
                ends = span >= 0
                span = span if ends else left
                shift, speed, _ = motion(span, way * v, g0, way * bc, way * bs, self.free)
                h, h1, one = impulse(span, self.free)
                step = np.array([[1 - self.free[0] * one, h, 0.0], [-self.free[0] * h, h1, 0.0], [0.0, 0.0, 0.0]])
                z, v = z + way * shift, way * speed
                if ends:
                    tops.append(z)
                    way, v = 0.0, 0.0
            tangent = step @ tangent
            theta, left = theta + self.om * span, left - span
        return np.array([z, v, pull]), tangent

    def steady(self, patience: int = 4000):
        """Symmetric periodic motion that is reached from rest: (amplitude, multipliers (3,) of a period, residual over
        it).

        The amplitude is 0 where the spring never slips.
        """
        theta, state = 0.0, np.zeros(3)
        guess = sliding_guess(self.b, self.limit, self.free)
        if guess[3]:
            theta, state = guess[0], np.array([guess[1], guess[2], self.limit])
        done, todo = 0, 4
        while done < patience:
            for _ in range(todo):
                state = -self.half(theta, state, [])[0]
            done, todo = done + todo, max(8, done)
            found = self._newton(theta, state)
            if found is not None:
                return found
        return 0.0, np.full(3, np.nan), inf

    def _newton(self, theta, state):
        last = inf
        for _ in range(12):
            tops = []
            end, tangent = self.half(theta, state, tops)
            size = max(map(abs, tops), default=0.0)
            miss = np.abs((end + state) / [1.0, self.om, max(self.kt, 1e-300)]).max()
            if size > 0 and miss <= 1e-12 * size and (miss >= 0.1 * last or miss <= 2e-14 * size):
                multipliers = np.linalg.eigvals(-tangent)**2
                return (size, multipliers, miss / size) if np.abs(multipliers).max() <= 1 + 1e-9 else None
            last = miss
            try:
                state = state - np.linalg.solve(tangent + np.eye(3), end + state)
            except np.linalg.LinAlgError:
                return None
            if not np.isfinite(state).all() or abs(state[2]) > self.limit * (1 + 1e-9):
                return None
            state[2] = min(max(state[2], -self.limit), self.limit)
        return None
