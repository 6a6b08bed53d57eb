"""Time integration of modes under the force, moment and friction due to a varying contact load.

The upper holder moves from its solved preload by the heave h = normal . z and the pitch th = pitch . z. The nodal forces are
those of the unilateral contact at approach delta0 - h and rotation theta0 + th (`contact.contact_sets`). The modes are
measured from the preloaded equilibrium: the modal force is normal (N - N0) + pitch (M - M0) - slide F. The rotational
spring of the holder is in series with the pitch, as a compliance x_i x_j/K in addition to that of the pieces.
"""

from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np

from ...compiled import load as compiled
from ...contact.contact_sets import ContactSets
from ...contact.set_arrays import N_BUILT, SetArrays, hash_set, make_set_arrays
from ...core import ModalBasis, PatchfemError, Response
from ...effects import describe_unsupported
from ...friction.bonds.list_rows_kernels import STATUS
from ...friction.laws.coulomb import Coulomb
from ...friction.laws.stretch import growth_numbers
from ...friction.laws.tanh import TanhLaw
from ...slip.shear_modes import N_SHEAR_MODES, find_sufficient_modes, shear_modes
from ..interfaces import arrays
from ..interfaces.arrays import LoadIndex, PointRow, PressedIndex
from ..interfaces.dispatch import COULOMB_LAW
from ..ledger import SampleColumn
from .faces import STEP_TOL
from .instances import COMMON_LOAD, POINT_LOADS, SHEARED_LISTS_MODULE
from .march import march as run
from .models import IDLE_KIND, Joint, element_model, nodal_load_fields, point_lists_model
from .run import Run

# Attainable residual of sums over bond lists, relative to the tolerance of other laws.
LIST_TOL_FACTOR = 1e4
# Pressure added to each node in the weights of the shear modes, relative to
# the mean pressure of the preload.
MIN_PRESSURE_FRACTION = 1.0
PRESS_COLUMNS = ("normal_load", "normal_moment", "normal_energy", "heave", "turn")


class LawKind(IntEnum):
    """Kind of a friction law under a varying load.

    - COULOMB: rigid Coulomb friction
    - PLASTIC, POINTS: elastic-plastic points and bond points, as in `shear_points_kernels`
    - LISTS: lists of bonds
    - RATE: velocity-dependent friction
    """

    COULOMB = 0
    PLASTIC = 1
    POINTS = 2
    LISTS = 3
    RATE = 4


# Types of friction law that act at each point under its own load.
POINT_LAWS = LawKind.PLASTIC, LawKind.POINTS, LawKind.LISTS


@dataclass(frozen=True, eq=False, slots=True)
class VaryingLoadLaw:
    """Friction law of a contact under a varying load.

    - `kind`: see `LawKind`.
    - `static`: mu_s, which times the preload is the scale of the residuals.
    - `force`: first numbers of `interfaces.arrays.PressedPoints`, with v_0 of a rate law in place of mu_k.
    - `growth`: parameters of the growth of bonds.
    - `length`: bond length [m].
    - `list_options`: the Bonds of a list with its cut-off and its merge width, as `models.bond_list_model` takes them.
    """

    kind: LawKind
    static: float
    force: tuple
    growth: tuple = (-1.0, 1.0, 1.0, 1.0, 1.0, 0.0)
    length: float = 0.0
    list_options: tuple = ()


def make_coulomb_law(static: float, kinetic: float | None = None) -> VaryingLoadLaw:
    """Return the set-valued Coulomb law that acts under the resultant load."""
    return VaryingLoadLaw(
        LawKind.COULOMB, static, (static, static if kinetic is None else kinetic, 0.0, 1.0)
    )


def make_tanh_law(static: float, speed: float) -> VaryingLoadLaw:
    """Return the regularised law mu N tanh(v/v_0) of eq. 2.4 that acts under the resultant load.

    speed: v_0 [m/s].

    """
    return VaryingLoadLaw(LawKind.RATE, static, (static, speed, 0.0, 1.0))


def make_elastic_plastic_law(static: float, length: float) -> VaryingLoadLaw:
    """Return the elastic-plastic law of eq. 3.12 that acts at each point under the point's load."""
    return VaryingLoadLaw(LawKind.PLASTIC, static, (static, static, length, 1.0), length=length)


