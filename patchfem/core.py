"""Immutable records that the folders of the package exchange, with read-only arrays in SI units.

A static contact problem is defined by an `Interface` and its `Compliance`; its solution is a `ContactState`. A rig is
defined by a `ModalBasis`, a drive such as `SineDrive`, and an `InitialState`; an engine computes its `Response`. A
`MeasureDefinition` describes how a quantity is computed from the response, and a `Measure` is its value with a numerical
error. An `Outcome` describes how the run ended.

Letters of array shapes: m interface nodes, n modes, i interfaces, k times, p masses or modes of the scene.

Signs: compression, normal stress and load are positive; relative displacement is upper minus lower surface; a positive
rotation opens the gap at +x.
"""

import tomllib
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple, dataclass_transform

import numpy as np

from .exceptions import Missing, NotConverged, PatchfemError
from .formatting import format_value

__all__ = [
    "G_N",
    "MIN_LOAD",
    "Compliance",
    "ContactState",
    "DriveSegment",
    "InitialState",
    "Interface",
    "Measure",
    "MeasureDefinition",
    "Missing",
    "ModalBasis",
    "NotConverged",
    "Outcome",
    "PatchfemError",
    "Response",
    "SineDrive",
    "add_interface_number",
    "array_dataclass",
    "compute_allowed_error",
    "frozen_array",
    "max_abs",
    "read_measure_rows",
    "remove_interface_number",
]

G_N = 9.80665  # standard gravity [m s-2]
MIN_LOAD = 1e-12  # load [N] in place of no load, to which a stiffness of a friction law refers


@dataclass_transform(eq_default=False, frozen_default=True)
def array_dataclass(cls: type) -> type:
    """Make a class a record of arrays: a dataclass that is immutable, has slots, and equals only itself."""
    return dataclass(frozen=True, eq=False, slots=True)(cls)


class Outcome(StrEnum):
    """Outcome of a run, such as steady, stuck or not converged."""

    DONE = "done"
    STEADY = "steady"
    STUCK = "stuck"
    TRANSIENT = "transient"
    GROWS = "grows"
    EXCEEDS_TRAVEL = "exceeds_travel"
    LEAVES_CONTACT = "leaves_contact"
    LEAVES_GROOVES = "leaves_grooves"
    WORN_THROUGH = "worn_through"
    NO_CONTACT = "no_contact"
    NOT_CONVERGED = "not_converged"

    @property
    def sentence(self) -> str:
        """Description of the outcome for the user, with advice where it exists."""
        return _OUTCOME_SENTENCES[self]


# Sentence about each outcome of a run
_OUTCOME_SENTENCES = {
    Outcome.DONE: "The run finished as requested.",
    Outcome.STEADY: "The motion is steady: it repeats within the tolerance.",
    Outcome.STUCK: "During the last cycles of the run the whole interface sticks all the time.",
    Outcome.TRANSIENT: "The run ended before the motion became steady; if the drive is periodic, more cycles may help.",
    Outcome.GROWS: "The amplitude still grows at the end of the run, and no bounded steady motion was found: friction "
    "does not limit the motion.",
    Outcome.EXCEEDS_TRAVEL: "The motion exceeded the travel of the flexure (`structure.travel`), so the run ended at "
    "that time.",
    Outcome.LEAVES_CONTACT: "The slide became so large that the pieces no longer overlap; lower the drive, shorten the "
    "slide or lengthen the piece.",
    Outcome.LEAVES_GROOVES: "The inertia of the lifted mass took all of the load, so the pieces left their grooves and "
    "the run ended at that time; lower the drive or the lifted mass, or raise the load.",
    Outcome.WORN_THROUGH: "A coating was worn through where the wear is deepest, so the run ended at that cycle; ask "
    "for fewer cycles or make the coating thicker.",
    Outcome.NO_CONTACT: "The pieces do not touch; raise the load or close the gap.",
    Outcome.NOT_CONVERGED: "A numerical method did not converge, so the result is marked as invalid; do not use the "
    "result.",
}


