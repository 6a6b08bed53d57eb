"""Numbers of the laws of contact points, and the memory of parallel sliders."""

from enum import IntEnum


class Law(IntEnum):
    """Number of a friction law in row 0 of `numbers`.

    - COULOMB: rigid friction
    - TANH: friction that follows the velocity, as its hyperbolic tangent
    - JENKINS: spring and slider in series
    - MASING: parallel sliders, see `Masing`
    - BOUC_WEN, LUGRE: laws of these names
    - BONDS: bonds that are summed by their moments
    """

    COULOMB = 0
    TANH = 1
    JENKINS = 2
    MASING = 3
    BOUC_WEN = 4
    LUGRE = 5
    BONDS = 6


class Masing(IntEnum):
    """Rows of the memory of parallel sliders, which follow Masing's rules.

    - SLIDE, FORCE: displacement [m] and force [N]
    - DIRECTION: sign of the last motion
    - COUNT: number of reversals on the stack
    - VIRGIN: 1 until the sliders have slipped as a whole, then -1
    - ENERGY: stored energy [J]
    - STRETCH: mean stretch [m]
    - STACK: first row of pairs of displacement [m] and force [N] at the reversals
    """

    SLIDE = 0
    FORCE = 1
    DIRECTION = 2
    COUNT = 3
    VIRGIN = 4
    ENERGY = 5
    STRETCH = 6
    STACK = 7