def make_bonds_law(law) -> VaryingLoadLaw:
    """Return the law of bonds of order 1 with friction.reading = "stretch" that acts at each point.

    Raises PatchfemError for other bonds.
    """
    if law.reading != "stretch" or law.order != 1:
        raise PatchfemError(
            describe_unsupported(
                "friction: a changing normal load together with reading = 'report' or an order other "
                "than 1",
                "recursion",
            )
        )

    return VaryingLoadLaw(
        LawKind.POINTS,
        law.static,
        (law.static, law.static, law.length, law.initial),
        tuple(growth_numbers(law)),
        law.length,
    )


def make_bond_lists_law(law, reach: float, merge: float) -> VaryingLoadLaw:
    """Return the law of bonds with friction.reading = "report", with a bond list at each point.

    Raises PatchfemError for friction.reading = "stretch".

    Bonds keep the pressure under which they formed. With friction.reading = "stretch" bonds are released as the load
    falls.

    Parameters
    ----------
    law : VaryingLoadLaw
    reach : float
        Cut-off in bond lengths.
    merge : float
        Widest merged strip in bond lengths at zero age; 0 merges nothing.
    """
    if law.reading != "report":
        raise PatchfemError(
            describe_unsupported(
                "friction: a changing normal load together with reading = 'stretch' and an order "
                "other than 1",
                "recursion",
            )
        )
    return VaryingLoadLaw(
        LawKind.LISTS,
        law.static,
        (law.static, law.static, law.length, law.initial),
        tuple(growth_numbers(law)),
        law.length,
        (law, reach, merge),
    )


def make_contact_sets(patch, spring: float = 0.0) -> ContactSets:
    """Return the contact sets of a patch in the vicinity of its solved contact state.

    `spring` is the rotational stiffness of the holder [N m/rad], 0 for a rigid one. PatchfemError for a nonlinear asperity
    layer, for strips and for a patch that carries no load.
    """
    if patch.has_smooth_skin:
        raise PatchfemError(
            describe_unsupported(
                "contact.asperities.law: a nonlinear law under a normal load that changes", "linear"
            )
        )
    if patch.strips is not None:
        raise PatchfemError(
            describe_unsupported("[contact.strips] with a normal load that changes", "either")
        )
    force = patch.pressure.sigma_n * patch.pieces.interface.weight
    c = patch.pieces.normal
    x = patch.x
    if spring > 0:
        c = c + np.outer(x, x) / spring
    return ContactSets(c, x, patch.pressure.gap - c @ force, force > 0)


def port_rows(modes: ModalBasis) -> np.ndarray:
    """Return relative displacement, heave and pitch per unit of each modal coordinate, (3, n)."""
    no_motion = np.zeros(modes.omega.size)
    return np.stack(
        [
            no_motion if part is None else np.asarray(part, float)
            for part in (modes.slide, modes.normal, modes.pitch)
        ]
    )


def make_pressed_fields(law: VaryingLoadLaw, normal, shear, limit: float) -> tuple:
    """Return the initial fields of `interfaces.arrays.PressedPoints` for given nodal forces.

    Parameters
    ----------
    law : VaryingLoadLaw
    normal : (m,) array
        Nodal forces [N].
    shear : ShearModes or None
        Shear of the pieces; None for pieces that are rigid in shear.
    limit : float
        Friction limit, the scale of the residuals [N].

    Returns
    -------
    tuple
    """
    memory = np.zeros((3, normal.size))
    size = normal.size
    plastic = law.kind == LawKind.PLASTIC
    memory[1 if plastic else 0] = (
        normal if plastic else normal * law.force[PressedIndex.INITIAL_DENSITY]
    )
    psi, kappa = (np.zeros((size, 0)), ()) if shear is None else (shear.shape, shear.stiffness)
    weight = np.full(size, law.static / (1.0 if plastic else law.length))
    return (
        np.array([*law.force, law.kind, STEP_TOL * limit]),
        memory,
        np.stack([normal, normal]),
        np.array(psi.T, order="C"),
        np.arange(size),
        *arrays.make_sheared_fields(weight, law.length, law.growth, psi, kappa).values(),
    )


