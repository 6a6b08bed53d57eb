"""The march of modes whose load climbs grooves, under Coulomb's law or a force that follows the speed."""

from dataclasses import dataclass, replace

import numpy as np

from ...compiled import load as compiled
from ...core import Outcome, PatchfemError, Response
from ...friction.grooves import STEADY, Grooves, Swing
from ..march.march import Run
from ..march.models import coulomb_model
from ..second_book import sampled_work
from ..smooth.waves import wave_of

KIND, PIECE = 11, 12  # of Climb.now
RAISED = 7  # of Climb.flags
TOLERANCE = 1e-11  # relative error of a step
REST = 1e-6  # of wavelength/(2 pi), below which a motion is at rest to the choice of the step


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
    """The arrays of a march over grooves, and its clock."""

    def __init__(self, modes, drive, model, steps_per_cycle, travel, hub, start=None):
        self.loop = compiled("dynamics.grooves.loop_kernels")
        super().__init__(modes, drive, model, steps_per_cycle, travel, hub, start)
        g, size, swing = model.grooves, 2 * modes.omega.size + 5, model.swing
        least, pace = REST / g.wave, max(float(modes.omega.max()), 2 * np.pi / drive.period)
        num = [model.load, g.wave, g.amplitude, g.phase, g.lifted_mass, model.static, model.kinetic,
               model.speed or 0.0, least, least * pace, swing.amplitude, swing.omega, swing.phase]
        damping = np.zeros((0, 0)) if modes.damping is None else modes.damping
        parts = (modes.omega, 2 * modes.zeta * modes.omega, modes.slide, modes.base, modes.output, damping,
                 [modes.mass], np.zeros((1, 6)), np.zeros(14), num, np.zeros(8), np.zeros((9, size)))
        self.climb = compiled("dynamics.grooves.step_kernels").Climb(*(np.array(p, float, order="C") for p in parts))
        self._driven()
        self.climb.flags[RAISED] = swing.about(model.load, 0.0) * g.height(modes.slide @ self.state[0])
        self.width += 2
        self.ledger[0] += self.strained()

    def _driven(self) -> None:
        """Bring the drive as it stands into the arrays."""
        self.wave = wave_of(self.drive)
        piece = int(np.searchsorted(self.wave.ends, self.done * self.prop.dt, side="right"))
        self.climb.now[[KIND, PIECE]] = self.wave.kind, piece
        self.climb = self.climb._replace(pieces=self.wave.pieces)

    def fork(self, drive):
        """As of a Run."""
        twin = super().fork(drive)
        twin.climb = type(self.climb)(*(array.copy() for array in self.climb))
        twin._driven()
        return twin

    def _slid(self, path) -> None:
        """Nothing: there is no memory."""

    def _steps(self, count: int, rows) -> tuple:
        return self.loop.march(self.climb, self.wave.ends, self.done, count, float(self.prop.dt), self.state, TOLERANCE,
                               float(self.travel), self.ledger, rows)

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
        height = self.climb.flags[RAISED] if self.model.swing.amplitude else self.model.load * g.height(q)
        return float(height + 0.5 * g.lifted_mass * (g.slope(q) * rate)**2)

    def response(self, rows, number) -> Response:
        """Histories; with a lifted mass or a load that swings `extra` has normal_load [N], the vertical force."""
        out, model = super().response(rows, number), self.model
        changes = model.grooves.lifted_mass or model.swing.amplitude
        return replace(out, extra=out.extra | {"normal_load": rows[:, -1]}) if changes else out
