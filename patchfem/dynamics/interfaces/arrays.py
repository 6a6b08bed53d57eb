"""Arrays of the contacts, loads and modes that the compiled loop of a march takes."""

from collections import namedtuple
from enum import IntEnum
from typing import NamedTuple

import numpy as np


class Element(NamedTuple):
    """Parameters and memory of one friction law that acts along one relative displacement.

    - num, mem: (1, k), (1, l) numbers and memory of the law
    - last: (2,) increments of the last two steps [m]
    - eps: (1,) bond length of the step [m]
    - bound: (1,) upper bound of the force [N], infinite for an unbounded law
    """

    num: np.ndarray
    mem: np.ndarray
    last: np.ndarray
    eps: np.ndarray
    bound: np.ndarray


class StepStart(NamedTuple):
    """Motion of an interface at the start of a step.

    - rel_disp: relative displacement [m]
    - velocity: relative velocity [m/s]
    - dt: duration of the step [s]
    """

    rel_disp: float
    velocity: float
    dt: float


class SolvedStep(NamedTuple):
    """Solution of a time step for a contact: displacement increment and mean force.

    - increment: increment of the relative displacement [m]
    - mean_force: path mean of the friction force [N]
    - iterations: number of iterations, below 0 if the solution failed
    """

    increment: float
    mean_force: float
    iterations: int


class StepProblem(NamedTuple):
    """Equation of a time step for points that are coupled by shear modes.

    It is dq = free - compliance times friction force.

    - free: increment of the holder in the absence of friction [m]
    - compliance: compliance of the modes in the step [m/N]; if it is 0, the increment of the holder is prescribed
    - law_kind: kind of the law of the points, PLASTIC or POINTS of `shear_points_kernels`
    - relaxes: whether the pieces relax while the holder is at rest
    """

    free: float
    compliance: float
    law_kind: int
    relaxes: bool


class LawStep(NamedTuple):
    """State of one friction law at the start of a time step.

    - numbers, memory: parameters and memory of the law
    - rel_disp: relative displacement at the start [m]
    - bond_length: bond length in the step [m]
    - dt: duration of the step [s]
    """

    numbers: np.ndarray
    memory: np.ndarray
    rel_disp: float
    bond_length: float
    dt: float


class BondSums(NamedTuple):
    """Sums over bond points: force [N], energy [J], stretch times load [N m], and load [N]."""

    force: float
    energy: float
    stretch: float
    load: float


class PointRow(IntEnum):
    """Row indices of `ShearedPoints.points`: bonds, load and step solution of each point.

    - DENSITY, STRETCH, SQUARED_STRETCH: moments of the bonds; for an elastic-plastic law DENSITY is the traction over mu and
      STRETCH the density of the springs
    - UNUSED: not used by bonds known by their moments
    - LOAD: load, or friction limit of a list of bonds
    - SLIDE, FORCE, SLOPE: slide [m], force [N] and slope [N/m] in the step
    """

    DENSITY = 0
    STRETCH = 1
    SQUARED_STRETCH = 2
    UNUSED = 3
    LOAD = 4
    SLIDE = 5
    FORCE = 6
    SLOPE = 7


class ListPointRow(IntEnum):
    """First row indices of `ShearedLists.points`, which replace those in `PointRow` for bond lists.

    - GROWTH_SPEED: speed at which bonds grow in the step [m/s]
    - LAST_SPEED: mean speed of the last step [m/s]
    - TRIAL_SLIDE, TRIAL_FORCE: slide [m] and force at the last evaluation
    """

    GROWTH_SPEED = 0
    LAST_SPEED = 1
    TRIAL_SLIDE = 2
    TRIAL_FORCE = 3


class FullSlipRow(IntEnum):
    """Row indices of `ShearedPoints.full_slip`. Its columns are the holder and the shear modes.

    - FORCE: force if all points slip in the positive direction [N]
    - MAX_SLIDE: largest slide of a point per coordinate
    - MEAN_SLIDE: mean slide of the points per coordinate
    """

    FORCE = 0
    MAX_SLIDE = 1
    MEAN_SLIDE = 2


