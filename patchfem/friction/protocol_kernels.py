"""Results of the compiled functions of a law (see `ADDING.md`), and default functions.

A law imports from here what it does not define. Its engines look up every name in the module of the law.
"""

from typing import NamedTuple

from ..compiled.jit import NJIT_NO_REFCOUNT, njit

IS_SET_VALUED = False  # whether the law sticks without any elastic stretch, as Coulomb's law does
HAS_ZERO_KINK = False  # whether the rate equation has a kink at zero stretch
# Whether the stretch depends on the path alone and is given by `integrate_stretch`
IS_RATE_INDEPENDENT = False
# Whether the force changes steeply over a narrow range of velocities around 0
HAS_SPEED_LAYER = False


class Reading(NamedTuple):
    """State of a friction law: force [N], stored energy [J], irreversible displacement [m]."""

    force: float
    stored_energy: float
    slip: float


class StepSolution(NamedTuple):
    """Closed-form solution of a step: displacement increment [m] and path-mean force [N]."""

    increment: float
    mean_force: float
    is_solved: bool


class RelaxedStretch(NamedTuple):
    """Stretch [m] after a step, and its derivatives by initial stretch, increment and time."""

    stretch: float
    by_stretch: float
    by_increment: float
    by_time: float


class Rates(NamedTuple):
    """Rate equation of a friction law: force [N], stretch rate [1] and force derivatives."""

    force: float
    stretch_rate: float
    force_by_stretch: float
    force_by_velocity: float


class IntegratedStretch(NamedTuple):
    """Stretch after a path [m], mean square stretch [m2] and work of the friction force [J]."""

    stretch: float
    mean_square: float
    work: float


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def step_bond_length(numbers, memory, velocity, dt):
    """Return 0, because a law without growing bonds has no bond length.

    Parameters
    ----------
    numbers, memory : (k,), (l,) array
        Parameters and memory of the law.
    velocity, dt : float
        Relative velocity [m/s] at the start of the step; time step [s].

    Returns
    -------
    float
        Bond length [m] in the middle of the step.
    """
    return 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def solve_step(numbers, memory, free, compliance):
    """Return an unsolved step, because the law has no closed form for a step.

    Parameters
    ----------
    numbers, memory : (k,), (l,) array
        Parameters and memory of the law.
    free, compliance : float
        Increment [m] without friction, and what one newton takes off it [m/N].

    Returns
    -------
    StepSolution
    """
    return StepSolution(0.0, 0.0, False)


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def integrate_stretch(numbers, stretch, mean_square, increment, direction):
    """Return the stretch unchanged, because the law is given by its rate equation alone.

    Parameters
    ----------
    numbers : sequence of float
        Parameters of the law.
    stretch, mean_square : float
        Stretch [m] and mean square of the stretches [m2] before.
    increment, direction : float
        Increment [m] and its sign.

    Returns
    -------
    IntegratedStretch
    """
    return IntegratedStretch(stretch, mean_square, 0.0)
