"""Record of the extent and the stiffness of a contact, for patches of any kind."""

from typing import NamedTuple


class EdgeValues(NamedTuple):
    """Quantities that depend on where a contact ends, numbers or (q,).

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