class SlipStateIndex(IntEnum):
    """Indices into `ShearedPoints.slip_state`: state of the contact during full slip.

    - FULL_SLIP_DIRECTION: sign of the slide while all points are in steady full slip, otherwise 0
    - TOTAL_SLIDE: slide of the holder [m]
    - IS_FULL: for `ShearedLists`, in place of the direction: 1 if a list is full
    """

    FULL_SLIP_DIRECTION = 0
    TOTAL_SLIDE = 1
    IS_FULL = 0


class WorkRow(IntEnum):
    """Row indices of `ShearedPoints.workspace`: gradient, Newton step and trial solution of a step."""

    GRADIENT = 0
    STEP = 1
    TRIAL = 2


class PressedIndex(IntEnum):
    """Indices into `PressedPoints.force`: parameters of the friction law at the points.

    - MU_STATIC, MU_KINETIC: coefficients of friction
    - BOND_LENGTH: bond length [m]
    - INITIAL_DENSITY: initial density of the bonds
    - LAW_KIND: kind of the law, PLASTIC or POINTS of `shear_points_kernels`
    - RESIDUAL_GOAL: tolerance of the residual [N]
    """

    MU_STATIC = 0
    MU_KINETIC = 1
    BOND_LENGTH = 2
    INITIAL_DENSITY = 3
    LAW_KIND = 4
    RESIDUAL_GOAL = 5


class LoadIndex(IntEnum):
    """Indices into `VaryingLoad.few`: load and normal contact in the present step.

    - LOAD: present load [N]
    - MEAN_PRESS: mean forces of the step on heave [N] and pitch [N m]
    - GUESS: increments of heave and pitch of the last step, the initial guess of the present one
    - OUT: first of nine results of `contact.press_path_kernels.path_mean`
    - START: first of heave, pitch, energy and forces at the start of the step
    """

    LOAD = 0
    MEAN_PRESS = 3
    GUESS = 6
    OUT = 8
    START = 17


class ShearedPoints(NamedTuple):
    """Arrays of a contact whose m points have memory and are coupled by r shear modes of the pieces.

    - weight: (m,) force per traction of the law: mu_s area/eps_0 for bonds under a load
      in Pa
    - eps: (2,) bond length at the start and at the middle of the step [m]
    - growth: (5,) parameters of eq. 2.10
    - psi, kappa, b: shear modes (r, m), their stiffness [N/m] and coordinates [m] (r,)
    - points: (8, m), see `PointRow`
    - count: (1,) number of columns of points and psi that are under load
    - full_slip, slip_state: (3, 1 + r), (2,) full slip under a constant load, see `FullSlipRow` and
      `SlipStateIndex`
    - y: (2, 1 + r) solution (dq, db) of the step, and of the relaxation of the pieces
    - last: (2, 1 + r) solutions of the two steps before
    - scale, workspace: (1 + r,), (3, 1 + r), see `WorkRow`
    - hess, ready: (2, 1 + r, 1 + r), and (2,): 1 where `hess` holds the factorised Hessian
    """

    weight: np.ndarray
    eps: np.ndarray
    growth: np.ndarray
    psi: np.ndarray
    kappa: np.ndarray
    b: np.ndarray
    points: np.ndarray
    count: np.ndarray
    full_slip: np.ndarray
    slip_state: np.ndarray
    y: np.ndarray
    last: np.ndarray
    scale: np.ndarray
    workspace: np.ndarray
    hess: np.ndarray
    ready: np.ndarray