def max_abs(values) -> float:
    """Return the largest magnitude of numbers in an array of any shape; 0 if it is empty."""
    return float(np.abs(values).max(initial=0.0))


def frozen_array(values, dtype=np.float64) -> np.ndarray:
    """Return a read-only, C-ordered copy of values as an array of this dtype."""
    out = np.array(values, dtype=dtype, order="C")
    out.setflags(write=False)
    return out


@array_dataclass
class Interface:
    """Nodes of the interface of a patch along the sliding direction.

    - x (m,): coordinate along the sliding direction, 0 in the middle of the patch [m].
    - weight (m,): area of each node, summed over the pairs of pieces [m2].
    - width: width across the sliding direction, summed over the pairs of pieces [m].
    """

    x: np.ndarray
    weight: np.ndarray
    width: float

    @property
    def length(self) -> float:
        """Length of the patch along x [m]."""
        return float(self.x[-1] - self.x[0])


@array_dataclass
class Compliance:
    """Elastic compliance matrices of both pieces, condensed to the interface nodes.

    Both matrices are symmetric and positive definite, because the far faces of the pieces are fixed and rigid-body
    motion is impossible.

    - interface: nodes to which the matrices belong.
    - normal (m, m): approach of the surfaces at a node per normal force at another [m/N].
    - tangential (m, m): relative tangential displacement at a node per shear force at another [m/N].
    """

    interface: Interface
    normal: np.ndarray
    tangential: np.ndarray


@array_dataclass
class ContactState:
    """Solution of a static normal contact problem.

    - sigma_n (m,): normal stress at the nodes, at least 0 [Pa].
    - gap (m,): remaining gap, at least 0 [m].
    - approach: displacement of the upper holder towards the lower one [m].
    - rotation: rotation of the upper holder [rad].
    - load: normal force [N].
    - moment: moment of the normal stress about x = 0 [N m].
    - outcome: outcome of the solution.
    """

    sigma_n: np.ndarray
    gap: np.ndarray
    approach: float
    rotation: float
    load: float
    moment: float
    outcome: Outcome


class StuckMode(NamedTuple):
    """Natural mode of a rig with stuck interfaces.

    - omega: circular frequency [rad/s], or None if an interface is rigid.
    - shape (n,): shape, which is 1 at one coordinate.
    """

    omega: float | None
    shape: np.ndarray


