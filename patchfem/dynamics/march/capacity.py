"""Capacity of a list of bonds that grows.

What a part of a run may change is copied before it. If the list fills up, the part is run again with twice the capacity. A
contact without a list has all the capacity that it needs; for it everything here does nothing.
"""

from typing import NamedTuple

import numpy as np

from ...core import Missing
from ...friction.bonds.list_rows_kernels import N_ROWS, STATUS
from ..interfaces.arrays import FlowPlace

MAX_ENTRIES = 2_000_000  # number of entries of a list of bonds beyond which a run is refused
ENTRY_BYTES = 8 * N_ROWS
REMEDY = 'raise accuracy.tail or accuracy.merge, or use reading = "stretch" with order = 1'


class SavedState(NamedTuple):
    """Copies of arrays of a run, from which a step is repeated.

    - `entries`: entries in use of every list of bonds.
    - `fields`: other arrays of the contact by name.
    - `others`: further arrays of the run.
    """

    entries: list
    fields: dict
    others: tuple


def copy_state(contact, *others) -> SavedState | None:
    """Return copies of a contact with a list of bonds and of other arrays.

    The result is None for a contact without a list.
    """
    if not hasattr(contact, "bondlist"):
        return None
    fields = {name: array.copy() for name, array in contact._asdict().items() if name != "bondlist"}
    entries = [
        contact.bondlist[:, head:end].copy()
        for head, end in _statuses(contact)[:, [STATUS.head, STATUS.end]].astype(int)
    ]
    return SavedState(entries, fields, tuple(array.copy() for array in others))


def _statuses(contact) -> np.ndarray:
    """Return the statuses (m, 16) of the lists of a contact."""
    return contact.statuses if hasattr(contact, "statuses") else contact.status[None]


def is_full(contact) -> bool:
    """Return whether a list of bonds of a contact is full.

    For a contact with a single list a full list is the only cause of a failed step.
    """
    return hasattr(contact, "bondlist") and (
        not hasattr(contact, "flow") or contact.flow[FlowPlace.IS_FULL] == 1.0
    )


def enlarge_list(contact, kept: SavedState, place: str, *others):
    """Restore a contact with twice the capacity of its list; other arrays are restored in place.

    Parameters
    ----------
    contact : tuple
        Arrays of a contact with a list of bonds.
    kept : SavedState
    place : str
        Where the run is, for the message.
    """
    rows, have = contact.bondlist.shape
    if have >= MAX_ENTRIES:
        raise Missing(
            f"the bond list grew beyond {have} entries ({have * ENTRY_BYTES / 1e6:.0f} MB) {place}; {REMEDY}",
            "",
        )
    for array, old in zip(others, kept.others):
        array[...] = old
    found = contact._replace(**{name: array.copy() for name, array in kept.fields.items()})
    statuses = _statuses(found)
    capacity = min(2 * have, MAX_ENTRIES) // len(statuses)
    wider = np.zeros((rows, capacity * len(statuses)))
    for j, (status, entries) in enumerate(zip(statuses, kept.entries)):
        status[STATUS.room_start] = status[STATUS.head] = j * capacity
        status[STATUS.room_end] = (j + 1) * capacity
        status[STATUS.end] = j * capacity + entries.shape[1]
        wider[:, j * capacity : j * capacity + entries.shape[1]] = entries
    return found._replace(bondlist=wider)


def list_bytes(strips: float) -> float:
    """Return the memory [bytes] of a list of bonds, with the copy that exists while it is enlarged."""
    return 3 * ENTRY_BYTES * min(strips, MAX_ENTRIES)
