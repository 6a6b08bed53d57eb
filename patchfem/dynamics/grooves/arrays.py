"""Names for the array entries of a contact that rides up groove flanks (`ClimbingPoints`)."""

from enum import IntEnum


class FlankIndex(IntEnum):
    """Indices into `ClimbingPoints.flank`: load, groove geometry and type of law.

    - LOAD: normal load on the patch [N]
    - WAVE_NUMBER, AMPLITUDE, PHASE: geometry of the grooves [rad/m], [m], [rad]
    - LIFTED_MASS: mass that rises with the load [kg]
    - KIND: kind of the law, as in `interfaces.shear_points_kernels`
    """

    LOAD = 0
    WAVE_NUMBER = 1
    AMPLITUDE = 2
    PHASE = 3
    LIFTED_MASS = 4
    KIND = 5


class ClimbIndex(IntEnum):
    """Indices into `ClimbingPoints.climb`: state of the lifted mass, and the trial step.

    State:

    - RISE_SPEED: vertical velocity of the lifted mass [m/s]
    - VERTICAL_FORCE: mean vertical force of the last step [N]
    - LAST_SLIDE, EARLIER_SLIDE: relative displacement of the last two steps [m]
    - HAS_LIFTED: 1 once the vertical force has vanished
    - START_FORCE: force along the flank at the end of the last step [N]
    - START_NORMAL: normal force at the start of the step [N]

    Of the last trial step:

    - MEAN_FORCE, STIFFNESS: mean force opposing the relative displacement [N] and its derivative
    [N/m]
    - ALONG_FORCE: mean force along the flank [N]
    - MEAN_SLOPE, PATH_RATIO: height and path along the flank per relative displacement [1]
    - TRIAL_VERTICAL: mean vertical force [N]
    - END_NORMAL: normal force at the end of the step [N]
    """

    RISE_SPEED = 0
    VERTICAL_FORCE = 1
    LAST_SLIDE = 2
    EARLIER_SLIDE = 3
    HAS_LIFTED = 4
    MEAN_FORCE = 5
    STIFFNESS = 6
    ALONG_FORCE = 7
    MEAN_SLOPE = 8
    PATH_RATIO = 9
    TRIAL_VERTICAL = 10
    START_FORCE = 11
    START_NORMAL = 12
    END_NORMAL = 13
