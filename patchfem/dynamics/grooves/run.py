"""Modes whose load climbs grooves, under Coulomb's law or a force that follows the speed: by `dynamics.smooth`, with
the samples of a march."""

from dataclasses import dataclass

import numpy as np

from ...core import InitialState, Outcome
from ...friction.grooves import Grooves
from ...friction.path_work import sampled_work
from ...friction.protocol import Element
from ..march.models import coulomb_model
from ..smooth import run as smooth
from ..smooth.arrays import DONE, PACE, POWER, STORED
from .climbing import FlankModel, GroovesRun, refuse_heavy

TOLERANCE = 1e-11  # relative error of a step
REST = 1e-6  # of wavelength/(2 pi), below which a motion is at rest to the choice of the step
HERE = "dynamics.grooves.flank_kernels"
ENDS = {Outcome.LEAVES_GROOVES: 5, Outcome.NOT_CONVERGED: 3}  # status of a march


@dataclass(frozen=True, eq=False, slots=True)
class GroovesModel(FlankModel):
    """A law without memory: static and kinetic coefficient [1] under a load [N]; speed: v_0 [m/s] of eq. 2.4, static
    tanh(v/v_0) along the flank, or None for Coulomb's law."""

    grooves: Grooves
    load: float
    static: float
    kinetic: float
    speed: float | None = None

    @property
    def length(self) -> float:
        """Bond length [m]: none."""
        return 0.0

    @property
    def set_valued(self) -> bool:
        """Whether the law holds without any stretch."""
        return self.speed is None

    @property
    def runner(self):
        """The class that marches it."""
        return SampledRun

    def build(self):
        """A contact that nothing uses."""
        return coulomb_model(0.0, 0.0).build()


def model_of(
    grooves: Grooves, load: float, static: float, kinetic: float, speed: float | None, modes
) -> GroovesModel:
    """The model of grooves below these modes.

    load [N]: mean of the load; static, kinetic [1]: coefficients of friction on the flanks; speed [m/s]: v_0 of the
    tanh law, None for Coulomb friction. PatchfemError as of `refuse_heavy`.
    """
    refuse_heavy(grooves, static, modes)
    return GroovesModel(grooves, load, static, kinetic, speed)


class SampledRun(GroovesRun):
    """The arrays of a march over grooves, its clock, and the motion that is sampled."""

    def __init__(self, modes, drive, model, steps_per_cycle, travel, loops, start=None):
        super().__init__(modes, drive, model, steps_per_cycle, travel, loops, start)
        self.width += 1
        self._begin()
        self.ledger[0] += self.strained()

    def _begin(self) -> None:
        """Begin the motion from the state as it stands, at the start of the drive."""
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
            HERE, np.array(numbers), np.zeros(1), model.limit, state_scales=(np.inf,) * 3
        )
        self.motion_of = smooth.Motion(
            self.modes, self.drive, element, 1.0, TOLERANCE, start=InitialState(*self.state)
        )
        self.motion_of.ends_only(1)
        n = self.modes.omega.size
        least = self.motion_of.moving.work[24]
        least[:n] = REST / g.wave_number
        least[n : 2 * n] = REST / g.wave_number * self.motion_of.moving.now[PACE]
        self.booked = self._sums_of()

    def _sums_of(self) -> np.ndarray:
        """Work of the drive, viscous loss, its |work|, friction's own loss, steps and work of the slide [J]."""
        y = self.motion_of.moving.y
        own = self.motion_of.kept.counters
        n = 2 * self.modes.omega.size
        return np.array([y[-3], y[-2], own[POWER], y[n], own[DONE], y[-1]])

    def fork(self, drive):
        """As of a Run."""
        twin = super().fork(drive)
        twin.motion_of = self.motion_of.fork(drive)
        return twin

    def _slid(self, path) -> None:
        """Nothing: there is no memory."""

    def _steps(self, count: int, rows) -> tuple:
        """As of a Run: the motion is sampled; rows have friction's own loss in the step besides."""
        n = self.modes.omega.size
        dt = float(self.prop.dt)
        times = (self.done + np.arange(count + 1)) * dt
        motion = self.motion_of
        if motion.time != times[0] or not np.array_equal(
            motion.moving.y[: 2 * n], self.state.ravel()
        ):
            self._begin()
            motion = self.motion_of
        begun = motion.fork(self.drive)
        seen = motion.until(times[-1], times)
        # where it ends, at the sample that follows
        if motion.outcome is not None and len(seen) <= count:
            seen = np.concatenate([seen, motion.settled()[0][None]])
        out = seen[:, 1 : 1 + n] @ self.modes.output
        beyond = np.flatnonzero(np.abs(out) > self.travel)
        last, status = (
            (int(beyond[0]), 1) if beyond.size else (len(seen) - 1, ENDS.get(motion.outcome, 0))
        )
        if 0 < last < len(seen) - 1:  # the sums and the state are those of the last sample
            motion = self.motion_of = begun
            motion.until(times[last], times[: last + 1])
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
        self.state[:] = motion.moving.y[: 2 * n].reshape(2, n)
        sums = self._sums_of()
        self.ledger[[0, 1, 2, 3, 5, 8]] += sums - self.booked
        self.ledger[4] = max(self.ledger[4], motion.kept.counters[STORED])
        self.booked = sums
        return last, status

    def _sampled(self, rows) -> np.ndarray:
        n = 2 * self.modes.omega.size
        after = rows[:-1, n + 4] if self.model.set_valued else None
        return sampled_work(rows[:, n], rows[:, n + 2], after)

    def _parts(self, rows) -> np.ndarray:
        """As of a Run; what is dissipated is friction's own work along the flank."""
        n = 2 * self.modes.omega.size
        return np.stack([self._works(rows), rows[:-1, n + 7], np.zeros(len(rows) - 1)])

    def _judge(self, status: int) -> None:
        super()._judge(status)
        if status == 5:
            self._leaves()

    def check(self) -> None:
        """Mark the run not_converged when steps did not meet their error; what was computed is kept."""
        if self.ledger[7]:
            self.outcome = Outcome.NOT_CONVERGED
            self.message = (
                f"{int(self.ledger[7])} of {self.done} time steps on the grooves did not converge; raise "
                "accuracy.steps_per_cycle"
            )

    def strained(self) -> float:
        """Energy of the height of the load and of the speed of what rises [J]."""
        g = self.model.grooves
        z, v = self.state
        q = float(self.modes.slide @ z)
        rate = float(self.modes.slide @ v)
        return float(self.model.load * g.height(q) + 0.5 * g.lifted_mass * (g.slope(q) * rate) ** 2)