@array_dataclass
class ModalBasis:
    """Modal coordinates of a rig (natural modes or masses) with a common modal mass.

    The coordinates z obey equation (3.4) of the report,
    z_i'' + (D z')_i + omega_i^2 z_i = -base_i a(t) - (slide_i F + ...)/mass.
    The participation of a point is its displacement per unit of each coordinate.

    - names: names of the modes or masses in the scene.
    - omega (n,): circular frequencies [rad/s].
    - zeta (n,): damping ratios.
    - slide (n,): participation of the relative displacement of the first interface.
    - base (n,): participation of the drive: of the acceleration a(t) of the base, or of a force, a(t) = F/mass, with
      its sign reversed.
    - output (n,): participation of the point whose motion is the output.
    - mass: modal mass of every coordinate [kg].
    - damping (n, n): damping matrix D that couples the coordinates [1/s]; None for D = diag(2 zeta omega).
    - faces (i, n): participation of the relative displacement of every interface; None for the single interface
      `slide`.
    - normal (n,): participation of the motion that opens the contact, or None.
    - pitch (n,): participation of the pitch of the patch [rad/m], or None.
    - yaw (n,): participation of the yaw of the patch [rad/m], or None.
    - shapes (p, n): shapes of the coordinates at the modes or masses in `names`; None for the identity.
    - gauge (n,): participation of the point whose displacement is measured; None if it is the same point as `output`,
      whose acceleration is measured.
    """

    names: tuple[str, ...]
    omega: np.ndarray
    zeta: np.ndarray
    slide: np.ndarray
    base: np.ndarray
    output: np.ndarray
    mass: float
    damping: np.ndarray | None = None
    faces: np.ndarray | None = None
    normal: np.ndarray | None = None
    pitch: np.ndarray | None = None
    yaw: np.ndarray | None = None
    shapes: np.ndarray | None = None
    gauge: np.ndarray | None = None

    @property
    def interfaces(self) -> np.ndarray:
        """Participation (i, n) of the relative displacement of each interface."""
        return self.slide[None, :] if self.faces is None else self.faces

    @property
    def displacement_point(self) -> np.ndarray:
        """Participation (n,) of the point whose displacement is measured."""
        return self.output if self.gauge is None else self.gauge

    @property
    def damping_matrix(self) -> np.ndarray:
        """Damping matrix D (n, n) [1/s]."""
        return np.diag(2 * self.zeta * self.omega) if self.damping is None else self.damping

    def compute_stuck_mode(self, rows, stiffness, number: int) -> StuckMode:
        """Return the natural mode with stuck interfaces that corresponds to a modal coordinate.

        Stuck interfaces act as springs. The modes with springs are assigned to the coordinates one to one by the overlap
        of their shapes. None has a lower frequency than its coordinate, because a spring lowers no frequency.

        Parameters
        ----------
        rows : (i, n) array
            Participations of the stuck interfaces.
        stiffness : (i,) array
            Tangential stiffness of the stuck interfaces [N/m].
        number : int
            Index of the modal coordinate.

        Returns
        -------
        StuckMode
            Its circular frequency is None if a stiffness is infinite.
        """
        if not np.isfinite(stiffness).all():
            return StuckMode(None, np.eye(self.omega.size)[number])
        values, vectors = np.linalg.eigh(
            np.diag(self.omega**2) + rows.T * stiffness @ rows / self.mass
        )
        # Relative round-off of squared frequencies, allowed for in the rule that a spring lowers no
        # frequency
        lower = (1 - 1e-9) * self.omega**2
        k = _assign_modes(lower, values, np.abs(vectors))[number]
        omega = float(np.sqrt(max(values[k], 0.0)))
        return StuckMode(omega, vectors[:, k] / vectors[number, k])


def _assign_modes(lower, values, overlap) -> np.ndarray:
    """Assign the modes with springs to coordinates by the maximum overlap of their shapes.

    `values` (n,) are the squared frequencies of the modes, `lower` (n,) their lower bounds for each coordinate, and
    `overlap` (n, n) the overlaps of the mode shapes. Returns the index (n,) of the mode of each coordinate.
    """
    if values.size == 1:
        return np.zeros(1, int)
    from scipy.optimize import linear_sum_assignment

    # 1e-30 keeps the logarithm finite, and the cost of a forbidden pair is larger than that of any allowed assignment
    cost = np.where(values >= lower[:, None], -np.log(np.maximum(overlap, 1e-30)), 1e6)
    return linear_sum_assignment(cost)[1]


@array_dataclass
class InitialState:
    """State of a rig at time t = 0.

    - z (n,): modal coordinates [m].
    - v (n,): modal velocities [m/s].
    """

    z: np.ndarray
    v: np.ndarray


@array_dataclass
class DriveSegment:
    """Segment of a drive signal in closed form: a constant plus a sinusoid.

    Between `start` and the start of the next segment, the drive is constant + amplitude sin(omega (t - start) + phase).

    - start: start of the segment [s].
    - constant: constant part [m s-2].
    - amplitude: amplitude of the sinusoid [m s-2].
    - omega: circular frequency of the sinusoid [rad/s].
    - phase: phase of the sinusoid at the start of the segment [rad].
    """

    start: float
    constant: float = 0.0
    amplitude: float = 0.0
    omega: float = 0.0
    phase: float = 0.0


