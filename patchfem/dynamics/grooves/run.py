"""Run of modes whose load climbs grooves, under a law without memory.

The law is Coulomb's, or a force that follows the speed.

`dynamics.smooth` integrates the motion, which is sampled as a march samples it.
"""

from dataclasses import dataclass

import numpy as np

from ...core import InitialState, Outcome
from ...friction.grooves import Grooves
from ...friction.path_work import sampled_work
from ...friction.protocol import Element
from ..ledger import Ledger
from ..march.models import coulomb_model
from ..smooth import run as smooth
from ..smooth.arrays import Counter, Scalar, Work
from .climbing import FlankModel, GroovesRun, check_lifted_mass

# relative tolerance of a step
STEP_TOLERANCE = 1e-11
# motion over wavelength/(2 pi), below which the choice of the step takes it for rest
REST_RATIO = 1e-6
LAW_MODULE = "dynamics.grooves.flank_kernels"
# positions in the ledger of a march of the sums that `SampledRun._read_sums` returns
LEDGER_SUMS = [
    Ledger.DRIVE_WORK,
    Ledger.VISCOUS_LOSS,
    Ledger.DRIVE_POWER,
    Ledger.FRICTION_LOSS,
    Ledger.N_ITERATIONS,
    Ledger.FRICTION_WORK,
]
# status of a march by the outcome of the motion
STATUS_OF_OUTCOME = {Outcome.LEAVES_GROOVES: 5, Outcome.NOT_CONVERGED: 3}


