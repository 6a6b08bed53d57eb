"""Numbers of the laws of contact points, from the laws of `friction`."""

import numpy as np

from ..core import MIN_LOAD
from .rows import Law

MIN_LENGTH = 1e-30  # length [m] in place of no length, by which a stiffness is divided
# Number of each law, and the attributes of a law of `friction` in the order of its numbers; those with a star are per
# newton of load
POINT_LAWS = {
    "coulomb": (Law.COULOMB, "static* kinetic*"),
    "elastic-plastic": (Law.JENKINS, "static* length"),
    "tanh": (Law.TANH, "static* speed"),
    "iwan": (Law.MASING, "static* phi_max chi beta"),
    "bouc-wen": (Law.BOUC_WEN, "static* length exponent shape"),
    "lugre": (Law.LUGRE, "static* kinetic* stiffness* speed micro_damping* viscous*"),
    "nonlocal": (Law.BONDS, "static* length"),
}
# Columns of numbers of a point: its `Law`, and the numbers of the law that has most of them
N_NUMBERS = 1 + max(len(attributes.split()) for _, attributes in POINT_LAWS.values())


def list_point_law(name: str, law, load) -> list[float | np.ndarray]:
    """Return the numbers of a point under a law.

    Parameters
    ----------
    name : str
        Name of the law, `friction.law`, a key of `POINT_LAWS`.
    law : friction law per newton of load, or friction.bonds.parameters.Bonds
        Law as `friction.record.make_law` returns it. Its attributes are floats, or arrays (c,) of the values of c points.
    load : float or (c,) array
        Normal load [N].
    """
    kind, attributes = POINT_LAWS[name]
    numbers = [float(kind)] + [0.0] * (N_NUMBERS - 1)
    for column, attribute in enumerate(attributes.split(), 1):
        number = getattr(law, attribute.rstrip("*"))
        if attribute.endswith("*"):
            number = number * np.maximum(load, MIN_LOAD)
        numbers[column] = np.maximum(number, MIN_LENGTH) if attribute == "length" else number
    return numbers
