"""Step of one case under a friction law with a single stretch, by a Runge-Kutta method.

The equation in the angle of the drive is x'' + D x' + W x = P sin - f(z, x'), with z' = g(z, x') x'. MEMORY is the stretch
z [m]. The functions f and g are those of the module `friction` (tanh, Bouc-Wen, LuGre, bonds), whose numbers have lengths
in m and angles for times, so that f is a force per unit mass [m].

A step ends and starts anew where the slide reverses, and where the law has a kink at zero stretch. A law whose force
changes in a thin layer of speeds (`HAS_SPEED_LAYER`) is followed through the layer in parts. A reference is the engine
`hybrid`.
"""

from math import cos, nan, sin
from typing import NamedTuple

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_INLINE, NJIT_NO_REFCOUNT
from ...friction.laws import tanh_kernels as friction
from .rigid_kernels import (
    PROOF_TOL,
    AngleStep,
    LaneState,
    StepOutcome,
    StickFractions,
    TriedStep,
    can_extrapolate,
    cubic_peak,
    newton_on_cubic,
    prepare_step,
)
from .rows_kernels import LANES, RowStart, StretchRowStart

__all__ = [
    "EVENT_KEEPS_STICK",
    "N_LAW_VARIABLES",
    "PROOF_TOL",
    "STICK_IS_RIGID",
    "can_extrapolate",
    "friction_at_reversal",
    "friction_force",
    "friction_rate",
    "irreversible_slide",
    "is_sticking",
    "prepare_step",
    "records_own_peaks",
    "resolve_step",
    "restore_derived_state",
    "set_derived_state",
    "slide_at_reversal",
    "slip_increment",
    "stick_fractions",
    "try_step",
]

STICK_IS_RIGID = False
EVENT_KEEPS_STICK = False
# Number of law variables that follow the linear map of a cycle: friction
# and mean square of the stretches.
N_LAW_VARIABLES = 2

# Maximum number of parts of a step, which has at most one reversal and
# one kink on either side of it.
MAX_PARTS = 4
# Number of Newton steps for the time of an event; the error of a cubic
# across a kink is of second order.
N_CORRECTIONS = 2
# Maximum number of parts of a step through a regularisation layer, which limits the cost of a step.
MAX_LAYER_PARTS = 64
# Speed at the edge of a regularisation layer, relative to the regularisation speed;
# beyond it the force is constant.
LAYER_EDGE_RATIO = 5.0
# Change of the speed in a part of a step, relative to the regularisation
# speed times the angle of the step.
LAYER_STEP_RATIO = 20.0
# Minimum change of the speed in a part of a step, relative to the regularisation speed.
MIN_LAYER_STEP_RATIO = 0.25
# Ratio of the other forces to the friction above which the speed changes monotonically.
FREE_FLIGHT_FACTOR = 2.0
# Smallest irreversible fraction of a change of the relative
# displacement at which an interface slips.
SLIP_FRACTION = 0.5
N_HALVINGS = 24  # number of bisections for the start of a slip, which leave 6e-8 of a segment
# Sign of the slip that is passed to a law with a regularisation layer, which does not use it.
SIGN_IN_LAYER = 1.0
AT_START = 0  # codes of the instants of a step, as in `observation_kernels`
AT_END = 3


class FlowState(NamedTuple):
    """Displacement, speed, friction per unit mass and stretch [m], and mean square stretch [m^2].

    The displacement is the relative displacement of the interface, and the speed its derivative
    with respect to the angle of the drive.
    """

    slide: float
    speed: float
    friction: float
    stretch: float
    square: float


class FirstEvent(NamedTuple):
    """First event in a part of a step: its fraction of the part, and whether it is a reversal.

    The fraction is 1 if there is no event.
    """

    fraction: float
    is_reversal: bool


class LayerPlan(NamedTuple):
    """Division of a step through a regularisation layer of the friction law into parts.

    - `flies`: whether the other forces drive the speed one way whatever the friction is; the parts
      are then equal in speed, otherwise equal in angle.
    - `side`: sign of the acceleration in the absence of friction.
    - `n_parts`: largest number of parts.
    - `edge_speed`: speed at the edge of the layer.
    - `width`: change of the speed in a part.
    - `angle`: angle of the step [rad].
    """

    flies: bool
    side: float
    n_parts: int
    edge_speed: float
    width: float
    angle: float


class LayerPart(NamedTuple):
    """Part of a step: angle [rad], state at its end, and friction work per unit mass [m^2]."""

    angle: float
    end: FlowState
    work: float


@njit(**NJIT_INLINE)
def law_numbers(workspace, lane):
    """Return the parameters (7,) of the friction law of a lane for its rate equation.

    The first number is not used.
    """
    first = RowStart.LAW_NUMBERS + lane
    return (
        0.0,
        workspace[first],
        workspace[first + LANES],
        workspace[first + 2 * LANES],
        workspace[first + 3 * LANES],
        workspace[first + 4 * LANES],
        workspace[first + 5 * LANES],
    )


