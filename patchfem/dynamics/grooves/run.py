"""Time integration over grooves under a friction law without memory.

The law is Coulomb's law, or a velocity-dependent force.

The engine `hybrid` integrates the motion from event to event, which is sampled at the steps of a march.
"""

from dataclasses import dataclass, replace

import numpy as np

from ...core import InitialState, Outcome
from ...friction.grooves import Grooves
from ...friction.path_work import sampled_work
from ...hybrid import cases
from ...hybrid import runs as engine
from ...hybrid.drives import make_signal
from ...hybrid.laws import grooves as rigid_law
from ...hybrid.laws import smooth_grooves as speed_law
from ...hybrid.records import (
    N_FACE_INTEGRALS,
    N_INTEGRALS,
    Clock,
    Memory,
    Piece,
    Setting,
    State,
    Status,
)
from ..ledger import Ledger
from ..march.models import coulomb_model
from ..march.run import MarchStatus
from .climbing import FlankModel, GroovesRun, check_lifted_mass

# Relative tolerance of an integration step, equal to that of a march with grooves.
STEP_TOLERANCE = 1e-11
# Largest displacement that the step-size control treats as rest, relative to wavelength/(2 pi).
REST_RATIO = 1e-6
# Ledger positions of the sums that `SampledRun._read_sums` returns.
LEDGER_SUMS = [
    Ledger.DRIVE_WORK,
    Ledger.VISCOUS_LOSS,
    Ledger.DRIVE_POWER,
    Ledger.FRICTION_LOSS,
    Ledger.N_ITERATIONS,
    Ledger.FRICTION_WORK,
]


