"""Record of contact length and contact stiffnesses, for patches with and without strips."""

from typing import NamedTuple


class EdgeValues(NamedTuple):
    """Contact length and contact stiffnesses, which depend on the positions of the contact edges.

    Each field is a number, or (q,) for q patches.

    - length: length in contact [m]; the mean over the strips.
    - width: distance between the outermost contact edges [m].
    - normal, tangential: stiffnesses [N/m].
    - rotational: stiffness [N m/rad].
    """

    length: float
    width: float
    normal: float
    tangential: float
    rotational: float
