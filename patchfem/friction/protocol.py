"""Interface of a friction law: NumPy methods for prescribed motions, `Element` for compiled solvers.

A law under a pressure that changes along the path or in time has these methods. None of them changes the state that it
is given. No traction remains without pressure, and at rest no traction exceeds mu sigma.

- `initial_state(sigma)`: state before any motion, under a pressure sigma (m,) [Pa]
- `step(state, increment, s0, s1, dt)`: `Step` for an increment [m] in dt [s] under pressures from s0 to s1
- `press(state, s0, s1)`: `Step` at rest while the pressure changes from s0 to s1
- `traction(state)`, `stored_energy(state)`: traction [Pa] and elastic energy per area [J/m2] of a state
- `element(load)`: `Element` of a whole contact

Laws of constant load (Iwan, Bouc-Wen, LuGre) have only `element`. Its kernels are a module of compiled functions, which
`ADDING.md` describes; `protocol_kernels` has their results, and the functions that most laws do not need.
"""

from typing import NamedTuple

import numpy as np


class Step(NamedTuple):
    """Result of a friction law for one increment of the relative displacement.

    - mean: path mean (m,) [Pa] of the traction, positive against slip to +x
    - dissipated: energy per area (m,) [J/m2], negative only if the law creates energy
    - state: state after the increment, of the type that the `initial_state` of the law returns
    """

    mean: np.ndarray
    dissipated: np.ndarray
    state: object


class SteadyLoop(NamedTuple):
    """Steady friction loop: force [N] at the reversals, and enclosed area [J]."""

    force: float | np.ndarray
    area: float | np.ndarray


class LastTraction:
    """Base class of friction laws whose state is the last traction (m,) [Pa].

    A subclass has `limit(sigma, direction)`, `limit_fraction(increment, dt)` and `step`.
    """

    __slots__ = ()
    can_change_load = True  # whether the load may change within a step

    def initial_state(self, sigma):
        """Return the traction before any motion, which is 0."""
        return np.zeros_like(sigma)

    def press(self, state, s0, s1) -> Step:
        """Reduce the traction at rest to the friction limit that holds after a change of the pressure.

        No energy is dissipated.

        Parameters
        ----------
        state : (m,) array
            Last traction [Pa].
        s0, s1 : (m,) array
            Pressures before and after [Pa].

        Returns
        -------
        Step
            Its mean is the traction after the change.
        """
        limit = self.limit(s1, 1.0)
        traction = np.clip(state, -limit, limit)
        return Step(traction, np.zeros_like(traction), traction)

    def traction(self, state):
        """Return the traction (m,) [Pa] at the end of the last step, positive against slip to +x."""
        return state

    def stored_energy(self, state):
        """Return the elastic energy per area (m,) [J/m2], which is 0 because the law has no elastic stretch."""
        return np.zeros_like(state)


class Element(NamedTuple):
    """Friction law of one contact in the form that the compiled solvers take.

    - kernels: module of the compiled functions for the harmonic balance; "" for a law that needs none
    - numbers, memory: parameters (k,), of which the first is reserved for the engines, and initial memory (l,)
    - limit: largest force [N], or a typical force if there is no largest
    - length: relative displacement [m] over which the law stretches before it slips; 0 without a stretch
    - is_bounded: whether no force exceeds the limit
    - form: "rigid" for a law that sticks rigidly, "parallel" for parallel elastic-plastic elements, "points" for points
      with bonds, "speed" for a function of the velocity, "flow" for a law with one state variable
    """

    kernels: str
    numbers: np.ndarray
    memory: np.ndarray
    limit: float
    length: float = 0.0
    is_bounded: bool = True
    form: str = ""
