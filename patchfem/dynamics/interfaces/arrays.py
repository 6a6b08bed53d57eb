"""Arrays of the contacts that a march can meet: one law on one slide, points behind shear modes, points under
a changing load or on flanks, a list of bonds; of faces beside each other and of a load that changes."""

from collections import namedtuple
from typing import NamedTuple

import numpy as np


class Element(NamedTuple):
    """num (1, k), mem (1, l) as the law has them; last (2,): the last two slide increments [m]; eps (1,): bond length
    of the step [m]; bound (1,): largest force [N], infinite where none is."""

    num: np.ndarray
    mem: np.ndarray
    last: np.ndarray
    eps: np.ndarray
    bound: np.ndarray


class Sheared(NamedTuple):
    """Points (m,) of a law with memory behind r shear modes of the pieces.

    weight (m,) makes a traction of the law a force [N]: mu_s area/eps_0 of bonds under a load in Pa; eps (2,): bond
    length [m] at the start and in the middle of the step; growth (6,) of eq. 2.10 and of the breakaway share; modes
    psi (r, m), kappa (r,) [N/m], coordinates b (r,) [m]. points (8, m), rows named in `shear_points_kernels`: m, z, s2
    and play of bonds, their load, and slide, force and slope in the step. count (1,):
    how many of its columns, and of those of psi, are points under load. drag (3, 1 + r), flow (2,): of points that all
    drag under a load that stays, as `shear_kernels` has it. Of the solve: y (2, 1 + r) = (dq, db) of the
    step and of what springs back, last (2, 1 + r) of the two steps before, scale (1 + r,), workspace (3, 1 + r), hess (2,
    1 + r, 1 + r) with ready (2,): 1 where it is a factor.
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


def sheared(weight, length: float, growth, psi, kappa, lanes: int = 1, load=None) -> dict:
    """The fields of `Sheared` at rest; psi (m, r), no modes of pieces that are rigid in shear.

    lanes: m is filled up to a multiple of it by points that bear and move nothing; load (m,) [Pa]: one that stays.
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


class Rub(namedtuple("Rub", ("force", "memory", "pressed", "modes", "under", *Sheared._fields))):
    """Points of a law under a load that changes, `pressed_points_kernels`.

    force (6,): mu_s, mu_k, bond length [m], initial density m_0, kind of the law as in `shear_points_kernels`, goal of
    the solve [N]; memory (3, m): elastic-plastic traction/mu and springs [N]; bonds m, z, s2 [N, N m, N m2]; pressed
    (2, m): nodal forces at both ends of the step [N]; modes (r, m): shear modes at all points, none of pieces that are
    rigid in shear; under (m,): numbers of the points under load, in the order in which they come in the rest, which is
    as of `Sheared`; there they have the memory after half of the change of load, and the mean load.
    """

    __slots__ = ()


class Climbing(namedtuple("Climbing", ("flank", "climb", "share", *Rub._fields))):
    """A law with memory along flanks, `grooves.points_kernels`.

    flank (6,): load [N], wave number [rad/m], amplitude [m], phase [rad], lifted mass [kg], kind of the law as in
    `shear_points_kernels`; now_at (14,): speed of what rises [m/s], vertical force of the step before [N], the last two
    slides of a step [m], 1 once the vertical force has fallen to zero, then of the step that was tried last: mean force
    U [N], its slope [N/m], force f along the flank [N], dz/dq, ds/dq, vertical force [N], and the force f at the end of
    the step before, then the normal force at both ends of the step [N]; share (m,): of the points in the normal force;
    the rest is as of `Rub`, with their shares of it for the loads.
    """

    __slots__ = ()


class BondList(NamedTuple):
    """One list of bonds for a slide that all share: force = mu_s N [N]; bondlist (9, capacity), now (6,), status (16,),
    law (24,), table (k,) as in friction.bonds.list_rows_kernels; growth (6,) of eq. 2.10; last (2,) slide increments [m];
    bound (1,): largest force [N]."""

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
            *Sheared._fields,
        ),
    )
):
    """Points (m,) behind shear modes of which each is a list of bonds, `shear_list_kernels`.

    bondlist (9, m capacity): the lists beside each other; nows (m, 6), statuses (m, 16): of each, and now, status of the
    one that is looked at; law, table: as of `BondList`; time (1,): length of the step [s]; the rest is as of `Sheared`,
    weight (m,) the friction limits [N] and the first four rows of points as `shear_lists_kernels` has them. pressed
    (2, m): nodal forces at both ends of the step [N], over those of the limits in the row LOAD of points, (2, 0) where
    they stay; pattern (2, k): of the lower piece, places [m] and pressures over that of the limits, places (m,) [m]: of
    the points at rest; (2, 0), (0,) where the pressure rides on the upper one.
    """

    __slots__ = ()


