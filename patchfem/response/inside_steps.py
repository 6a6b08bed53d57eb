"""Motion of an interface within time steps, for a friction force that changes in a step.

In: samples at the ends of steps, and the LuGre law. Out: the window with samples inside the
steps. The force of the LuGre law exceeds its kinetic limit while the slide reverses. If the
slide is many times the length over which the stretch relaxes, this takes less than a step and
is not visible at the ends of the steps. Here the law is integrated along the cubic through
slides and rates: every step is divided into N_SUBSTEPS parts, and a reversal of the slide is the end
of a part.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..core import Response
from ..friction.laws.lugre import LuGre
from .measures import find_reversal_steps

# Number of substeps per step; with 16, the error in peaks of 60 rigs is below the time-step error.
N_SUBSTEPS = 16


class Steps(NamedTuple):
    """Times [s], displacements [m] and speeds [m/s] at the ends of all substeps."""

    time: np.ndarray
    slide: np.ndarray
    speed: np.ndarray


def motion_inside_steps(window: Response, law: LuGre, load: float) -> Response:
    """Add the ends of all substeps to the samples of an interface in a window.

    Parameters
    ----------
    window : Response
        Samples (k,) at the ends of steps.
    law : LuGre
    load : float
        Normal load [N], constant.

    Returns
    -------
    Response
        time, slide, slide_rate, force and slip have (k - 1) N_SUBSTEPS + 1 samples; all other fields are
        those of the window.
    """
    parts = divide_steps(window.time, window.slide, window.slide_rate)
    time, slide, speed = (
        np.append(first, inside.ravel())
        for first, inside in zip((window.time[0], window.slide[0], window.slide_rate[0]), parts)
    )
    duration = np.diff(time)
    increment = np.diff(slide)
    mean_speed = np.divide(increment, duration, out=np.zeros_like(increment), where=duration > 0)
    length = law.limit(mean_speed) / law.stiffness
    kept = np.exp(-np.abs(increment) / length)
    stretch = evaluate_recursion(
        window.slide[0] - window.slip[0],
        kept.reshape(-1, N_SUBSTEPS),
        ((1 - kept) * np.sign(increment) * length).reshape(-1, N_SUBSTEPS),
    )
    rate = speed - law.stiffness * np.abs(speed) * stretch / law.limit(speed)
    force = load * (law.stiffness * stretch + law.micro_damping * rate + law.viscous * speed)
    return replace(
        window, time=time, slide=slide, slide_rate=speed, slip=slide - stretch, force=force
    )


def divide_steps(time, slide, speed) -> Steps:
    """Divide the steps between samples into substeps, on cubics of the displacement.

    If the speed changes sign in a step, half of its substeps lie before the reversal. A reversal
    that is closer to a sample than a substep stays inside one of the substeps there, because
    shorter substeps would have displacements of the size of round-off.

    Parameters
    ----------
    time, slide, speed : (k,)
        Times [s], slides [m] and speeds [m/s].

    Returns
    -------
    Steps
    """
    step = np.diff(time)
    share = np.tile(np.arange(1, N_SUBSTEPS + 1) / N_SUBSTEPS, (step.size, 1))
    turns, at, _ = find_reversal_steps(time, slide, speed)
    middle = np.clip(at, 1 / N_SUBSTEPS, 1 - 1 / N_SUBSTEPS)[:, None]
    half = np.arange(1, N_SUBSTEPS // 2 + 1) / (N_SUBSTEPS // 2)
    share[turns] = np.column_stack([middle * half, middle + (1 - middle) * half])
    begin = speed[:-1] * step
    end = speed[1:] * step
    rise = np.diff(slide)
    two = 3 * rise - 2 * begin - end
    three = begin + end - 2 * rise
    begin, two, three, first, step = (one[:, None] for one in (begin, two, three, slide[:-1], step))
    inside = Steps(
        time[:-1, None] + step * share,
        first + share * (begin + share * (two + share * three)),
        (begin + share * (2 * two + 3 * share * three)) / step,
    )
    inside.slide[:, -1] = slide[1:]
    inside.speed[:, -1] = speed[1:]
    inside.time[:, -1] = time[1:]
    return inside


def evaluate_recursion(start: float, factor, increment) -> np.ndarray:
    """Evaluate the recursion x -> factor x + increment over all substeps.

    Parameters
    ----------
    start : float
        First value.
    factor, increment : (k, p)
        Factor and increment of each substep.
    """
    product = np.cumprod(factor, axis=1)
    term = increment.copy()
    for part in range(1, factor.shape[1]):
        term[:, part] += factor[:, part] * term[:, part - 1]
    starts = [start]
    for total_factor, total_increment in zip(product[:-1, -1].tolist(), term[:-1, -1].tolist()):
        starts.append(total_factor * starts[-1] + total_increment)
    return np.append(start, product * np.array(starts)[:, None] + term)
