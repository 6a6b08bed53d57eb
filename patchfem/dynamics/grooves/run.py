"""Time integration over grooves under a friction law without memory.

The law is Coulomb's law, or a velocity-dependent force.

`dynamics.smooth` integrates the motion, which is sampled at the steps of a march.
"""

from dataclasses import dataclass

import numpy as np

from ...core import InitialState, Outcome
from ...friction.grooves import Grooves
from ...friction.path_work import sampled_work
from ...friction.protocol import Element
from ..ledger import Ledger
from ..march.models import coulomb_model
from ..march.run import MarchStatus
from ..smooth import run as smooth
from ..smooth.arrays import Counter, Scalar, Work
from .climbing import FlankModel, GroovesRun, check_lifted_mass

# Relative tolerance of an integration step, equal to that of a march with grooves.
STEP_TOLERANCE = 1e-11
# Largest displacement that the step-size control treats as rest, relative to wavelength/(2 pi).
REST_RATIO = 1e-6
LAW_MODULE = "dynamics.grooves.flank_kernels"
# Ledger positions of the sums that `SampledRun._read_sums` returns.
LEDGER_SUMS = [
    Ledger.DRIVE_WORK,
    Ledger.VISCOUS_LOSS,
    Ledger.DRIVE_POWER,
    Ledger.FRICTION_LOSS,
    Ledger.N_ITERATIONS,
    Ledger.FRICTION_WORK,
]
# Status of the march for each outcome of the integrated motion.
STATUS_OF_OUTCOME = {
    Outcome.LEAVES_GROOVES: MarchStatus.LEAVES_GROOVES,
    Outcome.NOT_CONVERGED: MarchStatus.NOT_FINITE,
}


@dataclass(frozen=True, eq=False, slots=True)
class GroovesModel(FlankModel):
    """Contact model of a friction law without memory along the flanks of grooves.

    - grooves, load: geometry and normal load [N]
    - static, kinetic: coefficients of friction [1]
    - speed: v_0 [m/s] of eq. 2.4, static tanh(v/v_0) along the flank; None for Coulomb's law
    """

    grooves: Grooves
    load: float
    static: float
    kinetic: float
    speed: float | None = None

    @property
    def length(self) -> float:
        """Bond length [m]; always 0 because the law has no bonds."""
        return 0.0

    @property
    def set_valued(self) -> bool:
        """Return whether the law sticks rigidly (set-valued Coulomb friction)."""
        return self.speed is None

    @property
    def runner(self):
        """Class that integrates a motion with this contact over time."""
        return SampledRun

    def allocate_contact(self):
        """Return a frictionless contact as a placeholder in the kernel arguments."""
        return coulomb_model(0.0, 0.0).allocate_contact()


def make_model(
    grooves: Grooves, load: float, static: float, kinetic: float, speed: float | None, modes
) -> GroovesModel:
    """Return the contact model for grooves with a friction law that has no memory.

    Parameters
    ----------
    grooves : Grooves
    load : float
        Mean normal load [N].
    static, kinetic : float
        Coefficients of friction on the flanks [1].
    speed : float or None
        v_0 [m/s] of the tanh law, None for Coulomb friction.
    modes : ModalBasis

    Returns
    -------
    GroovesModel

    Raises
    ------
    PatchfemError
        See `climbing.check_lifted_mass`.
    """
    check_lifted_mass(grooves, static, modes)
    return GroovesModel(grooves, load, static, kinetic, speed)


