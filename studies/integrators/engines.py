"""Every engine of the work-precision study as one callable: (problem, knob) to the slide at the problem's times.

An engine of ours more is one entry in `OURS`.
"""

import sys
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from engine_problems import ALL, POINT, POINTS, Problem, event_driven, march
from report_methods import Motion, coulomb, solve_duhamel, solve_euler, solve_newmark
from switched import PROBLEMS, follow


def _sampled_slide(motion: Motion, one: Problem, steps: int) -> np.ndarray:
    """Return the slide of a motion at the sample times of the problem."""
    return (motion.z[-one.last * steps - 1 :] @ one.modes.slide)[:: steps // POINTS][1:]


def _duhamel_motion(one: Problem, steps: int, stick_speed: float, **how) -> np.ndarray:
    """Return the motion by Duhamel's integral (3.10)."""
    motion = solve_duhamel(
        one.modes,
        one.drive,
        coulomb(one.limit, stick_speed),
        (one.cycles * one.drive.period, steps),
        start=one.start,
        **how,
    )
    return _sampled_slide(motion, one, steps)


def duhamel_report(one: Problem, steps: int) -> np.ndarray:
    """Integrate by (3.10) as in the report: the law sgn(v), iterated until the velocity changes by less than 1e-4."""
    return _duhamel_motion(one, steps, 0.0, criterion="velocity", tolerance=1e-4, relaxation=0.1)


def duhamel_cured(one: Problem, steps: int) -> np.ndarray:
    """Integrate by (3.10) with a static branch that narrows with the step; the force converges to 1e-9 of its limit."""
    return _duhamel_motion(one, steps, 0.1 * one.drive.period / steps, tolerance=1e-9 * one.limit)


def newmark_motion(
    one: Problem, steps: int, stick_speed: float, *, needs_force: bool
) -> np.ndarray:
    """Return the motion by Newmark's method.

    Parameters
    ----------
    one : Problem
    steps : int
        Steps per cycle.
    stick_speed : float
        Speed below which the interface stops [m/s].
    needs_force : bool
        The interface stops only where its friction suffices to hold it.
    """
    motion = solve_newmark(
        one.modes,
        one.drive,
        coulomb(one.limit, stick_speed),
        (one.cycles * one.drive.period, steps),
        needs_force=needs_force,
        start=one.start,
    )
    return _sampled_slide(motion, one, steps)


def newmark_report(one: Problem, steps: int) -> np.ndarray:
    """Integrate by Newmark's method with a stick speed of 1e-3; only the speed decides about sticking."""
    return newmark_motion(one, steps, 1e-3, needs_force=False)


def newmark_cured(one: Problem, steps: int) -> np.ndarray:
    """Integrate by Newmark's method.

    The block sticks if static friction suffices and the speed is below what friction removes in one
    step.
    """
    stick_speed = one.limit * one.drive.period / steps
    return newmark_motion(one, steps, stick_speed, needs_force=True)


def euler_tanh(one: Problem, steps: int) -> np.ndarray:
    """Integrate with the friction force limit tanh(v/1e-3) by explicit Euler steps."""
    motion = solve_euler(
        one.modes,
        one.drive,
        one.limit,
        1e-3,
        (one.cycles * one.drive.period, steps),
        one.start,
    )
    return _sampled_slide(motion, one, steps)


def advancer(tolerance: float, size: float):
    """Return the function `advance` of `switched`, based on SciPy's DOP853 with one event."""

    def advance(rhs, event, t, y, end, longest, wanted):
        def stop(t, y):
            return event(t, y)

        stop.terminal = True
        stop.direction = -1
        found = solve_ivp(
            rhs,
            (t, end),
            y,
            "DOP853",
            events=stop,
            rtol=tolerance,
            atol=tolerance * size,
            max_step=longest,
            t_eval=wanted,
        )
        if found.status < 0:
            raise RuntimeError(found.message)
        states = np.asarray(found.y).T if len(found.t) else []
        if found.status == 1:
            return found.t_events[0][-1], found.y_events[0][-1], states
        return end, found.y[:, -1], states

    return advance


def slide_and_events(one: Problem, tolerance: float, longest: float) -> tuple:
    """Integrate by SciPy's DOP853 from event to event; return the slide and the number of events.

    Parameters
    ----------
    one : Problem
    tolerance : float
    longest : float
        Longest step in cycles.
    """
    return follow(
        PROBLEMS[one.name](**one.numbers), advancer(tolerance, one.size), one.times, longest
    )


def dop853(one: Problem, tolerance: float) -> np.ndarray:
    """Integrate by SciPy's DOP853 from event to event; return the slide."""
    return slide_and_events(one, tolerance, one.longest)[0]


COARSE = (100, 200, 400, 800, 1600, 3200, 6400)
FINE = (1000, 2000, 4000, 8000, 16000, 32000)
OURS = {  # {name: (callable, accuracy settings, problems)}; a further integrator is a further entry
    "event_driven": (event_driven, (1e-3, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12), ALL),
    "march": (march, (*COARSE, 12800, 25600), ALL),
    "duhamel, report": (duhamel_report, COARSE, POINT),
    "duhamel, static branch": (duhamel_cured, COARSE, POINT),
    "newmark, stick speed": (newmark_report, COARSE, POINT),
    "newmark, and force": (newmark_cured, COARSE, POINT),
    "euler, tanh": (euler_tanh, FINE, POINT),
    "DOP853 + events": (dop853, (1e-3, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12), ALL),
}
