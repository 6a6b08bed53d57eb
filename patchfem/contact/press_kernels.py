"""Compiled search for the contact set under a rigid displacement of the holder.

On each set forces and gaps are affine in the motion. The motion is measured from a reference state:
closing d [m] and rotation t [rad]. The unknowns y of a set are the forces of its nodes in contact and
the gaps of the others. The linear complementarity problem w = b + t x - d + C f then reads
y = R (1, d, t). A node that enters or leaves the set is a principal pivot of the tableau [T | R].

A set is stored under a 64-bit hash, the exclusive or of the hashes of its nodes, so a state on a stored
set costs one pass over the nodes. The search exchanges all nodes of a wrong sign at once (block
pivoting), and after `N_BLOCK_EXCHANGES` sets only the first of them, which ends for every positive
definite C (Murty, Opsearch 11, 1974). `sets` is a `set_arrays.SetArrays`, `slot` the slot of a stored
set.
"""

from typing import NamedTuple

from ..kernel_cache.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from ..kernel_cache.jit import njit
from .set_arrays import (
    MAX_OPENING_INDEX,
    OLDEST_SLOT_INDEX,
    PRESENT_SLOT_INDEX,
    REFERENCE_ENERGY_INDEX,
    REFERENCE_LOAD_INDEX,
    REFERENCE_MOMENT_INDEX,
    STORED_COUNT_INDEX,
    EnergyTerm,
)

# Fast-math flags with which the compiler vectorizes loops that search for a minimum
FASTMATH_MINIMUM_SEARCH_FLAGS = FASTMATH_FLAGS | {"nnan", "nsz"}
# Largest number of sets for which all violating nodes are exchanged at once; beyond it the
# exchanges may cycle
N_BLOCK_EXCHANGES = 12
# Rounding error of a force or gap, relative to the largest of its terms
CONDITION_ROUND_OFF = 1e-13
# Largest relative residual for which the tableau is not recomputed; one refinement then reduces it
# to rounding errors
MAX_TABLEAU_RESIDUAL = 1e-8
# Smallest relative residual for which the tableau is refined; smaller ones are round-off
MIN_TABLEAU_RESIDUAL = 1e-15


class ContactBounds(NamedTuple):
    """Force [N] and gap [m] below which a node violates its contact condition.

    Both are <= 0, to allow for the rounding error of a force and of a gap.

    - min_force: force [N] of a node in contact below which it leaves the set.
    - min_gap: gap [m] of an open node below which it enters the set.
    """

    min_force: float
    min_gap: float


class ContactEnergy(NamedTuple):
    """Energy of a preloaded contact and its derivatives.

    - value: energy [J].
    - heave_slope: derivative [N] by the heave, the rigid displacement that opens the contact.
    - rotation_slope: derivative [N m] by the rotation.
    """

    value: float
    heave_slope: float
    rotation_slope: float


