"""The report's explicit Euler steps, meant for friction that follows the speed (2.4-2.7).

Explicit Euler multiplies a free vibration by |1 + i w h| per step: it takes w h/2 off the damping ratio of every mode,
and friction limit tanh(v/v_0) shakes at rest for h > 2 v_0 m/limit.
"""

import numpy as np

from patchfem.core import InitialState, ModalBasis

from .point_laws import elastic_rates, sticking_warnings
from .steps import Comparison, finish, grid


def run(
    modes: ModalBasis,
    drive,
    laws,
    duration: float,
    steps_per_cycle: int = 400,
    start: InitialState | None = None,
) -> Comparison:
    """Run from `start` (None: rest) for `duration` [s] by explicit Euler steps.

    laws: one of point_laws per interface. PatchfemError as in `comparison.grid`. Warnings say what the step takes off
    the damping.
    """
    found = grid(modes, drive, laws, (duration, steps_per_cycle), start)
    with np.errstate(over="ignore", invalid="ignore"):
        found.loops.euler_loop(
            found.rig, found.drive, found.laws, found.h, found.filled, found.room
        )
        return finish(
            modes,
            found,
            0,
            [
                *sticking_warnings(modes, laws, found.h),
                *_warnings(modes, laws, found.h, steps_per_cycle),
            ],
        )


def damping_left(modes: ModalBasis, h: float) -> np.ndarray:
    """Damping ratios (n,) that a step of h [s] leaves: the modes' own less omega h/2; nan for a rigid mode."""
    w = modes.omega
    own = np.divide(np.diag(modes.damping_matrix), 2 * w, out=np.full(w.size, np.nan), where=w > 0)
    return own - w * h / 2


def _warnings(modes, laws, h, steps: int) -> list:
    out, left = [], damping_left(modes, h)
    if np.any(np.isfinite(left)):
        i = int(np.nanargmin(left))
        lost = modes.omega * h / 2
        own, grows = left + lost, ""
        if left[i] < 0:
            damped = np.all(own[modes.omega > 0] > 0)
            times = int(np.ceil(np.nanmax(lost / own))) if damped else 0
            grows = ", so the free vibration of this mode grows; " + (
                f"set accuracy.steps_per_cycle = {steps * times}"
                if times
                else "no step size of this method damps this vibration"
            )
        out.append(
            f"explicit Euler lowers the damping ratio of mode '{modes.names[i]}' by {lost[i]:.3g}, from "
            f"{own[i]:.3g} to {left[i]:.3g}{grows}"
        )
    for one, face in zip(laws, modes.interfaces):
        pace = np.sum(face**2) / modes.mass * one.steepness
        if h * pace > 2:
            out.append(
                f"a time step of {h:.3g} s is longer than 2 v_0 m/F = {2 / pace:.3g} s (v_0: speed of the law, "
                "m: mass, F: friction limit), so the computed friction force changes its sign from step to step "
                "while the interface hardly moves"
            )
    return out + [
        "explicit Euler lowers the damping ratio of the vibration on the elastic contact from 0 to "
        f"-{h * rate / 2:.3g}"
        for rate in elastic_rates(modes, laws)
    ]