@dataclass(frozen=True, eq=False, slots=True)
class GroovesModel(FlankModel):
    """A law without memory along flanks.

    - grooves, load [N]
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
        """Bond length [m]; 0, as the law has no bonds."""
        return 0.0

    @property
    def set_valued(self) -> bool:
        """Whether the law holds without any stretch."""
        return self.speed is None

    @property
    def runner(self):
        """Class that marches this contact."""
        return SampledRun

    def build(self):
        """Return a contact without friction, which no kernel reads."""
        return coulomb_model(0.0, 0.0).build()


def make_model(
    grooves: Grooves, load: float, static: float, kinetic: float, speed: float | None, modes
) -> GroovesModel:
    """Return the model of grooves below these modes.

    Parameters
    ----------
    grooves : Grooves
    load : float
        Mean of the load [N].
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
        As `climbing.check_lifted_mass`.
    """
    check_lifted_mass(grooves, static, modes)
    return GroovesModel(grooves, load, static, kinetic, speed)


class SampledRun(GroovesRun):
    """Arrays and time of a march over grooves, and the motion that is sampled."""

    def __init__(self, modes, drive, model, steps_per_cycle, travel, loops, start=None):
        super().__init__(modes, drive, model, steps_per_cycle, travel, loops, start)
        self.width += 1
        self._begin()
        self.ledger[Ledger.DRIVE_WORK] += self.find_interface_energy()

    def _begin(self) -> None:
        """Start the motion from the present state, at the start of the drive."""
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
        least = self.smooth_motion.arrays.work[Work.SIZES]
        least[:n] = REST_RATIO / g.wave_number
        least[n : 2 * n] = (
            REST_RATIO / g.wave_number * self.smooth_motion.arrays.scalars[Scalar.FASTEST_RATE]
        )
        self.booked = self._read_sums()

    def _read_sums(self) -> np.ndarray:
        """Return the sums of the motion, six energies and counts.

        They are work of the drive, viscous loss, its |work|, friction loss [J], steps, and friction
        work [J].
        """
        y = self.smooth_motion.arrays.state
        own = self.smooth_motion.record.counters
        n = 2 * self.modes.omega.size
        return np.array(
            [y[-3], y[-2], own[Counter.DRIVE_POWER], y[n], own[Counter.ACCEPTED], y[-1]]
        )

    def fork(self, drive):
        """Return an independent copy, like `Run.fork`."""
        twin = super().fork(drive)
        twin.smooth_motion = self.smooth_motion.fork(drive)
        return twin

    def _slide_contact(self, path) -> None:
        """Do nothing: there is no memory."""

    def _march_steps(self, count: int, rows) -> tuple:
        """Fill rows like `Run._march_steps`, from samples of the motion.

        They also have the friction loss of each step.
        """
        n = self.modes.omega.size
        dt = float(self.prop.dt)
        times = (self.done + np.arange(count + 1)) * dt
        motion = self.smooth_motion
        if motion.time != times[0] or not np.array_equal(
            motion.arrays.state[: 2 * n], self.state.ravel()
        ):
            self._begin()
            motion = self.smooth_motion
        begun = motion.fork(self.drive)
        seen = motion.run_to(times[-1], times)
        # where it ends, at the sample that follows
        if motion.outcome is not None and len(seen) <= count:
            seen = np.concatenate([seen, motion.read_state()[0][None]])
        out = seen[:, 1 : 1 + n] @ self.modes.output
        beyond = np.flatnonzero(np.abs(out) > self.travel)
        last, status = (
            (int(beyond[0]), 1)
            if beyond.size
            else (len(seen) - 1, STATUS_OF_OUTCOME.get(motion.outcome, 0))
        )
        if 0 < last < len(seen) - 1:  # the sums and the state are those of the last sample
            motion = self.smooth_motion = begun
            motion.run_to(times[last], times[: last + 1])
        seen = seen[: last + 1]
        work = np.diff(seen[:, -1])
        slip_path = np.diff(seen[:, 2 * n + 1])
        part = rows[: last + 1]
        part[:, : 2 * n + 2] = seen[:, 1 : 2 * n + 3]
        part[:, 2 * n + 2] = seen[:, 2 * n + 3]
        part[:, 2 * n + 3] = seen[:, 2 * n + 4]
        part[:, 2 * n + 4] = seen[:, 2 * n + 3]
        part[:, 2 * n + 5] = seen[:, 2 * n + 5]
        part[:-1, 2 * n + 4] = np.divide(
            work, slip_path, out=seen[:-1, 2 * n + 3].copy(), where=slip_path != 0
        )
        part[:-1, 2 * n + 6] = work
        part[:-1, 2 * n + 7] = work - np.diff(seen[:, 2 * n + 5])
        self.state[:] = motion.arrays.state[: 2 * n].reshape(2, n)
        sums = self._read_sums()
        self.ledger[LEDGER_SUMS] += sums - self.booked
        self.ledger[Ledger.MAX_STORED] = max(
            self.ledger[Ledger.MAX_STORED], motion.record.counters[Counter.MAX_STORED]
        )
        self.booked = sums
        return last, status

    def _sampled_works(self, rows) -> np.ndarray:
        n = 2 * self.modes.omega.size
        after = rows[:-1, n + 4] if self.model.set_valued else None
        return sampled_work(rows[:, n], rows[:, n + 2], after)

    def _step_energies(self, rows) -> np.ndarray:
        """Return the energies of the steps, like `Run._step_energies`.

        Friction dissipates its own work along the flank.
        """
        n = 2 * self.modes.omega.size
        return np.stack([self._step_works(rows), rows[:-1, n + 7], np.zeros(len(rows) - 1)])

    def set_outcome(self, status: int) -> None:
        super().set_outcome(status)
        if status == 5:
            self._leaves()

    def check_steps(self) -> None:
        """Set the outcome not_converged where steps did not meet their error."""
        if self.ledger[Ledger.N_UNCONVERGED]:
            self.outcome = Outcome.NOT_CONVERGED
            self.message = (
                f"{int(self.ledger[Ledger.N_UNCONVERGED])} of {self.done} time steps on the grooves did not converge; raise "
                "accuracy.steps_per_cycle"
            )

    def find_interface_energy(self) -> float:
        """Return the potential energy of the load and the kinetic energy of the lifted mass [J]."""
        g = self.model.grooves
        z, v = self.state
        q = float(self.modes.slide @ z)
        rate = float(self.modes.slide @ v)
        return float(self.model.load * g.height(q) + 0.5 * g.lifted_mass * (g.slope(q) * rate) ** 2)
