"""Arrays of the contacts that a march can have."""

from collections import namedtuple
from typing import NamedTuple

import numpy as np


class Element(NamedTuple):
    """One law on one relative displacement.

    - num, mem: (1, k), (1, l) numbers and memory of the law
    - last: (2,) increments of the last two steps [m]
    - eps: (1,) bond length of the step [m]
    - bound: (1,) largest force [N], infinite where there is none
    """

    num: np.ndarray
    mem: np.ndarray
    last: np.ndarray
    eps: np.ndarray
    bound: np.ndarray


class ShearedPoints(NamedTuple):
    """Points (m,) of a law with memory behind r shear modes of the pieces.

    - weight: (m,) makes a traction of the law a force [N]: mu_s area/eps_0 of bonds under a load
      in Pa
    - eps: (2,) bond length at the start and in the middle of the step [m]
    - growth: (6,) of eq. 2.10 and of the breakaway fraction
    - psi, kappa, b: shear modes (r, m), their stiffness [N/m] and coordinates [m] (r,)
    - points: (8, m) rows named in `shear_points_kernels`
    - count: (1,) columns of points and psi that are under load
    - drag, flow: (3, 1 + r), (2,) of points that all drag under a constant load, see
      `shear_kernels`
    - y: (2, 1 + r) solution (dq, db) of the step, and of the pieces that spring back
    - last: (2, 1 + r) those of the two steps before
    - scale, workspace: (1 + r,), (3, 1 + r)
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
    drag: np.ndarray
    flow: np.ndarray
    y: np.ndarray
    last: np.ndarray
    scale: np.ndarray
    workspace: np.ndarray
    hess: np.ndarray
    ready: np.ndarray


def make_sheared_fields(
    weight, length: float, growth, psi, kappa, lanes: int = 1, load=None
) -> dict:
    """Return the fields of `ShearedPoints` at rest.

    Parameters
    ----------
    weight : array_like
        (m,).
    length : float
        Bond length [m].
    growth : array_like
        (6,).
    psi, kappa : ndarray
        (m, r) and (r,) shear modes; none for pieces that are rigid in shear.
    lanes : int, optional
        m is filled up to a multiple of it by points that carry nothing.
    load : array_like, optional
        (m,) constant load [Pa].

    Returns
    -------
    dict
    """
    m, r = psi.shape
    size = 1 + len(kappa)
    more = -m % lanes
    points = np.zeros((8, m + -m % lanes))
    drag = np.zeros((3, size))
    if load is not None:
        points[4, :m] = load
        pull = length * weight * load
        drag[:] = (
            np.append(pull.sum(), psi.T @ pull),
            np.append(0.0, np.abs(psi).max(axis=0)),
            np.append(1.0, psi.T @ pull / pull.sum()),
        )
    return {
        "weight": np.pad(np.array(weight, float), (0, more)),
        "eps": np.full(2, length),
        "growth": np.array(growth, float),
        "psi": np.pad(np.array(psi.T, order="C"), ((0, 0), (0, more))),
        "kappa": np.array(kappa, float),
        "b": np.zeros(r),
        "points": points,
        "count": np.full(1, m + more),
        "drag": drag,
        "flow": np.zeros(2),
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
    """Points of a law under a load that changes, see `pressed_points_kernels`.

    - force: (6,) positions named there
    - memory: (3, m) elastic-plastic traction/mu and springs [N], or m, z, s2 of bonds [N, N m, N
      m2]
    - pressed: (2, m) nodal forces at both ends of the step [N]
    - modes: (r, m) shear modes at all points, none for pieces that are rigid in shear
    - under: (m,) numbers of the points under load, in the order in which they stand in the other
      fields, which are those of `ShearedPoints`; there they have the memory after half of the
      change of load, and the mean load
    """

    __slots__ = ()


class ClimbingPoints(
    namedtuple("ClimbingPoints", ("flank", "climb", "share", *PressedPoints._fields))
):
    """A law with memory along flanks, see `dynamics.grooves`.

    - flank, climb: (6,), (14,) positions named in `grooves.arrays`
    - share: (m,) fractions of the normal force that the points carry

    The other fields are those of `PressedPoints`, with fractions of the normal force for the loads.
    """

    __slots__ = ()


class BondList(NamedTuple):
    """One list of bonds that all share a relative displacement.

    - force: (1,) mu_s N [N]
    - bondlist, now, status, law, table: see `friction.bonds.list_rows_kernels`
    - growth: (6,) of eq. 2.10
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
    """Points (m,) behind shear modes, each a list of bonds, see `shear_list_kernels`.

    - bondlist: (9, m capacity) the lists beside each other
    - nows, statuses: (m, 6), (m, 16) of each list; now, status: those of the present one
    - law, table: see `BondList`
    - time: (1,) duration of the step [s]
    - pressed: (2, m) nodal forces at both ends of the step [N], over the row LOAD of points; (2,
      0) where they are constant
    - pattern: (2, k) places [m] and relative pressures of the lower piece, (2, 0) where the
      pressure moves with the upper one
    - places: (m,) of the points at rest [m]

    The other fields are those of `ShearedPoints`: weight (m,) has the friction limits [N], the
    first four rows of points are named in `shear_lists_kernels`.
    """

    __slots__ = ()


class SingleContact(NamedTuple):
    """A contact on port 0 alone; goal: (1,) of its residual [N]."""

    goal: np.ndarray