@array_dataclass
class SineDrive:
    """Sinusoidal drive a sin(omega t) for t >= 0.

    All drive classes have the attributes `period`, `moving` and `segments` (empty without a closed form) and the method
    `values`.

    - acceleration: amplitude a [m s-2].
    - omega: circular frequency [rad/s].
    - moving: whether the drive is a base acceleration; otherwise it is a force over the modal mass, with the base at
      rest.
    """

    acceleration: float
    omega: float
    moving: bool = True

    @property
    def period(self) -> float:
        """Period of the drive [s]."""
        return 2 * np.pi / self.omega

    @property
    def segments(self) -> tuple[DriveSegment, ...]:
        """Closed form of the drive as a tuple of DriveSegment."""
        return (DriveSegment(0.0, 0.0, self.acceleration, self.omega),)

    def values(self, t):
        """Return the drive acceleration [m s-2] at times t (k,) >= 0 [s]."""
        return self.acceleration * np.sin(self.omega * np.asarray(t, float))


@array_dataclass
class Measure:
    """Computed quantity of a run with its unit and its numerical error.

    `str` gives the value and its error in a readable unit: ``14.808 ± 0.044 um``.

    - value: value in SI units; None if there is none.
    - unit: SI unit of the value.
    - error: numerical error (half-width); None without an estimate.
    - floor: absolute error that is allowed at any tolerance.
    - text: definition of the measure.
    - reason: reason why the value or its error is None.
    - engine: method that computed the value; "" for the engine of the run.
    - parts: contribution to the error of each discretisation, such as "steps" or "mesh", from coarser runs
      (`measures.errors`); None if they are unknown.
    """

    value: float | None
    unit: str
    error: float | None = None
    floor: float = 0.0
    text: str = ""
    reason: str = ""
    engine: str = ""
    parts: dict[str, float] | None = None

    def error_ratio(self, tolerance: float) -> float:
        """Return the numerical error divided by the error that a tolerance allows.

        The ratio is 0 without a value or an error.
        """
        if self.value is None or self.error is None:
            return 0.0
        return self.error / max(compute_allowed_error(tolerance, self.value, self.floor), 1e-300)

    def __str__(self) -> str:
        if self.value is None and self.reason:
            return self.reason
        return format_value(self.value, self.error, self.floor, self.unit)

    def __repr__(self) -> str:
        return f"{self} ({self.text})" if self.text else str(self)


def compute_allowed_error(tolerance, value, floor):
    """Return the error that a tolerance allows: tolerance x |value| + floor.

    Parameters
    ----------
    tolerance : float or array
        Relative tolerance.
    value : float or array
        Value of the measure [SI].
    floor : float or array
        Absolute floor, in the unit of the value.

    Returns
    -------
    float or array
        Error in the unit of the value.
    """
    return tolerance * abs(value) + floor


class MeasureDefinition(NamedTuple):
    """Definition of a measure: its computation from a solution and its allowed error.

    - name, unit: name in files and on pages, and SI unit.
    - floor: absolute floor of the allowed error.
    - text: meaning in one sentence.
    - function: function of the `LastCycles` that returns the value, or the name of their property that holds values by
      name; None if only an engine or another kind of run computes it.
    - sample_error: error due to sampling, multiplied by the number of samples per cycle.
    - group: group of related measures: motion, friction, energy, patch or wear.
    - larger_term: for a measure that is a small difference of larger terms, the name of these terms; otherwise "". The
      tolerance times their size (`measures.rows.find_larger_term`) is added to the floor.
    - order: order of the sampling error of an exact motion in the sample spacing.
    - minimum: smallest possible value.
    - flags: sets to which the measure belongs, separated by blanks: "main" (the tolerance of a run applies to it),
      "interface" (one value per interface), "level" (one value per drive level), "curve" (a column of a response
      curve), "mesh" (its error controls the mesh), "displacement" (its floor is limited by the displacement of the
      drive), "force" (its floor is limited by the normal load), "error" (it is itself an error), "sine" (it exists only
      under a sine), "cycle" (a mean over whole cycles of a sine),
      "loop" (an integral or a peak of samples of the friction loop), "run" (a sum over the whole run),
      "phase" (an angle modulo pi), "scatter" (a statistical mean under a random drive).
    - friction_scale: name of the size in `measures.errors.compute_friction_errors` that is the error of the measure for a
      relative error 1 of the friction force; "" if this is the value of the measure.
    """

    name: str
    unit: str
    floor: float
    text: str
    function: Callable[[Any], float | None] | str | None = None
    sample_error: float = 0.0
    group: str = "motion"
    larger_term: str = ""
    order: float = 1.0
    minimum: float = -np.inf
    flags: str = ""
    friction_scale: str = ""

    def has(self, flag: str) -> bool:
        """Return whether a flag is among those of the measure."""
        return flag in self.flags.split()


