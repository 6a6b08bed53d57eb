"""Results of the compiled functions of a law (see `ADDING.md`)."""

from typing import NamedTuple


class RelaxedStretch(NamedTuple):
    """Stretch of a law after a step.

    - stretch: stretch at the end of the step [m]
    - by_stretch, by_increment: its derivatives by the stretch at the start and by the increment [1]
    - by_time: its derivative by the duration of the step [m/s]
    """

    stretch: float
    by_stretch: float
    by_increment: float
    by_time: float


class Rates(NamedTuple):
    """Force of a friction law at a stretch and a velocity.

    - force: [N]
    - force_by_stretch: its derivative by the stretch [N/m]
    - force_by_velocity: its derivative by the velocity [N s/m]
    """

    force: float
    force_by_stretch: float
    force_by_velocity: float
