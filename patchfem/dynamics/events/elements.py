"""Parallel rigid and elastic-plastic friction elements of interfaces, and their hysteresis memory.

All elements share the relative displacement of their interface. The elastic-plastic ones are
sorted by yield slide, the stretch at which they slip.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...core import PatchfemError, frozen_array
from ...friction.cells import join_cells

# Largest relative difference of two yield displacements that are treated
# as equal; it exceeds round-off.
YIELD_TOL = 1e-14


@dataclass(frozen=True, eq=False, slots=True)
class Elements:
    """Parallel friction elements of one interface, whose total force is F = sum k_j e_j.

    The stretches obey |e_j| <= y_j. A rigid element (Coulomb friction) may act in parallel.

    - stiffness: (t,) k_j [N/m]
    - yield_displacement: (t,) y_j [m], in increasing order
    - rank: (a,) number of the element that each given element became part of; -1 for one without
      stiffness or yield slide, which carries nothing
    - static, kinetic: limits of the rigid element [N]; it holds the relative displacement until its
      reaction reaches `static` and then slips under `kinetic`; static = 0 stands for no rigid
      element
    """

    stiffness: np.ndarray
    yield_displacement: np.ndarray
    rank: np.ndarray
    static: float = 0.0
    kinetic: float = 0.0

    @property
    def limit(self) -> float:
        """Friction limit [N] of the elastic-plastic elements, sum k_j y_j."""
        return float(self.stiffness @ self.yield_displacement)


def make_elements(stiffness, yield_displacement) -> Elements:
    """Return elastic-plastic elements, sorted by increasing yield displacement.

    Elements with equal yield displacements become one.

    Parameters
    ----------
    stiffness, yield_displacement : array_like
        (a,) stiffness [N/m] and yield slide [m] in any order.

    Returns
    -------
    Elements

    Raises
    ------
    PatchfemError
        If a value is below 0 or not finite.
    """
    k = np.asarray(stiffness, float)
    y = np.asarray(yield_displacement, float)
    if not (np.isfinite(k).all() and np.isfinite(y).all() and (k >= 0).all() and (y >= 0).all()):
        raise PatchfemError(
            "friction: the stiffness and the yield slide of each element must be finite and >= 0"
        )
    # The general case would take 2.5 times as long for a single element.
    if k.size == 1 and k[0] > 0 and y[0] > 0:
        return Elements(frozen_array(k), frozen_array(y), frozen_array([0], np.int64))
    order = np.flatnonzero((k > 0) & (y > 0))
    order = order[np.argsort(y[order], kind="stable")]
    is_new = np.ones(order.size, bool)
    is_new[1:] = np.diff(y[order]) > YIELD_TOL * y[order][1:]
    first = np.flatnonzero(is_new)
    rank = np.full(k.size, -1, np.int64)
    rank[order] = np.cumsum(is_new) - 1
    merged = np.add.reduceat(k[order], first) if first.size else np.zeros(0)
    return Elements(
        frozen_array(merged), frozen_array(y[order][first]), frozen_array(rank, np.int64)
    )


def make_coulomb_elements(static: float, kinetic: float | None = None) -> Elements:
    """Return the rigid element for Coulomb friction with static and kinetic limits.

    Parameters
    ----------
    static : float
        Static limit [N].
    kinetic : float, optional
        Kinetic limit [N]; the static one by default.

    Returns
    -------
    Elements

    Raises
    ------
    PatchfemError
        Unless 0 <= kinetic <= static.
    """
    kinetic = static if kinetic is None else kinetic
    if not 0 <= kinetic <= static:
        raise PatchfemError("friction.kinetic: the value must lie between 0 and friction.static")
    none = frozen_array([])
    return Elements(none, none, frozen_array([], np.int64), float(static), float(kinetic))


def merge_elements(elements: Elements, count: int = 2, first: int = 0) -> Elements:
    """Merge neighbouring friction elements into fewer ones with equal total stiffness and limit.

    Parameters
    ----------
    elements : Elements
    count : int, optional
        Elements that become one, neighbours by yield slide.
    first : int, optional
        First element that is merged with those after it; those before it become one too. The last
        one of an odd number stays.

    Returns
    -------
    Elements
    """
    if not elements.stiffness.size:
        return elements
    stiffness, yield_slide = join_cells(
        count, first, elements.stiffness, elements.yield_displacement
    )
    return Elements(
        frozen_array(stiffness),
        frozen_array(yield_slide),
        frozen_array(np.arange(stiffness.size), np.int64),
    )


class ElementTable(NamedTuple):
    """Friction elements of all interfaces as padded arrays for the kernels.

    Interfaces are counted by i, elements of the interface with most elements by t.

    - n_elements: (i,) number of elements
    - yield_slide: (i, t + 1) [m], infinite after the last element
    - stiffness_sum, limit_sum, energy_sum: (i, t + 1) sums of k [N/m], k y [N] and k y^2 [J] over
      the first j elements
    - static_limit, kinetic_limit: (i,) limits of the rigid elements [N], 0 if there is none
    """

    n_elements: np.ndarray
    yield_slide: np.ndarray
    stiffness_sum: np.ndarray
    limit_sum: np.ndarray
    energy_sum: np.ndarray
    static_limit: np.ndarray
    kinetic_limit: np.ndarray


def make_element_table(groups) -> ElementTable:
    """Return the padded arrays of the friction elements of all interfaces."""
    longest = max((group.stiffness.size for group in groups), default=0)
    yield_slide = np.full((len(groups), longest + 1), np.inf)
    sums = np.zeros((3, len(groups), longest + 1))
    for i, group in enumerate(groups):
        k = group.stiffness
        y = group.yield_displacement
        yield_slide[i, : y.size] = y
        for j, part in enumerate((k, k * y, k * y * y)):
            sums[j, i, 1 : y.size + 1] = np.cumsum(part)
            sums[j, i, y.size + 1 :] = sums[j, i, y.size]
    limits = np.array([(group.static, group.kinetic) for group in groups], float)
    return ElementTable(
        np.array([group.stiffness.size for group in groups], np.int64),
        yield_slide,
        *sums,
        *limits.reshape(-1, 2).T.copy(),
    )


class Memory(NamedTuple):
    """Hysteresis memory of the friction elements of all interfaces.

    Interfaces are counted by i, elements by t.

    - slide: (i,) relative displacement [m]
    - n_slipping, direction: (i,) number of elements that slip, the first ones of the list, and the
      sign of their slip
    - n_groups: (i,) groups of elements that stopped together at a reversal, the innermost
      group last
    - group_end: (i, t + 2) end of a group in the list; it begins where the group inside it ends
    - group_slide, group_sign: (i, t + 2) relative displacement [m] at which a group stopped, and
      the sign of its slip before; the sign is 0 for elements that never slipped, which are
      unstretched at that displacement
    - force, slip: (i,) force [N], and mean slip [m] weighted with k y
    - work, loss: (i,) work done on the elements and energy that they dissipated [J]
    - rigid_state: (i,) sign of the slip of the rigid element, 0 in stick, and twice the sign where
      it is at its limit while other interfaces hold this relative displacement
    """

    slide: np.ndarray
    n_slipping: np.ndarray
    direction: np.ndarray
    n_groups: np.ndarray
    group_end: np.ndarray
    group_slide: np.ndarray
    group_sign: np.ndarray
    force: np.ndarray
    slip: np.ndarray
    work: np.ndarray
    loss: np.ndarray
    rigid_state: np.ndarray


def make_unstretched_memory(table: ElementTable, slide) -> Memory:
    """Return the memory of friction elements with zero stretch at relative displacements (i,) [m]."""
    n_interfaces, n_sums = table.stiffness_sum.shape
    shape = n_interfaces, n_sums + 1
    group_end = np.zeros(shape, np.int64)
    group_end[:, 0] = table.n_elements
    group_slide = np.zeros(shape)
    group_slide[:, 0] = slide
    return Memory(
        slide=np.array(slide, float),
        n_slipping=np.zeros(n_interfaces, np.int64),
        direction=np.zeros(n_interfaces),
        n_groups=np.ones(n_interfaces, np.int64),
        group_end=group_end,
        group_slide=group_slide,
        group_sign=np.zeros(shape),
        force=np.zeros(n_interfaces),
        slip=np.zeros(n_interfaces),
        work=np.zeros(n_interfaces),
        loss=np.zeros(n_interfaces),
        rigid_state=np.zeros(n_interfaces),
    )


def reset_work(memory: Memory) -> Memory:
    """Return a copy of the memory in which friction work and loss are 0."""
    return memory._replace(work=np.zeros_like(memory.work), loss=np.zeros_like(memory.loss))


def element_stretches(group: Elements, memory: Memory, interface: int) -> np.ndarray:
    """Return the stretch (a,) [m] of each friction element of an interface, in the order given.

    The order is that of the arguments of `make_elements`.

    Parameters
    ----------
    group : Elements
        Elements of the interface.
    memory : Memory
    interface : int

    Returns
    -------
    ndarray
        0 for an element that carries nothing.
    """
    stretches = sorted_stretches(group, memory, interface)
    if not stretches.size:
        return np.zeros(group.rank.size)
    return np.where(group.rank >= 0, stretches[group.rank], 0.0)


def sorted_stretches(group: Elements, memory: Memory, interface: int) -> np.ndarray:
    """Return the stretch (t,) [m] of each friction element, sorted by yield displacement.

    Parameters
    ----------
    group : Elements
        Elements of the interface.
    memory : Memory
    interface : int

    Returns
    -------
    ndarray
    """
    y = group.yield_displacement
    stretches = np.zeros(y.size)
    first = int(memory.n_slipping[interface])
    stretches[:first] = memory.direction[interface] * y[:first]
    for k in range(int(memory.n_groups[interface]) - 1, -1, -1):
        end = int(memory.group_end[interface, k])
        distance = memory.slide[interface] - memory.group_slide[interface, k]
        stretches[first:end] = memory.group_sign[interface, k] * y[first:end] + distance
        first = end
    return stretches
