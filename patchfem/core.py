"""The nouns that travel between stages: frozen, read-only, in SI units.

Shapes use the same letters everywhere: m interface points, n modes, i interfaces, k times, t elements.

Signs: compression, normal stress and load > 0; slip = upper - lower; rotation > 0 opens the gap at +x.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from .exceptions import Missing, NotConverged, PatchfemError
from .formatting import format_value

__all__ = [
    "G_N",
    "STICK_SPEED_RATIO",
    "SineDrive",
    "Compliance",
    "IntegratedMeasures",
    "Interface",
    "InterfaceLoop",
    "Measure",
    "Missing",
    "ModalBasis",
    "NotConverged",
    "Outcome",
    "PatchfemError",
    "ContactState",
    "Response",
    "MeasureDefinition",
    "DriveSegment",
    "InitialState",
    "frozen_array",
    "format_length",
]

STICK_SPEED_RATIO = (
    1e-2  # share of the cycle's peak slip speed below which a memory law counts as sticking
)
G_N = 9.80665  # standard gravity [m s-2]


class Outcome(StrEnum):
    """How a run ended; `sentence` says what it means and what to do next."""

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
        """One sentence for a person: the meaning and, where there is one, the remedy."""
        return _SENTENCES[self]


_SENTENCES = {
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


def frozen_array(values, dtype=np.float64) -> np.ndarray:
    """`values` as a C-ordered read-only array."""
    out = np.array(values, dtype=dtype, order="C")
    out.setflags(write=False)
    return out


@dataclass(frozen=True, eq=False, slots=True)
class Interface:
    """Points of the interface along the sliding direction.

    x: (m,) [m], 0 in the middle; weight: (m,) nodal areas [m2] of all pairs; width [m] of all pairs.
    """

    x: np.ndarray
    weight: np.ndarray
    width: float

    @property
    def length(self) -> float:
        """Length of the patch along x [m]."""
        return float(self.x[-1] - self.x[0])


@dataclass(frozen=True, eq=False, slots=True)
class Compliance:
    """The pair of pieces seen from their interface, all pairs together.

    normal: (m, m) closing per nodal normal force [m/N]; tangential: (m, m) relative slide per nodal shear force [m/N].
    Both are symmetric and positive definite: the far faces are held, so no rigid motion is inside.
    """

    interface: Interface
    normal: np.ndarray
    tangential: np.ndarray


@dataclass(frozen=True, eq=False, slots=True)
class ContactState:
    """A solved static contact state.

    sigma_n: (m,) nodal normal stress [Pa], >= 0; gap: (m,) gap that remains [m], >= 0; approach [m] and rotation [rad]
    of the upper holder; load [N]; moment [N m] about x = 0; iterations: contact sets tried; residuals: relative, from
    the independent check.
    """

    sigma_n: np.ndarray
    gap: np.ndarray
    approach: float
    rotation: float
    load: float
    moment: float
    outcome: Outcome
    iterations: int
    residuals: MappingProxyType


@dataclass(frozen=True, eq=False, slots=True)
class ModalBasis:
    """Modes of a rig, or its masses, as n coordinates of equal mass.

    Equation (3.4) of the report: z_i'' + (D z')_i + omega_i^2 z_i = -base_i a(t) - (slide_i F + ...)/mass.

    omega [rad/s], zeta [1], slide, base, output [1]: (n,); mass [kg]. base is the share of the drive: of the base's
    acceleration a(t), or of a force over the mass, a(t) = F/mass, with its sign turned. damping: (n, n) D [1/s] where
    it couples the coordinates; None: D = diag(2 zeta omega). faces: (i, n) slide of every interface; None: the one
    interface `slide`. normal (away from the contact, 1), pitch [rad/m], lateral [1], yaw [rad/m]: (n,) motion of the
    patch per coordinate, None where no mode has any. gauge: (n,) motion that the displacement is measured of, where it
    is not that of `output`, which the acceleration is measured of; None where they are one. shapes: (p, n) the modes or
    masses of the scene, which `names` are of, per coordinate; None: they are the coordinates. lateral_faces: (i, n)
    slide of every interface in its second direction, 0 of one without; None where none has one.
    """

    names: tuple
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
    lateral: np.ndarray | None = None
    yaw: np.ndarray | None = None
    shapes: np.ndarray | None = None
    gauge: np.ndarray | None = None
    lateral_faces: np.ndarray | None = None

    @property
    def interfaces(self) -> np.ndarray:
        """Slide of every interface per coordinate (i, n)."""
        return self.slide[None, :] if self.faces is None else self.faces

    @property
    def damping_matrix(self) -> np.ndarray:
        """Damping matrix D (n, n) [1/s], coupled or not."""
        return np.diag(2 * self.zeta * self.omega) if self.damping is None else self.damping

    def stuck_mode(self, rows, stiffness, number: int) -> tuple:
        """(omega [rad/s], shape (n,)) of a mode when rows (i, n) hold with stiffness (i,) [N/m]; omega None where one
        is infinite. Each coordinate has a held mode of its own, of most overlap, none slower than its own frequency,
        as a spring lowers none. The coordinate `number` of the shape is 1."""
        if not np.isfinite(stiffness).all():
            return None, np.eye(self.omega.size)[number]
        values, vectors = np.linalg.eigh(
            np.diag(self.omega**2) + rows.T * stiffness @ rows / self.mass
        )
        k = _partners((1 - 1e-9) * self.omega**2, values, np.abs(vectors))[number]
        return float(np.sqrt(max(values[k], 0.0))), vectors[:, k] / vectors[number, k]


def _partners(least, values, overlap) -> np.ndarray:
    """A value (n,) of its own for each number (n,) `least` that it is not below, such that the product of the overlaps
    (n, n) of all is largest."""
    if values.size == 1:
        return np.zeros(1, int)
    from scipy.optimize import linear_sum_assignment

    cost = np.where(values >= least[:, None], -np.log(np.maximum(overlap, 1e-30)), 1e6)
    return linear_sum_assignment(cost)[1]


@dataclass(frozen=True, eq=False, slots=True)
class InitialState:
    """State of a rig at t = 0: coordinates z (n,) [m] and their rates v (n,) [m/s]."""

    z: np.ndarray
    v: np.ndarray


@dataclass(frozen=True, eq=False, slots=True)
class DriveSegment:
    """One stretch of a drive in closed form, from `start` [s] until the next segment starts.

    It is constant + amplitude sin(omega (t - start) + phase) [m s-2]; omega [rad/s], phase [rad].
    """

    start: float
    constant: float = 0.0
    amplitude: float = 0.0
    omega: float = 0.0
    phase: float = 0.0


@dataclass(frozen=True, eq=False, slots=True)
class SineDrive:
    """A sine drive, +a sin(omega t) from t = 0; acceleration a [m s-2], omega [rad/s].

    moving: the base accelerates. Not moving: the drive is a force over the modal mass and the frame is at rest. Every
    drive has period [s], moving, segments (in closed form, () where there is none) and values(t).
    """

    acceleration: float
    omega: float
    moving: bool = True

    @property
    def period(self) -> float:
        """Drive period [s]."""
        return 2 * np.pi / self.omega

    @property
    def segments(self) -> tuple:
        """The drive as a tuple of one Segment."""
        return (DriveSegment(0.0, 0.0, self.acceleration, self.omega),)

    def values(self, t):
        """Drive [m s-2] at times t (k,) >= 0 [s]."""
        return self.acceleration * np.sin(self.omega * np.asarray(t, float))


@dataclass(frozen=True, eq=False, slots=True)
class Measure:
    """One number with its unit, its numerical error (half-width; None where none is estimated) and what it means.

    `str` of it is the value and its error in the unit that people read: ``14.808 ± 0.044 um``. reason: why there is no
    value, where it is None. engine: what computed it, in words; "" where the engine of the run did.
    """

    value: float | None
    unit: str
    error: float | None = None
    floor: float = 0.0
    text: str = ""
    reason: str = ""
    engine: str = ""

    def error_ratio(self, tolerance: float) -> float:
        """Error over what is `allowed` [1], above 1 where it misses the tolerance; 0 without a value or an error."""
        if self.value is None or self.error is None:
            return 0.0
        return self.error / max(allowed_error(tolerance, self.value, self.floor), 1e-300)

    def __str__(self) -> str:
        if self.value is None and self.reason:
            return self.reason
        return format_value(self.value, self.error, self.floor, self.unit)

    def __repr__(self) -> str:
        return f"{self} ({self.text})" if self.text else str(self)


def allowed_error(tolerance, value, floor):
    """Error that a tolerance allows a value: tolerance * |value| + floor, of numbers or (n,) of many."""
    return tolerance * abs(value) + floor


class MeasureDefinition(NamedTuple):
    """One measure that a run may have: its name, its unit, the absolute floor of its error and its meaning.

    of: its function of the solution, None where a run of another kind or an engine alone has it; grain: samples of a
    cycle that its reading may be off by; group: of measures that a reader looks at together, motion, friction, energy,
    patch or wear; term: of a measure that is a difference of larger terms, what these are in words, and the size of
    them from the values of the same interface by name; the tolerance times it is a floor as well. order: at which
    its error falls with the distance of the samples where it is read off those of a motion that is exact.
    needs_run: it is read off the histories of the whole run, which the runs behind its error then keep too.
    minimum: the smallest value that it can have.
    """

    name: str
    unit: str
    floor: float
    text: str
    of: Callable | None = None
    grain: float = 0.0
    group: str = "motion"
    term: tuple[str, Callable] | None = None
    order: float = 1.0
    needs_run: bool = False
    minimum: float = -np.inf


@dataclass(frozen=True, eq=False, slots=True)
class Response:
    """Time histories of a run at its kept samples; arrays (k,) unless noted.

    time [s]; modal (k, n) [m]; modal_rate (k, n) [m/s]; slide [m], slide_rate [m/s] of the interface; output [m],
    output_rate [m/s]; acceleration [m s-2], absolute, at the accelerometer; base_acceleration [m s-2]; force: friction
    resultant [N]; slip: irreversible part of `slide` [m]. `extra` may hold "ledger" (4, k) [J]: friction work, energy
    stored in the interface, dissipated, created; "felt", "felt_rate" (k,): motion [m] and rate [m/s] of an
    accelerometer that does not move as the output does.
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
    extra: dict = field(default_factory=dict)

    def at(self, pick) -> "Response":
        """Some of its samples: a slice, numbers or bools (k,); what `extra` has of other lengths is left out."""
        count = self.time.size
        columns = {
            name: getattr(self, name)[pick] for name in self.__dataclass_fields__ if name != "extra"
        }
        extra = {
            name: part[:, pick] if name == "ledger" else part[pick]
            for name, part in self.extra.items()
            if (part.shape[-1] if name == "ledger" else len(part)) == count
        }
        return Response(**columns, extra=extra)


class InterfaceLoop(NamedTuple):
    """Friction loop of one interface over the last cycles, as an engine integrated it.

    Attributes
    ----------
    first, pull : complex
        First harmonics of the relative displacement [m] and of the friction force [N].
    work : float
        Friction work [J].
    slip : float
        Range of the slip [m].
    stuck : float or None
        Time without slip [s]; None where it is read from samples.
    force : float
        Largest friction force [N].
    """

    first: complex
    pull: complex
    work: float
    slip: float
    stuck: float | None
    force: float


@dataclass(frozen=True, eq=False, slots=True)
class IntegratedMeasures:
    """Quantities that an engine integrated over the last cycles itself.

    An engine that has its motion in closed form, or as polynomials, knows peaks, times without slip and work better
    than samples of the motion show them. A quantity that is None, or an empty tuple, is read from samples instead
    (`response.rows`).

    Attributes
    ----------
    swing : float or None
        Half the range of the output [m].
    acceleration : float or None
        Largest acceleration at the output [m s-2].
    drift : float or None
        Time mean of the relative displacement in the last cycle less that in the first, per cycle between them [m].
    waves : tuple or None
        Sizes of the first and third harmonic of the absolute acceleration [m s-2].
    loops : tuple of InterfaceLoop
        One for each interface.
    starts : (s,) array or None
        Phases of the drive [rad], modulo pi, at which the first interface begins to slip.
    books : tuple or None
        Friction work [J] from samples, from the energy balance, and the sum of its absolute values.
    turns : tuple
        (relative displacement [m], friction force [N]) of the first interface at the smallest and at the largest
        relative displacement, a pair for every cycle.
    """

    swing: float | None = None
    acceleration: float | None = None
    drift: float | None = None
    waves: tuple | None = None
    loops: tuple = ()
    starts: np.ndarray | None = None
    books: tuple | None = None
    turns: tuple = ()


def format_length(length: float, digits: int = 4) -> str:
    """A length [m] as words for a message, such as "200 um" or "12.7 mm", to so many digits."""
    for unit, factor in (("m", 1.0), ("mm", 1e-3), ("um", 1e-6)):
        if abs(length) >= factor * (1 - 1e-9):
            return f"{length / factor:.{digits}g} {unit}"
    return f"{length / 1e-9:.{digits}g} nm" if length else "0 um"
