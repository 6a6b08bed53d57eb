"""Results of the compiled functions of a law (see `ADDING.md`)."""

from typing import NamedTuple


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
