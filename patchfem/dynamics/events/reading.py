"""What the last cycles of runs show, off the numbers that `read_kernels` takes from their pieces: of one run or of many
alike, as arrays over them."""

from dataclasses import dataclass

import numpy as np

from ...core import InterfaceLoop
from ..integrated import start_phase
from . import names_kernels as at

# least angle [rad] that what rings turns in a stick: a ring is told of 1.5 periods, and a fit that leaves a tenth of it
# over is off by tenths of a radian where elements yield one by one and the frequency falls
RINGS = 0.95 * 3 * np.pi


@dataclass(frozen=True, eq=False, slots=True)
class Reading:
    """Numbers run (..., OF_RUN) and faces (..., i, OF_FACE) by the places of `names_kernels`, of cycles that take span
    (...) [s] at a period (...) [s]."""

    run: np.ndarray
    faces: np.ndarray
    span: float
    period: float

    def of(self, place: int, face: int = 0):
        """A number of an interface."""
        return self.faces[..., face, place]

    @property
    def swing(self):
        """Half the range of the output [m]."""
        return (self.run[..., at.OUT_HIGH] - self.run[..., at.OUT_LOW]) / 2

    @property
    def acceleration(self):
        """Largest absolute acceleration of the output [m s-2]."""
        return self.run[..., at.ACCELERATION]

    @property
    def waves(self) -> tuple:
        """First and third harmonic of the absolute acceleration of the output [m s-2]."""
        x = self.run
        return (
            2 / self.span * np.hypot(x[..., at.A_COS], x[..., at.A_SIN]),
            2 / self.span * np.hypot(x[..., at.A3_COS], x[..., at.A3_SIN]),
        )

    @property
    def start(self):
        """Phase [rad] modulo pi of the releases of the first interface, as `start_phase` has it."""
        return start_phase(
            *(self.run[..., place] for place in (at.STARTS, at.START_COS, at.START_SIN))
        )

    @property
    def drift(self):
        """Mean of the first slide in the last cycle less that in the first, per cycle between them [m]; in fewer than
        1.5 cycles the motion from end to end."""
        cycles = np.asarray(self.span / self.period)
        means = (
            (self.of(at.LAST) - self.of(at.FIRST))
            / self.period
            / np.where(cycles > 1, cycles - 1, 1.0)
        )
        return np.where(
            cycles < 1.5, (self.of(at.END) - self.of(at.BEGIN)) / np.maximum(cycles, 1e-9), means
        )[()]

    @property
    def rise(self):
        """Mean size of the first force in the last cycle less that in the first [N]."""
        return (np.abs(self.of(at.F_LAST)) - np.abs(self.of(at.F_FIRST))) / self.period

    def loop(self, face: int = 0) -> InterfaceLoop:
        """The InterfaceLoop of an interface, of numbers or (n,) of n runs."""
        q, f = (
            2 / self.span * (self.of(c, face) - 1j * self.of(s, face))
            for c, s in ((at.Q_COS, at.Q_SIN), (at.F_COS, at.F_SIN))
        )
        slip = self.of(at.SLIP_HIGH, face) - self.of(at.SLIP_LOW, face)
        return InterfaceLoop(
            q, f, self.of(at.WORK, face), slip, self.of(at.STUCK, face), self.of(at.FORCE, face)
        )

    @property
    def loops(self) -> tuple:
        """An InterfaceLoop per interface."""
        return tuple(map(self.loop, range(self.faces.shape[-2])))


def ring_of(modal_system, table, reading: Reading) -> tuple | None:
    """(amplitude [m s-2], frequency [rad/s], damping ratio) of what rings in the sticks of one mode behind one
    interface under one sine.

    Of a single element in closed form, with an amplitude of 0 where nothing rings, as behind many elements whose sticks
    are too short for it; None where the samples have to tell.
    """
    if table.count[0] > 1:
        return (0.0, 0.0, 0.0) if reading.run[at.SWING] < RINGS else None
    beta = modal_system.square[0] + table.stiff[0, -1] * modal_system.reach[0]
    half = modal_system.damping[0, 0] / 2
    own = np.sqrt(max(beta - half**2, 0.0))
    return (
        (float(reading.run[at.RING]), float(own), float(half / np.sqrt(beta)))
        if own > 0
        else (0.0, 0.0, 0.0)
    )


def joined(readings) -> Reading:
    """The Reading of many runs with the same number of interfaces."""
    return Reading(
        *(
            np.array([getattr(one, name) for one in readings])
            for name in Reading.__dataclass_fields__
        )
    )