@dataclass(frozen=True, eq=False, slots=True)
class GroovesModel(FlankModel):
    """Contact model of a friction law without memory along the flanks of grooves.

    - grooves, load: geometry and normal load [N]
    - static, kinetic: coefficients of friction [1]
    - reference_speed: v_0 [m/s] of eq. 2.4, static tanh(v/v_0) along the flank; None for Coulomb's law
    """

    grooves: Grooves
    load: float
    static: float
    kinetic: float
    reference_speed: float | None = None

    @property
    def length(self) -> float:
        """Bond length [m]; always 0 because the law has no bonds."""
        return 0.0

    @property
    def set_valued(self) -> bool:
        """Return whether the law sticks rigidly (set-valued Coulomb friction)."""
        return self.reference_speed is None

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
        self._start_motion()
        self.ledger[Ledger.DRIVE_WORK] += self.find_interface_energy()

    def _start_motion(self) -> None:
        """Start the integration from the present modal state, at the present time."""
        self._make_case()
        start = cases.make_start(self.case.rig, (), InitialState(*self.state))
        self.motion = cases.make_batch([replace(self.case, y=start)])[1]
        self._enter_piece()
        self.counted_sums = self._read_sums()

    def _make_case(self) -> None:
        """Make the arrays of the engine for the present drive."""
        model = self.model
        make_law = (rigid_law if model.set_valued else speed_law).make_grooves
        interface = cases.Interface(
            make_law(model, model.grooves), cases.Load(model.load), self.modes.slide
        )
        signal = make_signal(self.drive)
        sizes = cases.find_sizes(self.modes, signal, self.drive, InitialState(*self.state))
        rest = REST_RATIO / model.grooves.wave_number
        sizes = max(sizes[0], rest), max(sizes[1], 2 * np.pi / signal.period * rest)
        options = cases.Options(self.drive.moving, rtol=STEP_TOLERANCE, max_steps=np.inf)
        rig = cases.make_rig(self.modes, signal, [interface], sizes, options)
        rig.settings[Setting.REPEAT] = 0  # a march finds by itself whether a motion repeats
        self.case = cases.Case(rig, np.zeros(rig.scales.size), *np.zeros((3, 1)), 1)

    def _enter_piece(self) -> None:
        """Set the time of the motion and the piece of the drive there."""
        clock = self.motion.clock[0]
        clock[Clock.TIME] = self.done * float(self.prop.dt)
        starts = self.case.rig.pieces[:, Piece.START]
        clock[Clock.PIECE] = max(np.searchsorted(starts, clock[Clock.TIME], side="right") - 1, 0)

    def _read_sums(self) -> np.ndarray:
        """Return the energy sums and the step count of the engine, (6,).

        They are drive work, viscous loss, sum of absolute drive works, friction loss [J], number of steps, and friction
        work [J].
        """
        y = self.motion.y[0]
        clock = self.motion.clock[0]
        work, _, loss = y[-N_INTEGRALS - N_FACE_INTEGRALS : -N_INTEGRALS]
        drive_work, viscous_loss = y[-N_INTEGRALS : -N_INTEGRALS + 2]
        exchanged, steps = clock[[Clock.EXCHANGED, Clock.N_STEPS]]
        return np.array([drive_work, viscous_loss, exchanged, loss, steps, work])

    def fork(self, drive):
        """Return an independent copy of the march that continues with another drive signal."""
        copied_run = super().fork(drive)
        copied_run.motion = copy_motion(self.motion)
        if drive is not self.drive:
            copied_run._make_case()
            copied_run._enter_piece()
        return copied_run

    def _slide_contact(self, path) -> None:
        """Do nothing, because the contact has no memory."""

    def _sample_motion(self, times) -> tuple[np.ndarray, Status]:
        """Continue the motion from the first to the last of several times [s].

        Returns
        -------
        samples : (k, m) ndarray
            Rows of `hybrid.records.Record.samples`; those of a motion that ends early are fewer, and the last is at its end.
        status : Status
        """
        clock = self.motion.clock[0]
        clock[Clock.SAMPLE] = 0
        case = replace(self.case, ends=times[-1:], windows=np.full(1, -1.0), samples=times)
        batch = engine.run_batch([case], states=self.motion)
        count = int(clock[Clock.SAMPLE])
        samples = batch.records.samples[0][: count + 1]
        if count < len(times):
            memory = self.motion.memory[0, 0]
            face = memory[Memory.FORCE], self.model.load, memory[Memory.DIRECTION]
            samples[count, :-2] = clock[Clock.TIME], *self.motion.y[0], *face
        return samples, Status(int(clock[Clock.STATUS]))

    def _march_steps(self, count: int, rows) -> tuple:
        """Fill the sample rows of a march from the integration by the engine `hybrid`.

        The rows have the friction loss of each step as an additional column.
        """
        n = self.modes.omega.size
        times = (self.done + np.arange(count + 1)) * float(self.prop.dt)
        clock = self.motion.clock[0]
        is_same = np.array_equal(self.motion.y[0, : 2 * n], self.state.ravel())
        if not is_same or clock[Clock.TIME] != times[0]:
            self._start_motion()
        before = copy_motion(self.motion)
        samples, outcome = self._sample_motion(times)
        status = MarchStatus.FINISHED
        if outcome is Status.LEAVES_GROOVES:
            status = MarchStatus.LEAVES_GROOVES
        elif outcome is not Status.DONE:
            status = MarchStatus.NOT_FINITE

        # The motion is integrated again up to the last sample within the travel, so that sums and state belong to it.
        exceeding = np.flatnonzero(np.abs(samples[:, 1 : 1 + n] @ self.modes.output) > self.travel)
        last = len(samples) - 1
        if exceeding.size:
            last = int(exceeding[0])
            status = MarchStatus.EXCEEDS_TRAVEL
        if 0 < last < len(samples) - 1:
            self.motion = before
            samples = self._sample_motion(times[: last + 1])[0]
        self._fill_rows(rows[: last + 1], samples[: last + 1])

        self.state[:] = self.motion.y[0, : 2 * n].reshape(2, n)
        sums = self._read_sums()
        self.ledger[LEDGER_SUMS] += sums - self.counted_sums
        self.ledger[Ledger.MAX_STORED] = max(
            self.ledger[Ledger.MAX_STORED], self.motion.clock[0, Clock.STORED]
        )
        self.counted_sums = sums
        return last, status

    def _fill_rows(self, rows, samples) -> None:
        """Write the columns of the march from samples of the engine."""
        n = self.modes.omega.size
        y = samples[:, 1:-5]
        force = samples[:, -5]
        rests = (samples[:, -3] == 0) & self.model.set_valued
        slide = y[:, :n] @ self.modes.slide
        rate = np.where(rests, 0.0, y[:, n : 2 * n] @ self.modes.slide)
        energy = self._find_interface_energies(slide, rate)
        work = np.diff(y[:, -N_INTEGRALS - N_FACE_INTEGRALS])

        rows[:, : 2 * n] = y[:, : 2 * n]
        rows[:, 2 * n : 2 * n + 6] = np.stack([slide, rate, force, slide, force, energy], axis=1)
        # The mean force over the path of a step; at rest the path is round-off.
        path = np.where(rests[:-1] & rests[1:], 0.0, np.diff(slide))
        np.divide(work, path, out=rows[:-1, 2 * n + 4], where=path != 0)
        rows[:-1, 2 * n + 6] = work
        rows[:-1, 2 * n + 7] = work - np.diff(energy)

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
        return float(self._find_interface_energies(*(self.state @ self.modes.slide)))

    def _find_interface_energies(self, slide, rate):
        """Return these energies [J] at relative displacements [m] and velocities [m/s]."""
        g = self.model.grooves
        return (
            self.model.load * g.height(slide) + 0.5 * g.lifted_mass * (g.slope(slide) * rate) ** 2
        )


def copy_motion(motion: State) -> State:
    """Return an independent copy of the arrays of a motion."""
    return State(*(array.copy() for array in motion))