@dataclass(frozen=True, eq=False, slots=True)
class VaryingLoadModel:
    """Model of a contact under a varying load for `march.march`.

    - `law`: friction law.
    - `sets`: contact sets.
    - `rows` (3, n): slide, heave and pitch per modal coordinate.
    - `load`: function of times (k,) [s] that returns a prescribed load [N] on one point, in place of the contact.
    - `shear`: ShearModes on every node, from `choose_shear_modes`.
    """

    law: VaryingLoadLaw
    sets: ContactSets | None
    rows: np.ndarray
    load: object = None
    shear: object = None

    @property
    def preload(self) -> float:
        """Normal load [N] at the start."""
        return self.sets.load if self.load is None else float(self.load(np.zeros(1))[0])

    @property
    def limit(self) -> float:
        """Force scale [N] of the residuals: the static friction limit, or the load if there is no friction."""
        return (self.law.static or 1.0) * max(self.preload, 1e-9)

    @property
    def length(self) -> float:
        """Bond length [m] of the law, or 0 if the law has no bonds."""
        return self.law.length

    @property
    def reduction(self):
        """Shear modes of the pieces, or None if the pieces are rigid in shear."""
        return self.shear

    @property
    def set_valued(self) -> bool:
        """Return whether the law sticks rigidly (set-valued Coulomb friction)."""
        return self.law.kind == LawKind.COULOMB

    @property
    def runner(self):
        """Class that integrates the model over time."""
        return VaryingLoadRun

    @property
    def has_point_loads(self) -> bool:
        """Return whether each point carries its own fraction of the load."""
        return self.law.kind in POINT_LAWS

    @property
    def loading(self) -> str:
        """Type of load for `instances`: resultant on the interface, or load on each point."""
        return POINT_LOADS if self.has_point_loads else COMMON_LOAD

    @property
    def laws(self) -> tuple:
        """Modules with the compiled laws of the elements (`joints`)."""
        return (COULOMB_LAW,) if self.set_valued else ()

    @property
    def joints(self) -> tuple:
        """Set-valued friction element at the preload."""
        if not self.set_valued:
            return ()
        law = Coulomb(self.law.force[PressedIndex.MU_KINETIC], self.law.static)
        return (Joint(0, law.element(self.preload)),)

    @property
    def kind(self) -> tuple:
        """Contact module and law module for which the loop is compiled; elements are not included."""
        if self.law.kind == LawKind.LISTS:
            return SHEARED_LISTS_MODULE, ""
        if self.has_point_loads:
            return "dynamics.interfaces.pressed_points_kernels", ""
        return IDLE_KIND if self.set_valued else (IDLE_KIND[0], "friction.laws.tanh_kernels")

    def allocate_contact(self):
        """Allocate the contact arrays at the preload."""
        law = self.law
        if self.has_point_loads:
            return self.points(
                np.full(1 if self.load is not None else self.sets.x.size, self.preload)
            )
        return element_model(
            TanhLaw(
                law.static, law.force[PressedIndex.MU_KINETIC] if law.kind == LawKind.RATE else 1.0
            ).element(self.preload)
        ).allocate_contact()

    def points(self, force):
        """Allocate the contact points at the nodal forces (m,) [N] due to the preload."""
        law = self.law
        if law.kind != LawKind.LISTS:
            return arrays.PressedPoints(*make_pressed_fields(law, force, self.shear, self.limit))
        measure = force + MIN_PRESSURE_FRACTION * force.mean()
        return point_lists_model(
            law.list_options[0],
            law.static * measure,
            measure,
            self.shear,
            *law.list_options[1:],
            nodal_load_fields(force, measure),
        ).allocate_contact()

    def get_plot_fields(self, contact) -> dict:
        """Return an empty dict, because the run stores the memory of the interface."""
        return {}


def choose_shear_modes(
    compliance,
    law: VaryingLoadLaw,
    force,
    weight,
    count: int | None = None,
    tolerance: float = 1e-3,
):
    """Choose the shear modes for pieces whose contact set changes during the motion.

    Modes are weighted with mu_s times the preload plus MIN_PRESSURE_FRACTION of its mean pressure, so nodes
    that are open at first also count; with m modes they are exact for any weights.

    Parameters
    ----------
    compliance : (m, m) array
        Tangential compliance on every node [m/N].
    law : VaryingLoadLaw
    force : (m,) array
        Nodal forces of the preload [N].
    weight : (m,) array
        Nodal areas.
    count : int or None
        Number of modes; None for as many as a tenth of the tolerance needs.
    tolerance : float

    Returns
    -------
    ShearModes
    """
    limit = law.static * (force + MIN_PRESSURE_FRACTION * force.sum() * weight / weight.sum())
    # An unstable patch could jump without a change of the drive, so it is
    # rejected as under a constant load.
    if law.growth[0] >= 0:
        shear_modes(
            compliance,
            law.static * force,
            law.length,
            1,
            law.growth[3] / law.growth[4] if law.growth[4] > 0 else np.inf,
        )
    if count is not None:
        return shear_modes(compliance, limit, law.length, count)
    return find_sufficient_modes(compliance, limit, law.length, N_SHEAR_MODES, 0.1 * tolerance)


