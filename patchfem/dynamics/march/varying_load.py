"""Modes that feel the normal force, the moment and the friction of the contact, each under the load of the moment.

The upper holder moves from its solved preload by heave h = normal . z and pitch th = pitch . z; the nodal forces are
those of the unilateral contact at approach delta0 - h and rotation theta0 + th (`contact.contact_sets`). The modes
count from the preloaded equilibrium: modal force normal (N - N0) + pitch (M - M0) - slide F. The holder's rotational
spring is in series with the pitch, a compliance x_i x_j/K beside that of the pieces.
"""

from dataclasses import dataclass, replace

import numpy as np

from ...compiled import load as compiled
from ...contact.contact_sets import ContactSets, sides
from ...core import ModalBasis, Outcome, PatchfemError, Response
from ...effects import unbuilt
from ...friction.laws.stretch import growth_numbers
from ...slip.shear_modes import SHEAR_MODES, enough_modes, shear_modes
from ..contacts.arrays import Rub, sheared
from .march import GOAL, Run
from .march import march as run
from .models import coulomb_model

COULOMB, PLASTIC, POINTS, RATE = 0, 1, 2, 4
FLOOR = 1.0  # least pressure of a node in the weights of the shear modes, over the mean of the preload
PRESS = ("normal_load", "normal_moment", "normal_energy", "heave", "turn")


@dataclass(frozen=True, eq=False, slots=True)
class Rubbing:
    """A law of friction under a load that changes: kind and numbers as in `varying_friction_kernels`; static: mu_s,
    which times the preload is the scale of the residuals."""

    kind: int
    static: float
    force: tuple
    growth: tuple = (-1.0, 1.0, 1.0, 1.0, 1.0, 0.0)
    length: float = 0.0


def coulomb(static: float, kinetic: float | None = None) -> Rubbing:
    """Set-valued Coulomb friction on the resultant load."""
    return Rubbing(COULOMB, static, (static, static if kinetic is None else kinetic, 0.0, 1.0))


def rate(static: float, speed: float) -> Rubbing:
    """Eq. 2.4, mu N tanh(v/v_0), v_0 [m/s]."""
    return Rubbing(RATE, static, (static, speed, 0.0, 1.0))


def plastic(static: float, length: float) -> Rubbing:
    """Eq. 3.12 at every point under its own load, length [m]."""
    return Rubbing(PLASTIC, static, (static, static, length, 1.0), length=length)


def bonds(law) -> Rubbing:
    """The stretch reading with p = 1 of a friction.law.Bonds at every point. PatchfemError for any other."""
    if law.reading != "stretch" or law.order != 1 or law.breakaway:
        raise PatchfemError(unbuilt("friction: such bonds beside a load that changes", "recursion"))

    return Rubbing(POINTS, law.static, (law.static, law.static, law.length, law.initial), tuple(growth_numbers(law)),
                   law.length)


def sets_of(patch, spring: float = 0.0) -> ContactSets:
    """The contact sets around the solved state of a patch; spring [N m/rad] of the holder's rotation, 0: rigid.

    PatchfemError for a smooth skin, strips, or a patch that carries no load.
    """
    if patch.skin is not None:
        raise PatchfemError(unbuilt("contact.asperities.law: a smooth skin beside a load that changes", "linear"))
    if patch.strips is not None:
        raise PatchfemError(unbuilt("contact.strips: beside a load that changes", "either"))
    force = patch.pressure.sigma_n * patch.pieces.interface.weight
    c, x = patch.pieces.normal, patch.x
    if spring > 0:
        c = c + np.outer(x, x) / spring
    return ContactSets(c, x, patch.pressure.gap - c @ force, force > 0)


def rows_of(modes: ModalBasis) -> np.ndarray:
    """(3, n): slide, heave and pitch per coordinate."""
    none = np.zeros(modes.omega.size)
    return np.stack([none if part is None else np.asarray(part, float)
                     for part in (modes.slide, modes.normal, modes.pitch)])


def contact_frequencies(modes: ModalBasis, sets: ContactSets) -> np.ndarray:
    """Natural frequencies [rad/s] of the modes on the preloaded contact set, without friction: what a step must
    resolve."""
    rows = rows_of(modes)[1:]
    q = sets.reference.energy
    hessian = np.array([[q[3], -q[4]], [-q[4], q[5]]])
    return np.sqrt(np.maximum(np.linalg.eigvalsh(np.diag(modes.omega**2) + rows.T @ hessian @ rows / modes.mass), 0))


