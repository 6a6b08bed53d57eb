"""Modes whose load climbs grooves, under Coulomb's law or a force that follows the speed: by `dynamics.smooth`, with
the samples of a march."""

from dataclasses import dataclass, replace

import numpy as np

from ...core import Outcome, PatchfemError, Response, Start
from ...friction.grooves import STEADY, Grooves, Swing
from ...friction.protocol import Element
from ..march.march import Run
from ..march.models import coulomb_model
from ..smooth import run as smooth
from ..smooth.arrays import DONE, PACE, POWER, STORED
from ..work_check import sampled_work

TOLERANCE = 1e-11  # relative error of a step
REST = 1e-6  # of wavelength/(2 pi), below which a motion is at rest to the choice of the step
HERE = "dynamics.grooves.flank_kernels"
ENDS = {Outcome.LEAVES_GROOVES: 5, Outcome.NOT_CONVERGED: 3}  # status of a march


@dataclass(frozen=True, eq=False, slots=True)
class GroovesModel:
    """What `march.march` needs to know: grooves under a load [N], static and kinetic coefficient [1].

    speed: v_0 [m/s] of eq. 2.4, static tanh(v/v_0) along the flank, or None for Coulomb's law; swing: of the load about
    its mean. Under a load that swings the books count the work done against it, int N dz, for what its height stores.
    """

    grooves: Grooves
    load: float
    static: float
    kinetic: float
    speed: float | None = None
    swing: Swing = STEADY
    joints, laws, loading = (), (), ""

    @property
    def limit(self) -> float:
        """Largest force [N] of the steepest flank."""
        return self.grooves.capacity(self.load + abs(self.swing.amplitude), self.static)

    @property
    def length(self) -> float:
        """Bond length [m]: none."""
        return 0.0

    @property
    def reduction(self):
        """None: no shear modes."""

    @property
    def set_valued(self) -> bool:
        """Whether the law holds without any stretch."""
        return self.speed is None

    @property
    def runner(self):
        """The class that marches it."""
        return GroovesRun

    def build(self, hub):
        """(contact, None) that nothing uses."""
        return coulomb_model(0.0, 0.0).build()

    def shown(self, contact) -> dict:
        """Nothing: it has no memory."""
        return {}


def model_of(grooves: Grooves, load: float, static: float, kinetic: float, speed: float | None, modes) -> GroovesModel:
    """The model of grooves below these modes; PatchfemError as of `refuse_heavy`."""
    refuse_heavy(grooves, static, modes)
    return GroovesModel(grooves, load, static, kinetic, speed)


def refuse_heavy(grooves: Grooves, static: float, modes) -> None:
    """Raise PatchfemError where friction under the lifted mass takes all of the mass that slides, 1 + m s t (t - mu)/(1
    + mu t) <= 0 on some flank, s [1/kg] the slide's acceleration per newton."""
    own = modes.mass / float(modes.slide @ modes.slide)
    taken = -grooves.lifted_mass * grooves.least_mass(static)
    if taken >= own:
        raise PatchfemError(f"{grooves.lifted_mass:.6g} kg press so hard while they are let down a flank that friction "
                            f"takes more than the {own:.6g} kg that slide, and no motion follows from the forces; less "
                            f"than {own / -grooves.least_mass(static):.6g} kg is wanted", f"{grooves.key}.lifted_mass")


def lifts(grooves: Grooves, time: float) -> str:
    """The sentence on a lifted mass that leaves its grooves at a time [s]."""
    return (f"the lifted mass of {grooves.lifted_mass:.3g} kg leaves the grooves at {time:.6g} s: its inertia takes "
            f"all of the load; lower {grooves.key}.lifted_mass or the drive, or raise the load")


