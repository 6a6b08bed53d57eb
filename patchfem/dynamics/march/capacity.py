"""Capacity of bond lists that grow during a march.

The arrays that a part of a run may change are copied before it. If the list fills up, the part is repeated with twice
the capacity. A contact without a list has a fixed size; for it these functions do nothing.
"""

from typing import NamedTuple

import numpy as np

from ...core import Missing
from ...friction.bonds.list_numbers import enlarge_lists
from ...friction.bonds.list_rows_kernels import N_ROWS, STATUS
from ..interfaces.arrays import SlipStateIndex

# Largest number of entries of a bond list, which limits the memory of a run.
MAX_ENTRIES = 2_000_000
ENTRY_BYTES = 8 * N_ROWS
LONG_LIST_ADVICE = (
    'raise accuracy.tail or accuracy.merge, or use reading = "stretch" with order = 1'
)


class SavedState(NamedTuple):
    """Copies of the arrays of a run, from which a section of the march can be repeated.

    - `strips`: used entries of all lists of bonds, which follow each other.
    - `fields`: other arrays of the contact by name.
    - `others`: further arrays of the run.
    """

    strips: np.ndarray
    fields: dict
    others: tuple


def copy_state(contact, *others) -> SavedState | None:
    """Copy the arrays of a contact with a bond list, and further arrays of a run.

    The result is None if the contact has no list.
    """
    if not hasattr(contact, "bondlist"):
        return None
    fields = {name: array.copy() for name, array in contact._asdict().items() if name != "bondlist"}
    statuses = fields["statuses"] if "statuses" in fields else fields["status"][None]
    used = 2 + int((statuses[:, STATUS.end] - statuses[:, STATUS.head]).max())
    strips = enlarge_lists(contact.bondlist, statuses, used)
    return SavedState(strips, fields, tuple(array.copy() for array in others))


def is_full(contact) -> bool:
    """Return whether any bond list of a contact has reached its capacity.

    For a contact with a single list a full list is the only cause of a failed step.
    """
    return hasattr(contact, "bondlist") and (
        not hasattr(contact, "slip_state") or contact.slip_state[SlipStateIndex.IS_FULL] == 1.0
    )


def enlarge_list(contact, saved_state: SavedState, location: str, *others):
    """Restore a contact from saved copies and double the capacity of its bond list.

    The other arrays are restored in place.

    Parameters
    ----------
    contact : tuple
        Arrays of a contact with a list of bonds.
    saved_state : SavedState
    location : str
        Position of the run in the message, such as "at step 10".
    *others : ndarray
        Arrays that are restored in place, in the order of `saved_state.others`.
    """
    old_capacity = contact.bondlist.shape[1]
    if old_capacity >= MAX_ENTRIES:
        raise Missing(
            f"the bond list grew beyond {old_capacity} entries ({old_capacity * ENTRY_BYTES / 1e6:.0f} MB) {location}; "
            f"{LONG_LIST_ADVICE}",
            "",
        )
    for array, saved in zip(others, saved_state.others):
        array[...] = saved
    restored = contact._replace(
        **{name: array.copy() for name, array in saved_state.fields.items()}
    )
    statuses = restored.statuses if hasattr(restored, "statuses") else restored.status[None]
    capacity = min(2 * old_capacity, MAX_ENTRIES) // len(statuses)
    return restored._replace(bondlist=enlarge_lists(saved_state.strips, statuses, capacity))


def list_bytes(n_entries: float) -> float:
    """Return the memory [bytes] that a bond list takes, including its copy during enlargement."""
    return 3 * ENTRY_BYTES * min(n_entries, MAX_ENTRIES)