class Single(NamedTuple):
    """A contact on port 0 with nothing beside it: goal (1,) [N] of its residual."""

    goal: np.ndarray


class Stops(NamedTuple):
    """The m set-valued faces of a march, `march.stops_kernels`.

    element, names (m,): their numbers, room for numbers; limit (4, m): static and kinetic friction [N] at the start of
    the step, then at its end; gives (3, m, m): what their forces take from their slides [m/N] and rates [m/(s N)] over
    a step, and from their accelerations [1/kg]; rows (m, n): their slides per coordinate; system (m, m), field (18, m)
    as `march.stops_kernels` has it.
    """

    element: np.ndarray
    names: np.ndarray
    limit: np.ndarray
    gives: np.ndarray
    rows: np.ndarray
    system: np.ndarray
    field: np.ndarray


class Faces(NamedTuple):
    """Elements (e,) on ports (p,) beside a contact on port 0, or in its place; rows are named in `march.stops_kernels`.

    rows (p, n): slide of every port per coordinate; gives (2, p, p): what port forces take from the slides [m/N] and
    rates [m/(s N)] of ports over a step; of (3, e): port, 1 for friction, 0 for springs, and the element of the other
    direction where both slide in a plane, else its own number; num, mem (e, ...) as the
    laws have them, num[e, 0] which law; each (10, e): force [N], slide, speed, bond length and slide increment of the
    step, residual, largest force [N], infinite where nothing bounds it, goal [N], last two slide increments; own (5,):
    of the contact its force, last increment, force at the sample and goal, and 1 where the stops of the step are known;
    port (2, p): free slide [m] and rate [m/s] in the step; modal (5, n): give of the coordinates [m/N], accelerations
    by what pushes the modes besides [m/s2], room; system (e, e), hess (n, n): room; stops: the set-valued elements.
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
    stops: Stops


class Pressing(NamedTuple):
    """A load that changes, `march.pressing_kernels`.

    sets: `contact.set_arrays.SetArrays`; rows (3, n): slide, heave and pitch per coordinate; beta (3, 3): what
    constant forces in a step take from them; arm (1,) [m]: half the length of the patch; force (2,): mu_s, mu_k of a
    law on the resultant load; now (m,): nodal forces [N]; loads (steps + 1,) [N]: prescribed load at the steps, empty
    where the contact says it; slot (1,): of the present contact set, below 0 where none fits; mean (1,): friction
    force of the step before [N]; goal (1,) [N]: of the residuals; few (22,): room.
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


class Steady(NamedTuple):
    """A load that stays: loads (0,), none."""

    loads: np.ndarray


def carried(contact, element=None) -> list | None:
    """What a contact carries from one step to the next, as rows of numbers of one kind each; None of one whose books
    grow for ever, as those of a list of bonds. element: the law of an `Element`."""
    if isinstance(contact, Element):
        return memory_rows(element, contact.mem[0])
    if isinstance(contact, Sheared):
        return [contact.eps, contact.b, contact.flow[1:], *contact.points[:5]]
    return (
        [contact.eps, contact.b, contact.pressed[1], *contact.memory]
        if isinstance(contact, Rub)
        else None
    )


def memory_rows(element, memory) -> list:
    """The memory (l,) of an element as rows of numbers of one kind each."""
    head = {"parallel": 3, "points": 1, "places": 1}.get(element.form, memory.size)
    kinds = 5 if element.form in ("points", "places") else 1
    return [*memory[:head, None], *memory[head:].reshape(kinds, -1)]


def copied(parts):
    """A tuple of arrays, or of such tuples, with arrays of its own."""
    return type(parts)(
        *(copied(part) if isinstance(part, tuple) else part.copy() for part in parts)
    )


class ModalArrays(NamedTuple):
    """The modes as the compiled loops of a march take them.

    omega, damp = 2 zeta omega, slide, base, output: (n,); damping: (n, n) where it couples, else (0, 0); their steps,
    arrays of `propagator.Propagator`, dt [s] and the beta [m/N] of the first interface; mass [kg]; workspace: (3, n).
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
