"""Named positions in the arrays of a contact that climbs flanks, `interfaces.arrays.ClimbingPoints`."""

from typing import NamedTuple


class FlankNumbers(NamedTuple):
    """Positions in `ClimbingPoints.flank`.

    - load: on the patch [N]
    - wave_number, amplitude, phase: of the grooves [rad/m], [m], [rad]
    - lifted_mass: mass that rises with the load [kg]
    - kind: of the law, as in `interfaces.shear_points_kernels`
    """

    load: int = 0
    wave_number: int = 1
    amplitude: int = 2
    phase: int = 3
    lifted_mass: int = 4
    kind: int = 5


class ClimbPositions(NamedTuple):
    """Positions in `ClimbingPoints.climb`.

    Of the state:

    - rise_speed: vertical velocity of the lifted mass [m/s]
    - vertical_force: mean vertical force of the last step [N]
    - last_slide, earlier_slide: relative displacement of the last two steps [m]
    - has_lifted: 1 once the vertical force has vanished
    - start_force: force along the flank at the end of the last step [N]
    - start_normal: normal force at the start of the step [N]

    Of the step that was tried last:

    - mean_force, stiffness: mean force against the relative displacement [N] and its derivative
    [N/m]
    - along_force: mean force along the flank [N]
    - mean_slope, path_ratio: height and path along the flank over the relative displacement [1]
    - trial_vertical: mean vertical force [N]
    - end_normal: normal force at the end of the step [N]
    """

    rise_speed: int = 0
    vertical_force: int = 1
    last_slide: int = 2
    earlier_slide: int = 3
    has_lifted: int = 4
    mean_force: int = 5
    stiffness: int = 6
    along_force: int = 7
    mean_slope: int = 8
    path_ratio: int = 9
    trial_vertical: int = 10
    start_force: int = 11
    start_normal: int = 12
    end_normal: int = 13


FLANK = FlankNumbers()
CLIMB = ClimbPositions()