class SampledRun(GroovesRun):
    """Time integration over grooves by the Runge-Kutta solver, with the samples of a march."""

    def __init__(self, modes, drive, model, steps_per_cycle, travel, loops, start=None):
        super().__init__(modes, drive, model, steps_per_cycle, travel, loops, start)
        self.width += 1
        self._start_smooth_motion()
        self.ledger[Ledger.DRIVE_WORK] += self.find_interface_energy()

    def _start_smooth_motion(self) -> None:
        """Start the Runge-Kutta integration from the present modal state, at the start of the drive signal."""
        g = self.model.grooves
        model = self.model
        numbers = [
            1.0,
            model.load,
            g.wave_number,
            g.amplitude,
            g.phase,
            g.lifted_mass,
            model.static,
            model.kinetic,
            model.speed or 0.0,
        ]
        element = Element(
            LAW_MODULE, np.array(numbers), np.zeros(1), model.limit, state_scales=(np.inf,) * 3
        )
        self.smooth_motion = smooth.Motion(
            self.modes, self.drive, element, 1.0, STEP_TOLERANCE, start=InitialState(*self.state)
        )
        self.smooth_motion.request_last_phasors(1)
        n = self.modes.omega.size
        size_floors = self.smooth_motion.arrays.work[Work.SIZES]
        size_floors[:n] = REST_RATIO / g.wave_number
        size_floors[n : 2 * n] = (
            REST_RATIO / g.wave_number * self.smooth_motion.arrays.scalars[Scalar.FASTEST_RATE]
        )
        self.counted_sums = self._read_sums()

    def _read_sums(self) -> np.ndarray:
        """Return the energy sums and the step count of the Runge-Kutta integration, (6,).

        They are drive work, viscous loss, sum of absolute drive works, friction loss [J], number of steps, and friction
        work [J].
        """
        y = self.smooth_motion.arrays.state
        counters = self.smooth_motion.record.counters
        n = 2 * self.modes.omega.size
        return np.array(
            [y[-3], y[-2], counters[Counter.DRIVE_POWER], y[n], counters[Counter.ACCEPTED], y[-1]]
        )

    def fork(self, drive):
        """Return an independent copy of the march that continues with another drive signal."""
        copied_run = super().fork(drive)
        copied_run.smooth_motion = self.smooth_motion.fork(drive)
        return copied_run

    def _slide_contact(self, path) -> None:
        """Do nothing, because the contact has no memory."""

    def _march_steps(self, count: int, rows) -> tuple:
        """Fill the sample rows of a march from the Runge-Kutta integration.

        The rows have the friction loss of each step as an additional column.
        """
        n = self.modes.omega.size
        dt = float(self.prop.dt)
        times = (self.done + np.arange(count + 1)) * dt
        motion = self.smooth_motion
        if motion.time != times[0] or not np.array_equal(
            motion.arrays.state[: 2 * n], self.state.ravel()
        ):
            self._start_smooth_motion()
            motion = self.smooth_motion
        start_motion = motion.fork(self.drive)
        samples = motion.run_to(times[-1], times)
        # A motion that ends early is sampled at its end.
        if motion.outcome is not None and len(samples) <= count:
            samples = np.concatenate([samples, motion.read_state()[0][None]])
        output = samples[:, 1 : 1 + n] @ self.modes.output
        exceeding = np.flatnonzero(np.abs(output) > self.travel)
        last = len(samples) - 1
        status = STATUS_OF_OUTCOME.get(motion.outcome, MarchStatus.FINISHED)
        if exceeding.size:
            last = int(exceeding[0])
            status = MarchStatus.EXCEEDS_TRAVEL
        # The motion is integrated again up to the last sample, so that sums
        # and state belong to that sample.
        if 0 < last < len(samples) - 1:
            motion = self.smooth_motion = start_motion
            motion.run_to(times[last], times[: last + 1])
        samples = samples[: last + 1]
        work = np.diff(samples[:, -1])
        slip_path = np.diff(samples[:, 2 * n + 1])
        filled_rows = rows[: last + 1]
        filled_rows[:, : 2 * n + 2] = samples[:, 1 : 2 * n + 3]
        filled_rows[:, 2 * n + 2] = samples[:, 2 * n + 3]
        filled_rows[:, 2 * n + 3] = samples[:, 2 * n + 4]
        filled_rows[:, 2 * n + 4] = samples[:, 2 * n + 3]
        filled_rows[:, 2 * n + 5] = samples[:, 2 * n + 5]
        filled_rows[:-1, 2 * n + 4] = np.divide(
            work, slip_path, out=samples[:-1, 2 * n + 3].copy(), where=slip_path != 0
        )
        filled_rows[:-1, 2 * n + 6] = work
        filled_rows[:-1, 2 * n + 7] = work - np.diff(samples[:, 2 * n + 5])
        self.state[:] = motion.arrays.state[: 2 * n].reshape(2, n)
        sums = self._read_sums()
        self.ledger[LEDGER_SUMS] += sums - self.counted_sums
        self.ledger[Ledger.MAX_STORED] = max(
            self.ledger[Ledger.MAX_STORED], motion.record.counters[Counter.MAX_STORED]
        )
        self.counted_sums = sums
        return last, status

    def _sampled_works(self, rows) -> np.ndarray:
        n = 2 * self.modes.omega.size
        after = rows[:-1, n + 4] if self.model.set_valued else None
        return sampled_work(rows[:, n], rows[:, n + 2], after)

    def _step_energies(self, rows) -> np.ndarray:
        """Return the friction work, dissipated energy and created energy in each step, (3, steps) [J].

        The dissipated energy is the work of friction along the flank.
        """
        n = 2 * self.modes.omega.size
        return np.stack([self._step_works(rows), rows[:-1, n + 7], np.zeros(len(rows) - 1)])

    def set_outcome(self, status: int) -> None:
        super().set_outcome(status)
        if status == MarchStatus.LEAVES_GROOVES:
            self._set_grooves_left()

    def check_steps(self) -> None:
        """Set the outcome to not_converged if any integration step has not met its tolerance."""
        if self.ledger[Ledger.N_UNCONVERGED]:
            self.outcome = Outcome.NOT_CONVERGED
            self.message = (
                f"{int(self.ledger[Ledger.N_UNCONVERGED])} of {self.done} time steps on the grooves did not converge; raise "
                "accuracy.steps_per_cycle"
            )

    def find_interface_energy(self) -> float:
        """Return the energy [J] due to the height of the load and the motion of the lifted mass."""
        g = self.model.grooves
        z, v = self.state
        q = float(self.modes.slide @ z)
        rate = float(self.modes.slide @ v)
        return float(self.model.load * g.height(q) + 0.5 * g.lifted_mass * (g.slope(q) * rate) ** 2)