class GroovesRun(Run):
    """The arrays of a march over grooves, its clock, and the motion that is sampled."""

    def __init__(self, modes, drive, model, steps_per_cycle, travel, hub, start=None):
        super().__init__(modes, drive, model, steps_per_cycle, travel, hub, start)
        self.width += 2
        self._begin()
        self.ledger[0] += self.strained()

    def _begin(self) -> None:
        """Begin the motion from the state as it stands, at the start of the drive."""
        g, model, swing = self.model.grooves, self.model, self.model.swing
        raised = swing.about(model.load, 0.0) * g.height(self.modes.slide @ self.state[0])
        numbers = [1.0, model.load, g.wave, g.amplitude, g.phase, g.lifted_mass, model.static, model.kinetic,
                   model.speed or 0.0, swing.amplitude, swing.omega, swing.phase]
        element = Element(HERE, np.array(numbers), np.array([raised, 0.0]), model.limit, sizes=(np.inf,) * 4)
        self.motion_of = smooth.Run(self.modes, self.drive, element, 1.0, TOLERANCE, start=Start(*self.state))
        self.motion_of.ends_only(1)
        n, least = self.modes.omega.size, self.motion_of.moving.work[24]
        least[:n], least[n:2 * n] = REST / g.wave, REST / g.wave * self.motion_of.moving.now[PACE]
        self.booked = self._sums_of()

    def _sums_of(self) -> np.ndarray:
        """Work of the drive, viscous loss, its |work|, friction's own loss, steps and work of the slide [J]."""
        y, own, n = self.motion_of.moving.y, self.motion_of.kept.tally, 2 * self.modes.omega.size
        return np.array([y[-3], y[-2], own[POWER], y[n], own[DONE], y[-1]])

    def fork(self, drive):
        """As of a Run."""
        twin = super().fork(drive)
        twin.motion_of = self.motion_of.fork(drive)
        return twin

    def _slid(self, path) -> None:
        """Nothing: there is no memory."""

    def _steps(self, count: int, rows) -> tuple:
        """As of a Run: the motion is sampled; rows have friction's own loss in the step and the vertical force besides.
        """
        n, dt = self.modes.omega.size, float(self.prop.dt)
        times, motion = (self.done + np.arange(count + 1)) * dt, self.motion_of
        if motion.time != times[0] or not np.array_equal(motion.moving.y[:2 * n], self.state.ravel()):
            self._begin()
            motion = self.motion_of
        seen = motion.until(times[-1], times)
        if motion.outcome is not None and len(seen) <= count:  # where it ends, at the sample that follows
            seen = np.concatenate([seen, motion.settled()[0][None]])
        out = seen[:, 1:1 + n] @ self.modes.output
        beyond = np.flatnonzero(np.abs(out) > self.travel)
        last, status = (int(beyond[0]), 1) if beyond.size else (len(seen) - 1, ENDS.get(motion.outcome, 0))
        seen, work, slid = seen[:last + 1], np.diff(seen[:last + 1, -1]), np.diff(seen[:last + 1, 2 * n + 1])
        part = rows[:last + 1]
        part[:, :2 * n + 2], part[:, 2 * n + 2], part[:, 2 * n + 3] = seen[:, 1:2 * n + 3], seen[:, 2 * n + 3], \
            seen[:, 2 * n + 4]
        part[:, 2 * n + 4], part[:, 2 * n + 5] = seen[:, 2 * n + 3], seen[:, 2 * n + 5]
        part[:-1, 2 * n + 4] = np.divide(work, slid, out=seen[:-1, 2 * n + 3].copy(), where=slid != 0)
        part[:-1, 2 * n + 6], part[:-1, 2 * n + 7] = work, work - np.diff(seen[:, 2 * n + 5])
        part[:, 2 * n + 8] = self._upright(times[:last + 1], seen)
        self.state[:] = motion.moving.y[:2 * n].reshape(2, n)
        sums = self._sums_of()
        self.ledger[[0, 1, 2, 3, 5, 8]] += sums - self.booked
        self.ledger[4], self.booked = max(self.ledger[4], motion.kept.tally[STORED]), sums
        return last, status

    def _upright(self, time, seen) -> np.ndarray:
        """Vertical force N + m (t q'' + t' q'^2) [N] at samples of a motion."""
        g, modes, n = self.model.grooves, self.modes, self.modes.omega.size
        z, rate, (q, v, force) = seen[:, 1:1 + n], seen[:, 1 + n:1 + 2 * n], seen[:, 2 * n + 1:2 * n + 4].T
        push = np.outer(self.drive.values(time), modes.base)
        along = -(push + rate @ modes.dampers.T + z * modes.omega**2 + np.outer(force, modes.slide) / modes.mass) \
            @ modes.slide
        return self.model.swing.about(self.model.load, time) + g.lifted_mass * (g.slope(q) * along + g.bend(q) * v**2)

    def _works(self, rows) -> np.ndarray:
        return rows[:-1, 2 * self.modes.omega.size + 6]

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
            self.outcome = Outcome.LEAVES_GROOVES
            self.message = lifts(self.model.grooves, self.done * self.prop.dt)

    def check(self) -> None:
        """Mark the run not_converged when steps did not meet their error; what was computed is kept."""
        if self.ledger[7]:
            self.outcome = Outcome.NOT_CONVERGED
            self.message = (f"{int(self.ledger[7])} of {self.done} steps did not come to their end over the grooves; "
                            "raise accuracy.steps_per_cycle")

    def strained(self) -> float:
        """Energy of the height of the load, or done against one that swings, and of the speed of what rises [J]."""
        g, (z, v) = self.model.grooves, self.state
        q, rate = float(self.modes.slide @ z), float(self.modes.slide @ v)
        swings = self.model.swing.amplitude
        height = self.motion_of.moving.y[2 * z.size + 1] if swings else self.model.load * g.height(q)
        return float(height + 0.5 * g.lifted_mass * (g.slope(q) * rate)**2)

    def response(self, rows, number) -> Response:
        """Histories; with a lifted mass or a load that swings `extra` has normal_load [N], the vertical force."""
        out, model = super().response(rows, number), self.model
        changes = model.grooves.lifted_mass or model.swing.amplitude
        return replace(out, extra=out.extra | {"normal_load": rows[:, -1]}) if changes else out