class SetValuedElements(NamedTuple):
    """The m set-valued interfaces of a march, see `march.stops_kernels`.

    - element, names: (m,) their numbers, and workspace for numbers
    - limit: (4, m) static and kinetic friction at the start and at the end of the step [N]
    - gives: (3, m, m) what their forces take from relative displacements [m/N], velocities [m/(s
      N)] and accelerations [1/kg]
    - rows: (m, n) relative displacement per coordinate
    - system, field: (m, m), (18, m) workspace
    """

    element: np.ndarray
    names: np.ndarray
    limit: np.ndarray
    gives: np.ndarray
    rows: np.ndarray
    system: np.ndarray
    field: np.ndarray


class PortElements(NamedTuple):
    """Elements (e,) on ports (p,), in addition to a contact on port 0 or in its place.

    Rows are named in `march.stops_kernels`.

    - rows: (p, n) displacement of every port per coordinate
    - gives: (2, p, p) what port forces take from displacements [m/N] and velocities [m/(s N)] of
      the ports
    - of: (3, e) port; 1 for friction, 0 for springs; element of the other direction of a plane,
      else its own number
    - num, mem: (e, ...) numbers and memory of the laws; num[e, 0] tells the law
    - each: (10, e) numbers of each element in the step
    - own: (5,) force, last increment, force at the sample and goal of the contact, and 1 where the
      stops are known
    - port: (2, p) displacement [m] and velocity [m/s] without forces
    - modal: (5, n), system: (e, e), hess: (n, n) workspace
    - stops: the set-valued elements
    """

    rows: np.ndarray
    gives: np.ndarray
    of: np.ndarray
    num: np.ndarray
    mem: np.ndarray
    each: np.ndarray
    own: np.ndarray
    port: np.ndarray
    modal: np.ndarray
    system: np.ndarray
    hess: np.ndarray
    stops: SetValuedElements


class VaryingLoad(NamedTuple):
    """A load that changes, see `march.pressing_kernels`.

    - sets: `contact.set_arrays.SetArrays`
    - rows: (3, n) slide, heave and pitch per coordinate; beta: (3, 3) what constant forces take
      from them
    - arm: (1,) half the length of the patch [m]
    - force: (2,) mu_s, mu_k of a law on the resultant load
    - now: (m,) nodal forces [N]; loads: (steps + 1,) prescribed load [N], empty where the contact
      determines it
    - slot: (1,) number of the contact set, below 0 where none fits
    - mean, goal: (1,) friction force of the step before, and goal of the residuals [N]
    - few: (22,) workspace
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
    """A constant load; loads: (0,)."""

    loads: np.ndarray


def split_memory(contact, element=None) -> list | None:
    """Return the memory that a contact carries from step to step, as rows of numbers of one kind.

    It is None for a list of bonds, whose sums grow without end. element: the law of an `Element`.
    """
    if isinstance(contact, Element):
        return split_element_memory(element, contact.mem[0])
    if isinstance(contact, ShearedPoints):
        return [contact.eps, contact.b, contact.flow[1:], *contact.points[:5]]
    return (
        [contact.eps, contact.b, contact.pressed[1], *contact.memory]
        if isinstance(contact, PressedPoints)
        else None
    )


def split_element_memory(element, memory) -> list:
    """Return the memory (l,) of an element as rows of numbers of one kind each."""
    head = {"parallel": 3, "points": 1, "places": 1}.get(element.form, memory.size)
    kinds = 5 if element.form in ("points", "places") else 1
    return [*memory[:head, None], *memory[head:].reshape(kinds, -1)]


def copy_arrays(parts):
    """Return a copy of a nested tuple of arrays."""
    return type(parts)(
        *(copy_arrays(part) if isinstance(part, tuple) else part.copy() for part in parts)
    )


class ModalArrays(NamedTuple):
    """The modes as the loops of a march take them.

    - omega, damp, slide, base, output: (n,); damp is 2 zeta omega
    - damping: (n, n) where it couples the modes, else (0, 0)
    - free, push, dense, reach, loss, dense_loss: of `propagator.Propagator`
    - dt, beta: step [s], and compliance of the first interface in a step [m/N]
    - mass: [kg]; workspace: (3, n)
    """

    omega: np.ndarray
    damp: np.ndarray
    slide: np.ndarray
    base: np.ndarray
    output: np.ndarray
    damping: np.ndarray
    free: np.ndarray
    push: np.ndarray
    dense: np.ndarray
    reach: np.ndarray
    loss: np.ndarray
    dense_loss: np.ndarray
    dt: float
    beta: float
    mass: float
    workspace: np.ndarray


class StepBounds(NamedTuple):
    """Bounds of a march of folded cycles.

    - goal: tolerance of the friction force of a step [N]
    - force: friction limit [N]
    - travel: displacement of the output beyond which the march ends [m]
    """

    goal: float
    force: float
    travel: float


class LargestSlide(NamedTuple):
    """Sample of the largest slide, in a system of n modes.

    - row: (2 n + 7,) the present sample
    - kept: (2 n + 10,) sample of the largest slide so far, with the sums there
    - number: (1,) its number, counted from the first step
    """

    row: np.ndarray
    kept: np.ndarray
    number: np.ndarray


class FoldedCycles(NamedTuple):
    """Sums and output that `march.passing_kernels` records of cycles without samples.

    - bounds, largest: as above
    - ledger: (9,) of `march.loop_kernels.march`
    - sums: (5,) sums over these cycles [J], named in `passing_kernels`
    - totals: (3,) the first three sums before these cycles [J]
    - trace: (4, s + 1) samples of the output and waves of the drive, named in `passing_kernels`
    - workspace: (14, k) space for a block of k steps
    """

    bounds: StepBounds
    largest: LargestSlide
    ledger: np.ndarray
    sums: np.ndarray
    totals: np.ndarray
    trace: np.ndarray
    workspace: np.ndarray