@njit(**NJIT_INLINE)
def speed_layer(numbers, angle):
    """Return the edge speed of the regularisation layer, and the speed change of a part in it.

    The parameters of a law with a layer begin with its limit and the reciprocal of the layer speed.
    """
    return LAYER_EDGE_RATIO / numbers[2], max(
        LAYER_STEP_RATIO * angle, MIN_LAYER_STEP_RATIO
    ) / numbers[2]


@njit(**NJIT_INLINE)
def friction_force(state, sine, workspace, lane):
    """Return the friction force per unit mass [m] from the rate equation of the law.

    Parameters
    ----------
    state, sine, workspace, lane
        See `rigid_kernels.friction_force`.

    Returns
    -------
    float
    """
    numbers = law_numbers(workspace, lane)
    return friction.rate_equation(numbers, state.memory, state.speed, state.slip_sign)[0]


@njit(**NJIT_INLINE)
def friction_rate(state, acceleration, workspace, lane, when):
    """Return the derivative of the friction force per unit mass with respect to the drive angle.

    Parameters
    ----------
    state, acceleration, workspace, lane, when
        See `rigid_kernels.friction_rate`.

    Returns
    -------
    float
    """
    numbers = law_numbers(workspace, lane)
    _, gain, by_stretch, by_rate = friction.rate_equation(
        numbers, state.memory, state.speed, state.slip_sign
    )
    return by_stretch * gain * state.speed + by_rate * acceleration


@njit(**NJIT_INLINE)
def friction_at_reversal(x, slip_sign, memory, event_memory, workspace, lane):
    """Return the friction force per unit mass [m] at a reversal, from the stretch at that point.

    Parameters
    ----------
    x, slip_sign, memory, event_memory, workspace, lane
        See `rigid_kernels.friction_at_reversal`.

    Returns
    -------
    float
    """
    return friction_force(LaneState(x, 0.0, slip_sign, event_memory), 0.0, workspace, lane)


@njit(**NJIT_INLINE)
def irreversible_slide(x, memory, workspace, lane):
    """Return the irreversible part of the relative displacement [m].

    Parameters
    ----------
    x, memory, workspace, lane
        See `rigid_kernels.irreversible_slide`.

    Returns
    -------
    float
    """
    return x - memory


@njit(**NJIT_INLINE)
def slip_increment(memory, event_memory, memory1, workspace, lane):
    """Return the friction work of the last step per unit mass [m^2].

    It replaces the slip path in laws with a single stretch.

    Parameters
    ----------
    memory, event_memory, memory1, workspace, lane
        See `rigid_kernels.slip_increment`.

    Returns
    -------
    float
    """
    return workspace[StretchRowStart.STEP_WORK + lane]


@njit(**NJIT_INLINE)
def stretch_after(numbers, stretch, slide, rise, slip_sign):
    """Return the stretch after an increment of the relative displacement.

    A rate-independent law is integrated in closed form.

    Parameters
    ----------
    numbers : tuple
        See `law_numbers`.
    stretch, slide, rise, slip_sign : float

    Returns
    -------
    float
    """
    if friction.IS_RATE_INDEPENDENT:
        return friction.integrate_stretch(numbers, stretch, 0.0, slide, slip_sign)[0]
    return stretch + rise


@njit(**NJIT_INLINE)
def runge_kutta_step(workspace, lane, state, slip_sign, sines, angle):
    """Integrate the motion over a drive angle by a Runge-Kutta method of order 4.

    Parameters
    ----------
    workspace, lane
        See `rigid_kernels.friction_force`.
    state : FlowState
    slip_sign : float
        Sign of the slip.
    sines : tuple of float
        Sine of the drive at the start, in the middle and at the end.
    angle : float
        [rad]

    Returns
    -------
    FlowState
    float
        Friction work [m^2].
    """
    x, v, f, z, q = state
    k = law_numbers(workspace, lane)
    drive = workspace[RowStart.DRIVE + lane]
    damping = workspace[RowStart.DAMPING + lane]
    stiffness = workspace[RowStart.STIFFNESS + lane]
    half = angle / 2
    g = friction.rate_equation(k, z, v, slip_sign)[1] * v
    a = drive * sines[0] - damping * v - stiffness * x - f
    v1 = v + half * a
    z1 = stretch_after(k, z, half * v, half * g, slip_sign)
    f1, gain, _, _ = friction.rate_equation(k, z1, v1, slip_sign)
    g1 = gain * v1
    a1 = drive * sines[1] - damping * v1 - stiffness * (x + half * v) - f1
    v2 = v + half * a1
    z2 = stretch_after(k, z, half * v1, half * g1, slip_sign)
    f2, gain, _, _ = friction.rate_equation(k, z2, v2, slip_sign)
    g2 = gain * v2
    a2 = drive * sines[1] - damping * v2 - stiffness * (x + half * v1) - f2
    v3 = v + angle * a2
    z3 = stretch_after(k, z, angle * v2, angle * g2, slip_sign)
    f3, gain, _, _ = friction.rate_equation(k, z3, v3, slip_sign)
    g3 = gain * v3
    a3 = drive * sines[2] - damping * v3 - stiffness * (x + angle * v2) - f3
    sixth = angle / 6
    slide = sixth * (v + 2 * (v1 + v2) + v3)
    speed = v + sixth * (a + 2 * (a1 + a2) + a3)
    work = sixth * (f * v + 2 * (f1 * v1 + f2 * v2) + f3 * v3)
    stretch = z + sixth * (g + 2 * (g1 + g2) + g3)
    square = stretch * stretch
    if friction.IS_RATE_INDEPENDENT:
        stretch, square, work = friction.integrate_stretch(k, z, q, slide, slip_sign)
    force = friction.rate_equation(k, stretch, speed, slip_sign)[0]
    return FlowState(x + slide, speed, force, stretch, square), work


