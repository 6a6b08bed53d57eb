"""Record of the length and the stiffness of a contact, for patches with and without strips."""

from typing import NamedTuple


class EdgeValues(NamedTuple):
    """Contact length and contact stiffnesses, which depend on the contact edges.

    Each is a number, or (q,) for q patches.

    - length: length in contact [m]; the mean of strips.
    - width: distance between the first and the last end [m].
    - normal, tangential: stiffness [N/m].
    - rotational: stiffness [N m/rad].
    """

    length: float
    width: float
    normal: float
    tangential: float
    rotational: float
