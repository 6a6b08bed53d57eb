"""The patch of parallel elements as a problem of `switched`, for integrators of others: nothing of patchfem."""

from math import pi, sin

import numpy as np


class Patch:
    """Modes under a sine with parallel elastic-plastic elements.

    Between two reversals of the slide the force is a function of the slide, so reversals are the
    only events; a yield is a kink that the step control must resolve.
    """

    def __init__(self, omega, zeta, slide, base, mass, drive, drive_omega, stiffness, yields):
        self.stiff = np.array(omega) ** 2
        self.damp = 2 * np.array(zeta) * np.array(omega)
        self.row = np.array(slide)
        self.base = np.array(base)
        self.mass = mass
        self.drive = drive
        self.omega = drive_omega
        self.period = 2 * pi / drive_omega
        self.k = np.array(stiffness)
        self.yields = np.array(yields)
        self.stretch = np.zeros(self.k.size)
        self.at = 0.0

    def start(self):
        """Return the phase and the state (z, v) at the start; the base first moves towards -x."""
        return (1 if self.row @ self.base * self.drive < 0 else -1), np.zeros(2 * self.row.size)

    def stretches(self, q):
        """Return the stretches of all elements at the slide q since the last reversal."""
        return np.minimum(np.maximum(self.stretch + (q - self.at), -self.yields), self.yields)

    def rhs(self, phase):
        """Return dy/dt."""
        n = self.row.size
        pull = self.base * self.drive
        push = self.row / self.mass

        def free(t, y):
            force = self.k @ self.stretches(self.row @ y[:n])
            return np.concatenate(
                [
                    y[n:],
                    -pull * sin(self.omega * t)
                    - self.stiff * y[:n]
                    - self.damp * y[n:]
                    - push * force,
                ]
            )

        return free

    def event(self, phase):
        """Return a function that is positive until the slide reverses."""
        n = self.row.size
        return lambda t, y: phase * (self.row @ y[n:])

    def switch(self, phase, t, y):
        """Return the phase and the state after a reversal.

        Parameters
        ----------
        phase : int
        t : float
            Time of the reversal.
        y : array
            State at the reversal.
        """
        q = float(self.row @ y[: self.row.size])
        self.stretch = self.stretches(q)
        self.at = q
        return -phase, np.array(y)

    def slide(self, y):
        """Return the slide of the interface from the states (k, n)."""
        return y[:, : self.row.size] @ self.row
