"""Results of the compiled functions of a law (see `ADDING.md`), and default functions.

A law imports from here what it does not define. Its engines look up every name in the module of the law.
"""

from typing import NamedTuple

from ..compiled.jit import NJIT_NO_REFCOUNT, njit


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
    """Force of a friction law [N], and its derivatives by the stretch [N/m] and the velocity [N s/m]."""

    force: float
    force_by_stretch: float
    force_by_velocity: float


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