@njit(**NJIT_INLINE)
def set_derived_state(workspace, lane):
    """Set the friction of a lane from its stretch and speed."""
    state = LaneState(
        workspace[RowStart.SLIDE + lane],
        workspace[RowStart.SPEED + lane],
        workspace[RowStart.SLIP_SIGN + lane],
        workspace[RowStart.MEMORY + lane],
    )
    workspace[StretchRowStart.FRICTION + lane] = friction_force(state, 0.0, workspace, lane)


restore_derived_state = set_derived_state


@njit(**NJIT_INLINE)
def flow_state(workspace, lane):
    """Return the displacement, speed, friction and stretch of a lane."""
    return FlowState(
        workspace[RowStart.SLIDE + lane],
        workspace[RowStart.SPEED + lane],
        workspace[StretchRowStart.FRICTION + lane],
        workspace[RowStart.MEMORY + lane],
        workspace[StretchRowStart.STRETCH_SQUARE + lane],
    )


@njit(**NJIT_INLINE)
def is_sticking(v, slip_sign, memory, workspace, lane):
    """Return 1 if the interface sticks, otherwise 0.

    It sticks if at most SLIP_FRACTION of a change of the relative displacement is irreversible.

    Parameters
    ----------
    v, slip_sign, memory, workspace, lane
        See `rigid_kernels.is_sticking`.

    Returns
    -------
    float
    """
    gain = friction.rate_equation(law_numbers(workspace, lane), memory, v, slip_sign)[1]
    return 1.0 if abs(1 - gain) < SLIP_FRACTION else 0.0


@njit(**NJIT_INLINE)
def try_step(workspace, lane, step, is_observed):
    """Try a step as if it contained no reversal, kink or regularisation layer.

    A step that is read must not contain the start or the end of a stick, nor a change of sign of the stretch.

    Parameters
    ----------
    workspace, lane, step, is_observed
        See `rigid_kernels.try_step`.

    Returns
    -------
    TriedStep
    """
    slip_sign = workspace[RowStart.SLIP_SIGN + lane]
    state = flow_state(workspace, lane)
    sines = (step.s0, workspace[RowStart.MIDPOINT_FACTOR + lane] * (step.s0 + step.s1), step.s1)
    end, work = runge_kutta_step(workspace, lane, state, slip_sign, sines, step.angle)
    if friction.HAS_SPEED_LAYER:
        edge_speed, width = speed_layer(law_numbers(workspace, lane), step.angle)
        slowest = 0.0 if state.speed * end.speed < 0.0 else min(abs(state.speed), abs(end.speed))
        event = (slowest < edge_speed and abs(end.speed - state.speed) > width) or (
            is_observed and state.speed * end.speed <= 0.0
        )
    else:
        event = (
            slip_sign * end.speed < 0.0
            or ((is_observed or friction.HAS_ZERO_KINK) and state.stretch * end.stretch < 0.0)
            or (
                is_observed
                and (
                    end.speed == 0.0
                    or is_sticking(state.speed, slip_sign, state.stretch, workspace, lane)
                    != is_sticking(end.speed, slip_sign, end.stretch, workspace, lane)
                )
            )
        )
    workspace[StretchRowStart.FRICTION + lane] = state.friction if event else end.friction
    workspace[StretchRowStart.STRETCH_SQUARE + lane] = state.square if event else end.square
    workspace[StretchRowStart.STEP_WORK + lane] = work
    workspace[StretchRowStart.IS_OBSERVED + lane] = 1.0 if is_observed else 0.0
    return TriedStep(end.slide, end.speed, end.stretch, event)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def find_hermite_root(y0, y1, m0, m1):
    """Return the root in [0, 1] of a cubic given by its values and slopes at 0 and 1.

    Parameters
    ----------
    y0, y1, m0, m1 : float
        Values and slopes of the cubic at 0 and 1.

    Returns
    -------
    float
    """
    c2 = 3 * (y1 - y0) - 2 * m0 - m1
    c3 = m0 + m1 - 2 * (y1 - y0)
    return newton_on_cubic(y0, m0, c2, c3, y0 / (y0 - y1))


