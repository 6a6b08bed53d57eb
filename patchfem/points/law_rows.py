"""Numbers of the laws of contact points, and the columns of their memory."""

from enum import IntEnum


class Law(IntEnum):
    """Number of a friction law in column 0 of `numbers`; laws up to JENKINS are linear between events.

    - COULOMB: rigid friction
    - JENKINS: spring and slider in series
    - TANH: friction that follows the velocity, as its hyperbolic tangent
    - MASING: parallel sliders, see `Masing`
    - BOUC_WEN, LUGRE: laws of these names
    - BONDS: bonds of constant length that are summed by their moments
    """

    COULOMB = 0
    JENKINS = 1
    TANH = 2
    MASING = 3
    BOUC_WEN = 4
    LUGRE = 5
    BONDS = 6


class Memory(IntEnum):
    """First columns of the memory of smooth laws.

    - STRETCH: elastic part of the slide [m]
    - ENERGY: stored energy [J]
    - SQUARE: of bonds, mean squared stretch relative to the squared length
    """

    STRETCH = 0
    ENERGY = 1
    SQUARE = 2


class Masing(IntEnum):
    """Further columns of the memory of parallel sliders, which follow Masing's rules.

    - SLIDE, FORCE: displacement [m] and force [N]
    - DIRECTION: sign of the last motion
    - COUNT: number of reversals on the stack
    - VIRGIN: 1 until the sliders have slipped as a whole, then -1
    - STACK: first column of pairs of displacement [m] and force [N] at the reversals
    """

    SLIDE = 2
    FORCE = 3
    DIRECTION = 4
    COUNT = 5
    VIRGIN = 6
    STACK = 7
