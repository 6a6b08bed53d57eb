"""Independent reference for elastic-plastic elements: DOP853, restarted at every yield and reversal."""

import numpy as np
from scipy.integrate import solve_ivp


class JenkinsReference:
    """Modes (core.ModalBasis) on elements (stiffness (t,), yield displacement (t,)) at every interface, from rest."""

    def __init__(self, modes, drive, elements, rtol=1e-12, atol=1e-14, method="DOP853"):
        self.modes = modes
        self.drive = drive
        self.rtol = rtol
        self.atol = atol
        self.method = method
        self.k, self.y = ([np.asarray(element[j], float) for element in elements] for j in (0, 1))
        self.stretch = [np.zeros(k.size) for k in self.k]
        # Direction of each slipping element, 0 of those that stick.
        self.way = [np.zeros(k.size) for k in self.k]
        self.faces = np.asarray(modes.interfaces)
        n = modes.omega.size
        self.state = np.zeros(2 * n)
        self.time = 0.0
        self.restarts = 0
        self.peak = 0.0

    def friction_forces(self, z, frozen):
        """Return the friction force of every interface; `frozen` holds the displacements at the last restart."""
        slide = self.faces @ z
        return np.array(
            [
                k @ np.where(way != 0, way * y, e + s - s0)
                for k, y, e, way, s, s0 in zip(
                    self.k, self.y, self.stretch, self.way, slide, frozen
                )
            ]
        )

    def march_to(self, end: float) -> np.ndarray:
        """March to the time `end` [s] and return the state (2 n,)."""
        modes = self.modes
        n = self.modes.omega.size
        step = 0.05 * self.drive.period
        while self.time < end:
            frozen = self.faces @ self.state[:n]

            def rate(t, x, frozen=frozen):
                """Return the time derivative of the state."""
                z = x[:n]
                v = x[n:]
                push = self.drive.values(t)
                return np.concatenate(
                    [
                        v,
                        -modes.damping_matrix @ v
                        - modes.omega**2 * z
                        - modes.base * push
                        - self.friction_forces(z, frozen) @ self.faces / modes.mass,
                    ]
                )

            def margin(t, x, frozen=frozen):
                """Return the smallest distance to yield of the elements that do not slip."""
                slide = self.faces @ x[:n]
                return (
                    min(
                        min(
                            (y - np.abs(e + s - s0))[way == 0].min(initial=1.0)
                            for y, e, way, s, s0 in zip(
                                self.y, self.stretch, self.way, slide, frozen
                            )
                        ),
                        1.0,
                    )
                    + 1e-15
                )

            events = [margin]
            for f, way in enumerate(self.way):
                if way.any():
                    events.append(
                        lambda t, x, f=f, sign=way[way != 0][0]: sign * (self.faces[f] @ x[n:])
                    )
            for event in events:
                event.terminal = True
                event.direction = -1
            solution = solve_ivp(
                rate,
                (self.time, end),
                self.state,
                self.method,
                rtol=self.rtol,
                atol=self.atol,
                max_step=step,
                events=events,
            )
            self.restarts += 1
            self._update_elements(solution, frozen)
        return self.state

    def _update_elements(self, solution, frozen):
        """Update the stretches and slip directions of the elements at the end of a piece."""
        n = self.modes.omega.size
        self.peak = max(self.peak, np.abs(self.modes.output @ solution.y[:n]).max())
        self.time = float(solution.t[-1])
        self.state = solution.y[:, -1]
        slide = self.faces @ self.state[:n]
        speed = self.faces @ self.state[n:]
        for f in range(len(self.k)):
            slips = self.way[f] != 0
            self.stretch[f] = np.where(
                slips, self.way[f] * self.y[f], self.stretch[f] + slide[f] - frozen[f]
            )
            if solution.status == 1:
                turned = (
                    f + 1 < len(solution.t_events) + 1
                    and slips.any()
                    and self.way[f][slips][0] * speed[f] <= 1e-12
                )
                if turned:
                    self.way[f][:] = 0.0
                sign = np.sign(speed[f])
                yields = (
                    (self.way[f] == 0)
                    & (sign * self.stretch[f] >= self.y[f] - 1e-14)
                    & (not turned)
                )
                self.way[f][yields] = sign
                self.stretch[f] = np.clip(self.stretch[f], -self.y[f], self.y[f])
