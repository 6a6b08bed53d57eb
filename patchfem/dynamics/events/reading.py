"""Measures (amplitudes, energies and slip) of the last cycles in event-driven runs."""

from dataclasses import dataclass

import numpy as np

from ...core import InterfaceLoop
from ..integrated import mean_slip_phase
from .positions_kernels import InterfaceMeasure, RunMeasure

# Minimum angle of a free vibration that is measured during a stick [rad]. Vibrations
# are reported from 1.5 periods on; while elements yield the frequency falls, and the
# fitted angle is wrong by up to 5 %.
MIN_VIBRATION_ANGLE = 0.95 * 3 * np.pi


@dataclass(frozen=True, eq=False, slots=True)
class Reading:
    """Measures of the last cycles of one run, or of several runs as arrays of shape (...).

    - run: (..., 13) see `positions_kernels.RunMeasure`
    - faces: (..., i, 21) see `positions_kernels.InterfaceMeasure`
    - span: (...) duration of these cycles [s]
    - period: (...) duration of a cycle [s]
    """

    run: np.ndarray
    faces: np.ndarray
    span: float
    period: float

    def interface_value(self, measure: int, interface: int = 0):
        """Return the value of a measure for one interface.

        `measure` is a member of `InterfaceMeasure`.
        """
        return self.faces[..., interface, measure]

    @property
    def output_amplitude(self):
        """Output amplitude [m]: half of the peak-to-peak range."""
        return (self.run[..., RunMeasure.MAX_OUTPUT] - self.run[..., RunMeasure.MIN_OUTPUT]) / 2

    @property
    def acceleration(self):
        """Peak magnitude of the output acceleration [m s-2]."""
        return self.run[..., RunMeasure.MAX_ACCELERATION]

    @property
    def acceleration_harmonics(self) -> tuple:
        """Amplitudes of the first and third harmonics of the absolute output acceleration [m s-2]."""
        x = self.run
        return (
            2 / self.span * np.hypot(x[..., RunMeasure.COS_1], x[..., RunMeasure.SIN_1]),
            2 / self.span * np.hypot(x[..., RunMeasure.COS_3], x[..., RunMeasure.SIN_3]),
        )

    @property
    def slip_start_phase(self):
        """Mean phase [rad], modulo pi, at which slip begins at the first interface.

        See `mean_slip_phase`.
        """
        return mean_slip_phase(
            self.run[..., RunMeasure.N_RELEASES],
            self.run[..., RunMeasure.RELEASE_COS],
            self.run[..., RunMeasure.RELEASE_SIN],
        )

    @property
    def drift(self):
        """Drift [m] of the relative displacement at the first interface per cycle.

        It is the difference of the mean relative displacements of the last and the first cycle
        divided by the number of cycles between them; for fewer than 1.5 cycles it is the difference between both ends.
        """
        cycles = np.asarray(self.span / self.period)
        means = (
            (
                self.interface_value(InterfaceMeasure.LAST_SLIDE)
                - self.interface_value(InterfaceMeasure.FIRST_SLIDE)
            )
            / self.period
            / np.where(cycles > 1, cycles - 1, 1.0)
        )
        return np.where(
            cycles < 1.5,
            (
                self.interface_value(InterfaceMeasure.END_SLIDE)
                - self.interface_value(InterfaceMeasure.START_SLIDE)
            )
            / np.maximum(cycles, 1e-9),
            means,
        )[()]

    @property
    def force_increase(self):
        """Increase [N] of the mean friction force magnitude at the first interface.

        It is that of the last cycle minus that of the first.
        """
        return (
            np.abs(self.interface_value(InterfaceMeasure.LAST_FORCE))
            - np.abs(self.interface_value(InterfaceMeasure.FIRST_FORCE))
        ) / self.period

    def _fourier_integral(self, cosine_measure: int, interface: int):
        """Return the integral of an interface quantity times exp(-i omega t).

        `cosine_measure` is the index of the integral with the cosine; that with the sine follows it.
        """
        cosine = self.interface_value(cosine_measure, interface)
        return cosine - 1j * self.interface_value(cosine_measure + 1, interface)

    def loop(self, interface: int = 0) -> InterfaceLoop:
        """Return the friction loop of an interface."""
        slide = 2 / self.span * self._fourier_integral(InterfaceMeasure.SLIDE_COS, interface)
        force = 2 / self.span * self._fourier_integral(InterfaceMeasure.FORCE_COS, interface)
        slip = self.interface_value(InterfaceMeasure.MAX_SLIP, interface) - self.interface_value(
            InterfaceMeasure.MIN_SLIP, interface
        )
        return InterfaceLoop(
            slide,
            force,
            self.interface_value(InterfaceMeasure.WORK, interface),
            slip,
            self.interface_value(InterfaceMeasure.STUCK_TIME, interface),
            self.interface_value(InterfaceMeasure.MAX_FORCE, interface),
        )

    @property
    def loops(self) -> tuple:
        """Friction loop of every interface."""
        return tuple(map(self.loop, range(self.faces.shape[-2])))


def find_stick_vibration(modal_system, table, reading: Reading) -> tuple | None:
    """Compute the free vibration of a single mode while its only interface sticks.

    Parameters
    ----------
    modal_system : ModalSystem
    table : ElementTable
    reading : Reading

    Returns
    -------
    tuple or None
        Amplitude [m s-2], frequency [rad/s] and damping ratio. They have a closed form for a
        single element; the amplitude is 0 if nothing vibrates, or if the sticks of many
        elements are too short. None where samples must tell.
    """
    if table.n_elements[0] > 1:
        return (0.0, 0.0, 0.0) if reading.run[RunMeasure.RING_ANGLE] < MIN_VIBRATION_ANGLE else None
    beta = modal_system.omega_squared[0] + table.stiffness_sum[0, -1] * modal_system.inverse_mass[0]
    half_damping = modal_system.damping[0, 0] / 2
    frequency = np.sqrt(max(beta - half_damping**2, 0.0))
    if frequency == 0:
        return 0.0, 0.0, 0.0
    return (
        float(reading.run[RunMeasure.RING]),
        float(frequency),
        float(half_damping / np.sqrt(beta)),
    )


def join_readings(readings) -> Reading:
    """Join the measures of runs with the same number of interfaces."""
    columns = []
    for name in Reading.__dataclass_fields__:
        columns.append(np.array([getattr(reading, name) for reading in readings]))
    return Reading(*columns)
