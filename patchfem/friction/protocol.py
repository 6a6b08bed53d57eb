"""Interface of a friction law: `Element`, the law of a whole contact in the form that the engines take.

A law has a method `element(load)`. Its kernels for the harmonic balance are a module of compiled functions, which
`ADDING.md` describes; `protocol_kernels` has their results. Prescribed motions and loads that change are those of the
contact points (`points`), for the laws that have return maps there. Without pressure there is no traction, and at rest
no traction exceeds mu sigma.
"""

from typing import NamedTuple

import numpy as np


class SteadyLoop(NamedTuple):
    """Steady friction loop: force [N] at the reversals, and enclosed area [J]."""

    force: float | np.ndarray
    area: float | np.ndarray


class Element(NamedTuple):
    """Friction law of one contact in the form that the compiled solvers take.

    - kernels: module of the compiled functions for the harmonic balance; "" for a law that needs none
    - numbers, memory: parameters (k,), of which the first is reserved for the engines, and initial memory (l,)
    - limit: largest force [N], or a typical force if there is no largest
    - length: relative displacement [m] over which the law stretches before it slips; 0 without a stretch
    - form: "rigid" for a law that sticks rigidly, "parallel" for parallel elastic-plastic elements, "points" for points
      with bonds, "speed" for a function of the velocity, "flow" for a law with one state variable
    """

    kernels: str
    numbers: np.ndarray
    memory: np.ndarray
    limit: float
    length: float = 0.0
    form: str = ""
