"""Every engine of the work-precision study as one callable: (problem, knob) to the slide at the problem's times.

An engine of ours more is one entry in `OURS`.
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from engine_problems import ALL, KIND, POINT, POINTS, Problem, exact, march
from report_methods import duhamel, euler, newmark
from report_methods.point_laws import Coulomb, Smooth
from switched import PROBLEMS, follow

from patchfem.friction.laws.elastic_plastic import ElasticPlastic
from patchfem.friction.laws.tanh import Rate


def _compared(method, one: Problem, steps: int, law, **how) -> np.ndarray:
    modes, laws = one.modes, (law,)
    if one.elements is not None:
        k, y = one.elements
        laws = tuple(Smooth(ElasticPlastic(a * b, b).element(1.0)) for a, b in zip(k, y))
        modes = replace(modes, faces=np.tile(modes.slide, (k.size, 1)))
    found = method.run(
        modes, one.drive, laws, one.cycles * one.drive.period, steps, start=one.start, **how
    )
    return (found.z[-one.last * steps - 1 :] @ modes.slide)[:: steps // POINTS][1:]


def duhamel_report(one: Problem, steps: int) -> np.ndarray:
    """(3.10) as the report ran it: sgn(v), the velocity unchanged to 1e-4."""
    return _compared(
        duhamel,
        one,
        steps,
        Coulomb(one.limit, one.limit),
        convergence="velocity",
        tolerance=1e-4 if one.elements is None else 1e-9,
        relax=0.1 if one.elements is None else 0.5,
    )


def duhamel_cured(one: Problem, steps: int) -> np.ndarray:
    """(3.10) with a static branch that narrows with the step, the force to 1e-9 of its limit."""
    return _compared(
        duhamel,
        one,
        steps,
        Coulomb(one.limit, one.limit, 0.1 * one.drive.period / steps),
        convergence="force",
        tolerance=1e-9 * one.limit,
    )


def newmark_report(one: Problem, steps: int) -> np.ndarray:
    """Newmark with a stick speed of 1e-3, stopped by the speed alone."""
    return _compared(newmark, one, steps, Coulomb(one.limit, one.limit, 1e-3))


def newmark_cured(one: Problem, steps: int) -> np.ndarray:
    """Newmark, stopped where the static friction suffices below what friction takes off the speed in a step."""
    return _compared(
        newmark,
        one,
        steps,
        Coulomb(one.limit, one.limit, one.limit * one.drive.period / steps),
        by_force=True,
    )


def euler_tanh(one: Problem, steps: int) -> np.ndarray:
    """Explicit Euler and friction limit tanh(v/1e-3)."""
    return _compared(euler, one, steps, Smooth(Rate(one.limit, 1e-3).element(1.0)))


def advancer(tolerance: float, size: float):
    """`advance` of `switched` by scipy's DOP853 with one event."""

    def advance(rhs, event, t, y, end, longest, wanted):
        def stop(t, y):
            return event(t, y)

        stop.terminal, stop.direction = True, -1
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


def counted(one: Problem, tolerance: float, longest: float) -> tuple:
    """(slide, events) of scipy's DOP853 from event to event, no step longer than so many cycles."""
    return follow(
        PROBLEMS[KIND[one.name]](**one.numbers), advancer(tolerance, one.size), one.times, longest
    )


def dop853(one: Problem, tolerance: float) -> np.ndarray:
    """scipy's DOP853 from event to event."""
    return counted(one, tolerance, one.longest)[0]


COARSE = (100, 200, 400, 800, 1600, 3200, 6400)
FINE = (1000, 2000, 4000, 8000, 16000, 32000)
OURS = {  # name: (callable, knobs, problems); one entry more for an engine more
    "exact": (exact, (0,), POINT),
    "march": (march, (*COARSE, 12800, 25600), ALL),
    "duhamel, report": (duhamel_report, COARSE, POINT),
    "duhamel, static branch": (duhamel_cured, COARSE, ALL),
    "newmark, stick speed": (newmark_report, COARSE, POINT),
    "newmark, and force": (newmark_cured, COARSE, ALL),
    "euler, tanh": (euler_tanh, FINE, ALL),
    "DOP853 + events": (dop853, (1e-3, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12), ALL),
}
