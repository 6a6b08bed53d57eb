"""Measures of the last cycles of one run or of many, from the numbers of `read_kernels`."""

from dataclasses import dataclass

import numpy as np

from ...core import InterfaceLoop
from ..integrated import mean_slip_phase
from .positions_kernels import INTERFACE, RUN

# [rad] angle by which a free vibration must turn in a stick to be measured: a vibration is reported from 1.5 periods on,
# and a fit to a frequency that falls while elements yield is wrong by up to 0.05 of that angle
MIN_RING_ANGLE = 0.95 * 3 * np.pi


@dataclass(frozen=True, eq=False, slots=True)
class Reading:
    """Numbers of the last cycles of a run, or of many runs (...).

    - run: (..., 13) see `positions_kernels.RunMeasures`
    - faces: (..., i, 21) see `positions_kernels.InterfaceMeasures`
    - span: (...) duration of these cycles [s]
    - period: (...) duration of a cycle [s]
    """

    run: np.ndarray
    faces: np.ndarray
    span: float
    period: float

    def interface_value(self, place: int, face: int = 0):
        """Return a number of an interface; position: a field of `INTERFACE`."""
        return self.faces[..., face, place]

    @property
    def swing(self):
        """Half the range of the output [m]."""
        return (self.run[..., RUN.max_output] - self.run[..., RUN.min_output]) / 2

    @property
    def acceleration(self):
        """Largest absolute acceleration of the output [m s-2]."""
        return self.run[..., RUN.max_acceleration]

    @property
    def waves(self) -> tuple:
        """First and third harmonic of the absolute acceleration of the output [m s-2]."""
        x = self.run
        return (
            2 / self.span * np.hypot(x[..., RUN.cos_1], x[..., RUN.sin_1]),
            2 / self.span * np.hypot(x[..., RUN.cos_3], x[..., RUN.sin_3]),
        )

    @property
    def start(self):
        """Mean phase [rad] modulo pi of the releases of the first interface, see `mean_slip_phase`."""
        return mean_slip_phase(
            *(self.run[..., place] for place in (RUN.n_releases, RUN.release_cos, RUN.release_sin))
        )

    @property
    def drift(self):
        """Drift of the first interface per cycle [m].

        It is the difference of the mean relative displacements of the last and the first cycle
        over the cycles between them; in fewer than 1.5 cycles the difference between both ends.
        """
        cycles = np.asarray(self.span / self.period)
        means = (
            (
                self.interface_value(INTERFACE.last_slide)
                - self.interface_value(INTERFACE.first_slide)
            )
            / self.period
            / np.where(cycles > 1, cycles - 1, 1.0)
        )
        return np.where(
            cycles < 1.5,
            (
                self.interface_value(INTERFACE.end_slide)
                - self.interface_value(INTERFACE.start_slide)
            )
            / np.maximum(cycles, 1e-9),
            means,
        )[()]

    @property
    def rise(self):
        """Mean magnitude of the first force in the last cycle minus that in the first [N]."""
        return (
            np.abs(self.interface_value(INTERFACE.last_force))
            - np.abs(self.interface_value(INTERFACE.first_force))
        ) / self.period

    def loop(self, face: int = 0) -> InterfaceLoop:
        """Return the InterfaceLoop of an interface."""
        q, f = (
            2 / self.span * (self.interface_value(c, face) - 1j * self.interface_value(s, face))
            for c, s in (
                (INTERFACE.slide_cos, INTERFACE.slide_sin),
                (INTERFACE.force_cos, INTERFACE.force_sin),
            )
        )
        slip = self.interface_value(INTERFACE.max_slip, face) - self.interface_value(
            INTERFACE.min_slip, face
        )
        return InterfaceLoop(
            q,
            f,
            self.interface_value(INTERFACE.work, face),
            slip,
            self.interface_value(INTERFACE.stuck_time, face),
            self.interface_value(INTERFACE.max_force, face),
        )

    @property
    def loops(self) -> tuple:
        """InterfaceLoop of every interface."""
        return tuple(map(self.loop, range(self.faces.shape[-2])))


def find_sticking_ring(modal_system, table, reading: Reading) -> tuple | None:
    """Find the free vibration in the sticks of one mode behind one interface under one sine.

    Parameters
    ----------
    modal_system : ModalSystem
    table : ElementTable
    reading : Reading

    Returns
    -------
    tuple or None
        Amplitude [m s-2], frequency [rad/s] and damping ratio. They have a closed form for a
        single element; the amplitude is 0 where nothing vibrates, or where the sticks of many
        elements are too short. None where samples must tell.
    """
    if table.n_elements[0] > 1:
        return (0.0, 0.0, 0.0) if reading.run[RUN.ring_angle] < MIN_RING_ANGLE else None
    beta = modal_system.omega_squared[0] + table.stiffness_sum[0, -1] * modal_system.inverse_mass[0]
    half = modal_system.damping[0, 0] / 2
    own = np.sqrt(max(beta - half**2, 0.0))
    return (
        (float(reading.run[RUN.ring]), float(own), float(half / np.sqrt(beta)))
        if own > 0
        else (0.0, 0.0, 0.0)
    )


def join_readings(readings) -> Reading:
    """Join the Readings of runs with the same number of interfaces."""
    return Reading(
        *(
            np.array([getattr(reading, name) for reading in readings])
            for name in Reading.__dataclass_fields__
        )
    )
