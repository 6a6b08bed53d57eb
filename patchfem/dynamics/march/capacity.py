"""Capacity for a list of bonds that grows: what a stretch of a run may change is kept, and where the list fills up the
stretch is gone through again with twice the capacity.

A contact without a list has all the capacity it needs; for it everything here does nothing.
"""

from typing import NamedTuple

import numpy as np

from ...core import Missing

MOST_STRIPS = 2_000_000  # entries of a list of bonds, beyond which a run is refused
ENTRY = 80  # bytes of one
CURE = "loosen accuracy.tail or accuracy.merge, or use reading = \"stretch\" with order = 1"


class Kept(NamedTuple):
    """Copies of arrays: the entries in use of a list of bonds, the other fields of its contact by name, and more that
    belong to the run."""

    entries: np.ndarray
    fields: dict
    others: tuple


def keep(contact, *others) -> Kept | None:
    """What to go back to, of a contact with a list of bonds and of other arrays; None of a contact without one."""
    if not hasattr(contact, "bondlist"):
        return None
    head, end = contact.tally[:2].astype(int)
    fields = {name: array.copy() for name, array in contact._asdict().items() if name != "bondlist"}
    return Kept(contact.bondlist[:, head:end].copy(), fields, tuple(array.copy() for array in others))


def lengthened(contact, kept: Kept, place: str, *others):
    """The contact as it was kept, with twice the capacity; the other arrays are set back in place.

    place: where the run stands, for the message. Missing beyond MOST_STRIPS entries.
    """
    rows, have = contact.bondlist.shape
    if have >= MOST_STRIPS:
        raise Missing(f"the bond list outgrew {have} entries ({have * ENTRY / 1e6:.0f} MB) {place}; {CURE}", "")
    for array, old in zip(others, kept.others):
        array[...] = old
    wider, size = np.zeros((rows, min(2 * have, MOST_STRIPS))), kept.entries.shape[1]
    wider[:, :size] = kept.entries
    tally = kept.fields["tally"].copy()
    tally[:2] = 0.0, size
    return contact._replace(**{name: array.copy() for name, array in kept.fields.items()} | {
        "bondlist": wider, "tally": tally})


def most_bytes(strips: float) -> float:
    """Memory [bytes] that a list of so many entries may take: while its room doubles the old one stands beside."""
    return 3 * ENTRY * min(strips, MOST_STRIPS)