def make_sheared_fields(
    weight, length: float, growth, psi, kappa, lanes: int = 1, load=None
) -> dict:
    """Return the initial fields of `ShearedPoints` for a contact that is at rest.

    Parameters
    ----------
    weight : array_like
        (m,) force per traction of the law.
    length : float
        Bond length [m].
    growth : array_like
        (5,) parameters of the growth of bonds.
    psi, kappa : ndarray
        (m, r) and (r,) shear modes and their stiffnesses; empty for pieces that are rigid in shear.
    lanes : int, optional
        The number of points is padded to a multiple of `lanes` by points without load.
    load : array_like, optional
        (m,) constant load [Pa].

    Returns
    -------
    dict
    """
    m, r = psi.shape
    size = 1 + len(kappa)
    n_padding = -m % lanes
    points = np.zeros((len(PointRow), m + -m % lanes))
    full_slip = np.zeros((len(FullSlipRow), size))
    if load is not None:
        points[PointRow.LOAD, :m] = load
        full_slip_force = length * weight * load
        full_slip[:] = (
            np.append(full_slip_force.sum(), psi.T @ full_slip_force),
            np.append(0.0, np.abs(psi).max(axis=0)),
            np.append(1.0, psi.T @ full_slip_force / full_slip_force.sum()),
        )
    return {
        "weight": np.pad(np.array(weight, float), (0, n_padding)),
        "eps": np.full(2, length),
        "growth": np.array(growth, float),
        "psi": np.pad(np.array(psi.T, order="C"), ((0, 0), (0, n_padding))),
        "kappa": np.array(kappa, float),
        "b": np.zeros(r),
        "points": points,
        "count": np.full(1, m + n_padding),
        "full_slip": full_slip,
        "slip_state": np.zeros(2),
        "y": np.zeros((2, size)),
        "last": np.zeros((2, size)),
        "scale": np.append(1.0, 1 / np.sqrt((psi**2).mean(axis=0))),
        "workspace": np.zeros((3, size)),
        "hess": np.zeros((2, size, size)),
        "ready": np.zeros(2),
    }


class PressedPoints(
    namedtuple(
        "PressedPoints", ("force", "memory", "pressed", "modes", "under", *ShearedPoints._fields)
    )
):
    """Arrays of a contact whose points are under a varying load (see `pressed_points_kernels`).

    - force: (6,) law parameters, see `PressedIndex`
    - memory: (3, m) elastic-plastic traction/mu and springs [N], or moments m, z, s2 of bonds [N, N m, N
      m2]
    - pressed: (2, m) nodal forces at both ends of the step [N]
    - modes: (r, m) shear modes at all points; empty for pieces that are rigid in shear
    - under: (m,) numbers of the points under load, in the order of the columns of the other
      fields, which are those of `ShearedPoints`; these have the memory after half of the
      change of load, and the mean load
    """

    __slots__ = ()


class ClimbingPoints(
    namedtuple("ClimbingPoints", ("flank", "climb", "share", *PressedPoints._fields))
):
    """Arrays of a contact with memory on the flanks of grooves (see `dynamics.grooves`).

    - flank, climb: (6,), (14,) see `FlankIndex` and `ClimbIndex` of `grooves.arrays`
    - share: (m,) fractions of the normal force that the points carry

    The other fields are those of `PressedPoints`, with fractions of the normal force for the loads.
    """

    __slots__ = ()


class BondList(NamedTuple):
    """Arrays of a contact that has one bond list along one relative displacement.

    - force: (1,) friction limit mu_s N [N]
    - bondlist, now, status, law, table: see `friction.bonds.list_rows_kernels`
    - growth: (5,) parameters of eq. 2.10
    - last: (2,) increments of the last two steps [m]
    - bound: (1,) largest force [N]
    """

    force: np.ndarray
    bondlist: np.ndarray
    now: np.ndarray
    status: np.ndarray
    law: np.ndarray
    table: np.ndarray
    growth: np.ndarray
    last: np.ndarray
    bound: np.ndarray


