"""Numbers and first memory of the laws of contact points, from keys of a scene or from parameters."""

from typing import NamedTuple

import numpy as np

from ..friction.bonds.parameters import Bonds, growth_numbers
from ..friction.laws.iwan import max_yield_displacement
from .law_rows import Law, Masing

N_NUMBERS = 10  # rows of numbers of a point
N_MEMORY = 6  # rows of memory of a point, without a stack of reversals
# Nested reversals that parallel sliders remember. A decay by 3 % from one to the next has reached 2e-7 of its start. After
# decays of 1000 to 5000 reversals, forces of a motion that grows again are wrong by up to 4e-3 of the limit.
REVERSALS = 512
MIN_LENGTH = 1e-30  # length [m] in place of no length, by which a stiffness is divided
MIN_LOAD = 1e-12  # load [N] in place of no load, to which a stiffness refers


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


def make_list(bonds: Bonds, load: float) -> PointLaw:
    """Return a point whose bonds are summed over a list, under a load [N]."""
    return _pack(Law.LIST, (bonds.static, bonds.length), load=load)


def make_sliders(limit, length, order, beta, load: float = 1.0) -> PointLaw:
    """Return parallel sliders of Segalman's density (`friction.laws.iwan`) under a constant load.

    Parameters
    ----------
    limit : float or (c,) array
        Force [N] at which all sliders slip.
    length : float or (c,) array
        Displacement phi_max [m] at which they do.
    order, beta : float or (c,) array
        Exponent chi + 1 of the density, and weight of the last slider.
    load : float or (c,) array
        Normal load [N].
    """
    memory = (*(0.0,) * Masing.VIRGIN, 1.0)
    size = Masing.STACK + 2 * REVERSALS
    return _pack(Law.MASING, (limit, length, order, beta), memory, load, size)


def make_cubic(stiffness: float) -> PointLaw:
    """Return a spring of force stiffness q^3."""
    return _pack(Law.CUBIC, (stiffness,))


def make_interlocking(stiffness: float, wavelength: float) -> PointLaw:
    """Return a spring whose force is sinusoidal, of stiffness [N/m] at rest."""
    return _pack(Law.INTERLOCK, (stiffness, wavelength))


def make_point_law(friction, load) -> PointLaw:
    """Return the law that the keys of a table [friction] define, under a load [N].

    Bonds of the law "nonlocal" do not grow.

    Parameters
    ----------
    friction : table
        Keys in SI units; floats, or arrays (c,) of the values of c points.
    load : float or (c,)
        Normal load [N].
    """
    name = friction.law
    load = np.maximum(load, MIN_LOAD)
    limit = friction.static * load
    kinetic = getattr(friction, "kinetic", None)
    kinetic = friction.static if kinetic is None else kinetic

    if name == "coulomb":
        return make_coulomb(friction.static, kinetic, load)
    if name == "tanh":
        return make_tanh(friction.static, friction.reference_speed, load)
    if name == "elastic-plastic":
        has_length = friction.bond_length is not None
        length = friction.bond_length if has_length else limit / friction.stiffness
        return make_jenkins(friction.static, length, load)

    if name == "nonlocal":
        return make_bonds(Bonds(friction.static, friction.bond_length), load)

    if name == "iwan":
        length = max_yield_displacement(limit, friction.stiffness, friction.chi, friction.beta)
        return make_sliders(limit, length, friction.chi + 1, friction.beta, load)
    if name == "bouc-wen":
        length = limit / friction.stiffness
        numbers = (friction.static, length, friction.exponent, friction.shape)
        return _pack(Law.BOUC_WEN, numbers, load=load)

    # The kernels multiply stiffness and damping by the present load.
    per_load = (friction.stiffness / load, kinetic, friction.static, friction.stribeck_speed)
    damping = (friction.micro_damping / load, friction.viscous / load)
    return _pack(Law.LUGRE, (*per_load, *damping), load=load)