class PressedState(NamedTuple):
    """Load [N], moment [N m] and energy [J] of a contact at a rigid displacement."""

    load: float
    moment: float
    energy: float


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def pivot(sets, k):
    """Exchange force and gap of node k in the tableau (a principal pivot), in place.

    The tableau gives the unknowns of all nodes: the force [N] of a node in contact, the gap [m] of another one. Its
    first m columns are the coefficients of the other variable of each node, which is 0 in the solution. The last three
    are those of 1, of the closing d and of the rotation t. Node k enters or leaves the contact set. Cost: m^2
    multiplications.

    Parameters
    ----------
    sets : set_arrays.SetArrays
        `tableau.values` (m, m + 3) and `tableau.in_contact` (m,) are changed.
    k : int
        Node.

    Returns
    -------
    bool
        False, without any change, if the diagonal entry is not positive, as rounding errors may cause.
    """
    values = sets.tableau.values
    row = sets.tableau.row
    n_nodes, width = values.shape
    diagonal = values[k, k]
    if not diagonal > 0:
        return False

    # Row k is solved for the other variable of the node, which is then eliminated from the other rows
    for j in range(width):
        row[j] = values[k, j] / diagonal
    for i in range(n_nodes):
        factor = values[i, k]
        if i == k or factor == 0.0:
            continue
        line = values[i]
        for j in range(width):
            line[j] -= factor * row[j]
        line[k] = factor / diagonal

    for j in range(width):
        values[k, j] = -row[j]
    values[k, k] = 1 / diagonal
    sets.tableau.in_contact[k] = not sets.tableau.in_contact[k]
    return True


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def reset_tableau(sets):
    """Initialize the tableau of `sets` for the empty contact set: gaps w = C f + opening - d + x t.

    C [m/N] is the compliance, and opening [m] that of the reference state without forces.
    """
    values = sets.tableau.values
    n_nodes = sets.x.size
    for i in range(n_nodes):
        for j in range(n_nodes):
            values[i, j] = sets.compliance[i, j]
        values[i, n_nodes] = sets.opening[i]
        values[i, n_nodes + 1] = -1.0
        values[i, n_nodes + 2] = sets.x[i]
        sets.tableau.in_contact[i] = False


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def _multiply(line, vector):
    """Return the product of the first m entries of a row `line` with a vector (m,)."""
    total = 0.0
    for j in range(vector.size):
        total += line[j] * vector[j]
    return total


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def _refine_column(sets, column):
    """Improve one of the last three columns of the tableau by a step of iterative refinement.

    The column gives the forces [N] of the nodes in contact and the gaps [m] of the others per unit of 1, of the closing
    d or of the rotation t. The gaps that these forces leave in contact are computed anew from the compliance. They
    should be 0.

    Parameters
    ----------
    sets : set_arrays.SetArrays
        `tableau.values` (m, m + 3) is changed. `forces` and `residuals` (m,) of the tableau are workspaces.
    column : int
        0, 1 or 2 for the column of 1, d or t.

    Returns
    -------
    float
        Largest gap in contact before the step, relative to the largest term of a gap.
    """
    n_nodes = sets.x.size
    values = sets.tableau.values
    in_contact = sets.tableau.in_contact
    forces = sets.tableau.forces
    residuals = sets.tableau.residuals
    for i in range(n_nodes):
        forces[i] = values[i, n_nodes + column] if in_contact[i] else 0.0
        residuals[i] = 0.0

    # Openings of all nodes under the forces of the set, w = opening - d + x t + C f. They vanish in contact, up to the
    # residual, and are the unknowns of the other nodes.
    scale = 0.0
    error = 0.0
    for i in range(n_nodes):
        given = sets.opening[i]
        if column > 0:
            given = -1.0 if column == 1 else sets.x[i]
        displacement = _multiply(sets.compliance[i], forces)
        scale = max(scale, abs(displacement), abs(given))
        if in_contact[i]:
            residuals[i] = displacement + given
            error = max(error, abs(residuals[i]))
        else:
            values[i, n_nodes + column] = displacement + given

    # One step of iterative refinement: the tableau is nearly the inverse of the equations, so its product with the
    # residuals corrects the column
    residual = error / scale if scale > 0 else 0.0
    if residual > MIN_TABLEAU_RESIDUAL:
        for i in range(n_nodes):
            values[i, n_nodes + column] -= _multiply(values[i], residuals)
    return residual


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def refine_columns(sets):
    """Improve the columns of 1, d and t of the tableau of `sets` by one step of iterative refinement.

    Returns the largest residual before the step, relative to the largest term of its column.
    """
    residual = 0.0
    for column in range(3):
        residual = max(residual, _refine_column(sets, column))
    return residual


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def take_slot(sets):
    """Return the row in `sets.stored` for a new contact set, its slot.

    It is a free one, or that of the oldest set other than the present one, which also leaves the list of sets of equal
    hash.
    """
    stored = sets.stored
    n_slots = stored.hashes.size
    slot = sets.counters[STORED_COUNT_INDEX]
    if slot < n_slots:
        sets.counters[STORED_COUNT_INDEX] += 1
        return slot

    # Every trial of a step starts from the present set, which is therefore kept
    slot = sets.counters[OLDEST_SLOT_INDEX]
    if slot == sets.counters[PRESENT_SLOT_INDEX]:
        slot = (slot + 1) % n_slots
    sets.counters[OLDEST_SLOT_INDEX] = (slot + 1) % n_slots

    # The set that the slot holds leaves the chain of its hash
    bucket = stored.hashes[slot] & (stored.heads.size - 1)
    k = stored.heads[bucket]
    if k == slot:
        stored.heads[bucket] = stored.links[slot]
        return slot
    while stored.links[k] != slot:
        k = stored.links[k]
    stored.links[k] = stored.links[slot]
    return slot


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def store_set(sets, set_hash):
    """Store the contact set to which the tableau is pivoted.

    Parameters
    ----------
    sets : set_arrays.SetArrays
        Its `stored` gets the nodes in contact (m,), forces [N] or gaps [m] of all nodes per unit of 1, of the closing
        d and of the rotation t (3, m), and the six coefficients of the energy [J] as a quadratic function of d and t
        (`EnergyTerm`).
    set_hash : int
        64-bit hash of the set.

    Returns
    -------
    int
        Slot of the set: its row in these arrays.
    """
    stored = sets.stored
    values = sets.tableau.values
    n_nodes = sets.x.size
    slot = take_slot(sets)

    # Energy beyond that of the reference state and the work of its forces: E - E0 - N0 d + M0 t
    energy = stored.energy[slot]
    energy[:] = 0.0
    energy[EnergyTerm.CONSTANT] = -sets.reference[REFERENCE_ENERGY_INDEX]
    energy[EnergyTerm.BY_D] = -sets.reference[REFERENCE_LOAD_INDEX]
    energy[EnergyTerm.BY_T] = sets.reference[REFERENCE_MOMENT_INDEX]

    # Unknowns of every node. The forces f = constant + by_d d + by_t t give E = -f . (opening - d + x t)/2, of which
    # each coefficient is a sum over the nodes in contact, since C is symmetric.
    for i in range(n_nodes):
        constant = values[i, n_nodes]
        by_d = values[i, n_nodes + 1]
        by_t = values[i, n_nodes + 2]
        stored.unknowns[slot, 0, i] = constant
        stored.unknowns[slot, 1, i] = by_d
        stored.unknowns[slot, 2, i] = by_t
        stored.in_contact[slot, i] = sets.tableau.in_contact[i]
        if sets.tableau.in_contact[i]:
            energy[EnergyTerm.CONSTANT] -= 0.5 * constant * sets.opening[i]
            energy[EnergyTerm.BY_D] += constant
            energy[EnergyTerm.BY_T] -= constant * sets.x[i]
            energy[EnergyTerm.BY_DD] += by_d
            energy[EnergyTerm.BY_DT] += 0.5 * (by_t - by_d * sets.x[i])
            energy[EnergyTerm.BY_TT] -= by_t * sets.x[i]

    # The set becomes the first one in the chain of its hash
    stored.hashes[slot] = set_hash
    bucket = set_hash & (stored.heads.size - 1)
    stored.links[slot] = stored.heads[bucket]
    stored.heads[bucket] = slot
    return slot


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def pivot_to_target(sets):
    """Pivot the tableau to its target contact set; return False if a pivot is not positive.

    Every node of `sets` whose contact differs from that in `tableau.target` is exchanged.
    """
    tableau = sets.tableau
    for i in range(sets.x.size):
        if tableau.in_contact[i] != tableau.target[i] and not pivot(sets, i):
            return False
    return True


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def build_set(sets, set_hash):
    """Pivot the tableau to its target contact set, store the set, and return its slot.

    If the tableau has lost its digits, it is computed anew and pivoted once more. The slot is -1 if the compliance is
    not positive definite on the set. Cost: m^2 multiplications for each node that is exchanged. `set_hash` is the 64-bit
    hash of the set.
    """
    if not pivot_to_target(sets) or refine_columns(sets) > MAX_TABLEAU_RESIDUAL:
        reset_tableau(sets)
        if not pivot_to_target(sets) or refine_columns(sets) > MAX_TABLEAU_RESIDUAL:
            return -1
    return store_set(sets, set_hash)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def find_stored(sets, set_hash):
    """Return the slot in which the target contact set is stored, or -1.

    Parameters
    ----------
    sets : set_arrays.SetArrays
        Preloaded interface with its stored contact sets.
    set_hash : int
        Hash of the target set. Different sets may have equal hashes, so that sets are also compared node by node.

    Returns
    -------
    int
    """
    stored = sets.stored
    slot = stored.heads[set_hash & (stored.heads.size - 1)]
    while slot >= 0:
        if stored.hashes[slot] == set_hash:
            is_equal = True
            for i in range(sets.x.size):
                if stored.in_contact[slot, i] != sets.tableau.target[i]:
                    is_equal = False
                    break
            if is_equal:
                return slot
        slot = stored.links[slot]
    return slot