def read_measure_rows(table: str) -> dict[str, MeasureDefinition]:
    """Read a table of measures.toml, "motion", "internal" or "patch", as MeasureDefinitions by name."""
    rows = _read_measure_tables()[table].items()
    return {name: MeasureDefinition(name, **row) for name, row in rows}


@cache
def _read_measure_tables() -> dict[str, dict[str, dict[str, Any]]]:
    """Read the tables of measures.toml, with the columns of each measure by its name."""
    return tomllib.loads(Path(__file__).with_name("measures.toml").read_text("utf-8"))


@array_dataclass
class Response:
    """Time histories of a run at its stored samples.

    - time (k,): time from the start of the run [s].
    - modal, modal_rate (k, n): modal coordinates [m] and velocities [m/s].
    - slide, slide_rate (k,): relative displacement [m] and velocity [m/s] of the first interface.
    - output, output_rate (k,): displacement [m] and velocity [m/s] of the output relative to the base.
    - acceleration (k,): absolute acceleration at the accelerometer [m s-2].
    - base_acceleration (k,): acceleration of the base [m s-2].
    - force (k,): friction force [N].
    - slip (k,): irreversible part of `slide` [m].
    - extra: further histories, such as "ledger" (4, k): friction work, energy stored in the interface, dissipated and
      created energy [J]; "sensor", "sensor_rate" (k,): displacement [m] and velocity [m/s] of an accelerometer that is
      not mounted at the output.
    """

    time: np.ndarray
    modal: np.ndarray
    modal_rate: np.ndarray
    slide: np.ndarray
    slide_rate: np.ndarray
    output: np.ndarray
    output_rate: np.ndarray
    acceleration: np.ndarray
    base_acceleration: np.ndarray
    force: np.ndarray
    slip: np.ndarray
    extra: dict[str, np.ndarray] = field(default_factory=dict)

    @property
    def span(self) -> float:
        """Time from the first to the last sample [s]."""
        return float(self.time[-1] - self.time[0])

    @property
    def slides(self) -> np.ndarray:
        """Relative displacement (k, i) [m] of each interface."""
        return self.extra.get("slides", self.slide[:, None])

    @property
    def forces(self) -> np.ndarray:
        """Friction force (k, i) [N] of each interface."""
        return self.extra.get("forces", self.force[:, None])

    @property
    def slips(self) -> np.ndarray:
        """Irreversible part (k, i) [m] of the displacement of each interface; all of it without slips of several."""
        return self.extra.get("slips", self.extra.get("slides", self.slip[:, None]))

    def select(self, samples) -> "Response":
        """Return the response at selected samples.

        `samples` is a slice, an array of indices or a mask (k,). Histories of other lengths in `extra` are omitted.
        """
        names = [name for name in self.__dataclass_fields__ if name != "extra"]
        columns = {name: getattr(self, name)[samples] for name in names}
        extra = {}
        for name, history in self.extra.items():
            n_samples = history.shape[-1] if name == "ledger" else len(history)
            if n_samples == self.time.size:
                extra[name] = history[:, samples] if name == "ledger" else history[samples]
        return Response(**columns, extra=extra)


def remove_interface_number(name: str) -> str:
    """Return the name of a measure without the number of an interface, such as "_2"."""
    head, _, number = name.rpartition("_")
    return head if number.isdigit() else name


def add_interface_number(name: str, number: int) -> str:
    """Return the name of a measure with the number of an interface, except for the first one."""
    return f"{name}_{number + 1}" if number else name