@dataclass(frozen=True, eq=False, slots=True)
class VaryingLoadModel:
    """What `march.march` needs to know: law, contact sets, rows (3, n) of slide, heave and pitch.

    load: function of times (k,) [s] to a load [N] >= 0 that is prescribed on one point, in place of the contact; shear:
    ShearModes on every node where the pieces give way, see `shear_of`.
    """

    law: Rubbing
    sets: ContactSets | None
    rows: np.ndarray
    load: object = None
    shear: object = None

    @property
    def preload(self) -> float:
        """Load [N] at the start."""
        return self.sets.load if self.load is None else float(self.load(np.zeros(1))[0])

    @property
    def limit(self) -> float:
        """Scale of the residuals [N]: static friction of the preload, or the load where nothing rubs."""
        return (self.law.static or 1.0) * max(self.preload, 1e-9)

    @property
    def length(self) -> float:
        """Bond length [m], 0 without."""
        return self.law.length

    @property
    def reduction(self):
        """ShearModes, None of pieces that are rigid in shear."""
        return self.shear

    @property
    def set_valued(self) -> bool:
        """Whether the law holds without any stretch."""
        return self.law.kind == COULOMB

    @property
    def runner(self):
        """The class that marches it."""
        return VaryingLoadRun

    def build(self, hub):
        """(contact, None) that nothing uses."""
        return coulomb_model(0.0, 0.0).build()

    def shown(self, contact) -> dict:
        """Nothing: its memory is that of the run."""
        return {}


def shear_of(giving, law: Rubbing, force, weight, count: int | None = None, tolerance: float = 1e-3):
    """ShearModes of pieces whose contact set changes: of the tangential compliance (m, m) [m/N] on every node.

    force (m,) [N]: nodal forces of the preload, weight (m,) areas. Modes are weighted with mu_s times the preload and
    `FLOOR` of its mean pressure, so nodes that are open at first have their share; with m modes they are exact whatever
    the weights. count: how many, None: as the backbone under these weights asks for at a tenth of the tolerance.
    """
    limit = law.static * (force + FLOOR * force.sum() * weight / weight.sum())
    if law.growth[0] >= 0:  # a patch that could jump by itself is refused, under its preload as where the load stays
        shear_modes(giving, law.static * force, law.length, 1,
                    law.growth[3] / law.growth[4] if law.growth[4] > 0 else np.inf)
    if count is not None:
        return shear_modes(giving, limit, law.length, count)
    return enough_modes(giving, limit, law.length, SHEAR_MODES, 0.1 * tolerance)


def model_of(modes: ModalBasis, law: Rubbing, sets: ContactSets | None, load=None, shear=None) -> VaryingLoadModel:
    """The model of a basis on contact sets, or under a prescribed load on one point, which no heave or pitch can move.
    shear: ShearModes of an elastic-plastic law or of bonds; PatchfemError beside any other."""
    if shear is not None and law.kind not in (PLASTIC, POINTS):
        raise PatchfemError(unbuilt("friction.law: this one beside a load that changes and [contact.shear]", "stiff"))
    if shear is not None and shear.points.size != sets.x.size:
        raise PatchfemError("contact.shear: under a load that changes the shear modes must span every node")
    if load is not None and any(part is not None and np.any(part) for part in (modes.normal, modes.pitch)):
        raise PatchfemError("structure.mode.normal: a load on one rigid point leaves no room for heave or pitch; name "
                            "[contact] in place of [normal]")
    return VaryingLoadModel(law, sets, rows_of(modes), load, shear)