def make_model(
    modes: ModalBasis, law: VaryingLoadLaw, sets: ContactSets | None, load=None, shear=None
) -> VaryingLoadModel:
    """Return the model for a contact under a varying load.

    Parameters
    ----------
    modes : ModalBasis
    law : VaryingLoadLaw
    sets : ContactSets or None
        Nodes in contact at each load and tilt; None if the load of one point is prescribed.
    load : callable or None
        Prescribed load [N] at times (k,) [s], in place of the contact.
    shear : ShearModes or None
        Shear of the pieces; None for pieces that are rigid in shear.

    Returns
    -------
    VaryingLoadModel
        PatchfemError for shear modes beside a law other than elastic-plastic or bonds, and for a point
        with heave or pitch.
    """
    if shear is not None and law.kind not in POINT_LAWS:
        raise PatchfemError(
            describe_unsupported(
                "friction.law: this law together with [contact.shear] and a normal load that "
                "changes",
                "stiff",
            )
        )
    if shear is not None and shear.points.size != sets.x.size:
        raise PatchfemError(
            "contact.shear: if the normal load changes, the shear modes must include every node"
        )
    if load is not None and any(
        part is not None and np.any(part) for part in (modes.normal, modes.pitch)
    ):
        raise PatchfemError(
            "structure.mode.normal: with [normal] the contact is a single point, which cannot move "
            "normal to the contact (`normal`) or rotate (`pitch`); use [contact] in place of [normal]"
        )
    return VaryingLoadModel(law, sets, port_rows(modes), load, shear)


