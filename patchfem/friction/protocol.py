"""What a friction law is: a record of its numbers per newton of load, from which the engines take theirs.

A law has `static`, the coefficient of static friction or of the limit, and `length`, the relative displacement [m] over
which it stretches before it slips, 0 without a stretch. A law of parallel elastic-plastic elements has
`elements(load)`, which returns their stiffness [N/m] and yield displacement [m], and a law with a steady loop in closed
form has `steady_loop(load, amplitude)`. Without pressure there is no traction, and at rest no traction exceeds mu sigma.
`ADDING.md` adds a law.
"""

from typing import NamedTuple

import numpy as np


class SteadyLoop(NamedTuple):
    """Steady friction loop: force [N] at the reversals, and enclosed area [J]."""

    force: float | np.ndarray
    area: float | np.ndarray
