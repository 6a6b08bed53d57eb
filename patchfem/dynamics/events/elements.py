"""Elements side by side under one slide: a rigid one (Coulomb), elastic-plastic ones sorted by the slide at which they
yield."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...core import PatchfemError, frozen_array

# (cells of a density that are one, from which on) in the runs for its error
JOINED = (4, 0), (4, 1), (4, 2), (4, 3)
SAME = 1e-14  # relative difference of two yield slides that are one


@dataclass(frozen=True, eq=False, slots=True)
class Elements:
    """Elements of one interface: springs k_j that slip at a stretch y_j, F = sum k_j e_j with |e_j| <= y_j, and a rigid
    element before them.

    stiffness: (t,) [N/m]; yield_displacement: (t,) [m], rising; rank: (a,) element that each given one became part of, -1
    for one without stiffness or yield slide, which carries nothing. static, kinetic [N]: limits of the rigid element,
    which holds the slide until its reaction reaches static and then slips under kinetic; static = 0 where there is
    none.
    """

    stiffness: np.ndarray
    yield_displacement: np.ndarray
    rank: np.ndarray
    static: float = 0.0
    kinetic: float = 0.0

    @property
    def limit(self) -> float:
        """Friction limit sum k_j y_j [N]."""
        return float(self.stiffness @ self.yield_displacement)


def elements_of(stiffness, yield_displacement) -> Elements:
    """Elements from stiffness (a,) [N/m] >= 0 and yield slide (a,) [m] >= 0 in any order; equal yields become one.

    PatchfemError for values below zero or not finite.
    """
    k = np.asarray(stiffness, float)
    y = np.asarray(yield_displacement, float)
    if not (np.isfinite(k).all() and np.isfinite(y).all() and (k >= 0).all() and (y >= 0).all()):
        raise PatchfemError(
            "friction: the stiffness and the yield slide of each element must be finite and >= 0"
        )
    if k.size == 1 and k[0] > 0 and y[0] > 0:  # nothing to sort, in two fifths of the time
        return Elements(frozen_array(k), frozen_array(y), frozen_array([0], np.int64))
    order = np.flatnonzero((k > 0) & (y > 0))
    order = order[np.argsort(y[order], kind="stable")]
    new = np.ones(order.size, bool)
    new[1:] = np.diff(y[order]) > SAME * y[order][1:]
    place = np.cumsum(new) - 1
    first = np.flatnonzero(new)
    rank = np.full(k.size, -1, np.int64)
    rank[order] = place
    stiff = np.add.reduceat(k[order], first) if first.size else np.zeros(0)
    return Elements(
        frozen_array(stiff), frozen_array(y[order][first]), frozen_array(rank, np.int64)
    )


def coulomb(static: float, kinetic: float | None = None) -> Elements:
    """The rigid element of Coulomb friction alone: limits static and kinetic [N], kinetic as static without it.

    PatchfemError unless 0 <= kinetic <= static.
    """
    kinetic = static if kinetic is None else kinetic
    if not 0 <= kinetic <= static:
        raise PatchfemError("friction.kinetic: the value must lie between 0 and friction.static")
    none = frozen_array([])
    return Elements(none, none, frozen_array([], np.int64), float(static), float(kinetic))


def merged(parts: Elements, count: int = 2, first: int = 0) -> Elements:
    """Fewer elements: each `count` that yield one after the other as one of their stiffness and limit together, from
    the number `first` on, and those before it; of an odd number the last one stays."""
    k = parts.stiffness
    limit = parts.stiffness * parts.yield_displacement
    if not k.size:
        return parts
    last = k.size % 2
    begins = np.unique(
        np.r_[0, np.arange(first, k.size - last, count), [k.size - 1] * last]
    ).astype(int)
    stiff = np.add.reduceat(k, begins)
    # between those of its parts each new yield is, so they rise and differ: nothing to sort
    return Elements(
        frozen_array(stiff),
        frozen_array(np.add.reduceat(limit, begins) / stiff),
        frozen_array(np.arange(begins.size), np.int64),
    )


def cells_joined(count: int, first: int, stiffness, yield_displacement) -> tuple:
    """(stiffness [N/m], yield slide [m]) of elements (t,) each, `merged`."""
    one = merged(Elements(stiffness, yield_displacement, np.arange(stiffness.size)), count, first)
    return one.stiffness, one.yield_displacement


class Table(NamedTuple):
    """Elements of all interfaces (i) as the compiled loop takes them, t of the longest list.

    count: (i,); reach: (i, t) yield slides [m], infinite behind the last; and sums over the first j elements, j = 0 to
    t: stiff (i, t + 1) of k [N/m], limit of k y [N], twice of k y^2 [J]. static, kinetic: (i,) [N] limits of the rigid
    elements, 0 where there is none.
    """

    count: np.ndarray
    reach: np.ndarray
    stiff: np.ndarray
    limit: np.ndarray
    twice: np.ndarray
    static: np.ndarray
    kinetic: np.ndarray


def table_of(groups) -> Table:
    """The Table of Elements of every interface, in order."""
    most = max((one.stiffness.size for one in groups), default=0)
    reach = np.full((len(groups), most + 1), np.inf)
    sums = np.zeros((3, len(groups), most + 1))
    for i, one in enumerate(groups):
        k = one.stiffness
        y = one.yield_displacement
        reach[i, : y.size] = y
        for j, part in enumerate((k, k * y, k * y * y)):
            sums[j, i, 1 : y.size + 1] = np.cumsum(part)
            sums[j, i, y.size + 1 :] = sums[j, i, y.size]
    limits = np.array([(one.static, one.kinetic) for one in groups], float).reshape(-1, 2).T
    return Table(
        np.array([one.stiffness.size for one in groups], np.int64), reach, *sums, *limits.copy()
    )


class Memory(NamedTuple):
    """What the elements of all interfaces (i) remember.

    place: (i,) slide [m]; slipping: (i,) how many elements slip, the first of the sorted list; way: (i,) sign of their
    slip; the others keep their stretch since a turning point, in groups: depth (i,) groups, the innermost last; upto
    (i, t + 1) the elements before this number, from where the inner group ends; at (i, t + 1) [m] the slide at which a
    group stopped slipping; side (i, t + 1) the sign of that slip, 0 for elements that never slipped, unstretched at
    `at`. force [N], slip [m] (mean irreversible slide, weighted with k y), worked, lost [J]: (i,). head: (i,) of the
    rigid element the sign of its slip, 0 while it holds, twice the sign where it is at its limit while others hold the
    slide.
    """

    place: np.ndarray
    slipping: np.ndarray
    way: np.ndarray
    depth: np.ndarray
    upto: np.ndarray
    at: np.ndarray
    side: np.ndarray
    force: np.ndarray
    slip: np.ndarray
    worked: np.ndarray
    lost: np.ndarray
    head: np.ndarray


def virgin(table: Table, slide) -> Memory:
    """Memory of unstretched elements at slides (i,) [m]."""
    faces, wide = table.stiff.shape
    upto = np.zeros((faces, wide + 1), np.int64)
    upto[:, 0] = table.count
    at = np.zeros((faces, wide + 1))
    at[:, 0] = slide
    zero = [np.zeros(faces) for _ in range(6)]
    return Memory(
        np.array(slide, float),
        np.zeros(faces, np.int64),
        zero[0],
        np.ones(faces, np.int64),
        upto,
        at,
        np.zeros((faces, wide + 1)),
        *zero[1:],
    )


def books_begin(memory: Memory) -> Memory:
    """The same stretches with no work counted yet: for a run that begins here."""
    return memory._replace(worked=np.zeros_like(memory.worked), lost=np.zeros_like(memory.lost))


def stretches(group: Elements, memory: Memory, face: int) -> np.ndarray:
    """Stretch (a,) [m] of every element as given to `elements_of`, of the interface `face`; 0 where it carries
    nothing."""
    out = sorted_stretches(group, memory, face)
    return (
        np.where(group.rank >= 0, out[group.rank], 0.0) if out.size else np.zeros(group.rank.size)
    )


def sorted_stretches(group: Elements, memory: Memory, face: int) -> np.ndarray:
    """Stretch (t,) [m] of every element in the order of the yield slides, of the interface `face`."""
    out = np.zeros(group.yield_displacement.size)
    y = group.yield_displacement
    first = int(memory.slipping[face])
    out[:first] = memory.way[face] * y[:first]
    for k in range(int(memory.depth[face]) - 1, -1, -1):
        end = int(memory.upto[face, k])
        out[first:end] = (
            memory.side[face, k] * y[first:end] + memory.place[face] - memory.at[face, k]
        )
        first = end
    return out
