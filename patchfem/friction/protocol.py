"""What every law of friction returns for a step.

A law is start(sigma) -> state, step(state, dq, s0, s1, dt) -> Step for an increment of slide over a pressure that
changes along the way, and press(state, s0, s1) -> Step for a pressure that changes in time at rest. None of them
changes the state it was given. No traction outlives the contact, and at rest none exceeds mu sigma.
"""

from typing import NamedTuple

import numpy as np


class Step(NamedTuple):
    """mean: (m,) path-mean traction [Pa]; dissipated: (m,) energy per area [J/m2]; state: after the step."""

    mean: np.ndarray
    dissipated: np.ndarray
    state: object