@njit(error_model="numpy", fastmath=FASTMATH_MINIMUM_SEARCH_FLAGS, **NJIT_NO_REFCOUNT)
def check_contact_conditions(sets, slot, d, t):
    """Check whether a set meets the contact conditions at a rigid displacement (d, t).

    In `sets.stored` the set has the force [N] of each node in contact, and the gap [m] of each other one, as constant
    + by_d d + by_t t. Both must be >= 0, but for rounding errors.

    Parameters
    ----------
    sets : set_arrays.SetArrays
        Preloaded interface with its stored contact sets.
    slot : int
        Slot of the contact set.
    d, t : float
        Displacement [m] and rotation [rad] of the holder.

    Returns
    -------
    holds : bool
        Whether no force and no gap lies below its bound.
    bounds : ContactBounds
        Bounds for the rounding errors at this displacement.
    """
    constant = sets.stored.unknowns[slot, 0]
    by_d = sets.stored.unknowns[slot, 1]
    by_t = sets.stored.unknowns[slot, 2]
    in_contact = sets.stored.in_contact[slot]

    # The conditions are force >= 0 in contact and gap >= 0 outside, up to the round-off of the largest terms.
    scale = 0.0
    smallest_force = 0.0
    smallest_gap = 0.0
    for i in range(in_contact.size):
        value = constant[i] + by_d[i] * d + by_t[i] * t
        term = abs(constant[i]) + abs(by_d[i] * d) + abs(by_t[i] * t)
        scale = max(scale, term if in_contact[i] else 0.0)
        smallest_force = min(smallest_force, value if in_contact[i] else 0.0)
        smallest_gap = min(smallest_gap, 0.0 if in_contact[i] else value)

    min_force = -CONDITION_ROUND_OFF * scale
    arm = max(abs(sets.x[0]), abs(sets.x[-1]))
    min_gap = -CONDITION_ROUND_OFF * (sets.reference[MAX_OPENING_INDEX] + abs(d) + abs(t) * arm)
    holds = smallest_force >= min_force and smallest_gap >= min_gap
    return holds, ContactBounds(min_force, min_gap)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def exchange_violating_nodes(sets, slot, d, t, bounds, is_single):
    """Write to `sets.tableau.target` a stored contact set in which the violating nodes are exchanged.

    A node in contact whose force is below `bounds.min_force` leaves the set, and an open node whose gap is below
    `bounds.min_gap` enters it.

    Force [N] and gap [m] are linear in the displacement: the coefficients of 1, d and t are stored with the set. The
    hash of a set is the exclusive or of the hashes of its nodes.

    Parameters
    ----------
    sets : set_arrays.SetArrays
        Preloaded interface with its stored contact sets; its target is overwritten.
    slot : int
        Slot of the stored contact set.
    d, t : float
        Displacement [m] and rotation [rad] of the holder.
    bounds : ContactBounds
        Force and gap below which a node violates its condition.
    is_single : bool
        Whether only the first violating node is exchanged.

    Returns
    -------
    int
        Hash of the new set, by which `find_stored` looks it up.
    """
    stored = sets.stored
    set_hash = stored.hashes[slot]
    is_searching = True
    for i in range(sets.x.size):
        in_contact = stored.in_contact[slot, i]
        value = stored.unknowns[slot, 0, i] + stored.unknowns[slot, 1, i] * d
        value += stored.unknowns[slot, 2, i] * t
        is_violated = is_searching and value < (bounds.min_force if in_contact else bounds.min_gap)
        if is_violated:
            set_hash ^= stored.node_hashes[i]
            is_searching = not is_single
        sets.tableau.target[i] = in_contact != is_violated
    return set_hash


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def find_set(sets, slot, d, t):
    """Find the contact set at a rigid displacement, starting from a neighbouring set.

    For 400 nodes this takes 1 us on a known set, and 0.3 ms for a new set that differs by one node.

    Each step checks the conditions of a set (forces and gaps >= 0) at the displacement, exchanges the nodes that
    violate them, and looks up the resulting set, or computes and stores it.

    Parameters
    ----------
    sets : set_arrays.SetArrays
        Preloaded interface with its stored contact sets.
    slot : int
        Slot of the first set.
    d, t : float
        Displacement [m] and rotation [rad].

    Returns
    -------
    int
        Slot of the contact set, -1 if none is found.
    """
    for count in range(N_BLOCK_EXCHANGES + 10 * sets.x.size):
        holds, bounds = check_contact_conditions(sets, slot, d, t)
        if holds:
            return slot
        is_single = count >= N_BLOCK_EXCHANGES
        set_hash = exchange_violating_nodes(sets, slot, d, t, bounds, is_single)
        slot = find_stored(sets, set_hash)
        if slot < 0:
            slot = build_set(sets, set_hash)
        if slot < 0:
            return slot
    return -1


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def build_first_set(sets, set_hash):
    """Compute the target contact set from an empty tableau, and return its slot.

    The slot is -1 if the compliance is not positive definite on the set.

    Parameters
    ----------
    sets : set_arrays.SetArrays
        Preloaded interface with its stored contact sets.
    set_hash : int
        Hash of the target set.
    """
    reset_tableau(sets)
    return build_set(sets, set_hash)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def compute_energy(sets, slot, heave, rotation):
    """Compute the energy of a preloaded contact, and its derivatives, for a contact set.

    The load of the contact is the load at rest less the slope of the energy in heave, and its moment that at rest less
    the slope in rotation.

    Parameters
    ----------
    sets : set_arrays.SetArrays
        Preloaded interface with its stored contact sets.
    slot : int
        Slot of the contact set.
    heave, rotation : float
        Motion of the holder from rest: heave [m], positive where the pieces separate, and rotation [rad].

    Returns
    -------
    ContactEnergy
    """
    energy = sets.stored.energy[slot]
    d = -heave
    linear_d = energy[EnergyTerm.BY_D]
    linear_t = energy[EnergyTerm.BY_T]
    coupling = energy[EnergyTerm.BY_DT]
    by_d = energy[EnergyTerm.BY_DD] * d + coupling * rotation
    by_t = coupling * d + energy[EnergyTerm.BY_TT] * rotation
    value = energy[EnergyTerm.CONSTANT] + d * (linear_d + 0.5 * by_d)
    value += rotation * (linear_t + 0.5 * by_t)
    return ContactEnergy(value, -(linear_d + by_d), linear_t + by_t)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def press_state(sets, slot, d, t, force):
    """Compute load, moment, energy and forces of a contact at a rigid displacement.

    The forces follow from the coefficients of 1, d and t that are stored with the set, and load and moment from the
    slopes of the energy.

    Parameters
    ----------
    sets : set_arrays.SetArrays
        Preloaded interface with its stored contact sets.
    slot : int
        Slot of the contact set.
    d, t : float
        Motion [m] and [rad].
    force : (m,) ndarray
        Nodal forces [N] >= 0, written.

    Returns
    -------
    PressedState
    """
    energy = compute_energy(sets, slot, -d, t)
    unknowns = sets.stored.unknowns
    for i in range(force.size):
        value = unknowns[slot, 0, i] + unknowns[slot, 1, i] * d + unknowns[slot, 2, i] * t
        force[i] = max(value, 0.0) if sets.stored.in_contact[slot, i] else 0.0
    load = sets.reference[REFERENCE_LOAD_INDEX] - energy.heave_slope
    moment = sets.reference[REFERENCE_MOMENT_INDEX] - energy.rotation_slope
    return PressedState(load, moment, energy.value)
