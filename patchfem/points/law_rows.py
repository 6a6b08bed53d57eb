"""Laws of contact points, and the columns of their numbers and of their memory."""

from enum import IntEnum


class Law(IntEnum):
    """Number of a friction law; laws up to JENKINS are linear between events.

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


class LawNumber(IntEnum):
    """Columns of the numbers of a law; LUGRE has those of `LuGreNumber` after the first.

    - LAW: the `Law`
    - LIMIT: friction limit [N], of COULOMB the static one
    - KINETIC: kinetic limit of COULOMB [N]
    - SPEED: reference speed of TANH [m/s]
    - LENGTH: length of JENKINS, BOUC_WEN and BONDS, and phi_max of MASING [m]
    - CHI, BETA: parameters of MASING
    - EXPONENT, SHAPE: parameters of BOUC_WEN
    """

    LAW = 0
    LIMIT = 1
    KINETIC = 2
    SPEED = 2
    LENGTH = 2
    CHI = 3
    BETA = 4
    EXPONENT = 3
    SHAPE = 4


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
