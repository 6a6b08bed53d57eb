"""Motion of an interface inside the steps of a march, for laws whose force changes within a step.

The force of the LuGre law rises over its kinetic limit while the slide turns. That lasts less than a step where the
slide is many times the length over which the stretch relaxes, so samples at the ends of steps do not show it. Here the
law follows the cubic through slides and rates: every step has PARTS parts, and the turn of a slide is the end of one.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..core import Response
from ..friction.laws.lugre import LuGre
from .measures import turn_shares

# parts of a step; with so many the peaks of 60 rigs change by less than those of a step do
PARTS = 16


class Steps(NamedTuple):
    """Parts of every step between two samples: times [s], slides [m] and speeds [m/s] at their ends, (k, PARTS)."""

    time: np.ndarray
    slide: np.ndarray
    speed: np.ndarray


def motion_inside_steps(window: Response, law: LuGre, load: float) -> Response:
    """Return the interface of a window with the ends of all parts of its steps as samples.

    Parameters
    ----------
    window : Response
        Samples (k,) at the ends of steps.
    law : LuGre
    load : float
        Normal load [N], which stays.

    Returns
    -------
    Response
        Its time, slide, slide_rate, force and slip have (k - 1) PARTS + 1 samples; all else is that of the window.
    """
    parts = divide_steps(window.time, window.slide, window.slide_rate)
    time, slide, speed = (
        np.append(first, inside.ravel())
        for first, inside in zip((window.time[0], window.slide[0], window.slide_rate[0]), parts)
    )
    duration, increment = np.diff(time), np.diff(slide)
    mean_speed = np.divide(increment, duration, out=np.zeros_like(increment), where=duration > 0)
    length = law.limit(mean_speed) / law.stiffness
    kept = np.exp(-np.abs(increment) / length)
    stretch = relax(
        window.slide[0] - window.slip[0],
        kept.reshape(-1, PARTS),
        ((1 - kept) * np.sign(increment) * length).reshape(-1, PARTS),
    )
    rate = speed - law.stiffness * np.abs(speed) * stretch / law.limit(speed)
    force = load * (law.stiffness * stretch + law.micro_damping * rate + law.viscous * speed)
    return replace(
        window, time=time, slide=slide, slide_rate=speed, slip=slide - stretch, force=force
    )


def divide_steps(time, slide, speed) -> Steps:
    """Divide steps between samples (k,) of slide [m] and speed [m/s] at times [s] on the cubics through both.

    A step in which the speed changes its sign has half of its parts before the turn. A turn that is closer to a sample
    than a part stays inside one of the short parts there: shorter ones would have slides of round-off.
    """
    step = np.diff(time)
    share = np.tile(np.arange(1, PARTS + 1) / PARTS, (step.size, 1))
    turns, at = turn_shares(time, slide, speed)
    middle = np.clip(at, 1 / PARTS, 1 - 1 / PARTS)[:, None]
    half = np.arange(1, PARTS // 2 + 1) / (PARTS // 2)
    share[turns] = np.column_stack([middle * half, middle + (1 - middle) * half])
    begin, end = speed[:-1] * step, speed[1:] * step
    rise = np.diff(slide)
    two, three = 3 * rise - 2 * begin - end, begin + end - 2 * rise
    begin, two, three, first, step = (one[:, None] for one in (begin, two, three, slide[:-1], step))
    inside = Steps(
        time[:-1, None] + step * share,
        first + share * (begin + share * (two + share * three)),
        (begin + share * (2 * two + 3 * share * three)) / step,
    )
    inside.slide[:, -1], inside.speed[:, -1], inside.time[:, -1] = slide[1:], speed[1:], time[1:]
    return inside


def relax(start: float, kept, gained) -> np.ndarray:
    """Return what start, then kept x + gained (k, p) of it, part after part, is at all their ends (k p + 1,)."""
    factor = np.cumprod(kept, axis=1)
    term = gained.copy()
    for part in range(1, kept.shape[1]):
        term[:, part] += kept[:, part] * term[:, part - 1]
    begin = [start]
    for whole, added in zip(factor[:-1, -1].tolist(), term[:-1, -1].tolist()):
        begin.append(whole * begin[-1] + added)
    return np.append(start, factor * np.array(begin)[:, None] + term)
