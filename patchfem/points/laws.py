"""Numbers and first memory of the laws of contact points, from keys of a scene or from parameters."""

from typing import NamedTuple

import numpy as np

from ..core import MIN_LOAD, PatchfemError
from ..friction.bonds.parameters import Bonds, growth_numbers
from .law_rows import Law, Masing

N_NUMBERS = 10  # rows of numbers of a point
N_MEMORY = 6  # rows of memory of a point, without a stack of reversals
# Nested reversals that parallel sliders remember. A decay by 3 % from one to the next has reached 2e-7 of its start. After
# decays of 1000 to 5000 reversals, forces of a motion that grows again are wrong by up to 4e-3 of the limit.
REVERSALS = 512
MIN_LENGTH = 1e-30  # length [m] in place of no length, by which a stiffness is divided
# Number of each law whose rows are attributes of the law of `friction.laws`, and these attributes in the order of the rows
PLAIN_LAWS = {
    "coulomb": (Law.COULOMB, "static kinetic"),
    "tanh": (Law.TANH, "static speed"),
    "bouc-wen": (Law.BOUC_WEN, "static length exponent shape"),
    "lugre": (Law.LUGRE, "static kinetic stiffness speed micro_damping viscous"),
}


class PointLaw(NamedTuple):
    """Law of a contact point, or of c points with numbers that differ.

    - numbers (10,) or (10, c), memory (m,) or (m, c): see `return_maps_kernels`
    - load: normal load [N] per which the numbers are, a float or (c,)
    """

    numbers: np.ndarray
    memory: np.ndarray
    load: float | np.ndarray


def _pack(law: Law, numbers, memory=(), load=1.0, n_memory: int = N_MEMORY) -> PointLaw:
    """Return a PointLaw whose other numbers and memory are 0.

    The `numbers` follow the law in the rows of `PointLaw.numbers`, `memory` has the first values of the state of the
    law, which has `n_memory` rows, and `load` [N] is the normal load. The entries of numbers and memory are floats, or
    arrays (c,) with a value for each of c points.
    """
    shape = np.broadcast_shapes(np.shape(load), *map(np.shape, (*numbers, *memory)))
    rows = np.zeros((N_NUMBERS, *shape))
    state = np.zeros((n_memory, *shape))
    for row, number in enumerate((law, *numbers)):
        rows[row] = number
    for row, number in enumerate(memory):
        state[row] = number
    return PointLaw(rows, state, load)


def make_jenkins(static: float, length: float, load: float = 1.0) -> PointLaw:
    """Return an elastic-plastic point (eq. 3.12) of friction coefficient `static` and length [m].

    Parameters
    ----------
    static : float or (c,) array
        Coefficient of friction.
    length : float or (c,) array
        Slide [m] at which an unstretched point slips.
    load : float or (c,) array
        Normal load [N].
    """
    return _pack(Law.JENKINS, (static, np.maximum(length, MIN_LENGTH)), (0.0, load), load)


def make_coulomb(static: float, kinetic: float, load: float = 1.0) -> PointLaw:
    """Return a rigid point with static and kinetic friction.

    Parameters
    ----------
    static : float or (c,) array
        Coefficient of static friction.
    kinetic : float or (c,) array
        Coefficient of kinetic friction.
    load : float or (c,) array
        Normal load [N].
    """
    return _pack(Law.COULOMB, (static, kinetic), load=load)


def make_tanh(static: float, speed: float, load: float = 1.0) -> PointLaw:
    """Return the regularised law static load tanh(v/speed) of eq. 2.4.

    Parameters
    ----------
    static : float or (c,) array
        Coefficient of friction.
    speed : float or (c,) array
        Reference speed v_0 [m/s].
    load : float or (c,) array
        Normal load [N].
    """
    return _pack(Law.TANH, (static, speed), load=load)


def make_bonds(bonds: Bonds, load: float = 1.0) -> PointLaw:
    """Return a point with bonds of order 1 and reading = "stretch"."""
    numbers = (bonds.static, bonds.length, *growth_numbers(bonds), bonds.initial)
    return _pack(Law.BONDS, numbers, (bonds.length, bonds.initial * load), load)


def make_sliders(limit, length, order, beta) -> PointLaw:
    """Return parallel sliders of Segalman's density (`friction.laws.iwan`) under a constant load.

    Parameters
    ----------
    limit : float or (c,) array
        Force [N] at which all sliders slip.
    length : float or (c,) array
        Displacement phi_max [m] at which they do.
    order, beta : float or (c,) array
        Exponent chi + 1 of the density, and weight of the last slider.
    """
    memory = (*(0.0,) * Masing.VIRGIN, 1.0)
    size = Masing.STACK + 2 * REVERSALS
    return _pack(Law.MASING, (limit, length, order, beta), memory, n_memory=size)


def make_point_law(name: str, law, load) -> PointLaw:
    """Return a friction law in the form of a contact point under a load [N].

    Parameters
    ----------
    name : str
        Name of the law, `friction.law`.
    law : friction law per newton of load, or friction.bonds.parameters.Bonds
        Law as `friction.record.make_law` returns it. Its numbers are floats, or arrays (c,) of the values of c points.
    load : float or (c,) array
        Normal load [N].

    Raises
    ------
    PatchfemError
        If the law has no return map.
    """
    load = np.maximum(load, MIN_LOAD)
    if name == "nonlocal":
        return make_bonds(law, load)
    if name == "elastic-plastic":
        return make_jenkins(law.static, law.length, load)
    if name == "iwan":
        return make_sliders(law.static * load, law.phi_max, law.chi + 1, law.beta)
    if name not in PLAIN_LAWS:
        raise PatchfemError(
            f"a bench and time steps need the return map of a law, which '{name}' lacks; add it to "
            "points/return_maps_kernels.py, or compute a rig with another method"
        )
    number, names = PLAIN_LAWS[name]
    return _pack(number, [getattr(law, one) for one in names.split()], load=load)
