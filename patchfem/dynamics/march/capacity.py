"""Capacity for a list of bonds that grows: what a stretch of a run may change is kept, and where the list fills up the
stretch is gone through again with twice the capacity.

A contact without a list has all the capacity it needs; for it everything here does nothing.
"""

from typing import NamedTuple

import numpy as np

from ...core import Missing
from ...friction.bonds.list_rows_kernels import N_ROWS, STATUS

MOST_STRIPS = 2_000_000  # entries of a list of bonds, beyond which a run is refused
ENTRY = 8 * N_ROWS  # bytes of one
CURE = 'raise accuracy.tail or accuracy.merge, or use reading = "stretch" with order = 1'


class Kept(NamedTuple):
    """Copies of arrays: the entries in use of every list of bonds, the other fields of their contact by name, and more
    that belong to the run."""

    entries: list
    fields: dict
    others: tuple


def keep(contact, *others) -> Kept | None:
    """What to go back to, of a contact with a list of bonds and of other arrays; None of a contact without one."""
    if not hasattr(contact, "bondlist"):
        return None
    fields = {name: array.copy() for name, array in contact._asdict().items() if name != "bondlist"}
    entries = [
        contact.bondlist[:, head:end].copy()
        for head, end in _statuses(contact)[:, [STATUS.head, STATUS.end]].astype(int)
    ]
    return Kept(entries, fields, tuple(array.copy() for array in others))


def _statuses(contact) -> np.ndarray:
    """The statuses (m, 16) of the lists of a contact."""
    return contact.statuses if hasattr(contact, "statuses") else contact.status[None]


def full(contact) -> bool:
    """Whether a list of a contact has no room; a single one misses nothing else."""
    return hasattr(contact, "bondlist") and (not hasattr(contact, "flow") or contact.flow[0] == 1.0)


def lengthened(contact, kept: Kept, place: str, *others):
    """The contact as it was kept, with twice the capacity; the other arrays are set back in place.

    place: where the run stands, for the message. Missing beyond MOST_STRIPS entries.
    """
    rows, have = contact.bondlist.shape
    if have >= MOST_STRIPS:
        raise Missing(
            f"the bond list grew beyond {have} entries ({have * ENTRY / 1e6:.0f} MB) {place}; {CURE}",
            "",
        )
    for array, old in zip(others, kept.others):
        array[...] = old
    found = contact._replace(**{name: array.copy() for name, array in kept.fields.items()})
    statuses = _statuses(found)
    capacity = min(2 * have, MOST_STRIPS) // len(statuses)
    wider = np.zeros((rows, capacity * len(statuses)))
    for j, (status, entries) in enumerate(zip(statuses, kept.entries)):
        status[STATUS.room_start] = status[STATUS.head] = j * capacity
        status[STATUS.room_end] = (j + 1) * capacity
        status[STATUS.end] = j * capacity + entries.shape[1]
        wider[:, j * capacity : j * capacity + entries.shape[1]] = entries
    return found._replace(bondlist=wider)


def most_bytes(strips: float) -> float:
    """Memory [bytes] that a list of so many entries may take: while its room doubles the old one stands beside."""
    return 3 * ENTRY * min(strips, MOST_STRIPS)