class VaryingLoadRun(Run):
    """Time integration of a modal basis under a varying load."""

    def _make_initial_load(self) -> arrays.VaryingLoad:
        """Return the arrays for the initial load, and apply this load to the contact points.

        The contact sets are copied, because other runs may use them.
        """
        model = self.model
        press = compiled("contact.press_kernels")
        slot = 0
        if model.load is None:
            self.sets = model.sets.make_arrays()
        else:
            self.sets = _make_point_sets(model.preload)
        x = self.sets.x
        nodal_forces = np.full(x.size, model.preload)
        if model.load is None:
            heave, pitch = model.rows[1:] @ self.state[0]
            name = hash_set(self.sets, model.sets.in_contact)
            slot = press.find_set(self.sets, press.build_first_set(self.sets, name), -heave, pitch)
            press.press_state(self.sets, slot, -heave, pitch, nodal_forces)
        if model.has_point_loads:
            self.contact = model.points(nodal_forces)
        goal = STEP_TOL * model.limit
        if model.law.kind == LawKind.LISTS:
            goal *= LIST_TOL_FACTOR
        return arrays.VaryingLoad(
            (),
            np.ascontiguousarray(model.rows, float),
            self.prop.beta.copy(),
            np.array([float(np.ptp(x) / 2) or 1.0]),
            np.array(model.law.force[:2]),
            nodal_forces,
            np.zeros(0),
            np.array([slot]),
            np.zeros(1),
            np.array([goal]),
            np.zeros(LoadIndex.START + 5),
        )

    def _changing_arrays(self) -> list:
        press = self.load
        return [*super()._changing_arrays(), press.now, press.slot, press.mean, press.few]

    def _make_step_load(self, count: int) -> arrays.VaryingLoad:
        loads = self.load.loads
        if self.model.load is not None:
            loads = np.array(
                self.model.load((self.done + np.arange(count + 1)) * self.prop.dt), float
            )
        return self.load._replace(sets=self.sets, loads=loads)

    def _step_energies(self, rows) -> np.ndarray:
        """Return the step energies of `Run._step_energies` with the noise of a varying load.

        The noise is that of the largest force, of the mean force, which is computed from the slide that it
        takes (2e-16 of it over `beta`, which is much if the modes hardly slide), of the last digit of the
        slide, and of the stored energy.
        """
        n = 2 * self.modes.omega.size
        work = self._step_works(rows)
        dissipated = work - np.diff(rows[:, n + SampleColumn.ENERGY])
        size = np.maximum(self.model.limit, np.abs(rows[:-1, n + SampleColumn.MEAN_FORCE]))
        digit = np.abs(rows[:, : n // 2]) @ np.abs(self.modes.slide)
        slip_path = np.abs(np.diff(rows[:, n]))
        beta = self.prop.beta[0, 0]
        digit = np.maximum(digit[1:], digit[:-1]) + beta * size
        noise = (
            size * (1e-12 * slip_path + 2e-15 * digit)
            + 2e-16 * slip_path**2 / (beta or np.inf)
            + 1e-14
            * np.maximum(rows[:-1, n + SampleColumn.ENERGY], rows[1:, n + SampleColumn.ENERGY])
        )
        return np.stack(
            [
                work,
                np.where(dissipated > -noise, dissipated, 0.0),
                np.where(dissipated < -noise, -dissipated, 0.0),
            ]
        )

    def _make_snapshot(self, row) -> dict:
        nodal = self.load.now.copy()
        contact_state = {"b": np.zeros(0), "memory": np.zeros((3, nodal.size)), "bend": 0.0}
        c = self.contact
        # All bonds of a point are plotted at their mean stretch.
        if self.model.law.kind == LawKind.LISTS:
            force = self.model.law.static * c.points[PointRow.LOAD] * c.statuses[:, STATUS.force]
            law = self.model.law
            contact_state = {
                "b": c.b.copy(),
                "memory": np.stack([nodal, law.length / law.static * force, 0 * nodal]),
                "bend": c.b @ c.psi,
            }
        elif self.model.has_point_loads:
            contact_state = {"b": c.b.copy(), "memory": c.memory.copy(), "bend": c.b @ c.modes}
        return (
            super()._make_snapshot(row)
            | {"heave": row[-2], "turn": row[-1], "nodal": nodal}
            | contact_state
        )

    def energy_balance(self) -> dict:
        """Return the energies [J] by name, and the numbers of contact sets, pivots and tableaus."""
        return super().energy_balance() | dict(
            zip(("contact_sets", "pivots", "renewed"), map(int, self.sets.counters[N_BUILT:]))
        )

    def make_response(self, rows, number) -> Response:
        """Return the time histories for samples, including load, heave and pitch.

        `extra` has normal_load [N], normal_moment [N m], normal_energy [J], heave [m] and turn [rad].
        """
        out = super().make_response(rows, number)
        modes = self.modes
        model = self.model
        extra = out.extra | dict(zip(PRESS_COLUMNS, rows[:, -5:].T))
        if model.load is not None:
            return replace(out, extra=extra)
        press_force = np.stack(
            [rows[:, -5] - model.sets.load, rows[:, -4] - model.sets.moment], axis=1
        )
        return replace(
            out,
            acceleration=out.acceleration
            + press_force @ model.rows[1:] @ modes.output / modes.mass,
            extra=extra,
        )


def _make_point_sets(load: float) -> SetArrays:
    """Return the contact-set arrays for a prescribed load on one point."""
    point = np.zeros(1)
    reference = (load, 0.0, 0.0, 1.0, 1.0)
    return make_set_arrays(np.ones((1, 1)), point, point, reference, np.zeros(1, bool), n_slots=1)


def march(
    modes: ModalBasis,
    drive,
    sets: ContactSets | None,
    law: VaryingLoadLaw,
    cycles: float,
    steps_per_cycle: int,
    window: int = 10,
    travel: float = np.inf,
    frames: int = 0,
    start=None,
    load=None,
    say=None,
    progress=None,
    shear=None,
):
    """March a modal basis under a varying load, from rest or from an initial state.

    The other arguments, the result and the errors are those of `march.march`.

    Parameters
    ----------
    modes : ModalBasis
    drive
    sets : ContactSets or None
        Nodes in contact at each load and tilt; None if the load of one point is prescribed.
    law : VaryingLoadLaw
    cycles
    steps_per_cycle
    window
    travel
    frames
    start
    load : callable or None
        Prescribed load [N] at times (k,) [s], in place of the contact.
    say
    progress
    shear : ShearModes or None
        Shear of the pieces; None for pieces that are rigid in shear.

    Returns
    -------
    march.MarchResult
    """
    model = make_model(modes, law, sets, load, shear)
    return run(
        modes, drive, model, cycles, steps_per_cycle, window, travel, frames, say, progress, start
    )