@njit(**NJIT_INLINE)
def flow_acceleration(workspace, lane, state, sine):
    """Return the acceleration of the relative displacement per squared drive frequency [m].

    Parameters
    ----------
    workspace, lane
        See `rigid_kernels.friction_force`.
    state : FlowState
    sine : float
        Sine of the drive.

    Returns
    -------
    float
        [m]
    """
    return (
        workspace[RowStart.DRIVE + lane] * sine
        - workspace[RowStart.DAMPING + lane] * state.speed
        - workspace[RowStart.STIFFNESS + lane] * state.slide
        - state.friction
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def find_first_event(workspace, lane, start, end, slip_sign, sines, angle):
    """Find the first event in a part of a step by cubics of speed and stretch.

    Parameters
    ----------
    workspace, lane, slip_sign, sines, angle
        See `runge_kutta_step`.
    start, end : FlowState

    Returns
    -------
    FirstEvent
    """
    numbers = law_numbers(workspace, lane)
    v = start.speed
    v1 = end.speed
    fraction = 1.0
    is_reversal = False
    if slip_sign * v1 < 0.0:
        is_reversal = True
        fraction = 0.0
        if slip_sign * v > 0.0:
            a = flow_acceleration(workspace, lane, start, sines[0])
            a1 = flow_acceleration(workspace, lane, end, sines[2])
            fraction = find_hermite_root(v, v1, angle * a, angle * a1)
    if friction.HAS_ZERO_KINK and start.stretch * end.stretch < 0.0:
        gain = friction.rate_equation(numbers, start.stretch, v, slip_sign)[1]
        gain1 = friction.rate_equation(numbers, end.stretch, v1, slip_sign)[1]
        kink = find_hermite_root(start.stretch, end.stretch, angle * v * gain, angle * v1 * gain1)
        if kink < fraction:
            fraction = kink
            is_reversal = False
    return FirstEvent(fraction, is_reversal)


@njit(**NJIT_INLINE)
def hermite_cubic(y0, y1, m0, m1, u):
    """Evaluate the cubic with given values and slopes at 0 and 1.

    Parameters
    ----------
    y0, y1, m0, m1, u : float

    Returns
    -------
    float
    """
    w = 1 - u
    return w * w * ((1 + 2 * u) * y0 + u * m0) + u * u * ((1 + 2 * w) * y1 - w * m1)


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def records_own_peaks():
    """Return whether `resolve_step` itself adds the peaks and the work of a step to the measures."""
    return friction.HAS_SPEED_LAYER


@njit(**NJIT_INLINE)
def slide_at_reversal(x, v, x1, v1, angle):
    """Return the relative displacement at a reversal in a step that contains no event.

    If there is no reversal, it is that at the end of the step.

    Parameters
    ----------
    x, v, x1, v1, angle
        See `rigid_kernels.slide_at_reversal`.

    Returns
    -------
    float
    """
    u = v / (v - v1)
    is_reversed = friction.HAS_SPEED_LAYER and v * v1 < 0.0
    return hermite_cubic(x, x1, angle * v, angle * v1, u) if is_reversed else x1


@njit(**NJIT_INLINE)
def advance_angle(sine, cosine, angle):
    """Return sine and cosine of the drive after a further angle up to 0.2 rad, to 1e-9.

    Parameters
    ----------
    sine, cosine : float
        Sine and cosine before the angle.
    angle : float
        [rad]

    Returns
    -------
    float
        Sine.
    float
        Cosine.
    """
    t = angle
    t2 = t * t
    cosine_part = 1 + t2 * (-1 / 2 + t2 * (1 / 24 - t2 * (1 / 720)))
    sine_part = t * (1 + t2 * (-1 / 6 + t2 * (1 / 120 - t2 * (1 / 5040))))
    return sine * cosine_part + cosine * sine_part, cosine * cosine_part - sine * sine_part


@njit(**NJIT_INLINE)
def step_to_speed(workspace, lane, state, sine, cosine, end_speed):
    """Integrate the motion up to a given speed, with the speed as independent variable.

    The force of a layer depends on the speed alone, so it is known beforehand.

    Parameters
    ----------
    workspace, lane
        See `rigid_kernels.friction_force`.
    state : FlowState
    sine, cosine : float
        Of the drive at the start.
    end_speed : float

    Returns
    -------
    LayerPart
    """
    x, v, f, z, q = state
    numbers = law_numbers(workspace, lane)
    drive = workspace[RowStart.DRIVE + lane]
    damping = workspace[RowStart.DAMPING + lane]
    stiffness = workspace[RowStart.STIFFNESS + lane]
    half = (end_speed - v) / 2
    middle = v + half
    third = half / 3
    fm = friction.rate_equation(numbers, z, middle, SIGN_IN_LAYER)[0]
    fe = friction.rate_equation(numbers, z, end_speed, SIGN_IN_LAYER)[0]
    # These are the phase angles at the Runge-Kutta stages, divided by the angular speed.
    r = 1 / (drive * sine - damping * v - stiffness * x - f)
    sine1 = advance_angle(sine, cosine, half * r)[0]
    r1 = 1 / (drive * sine1 - damping * middle - stiffness * (x + half * v * r) - fm)
    sine2 = advance_angle(sine, cosine, half * r1)[0]
    r2 = 1 / (drive * sine2 - damping * middle - stiffness * (x + half * middle * r1) - fm)
    sine3 = advance_angle(sine, cosine, 2 * half * r2)[0]
    r3 = 1 / (drive * sine3 - damping * end_speed - stiffness * (x + 2 * half * middle * r2) - fe)
    mean = 2 * (r1 + r2)
    slide = third * (v * r + middle * mean + end_speed * r3)
    return LayerPart(
        third * (r + mean + r3),
        FlowState(x + slide, end_speed, fe, z, q),
        third * (f * v * r + fm * middle * mean + fe * end_speed * r3),
    )


@njit(**NJIT_INLINE)
def add_part_measures(workspace, lane, start, first, end, last, angle):
    """Add the peaks and the loop work of a part of a step to the measures.

    Parameters
    ----------
    workspace, lane
        See `rigid_kernels.friction_force`.
    start, end : FlowState
    first, last : tuple of float
        Sine and cosine of the drive and acceleration at both ends.
    angle : float
        [rad]
    """
    output = workspace[RowStart.OUTPUT_GAIN + lane]
    base = workspace[RowStart.BASE_GAIN + lane]
    drive = workspace[RowStart.DRIVE + lane]
    damping = workspace[RowStart.DAMPING + lane]
    stiffness = workspace[RowStart.STIFFNESS + lane]
    sine, cosine, a = first
    sine1, cosine1, a1 = last
    first_state = LaneState(start.slide, start.speed, SIGN_IN_LAYER, 0.0)
    last_state = LaneState(end.slide, end.speed, SIGN_IN_LAYER, 0.0)
    rate = friction_rate(first_state, a, workspace, lane, AT_START)
    rate1 = friction_rate(last_state, a1, workspace, lane, AT_END)
    jerk = output * (drive * cosine - damping * a - stiffness * start.speed - rate) + base * cosine
    jerk1 = (
        output * (drive * cosine1 - damping * a1 - stiffness * end.speed - rate1) + base * cosine1
    )
    peak = cubic_peak(
        output * a + base * sine, output * a1 + base * sine1, angle * jerk, angle * jerk1
    )
    force = cubic_peak(start.friction, end.friction, angle * rate, angle * rate1)
    work = 0.5 * (start.friction + end.friction) * (end.slide - start.slide)
    workspace[RowStart.MAX_ACCELERATION + lane] = max(
        workspace[RowStart.MAX_ACCELERATION + lane], peak
    )
    workspace[RowStart.MAX_FORCE + lane] = max(workspace[RowStart.MAX_FORCE + lane], force)
    workspace[RowStart.LOOP_WORK + lane] += work
    workspace[RowStart.LOOP_WORK_SIZE + lane] += abs(work)


@njit(**NJIT_INLINE)
def count_layer_parts(workspace, lane, state, s0, s1, angle):
    """Return the number of equal parts in which a step crosses a regularisation layer.

    Parameters
    ----------
    workspace, lane
        See `rigid_kernels.friction_force`.
    state : FlowState
        State at the start of the step.
    s0, s1 : float
        Sine of the drive at both ends of the step.
    angle : float
        [rad]

    Returns
    -------
    int
    """
    numbers = law_numbers(workspace, lane)
    edge_speed, width = speed_layer(numbers, angle)
    sines = (s0, workspace[RowStart.MIDPOINT_FACTOR + lane] * (s0 + s1), s1)
    end, _ = runge_kutta_step(workspace, lane, state, SIGN_IN_LAYER, sines, angle)
    v = state.speed
    slowest = 0.0 if v * end.speed < 0.0 else min(abs(v), abs(end.speed))
    if slowest >= edge_speed:
        return 1
    return int(min(abs(end.speed - v) / width, MAX_LAYER_PARTS - 1.0)) + 1


@njit(**NJIT_INLINE)
def plan_layer_step(workspace, lane, state, step):
    """Plan how a step through a regularisation layer is divided into parts.

    Parameters
    ----------
    workspace, lane
        See `rigid_kernels.friction_force`.
    state : FlowState
        State at the start of the step.
    step : AngleStep

    Returns
    -------
    LayerPlan
    """
    numbers = law_numbers(workspace, lane)
    drive = workspace[RowStart.DRIVE + lane]
    damping = workspace[RowStart.DAMPING + lane]
    stiffness = workspace[RowStart.STIFFNESS + lane]
    edge_speed, width = speed_layer(numbers, step.angle)
    free = drive * step.s0 - damping * state.speed - stiffness * state.slide
    side = 1.0 if free > 0.0 else -1.0
    free_rate = drive * step.c0 - damping * (free - state.friction) - stiffness * state.speed
    change = step.angle * abs(free_rate)
    flies = side * free > FREE_FLIGHT_FACTOR * numbers[1] + change
    n_parts = MAX_LAYER_PARTS
    if not flies:
        n_parts = count_layer_parts(workspace, lane, state, step.s0, step.s1, step.angle)
    return LayerPlan(flies, side, n_parts, edge_speed, width, step.angle)


@njit(**NJIT_INLINE)
def next_layer_part(workspace, lane, state, remaining_step, plan, is_last):
    """Compute the next part of a step through a regularisation layer.

    Parameters
    ----------
    workspace, lane
        See `rigid_kernels.friction_force`.
    state : FlowState
        State at the start of the part.
    remaining_step : AngleStep
        Remainder of the step.
    plan : LayerPlan
    is_last : bool
        Whether this is the last part that the plan allows.

    Returns
    -------
    LayerPart
    bool
        Whether the part ends the step.
    """
    v = state.speed
    side = plan.side
    if plan.flies and not is_last and side * v < plan.edge_speed:
        end_speed = v + side * plan.width
        if side * v < -plan.edge_speed:
            end_speed = -side * plan.edge_speed
        part = step_to_speed(
            workspace, lane, state, remaining_step.s0, remaining_step.c0, end_speed
        )
        if 0.0 < part.angle < remaining_step.angle:
            return part, False
    is_last = plan.flies or is_last
    t = remaining_step.angle if is_last else plan.angle / plan.n_parts
    end_sine = (
        remaining_step.s1 if is_last else advance_angle(remaining_step.s0, remaining_step.c0, t)[0]
    )
    sines = (
        remaining_step.s0,
        advance_angle(remaining_step.s0, remaining_step.c0, t / 2)[0],
        end_sine,
    )
    end, work = runge_kutta_step(workspace, lane, state, SIGN_IN_LAYER, sines, t)
    return LayerPart(t, end, work), is_last


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def resolve_layer_step(workspace, lane, step):
    """Compute a step of a law with a regularisation layer in parts that resolve the layer.

    The function adds to the sums of the step what the trapezoidal rule between its ends leaves out.

    Parameters
    ----------
    workspace, lane, step
        See `rigid_kernels.resolve_step`.

    Returns
    -------
    StepOutcome
    """
    state = flow_state(workspace, lane)
    plan = plan_layer_step(workspace, lane, state, step)
    angle = step.angle
    start_speed = state.speed
    start_rate = flow_acceleration(workspace, lane, state, step.s0)
    s = step.s0
    c = step.c0
    a = start_rate
    elapsed = 0.0
    work = 0.0
    event = 1.0
    event_slide = nan
    work_sum = 0.0
    loss_sum = 0.0
    for n in range(plan.n_parts):
        remaining_step = AngleStep(s, c, step.s1, step.c1, angle - elapsed)
        part, is_last = next_layer_part(
            workspace, lane, state, remaining_step, plan, n == plan.n_parts - 1
        )
        t = part.angle
        end = part.end
        s2 = step.s1
        c2 = step.c1
        if not is_last:
            s2, c2 = advance_angle(s, c, t)
        v = state.speed
        v1 = end.speed
        a1 = flow_acceleration(workspace, lane, end, s2)
        if workspace[StretchRowStart.IS_OBSERVED + lane] > 0.0:
            add_part_measures(workspace, lane, state, (s, c, a), end, (s2, c2, a1), t)
        if v * v1 <= 0.0 and v != 0.0:
            fraction = find_hermite_root(v, v1, t * a, t * a1)
            event = (elapsed + fraction * t) / angle
            event_slide = hermite_cubic(state.slide, end.slide, t * v, t * v1, fraction)
        # Hermite's rule integrates sin x' and x'^2 over the part.
        work_sum += t * (s * v + s2 * v1 + t / 6 * (c * v + s * a - c2 * v1 - s2 * a1)) / 2
        loss_sum += t * (v * v + v1 * v1 + t / 3 * (v * a - v1 * a1)) / 2
        work += part.work
        elapsed += t
        state = end
        s = s2
        c = c2
        a = a1
        if is_last:
            break
    v = start_speed
    v1 = state.speed
    # The trapezoidal rule over the run adds the ends of this step. Its
    # correction adds the ends of the run.
    work_ends = angle / 12 * (step.c1 * v1 + step.s1 * a - step.c0 * v - step.s0 * start_rate)
    loss_ends = angle / 6 * (v1 * a - v * start_rate)
    workspace[RowStart.WORK_SUM + lane] += (
        work_sum / angle + work_ends - (step.s0 * v + step.s1 * v1) / 2
    )
    workspace[RowStart.LOSS_SUM + lane] += loss_sum / angle + loss_ends - (v * v + v1 * v1) / 2
    workspace[StretchRowStart.FRICTION + lane] = state.friction
    workspace[StretchRowStart.STRETCH_SQUARE + lane] = state.square
    workspace[StretchRowStart.STEP_WORK + lane] = work
    is_reversed = event_slide == event_slide
    slip_sign = -workspace[RowStart.SLIP_SIGN + lane]
    if v1 != 0.0:
        slip_sign = 1.0 if v1 > 0.0 else -1.0
    if not is_reversed:
        event_slide = state.slide
    event_speed = 0.0 if is_reversed else v1
    return StepOutcome(
        state.slide,
        v1,
        slip_sign,
        state.stretch,
        event,
        event_slide,
        event_speed,
        0.0,
        event_slide,
        0.0,
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def resolve_step(workspace, lane, step):
    """Compute a step that is split at reversals and at kinks of the friction law.

    The irreversible part of the slide reverses at a kink, so its range is updated here.

    Parameters
    ----------
    workspace, lane, step
        See `rigid_kernels.resolve_step`.

    Returns
    -------
    StepOutcome
    """
    if friction.HAS_SPEED_LAYER:
        return resolve_layer_step(workspace, lane, step)
    numbers = law_numbers(workspace, lane)
    state = flow_state(workspace, lane)
    first_sign = workspace[RowStart.SLIP_SIGN + lane]
    slip_sign = first_sign
    event = 1.0
    at_reversal = state
    elapsed = 0.0
    work = 0.0
    for part in range(MAX_PARTS):
        remaining_angle = step.angle - elapsed
        sine = step.s0 * cos(elapsed) + step.c0 * sin(elapsed)
        middle = elapsed + remaining_angle / 2
        sines = (sine, step.s0 * cos(middle) + step.c0 * sin(middle), step.s1)
        end, part_work = runge_kutta_step(workspace, lane, state, slip_sign, sines, remaining_angle)
        first = find_first_event(workspace, lane, state, end, slip_sign, sines, remaining_angle)
        fraction = first.fraction
        if part == MAX_PARTS - 1 or not (first.is_reversal or fraction < 1.0):
            break
        if fraction > 0.0:
            reached = state
            for _ in range(1 + N_CORRECTIONS):
                event_angle = elapsed + fraction * remaining_angle
                middle = elapsed + fraction * remaining_angle / 2
                event_sine = step.s0 * cos(event_angle) + step.c0 * sin(event_angle)
                sines = (sine, step.s0 * cos(middle) + step.c0 * sin(middle), event_sine)
                reached, part_work = runge_kutta_step(
                    workspace, lane, state, slip_sign, sines, fraction * remaining_angle
                )
                v = reached.speed
                z = reached.stretch
                distance = z
                rate = friction.rate_equation(numbers, z, v, slip_sign)[1] * v
                if first.is_reversal:
                    distance = v
                    rate = flow_acceleration(workspace, lane, reached, event_sine)
                if abs(distance) < remaining_angle * abs(rate):
                    fraction = min(max(fraction - distance / (remaining_angle * rate), 0.0), 1.0)
            work += part_work
            elapsed = event_angle
            v = 0.0 if first.is_reversal else reached.speed
            z = reached.stretch if first.is_reversal else 0.0
            force = friction.rate_equation(numbers, z, v, slip_sign)[0]
            state = FlowState(reached.slide, v, force, z, reached.square)
            if not first.is_reversal and workspace[StretchRowStart.IS_OBSERVED + lane] > 0.0:
                slip = reached.slide
                workspace[RowStart.MAX_SLIP + lane] = max(workspace[RowStart.MAX_SLIP + lane], slip)
                workspace[RowStart.MIN_SLIP + lane] = min(workspace[RowStart.MIN_SLIP + lane], slip)
        if first.is_reversal:
            slip_sign = -slip_sign
            event = elapsed / step.angle
            at_reversal = state
    workspace[StretchRowStart.FRICTION + lane] = end.friction
    workspace[StretchRowStart.STRETCH_SQUARE + lane] = end.square
    workspace[StretchRowStart.STEP_WORK + lane] = work + part_work
    if slip_sign == first_sign:
        event = 1.0
        at_reversal = end
    return StepOutcome(
        end.slide,
        end.speed,
        slip_sign,
        end.stretch,
        event,
        at_reversal.slide,
        at_reversal.speed,
        at_reversal.stretch,
        at_reversal.slide,
        0.0,
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def stretch_in_segment(start, end, numbers, angle, u):
    """Return the stretch inside a segment of a step.

    Parameters
    ----------
    start, end : observation_kernels.Instant
    numbers : tuple
        See `law_numbers`.
    angle : float
        Angle of the segment [rad].
    u : float
        Fraction of the segment.

    Returns
    -------
    float
    """
    slip_sign = start.state.slip_sign
    x = start.state.slide
    v = start.state.speed
    z = start.state.memory
    v1 = end.state.speed
    z1 = end.state.memory
    if friction.IS_RATE_INDEPENDENT:
        slide = hermite_cubic(x, end.state.slide, angle * v, angle * v1, u) - x
        return friction.integrate_stretch(numbers, z, 0.0, slide, slip_sign)[0]
    rate = v * friction.rate_equation(numbers, z, v, slip_sign)[1]
    rate1 = v1 * friction.rate_equation(numbers, z1, v1, slip_sign)[1]
    return hermite_cubic(z, z1, angle * rate, angle * rate1, u)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def is_stuck_in_segment(start, end, numbers, angle, u):
    """Return whether the interface sticks at a point of a segment of a step.

    Parameters
    ----------
    start, end, numbers, angle, u
        See `stretch_in_segment`.

    Returns
    -------
    bool
    """
    speed = hermite_cubic(
        start.state.speed, end.state.speed, angle * start.acceleration, angle * end.acceleration, u
    )
    stretch = stretch_in_segment(start, end, numbers, angle, u)
    gain = friction.rate_equation(numbers, stretch, speed, start.state.slip_sign)[1]
    return abs(1 - gain) < SLIP_FRACTION


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def find_stick_change(start, end, numbers, angle, low, high):
    """Find by bisection where a stick starts or ends in a segment of a step.

    Parameters
    ----------
    start, end, numbers, angle
        See `stretch_in_segment`.
    low, high : float
        Bounds of the fraction of the segment.

    Returns
    -------
    float
    """
    sticks = is_stuck_in_segment(start, end, numbers, angle, low)
    for _ in range(N_HALVINGS):
        u = 0.5 * (low + high)
        if is_stuck_in_segment(start, end, numbers, angle, u) == sticks:
            low = u
        else:
            high = u
    return low


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def find_zero_stretch(start, end, numbers, angle):
    """Find by bisection where the stretch changes its sign in a segment of a step.

    Parameters
    ----------
    start, end, numbers, angle
        See `stretch_in_segment`.

    Returns
    -------
    float
        Fraction of the segment.
    """
    low = 0.0
    high = 1.0
    for _ in range(N_HALVINGS):
        u = 0.5 * (low + high)
        is_negative = stretch_in_segment(start, end, numbers, angle, u) < 0.0
        if is_negative == (start.state.memory < 0.0):
            low = u
        else:
            high = u
    return low


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def stick_fractions(start, end, workspace, lane, angle):
    """Return the stick and slip fractions in a segment of a step.

    Relative displacement, speed and stretch are cubics between the ends of the segment.

    The irreversible slide reverses where the stretch is 0; at a kink `resolve_step` notes where.

    Parameters
    ----------
    start, end, workspace, lane, angle
        See `rigid_kernels.stick_fractions`.

    Returns
    -------
    StickFractions
    """
    numbers = law_numbers(workspace, lane)
    x = start.state.slide
    x1 = end.state.slide
    extreme_slip = irreversible_slide(x1, end.state.memory, workspace, lane)
    turnover = 1.0
    if start.state.memory * end.state.memory < 0.0:
        turnover = find_zero_stretch(start, end, numbers, angle)
        if not friction.HAS_ZERO_KINK:
            v = start.state.speed
            extreme_slip = hermite_cubic(x, x1, angle * v, angle * end.state.speed, turnover)
    sticks = is_stuck_in_segment(start, end, numbers, angle, 0.0)
    last_sticks = is_stuck_in_segment(start, end, numbers, angle, 1.0)
    if sticks != last_sticks:
        u = find_stick_change(start, end, numbers, angle, 0.0, 1.0)
        return StickFractions(u if sticks else 1 - u, u if sticks else 2.0, extreme_slip)
    if sticks or not is_stuck_in_segment(start, end, numbers, angle, turnover):
        return StickFractions(1.0 if sticks else 0.0, 2.0, extreme_slip)
    # The interface slips at both ends with stretches of opposite sign, so it may stick in between.
    release = find_stick_change(start, end, numbers, angle, turnover, 1.0)
    stick = find_stick_change(start, end, numbers, angle, 0.0, turnover)
    return StickFractions(release - stick, release, extreme_slip)
