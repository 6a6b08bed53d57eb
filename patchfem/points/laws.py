"""Numbers and first memory of the laws of contact points, from keys of a scene or from parameters."""

from typing import NamedTuple

import numpy as np

from ..friction.bonds.parameters import Bonds
from ..friction.laws.iwan import max_yield_displacement
from ..friction.laws.stretch import growth_numbers
from ..friction.record import make_law
from .return_maps_kernels import Law, Masing

N_NUMBERS = 10  # rows of numbers of a point
N_MEMORY = 6  # rows of memory of a point, without a stack of reversals
REVERSALS = 48  # reversals that parallel sliders remember
MIN_LOAD = 1e-12  # load [N] in place of no load, to which a stiffness refers


class PointLaw(NamedTuple):
    """Law of a contact point with its rows of numbers and memory, and the load [N] per which they are."""

    numbers: np.ndarray
    memory: np.ndarray
    load: float


def _pack(law: Law, numbers, memory=(), load: float = 1.0, n_memory: int = N_MEMORY) -> PointLaw:
    rows = np.zeros(N_NUMBERS)
    rows[: 1 + len(numbers)] = (law, *numbers)
    state = np.zeros(n_memory)
    state[: len(memory)] = memory
    return PointLaw(rows, state, load)


def make_jenkins(static: float, length: float, load: float = 1.0) -> PointLaw:
    """Return an elastic-plastic point (eq. 3.12) of friction coefficient `static` and length [m]."""
    return _pack(Law.JENKINS, (static, length), (0.0, load), load)


def make_coulomb(static: float, kinetic: float, load: float = 1.0) -> PointLaw:
    """Return a rigid point with static and kinetic friction."""
    return _pack(Law.COULOMB, (static, kinetic), load=load)


def make_tanh(static: float, speed: float, load: float = 1.0) -> PointLaw:
    """Return the regularised law static load tanh(v/speed) of eq. 2.4."""
    return _pack(Law.TANH, (static, speed), load=load)


def make_bonds(bonds: Bonds, load: float = 1.0) -> PointLaw:
    """Return a point with bonds of order 1 and reading = "stretch"."""
    numbers = (bonds.static, bonds.length, *growth_numbers(bonds), bonds.initial)
    return _pack(Law.BONDS, numbers, (bonds.length, bonds.initial * load), load)


def make_cubic(stiffness: float) -> PointLaw:
    """Return a spring of force stiffness q^3."""
    return _pack(Law.CUBIC, (stiffness,))


def make_interlocking(stiffness: float, wavelength: float) -> PointLaw:
    """Return a spring whose force is sinusoidal, of stiffness [N/m] at rest."""
    return _pack(Law.INTERLOCK, (stiffness, wavelength))


def make_point_law(friction, load: float, bonds: Bonds | None = None) -> PointLaw:
    """Return the law that the keys of a table [friction] define, under a load [N].

    Parameters
    ----------
    friction : table
        Keys in SI units.
    load : float
        Normal load [N].
    bonds : Bonds, optional
        Bonds of the law "nonlocal" with their rest speed.
    """
    name = friction.law
    load = max(load, MIN_LOAD)
    if name == "coulomb":
        kinetic = friction.static if friction.kinetic is None else friction.kinetic
        return make_coulomb(friction.static, kinetic, load)
    if name == "tanh":
        return make_tanh(friction.static, friction.reference_speed, load)
    if name == "elastic-plastic":
        length = friction.bond_length or friction.static * load / friction.stiffness
        return make_jenkins(friction.static, length, load)
    if name == "nonlocal":
        return make_bonds(bonds, load)
    if name == "iwan":
        limit = friction.static * load
        chi, beta = friction.chi, friction.beta
        length = max_yield_displacement(limit, friction.stiffness, chi, beta)
        memory = np.zeros(Masing.VIRGIN + 1)
        memory[Masing.VIRGIN] = 1.0
        size = Masing.STACK + 2 * REVERSALS
        return _pack(Law.MASING, (limit, length, chi + 1, beta), memory, load, size)
    element = make_law(friction, load).element(load).numbers
    if name == "bouc-wen":
        return _pack(Law.BOUC_WEN, (element[1] / load, *element[2:5]), load=load)
    per_load = element[1:7] / load
    per_load[3] = element[4]
    return _pack(Law.LUGRE, per_load, load=load)
