"""Records of arrays in which the compiled search stores contact sets.

`press_kernels` searches for contact sets, and `press_path_kernels` follows a motion from set to set.
"""

from enum import IntEnum
from typing import NamedTuple

import numpy as np

REFERENCE_LOAD_INDEX = 0  # index into `SetArrays.reference` of the load of the reference state [N]
# Index into `SetArrays.reference` of the moment of the reference state about x = 0 [N m]
REFERENCE_MOMENT_INDEX = 1
# Index into `SetArrays.reference` of the elastic energy of the reference state [J]
REFERENCE_ENERGY_INDEX = 2
# Index into `SetArrays.reference` of the largest magnitude of the openings [m]
MAX_OPENING_INDEX = 3
STORED_COUNT_INDEX = 0  # index into `SetArrays.counters` of the number of stored sets
OLDEST_SLOT_INDEX = 1  # index into `SetArrays.counters` of the slot that is replaced next
# Index into `SetArrays.counters` of the slot of the present contact set, -1 if none is found
PRESENT_SLOT_INDEX = 2


class EnergyTerm(IntEnum):
    """Indices of the coefficients of 1, d, t, d^2/2, d t and t^2/2 of the energy [J] in `StoredSets.energy`."""

    CONSTANT = 0
    BY_D = 1
    BY_T = 2
    BY_DD = 3
    BY_DT = 4
    BY_TT = 5


class PathMean(IntEnum):
    """Indices of the results of `press_path_kernels.path_mean`.

    - HEAVE, ROTATION: slopes of the energy by heave [N] and rotation [N m], averaged over the increment
    - END_ENERGY, END_HEAVE, END_ROTATION: energy [J] and its slopes at the end of the increment
    - HEAVE_BY_HEAVE to ROTATION_BY_ROTATION: derivatives of both means by the increments
    """

    HEAVE = 0
    ROTATION = 1
    END_ENERGY = 2
    END_HEAVE = 3
    END_ROTATION = 4
    HEAVE_BY_HEAVE = 5
    HEAVE_BY_ROTATION = 6
    ROTATION_BY_HEAVE = 7
    ROTATION_BY_ROTATION = 8


class Tableau(NamedTuple):
    """Tableau [T | R] of the linear complementarity problem, pivoted to one contact set.

    - values (m, m + 3): T, then the columns R of 1, d and t.
    - in_contact (m,): nodes of the set to which it is pivoted.
    - target (m,): nodes of the set that is searched for.
    - row (m + 3,), forces (m,) and residuals (m,): workspaces.
    """

    values: np.ndarray
    in_contact: np.ndarray
    target: np.ndarray
    row: np.ndarray
    forces: np.ndarray
    residuals: np.ndarray


class StoredSets(NamedTuple):
    """Contact sets in k slots, which are looked up by 64-bit hashes.

    The hash of a set is the exclusive or of the hashes of its nodes. The sets whose hashes have the same last bits form a
    chain: `heads` has its first slot, at the index of these bits, and `links` the slot that follows each slot; -1 ends it.

    - in_contact (k, m): nodes in contact.
    - unknowns (k, 3, m): force [N] of nodes in contact and gap [m] of the others per (1, d, t).
    - energy (k, 6): coefficients of the energy of the preloaded contact, in the order of `EnergyTerm`.
    - hashes (k,): hashes of the sets; node_hashes (m,): hashes of the nodes.
    - heads (2^n,), links (k,): chains of the sets, 2^n > k.
    """

    in_contact: np.ndarray
    unknowns: np.ndarray
    energy: np.ndarray
    hashes: np.ndarray
    node_hashes: np.ndarray
    heads: np.ndarray
    links: np.ndarray


class SetArrays(NamedTuple):
    """Arrays for a preloaded interface, for its stored contact sets and for the search for them.

    - compliance (m, m) [m/N]; x (m,) [m].
    - opening (m,): openings of the reference state without forces [m].
    - reference (4,): properties of the reference state, from `REFERENCE_LOAD_INDEX` to `MAX_OPENING_INDEX`.
    - tableau, stored: see there.
    - counters (3,): from `STORED_COUNT_INDEX` to `PRESENT_SLOT_INDEX`.
    """

    compliance: np.ndarray
    x: np.ndarray
    opening: np.ndarray
    reference: np.ndarray
    tableau: Tableau
    stored: StoredSets
    counters: np.ndarray


def _make_node_hashes(count: int) -> np.ndarray:
    """Return integers (count,) that look random: the generator SplitMix64 (numpy.random takes long to import)."""
    hashes = np.arange(1, count + 1, dtype=np.uint64) * np.uint64(0x9E3779B97F4A7C15)
    hashes = (hashes ^ (hashes >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    hashes = (hashes ^ (hashes >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return (hashes ^ (hashes >> np.uint64(31))).astype(np.int64)


def make_set_arrays(compliance, x, opening, reference, in_contact, n_slots: int) -> SetArrays:
    """Return the arrays for a search for contact sets, in which no set is stored yet.

    Parameters
    ----------
    compliance : (m, m) ndarray
        Compliance [m/N] of the interface.
    x, opening : (m,) ndarray
        Positions, and openings of the reference state without forces [m].
    reference : (4,) sequence of float
        Properties of the reference state, from `REFERENCE_LOAD_INDEX` to `MAX_OPENING_INDEX`.
    in_contact : (m,) bool ndarray
        Contact set of the reference state, the first target of the search.
    n_slots : int
        Number of contact sets that can be stored.

    Returns
    -------
    SetArrays
    """
    m = x.size
    tableau = Tableau(
        values=np.zeros((m, m + 3)),
        in_contact=np.zeros(m, bool),
        target=in_contact.copy(),
        row=np.zeros(m + 3),
        forces=np.zeros(m),
        residuals=np.zeros(m),
    )

    # The heads of the hash chains are a power of 2 above the number of slots, so that a chain has at most one set on average
    stored = StoredSets(
        in_contact=np.zeros((n_slots, m), bool),
        unknowns=np.zeros((n_slots, 3, m)),
        energy=np.zeros((n_slots, len(EnergyTerm))),
        hashes=np.zeros(n_slots, np.int64),
        node_hashes=_make_node_hashes(m),
        heads=np.full(1 << n_slots.bit_length(), -1, np.int64),
        links=np.zeros(n_slots, np.int64),
    )

    return SetArrays(
        compliance.copy(),
        x.copy(),
        opening.copy(),
        np.array(reference, float),
        tableau,
        stored,
        np.zeros(3, np.int64),
    )


def hash_set(sets: SetArrays, in_contact) -> int:
    """Return the 64-bit hash of the contact set of the nodes `in_contact` (m,) of bool.

    It is the exclusive or of the hashes of these nodes.
    """
    return int(np.bitwise_xor.reduce(sets.stored.node_hashes[in_contact], initial=0))