class ShearedLists(
    namedtuple(
        "ShearedLists",
        (
            "bondlist",
            "now",
            "status",
            "law",
            "table",
            "nows",
            "statuses",
            "time",
            "pressed",
            "pattern",
            "places",
            *ShearedPoints._fields,
        ),
    )
):
    """Arrays of a contact whose m points are coupled by shear modes and each have a bond list.

    The functions are those of `shear_list_kernels`.

    - bondlist: (8, m capacity) lists of all points, one after the other
    - nows, statuses: (m, 6), (m, 14) time state and status of each list; now, status: those of the present list
    - law, table: see `BondList`
    - time: (1,) duration of the step [s]
    - pressed: (2, m) nodal forces at both ends of the step [N], relative to the row LOAD of points; (2,
      0) if they are constant
    - pattern: (2, k) positions [m] and relative pressures of the lower piece, (2, 0) if the
      pressure moves with the upper one
    - places: (m,) initial positions of the points [m]

    The other fields are those of `ShearedPoints`: weight (m,) has the friction limits [N], the
    first four rows of points are those of `ListPointRow`.
    """

    __slots__ = ()


class VaryingLoad(NamedTuple):
    """Arrays for a varying normal load, with heave and pitch (see `march.pressing_kernels`).

    - sets: `contact.set_arrays.SetArrays`
    - rows: (3, n) slide, heave and pitch per coordinate; beta: (3, 3) their reduction in a step
      per constant force
    - arm: (1,) half-length of the patch [m]
    - force: (2,) mu_s, mu_k of a law under the resultant load
    - now: (m,) nodal forces [N]; loads: (steps + 1,) prescribed load [N], empty if the contact
      determines it
    - slot: (1,) number of the contact set, below 0 where none fits
    - mean, goal: (1,) friction force of the step before, and tolerance of the residuals [N]
    - few: (22,) workspace, see `LoadIndex`
    """

    sets: tuple
    rows: np.ndarray
    beta: np.ndarray
    arm: np.ndarray
    force: np.ndarray
    now: np.ndarray
    loads: np.ndarray
    slot: np.ndarray
    mean: np.ndarray
    goal: np.ndarray
    few: np.ndarray


class ConstantLoad(NamedTuple):
    """Empty arrays that replace `VaryingLoad` if the normal load is constant.

    - loads: (0,)

    """

    loads: np.ndarray


def split_memory(contact, element=None) -> list | None:
    """Return the memory of a contact as a list of rows, each with numbers of comparable magnitude.

    It is None for a list of bonds, whose sums increase without bound. element: law of an `Element`.
    """
    if isinstance(contact, Element):
        return split_element_memory(element, contact.mem[0])
    if isinstance(contact, ShearedPoints):
        return [
            contact.eps,
            contact.b,
            contact.slip_state[SlipStateIndex.TOTAL_SLIDE :],
            *contact.points[: PointRow.SLIDE],
        ]
    return (
        [contact.eps, contact.b, contact.pressed[1], *contact.memory]
        if isinstance(contact, PressedPoints)
        else None
    )


def split_element_memory(element, memory) -> list:
    """Return the memory (l,) of a friction element as rows of numbers of comparable magnitude."""
    head = {"parallel": 3, "points": 1, "places": 1}.get(element.form, memory.size)
    kinds = 4 if element.form in ("points", "places") else 1
    return [*memory[:head, None], *memory[head:].reshape(kinds, -1)]


def copy_arrays(parts):
    """Return a deep copy of a nested tuple of arrays."""
    return type(parts)(
        *(copy_arrays(part) if isinstance(part, tuple) else part.copy() for part in parts)
    )


class ModalArrays(NamedTuple):
    """Arrays of the modes for the compiled loop of a march.

    - omega, damp, slide, base, output: (n,); damp is 2 zeta omega
    - damping: (n, n) if it couples the modes, otherwise (0, 0)
    - free, force_response, dense, slide_response, loss, dense_loss: step coefficients of `propagator.Propagator`
    - dt, beta: step length [s], and compliance of the first interface in a step [m/N]
    - mass: modal mass [kg]; workspace: (3, n)
    """

    omega: np.ndarray
    damp: np.ndarray
    slide: np.ndarray
    base: np.ndarray
    output: np.ndarray
    damping: np.ndarray
    free: np.ndarray
    force_response: np.ndarray
    dense: np.ndarray
    slide_response: np.ndarray
    loss: np.ndarray
    dense_loss: np.ndarray
    dt: float
    beta: float
    mass: float
    workspace: np.ndarray