class VaryingLoadRun(Run):
    """The arrays of a march under a load that varies, and its clock."""

    def __init__(self, modes, drive, model, steps_per_cycle, travel, hub, start=None):
        self.loop, self.press = compiled("dynamics.march.varying_load_kernels"), compiled("contact.press_kernels")
        super().__init__(modes, drive, model, steps_per_cycle, travel, hub, start)
        law, sets = model.law, model.sets
        arrays = sets.arrays() if model.load is None else _one_point(model.preload)
        x = arrays["x"]
        self.sets = self.press.SetArrays(**arrays)
        self.ports = self.loop.Ports(np.ascontiguousarray(model.rows, float), self.prop.beta.copy(),
                                     float(np.ptp(x) / 2) or 1.0)
        now, slot = np.full(x.size, model.preload), 0
        if model.load is None:
            heave, turn = model.rows[1:] @ self.state[0]
            slot = self.press.locate(self.sets, self.press.begin(self.sets, sets.name(arrays)), -heave, turn)
            self.press.press_state(self.sets, slot, -heave, turn, now)
        self.slot, memory = np.array([slot]), np.zeros((3, x.size))
        memory[1 if law.kind == PLASTIC else 0] = now * (1.0 if law.kind == PLASTIC else law.force[3])
        psi, kappa = (np.zeros((x.size, 0)), ()) if model.shear is None else (model.shear.shape, model.shear.stiffness)
        weight = np.full(x.size, law.static / (law.length if law.kind == POINTS else 1.0))
        self.rub = Rub(
            np.array(law.force, float), memory, now.copy(), now, np.array(psi.T, order="C"), np.arange(x.size),
            **sheared(weight, law.length, law.growth, psi, kappa))
        self.held, self.room = np.zeros(3), (np.empty(30), np.empty((3, modes.omega.size)))
        self.width += 5
        self.ledger[0] += self.strained()

    def fork(self, drive):
        """As of a Run; the contact sets are shared, which any run may ask."""
        twin = super().fork(drive)
        twin.rub = type(self.rub)(*(array.copy() for array in self.rub))
        return twin

    def _steps(self, count: int, rows) -> tuple:
        table, row = self.table(count)
        model, loads = self.model, np.zeros(0)
        if model.load is not None:
            loads = np.array(model.load((self.done + np.arange(count + 1)) * self.prop.dt), float)
        return self.loop.march(row, count, self.state, self.held, self.slot, self.plant, self.ports, table,
                               model.law.kind, self.rub, self.sets, loads, GOAL * model.limit, float(self.travel),
                               self.room, self.ledger, rows)

    def _parts(self, rows) -> np.ndarray:
        """As of a Run; the noise is that of the largest force, of the slide's last digit (a sum over the modes) and of
        the stored energy."""
        n = 2 * self.modes.omega.size
        work = self._works(rows)
        lost = work - np.diff(rows[:, n + 5])
        size = np.maximum(self.model.limit, np.abs(rows[:-1, n + 4]))
        digit = np.abs(rows[:, :n // 2]) @ np.abs(self.modes.slide)
        digit = np.maximum(digit[1:], digit[:-1]) + self.prop.beta[0, 0] * size
        noise = size * (1e-12 * np.abs(np.diff(rows[:, n])) + 2e-15 * digit) \
            + 1e-14 * np.maximum(rows[:-1, n + 5], rows[1:, n + 5])
        return np.stack([work, np.where(lost > -noise, lost, 0.0), np.where(lost < -noise, -lost, 0.0)])

    def _judge(self, status: int) -> None:
        super()._judge(status)
        if status == 4:
            self.outcome = Outcome.NOT_CONVERGED
            self.message = f"no contact set fits the motion at step {self.done}; raise accuracy.steps_per_cycle"

    def _snapshot(self, row) -> dict:
        rub = self.rub
        return super()._snapshot(row) | {"heave": row[-2], "turn": row[-1], "nodal": rub.now.copy(), "b": rub.b.copy(),
                                         "memory": rub.memory.copy(), "bend": rub.b @ rub.modes}

    def strained(self) -> float:
        """Energy of the preloaded contact and of what stretches in it [J]."""
        law, (top, bottom, square), out = self.model.law, self.rub.memory, 0.0
        if self.model.load is None:
            heave, turn = self.model.rows[1:] @ self.state[0]
            slot = self.press.locate(self.sets, int(self.slot[0]), -heave, turn)
            out = self.press.press_state(self.sets, slot, -heave, turn, np.zeros(top.size))[2]
        if law.kind == PLASTIC:
            on = bottom > 0
            out += law.static * law.length / 2 * float(np.sum(top[on]**2 / bottom[on]))
        elif law.kind == POINTS:
            out += law.static / law.length / 2 * float(square.sum())
        return float(out) + float(self.rub.kappa @ self.rub.b**2) / 2

    def book(self) -> dict:
        """The energy ledger [J], contact sets made, pivots, tableaus made anew."""
        return super().book() | dict(zip(("contact_sets", "pivots", "renewed"), map(int, self.sets.meta[2:])))

    def response(self, rows, number) -> Response:
        """Histories; `extra` has normal_load [N], normal_moment [N m], normal_energy [J], heave [m] and turn [rad]."""
        out, modes, model = super().response(rows, number), self.modes, self.model
        extra = out.extra | dict(zip(PRESS, rows[:, -5:].T))
        if model.load is not None:
            return replace(out, extra=extra)
        pull = np.stack([rows[:, -5] - model.sets.load, rows[:, -4] - model.sets.moment], axis=1)
        return replace(out, acceleration=out.acceleration + pull @ model.rows[1:] @ modes.output / modes.mass,
                       extra=extra)


def _one_point(load: float) -> dict:
    """Arrays of contact sets that are never asked, for a load that is prescribed."""
    return {"c": np.ones((1, 1)), "x": np.zeros(1), "b": np.zeros(1), "tableau": np.zeros((1, 4)),
            "here": np.zeros(1, bool), "rows": np.zeros((1, 3, 1)), "on": np.zeros((1, 1), bool),
            "energy": np.zeros((1, 6)), "names": np.zeros(1, np.int64), "heads": np.full(2, -1, np.int64),
            "link": np.full(1, -1, np.int64), "node": np.zeros(1, np.int64), "wanted": np.zeros(1, bool),
            "base": np.array([load, 0.0, 0.0, 1.0, 1.0]), "side": np.zeros((2, 3, 1)), "row": np.zeros(4),
            "meta": np.zeros(5, np.int64), **sides(1)}


def march(modes: ModalBasis, drive, sets: ContactSets | None, law: Rubbing, cycles: float, steps_per_cycle: int,
          window: int = 10, travel: float = np.inf, frames: int = 0, start=None, load=None, say=None, progress=None,
          shear=None):
    """`march.march` of a basis on contact sets, or under a prescribed load, from rest or from `start`."""
    model = model_of(modes, law, sets, load, shear)
    return run(modes, drive, model, cycles, steps_per_cycle, window, travel, frames, say, progress, start)
