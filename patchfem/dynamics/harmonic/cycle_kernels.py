"""Reversals of a periodic slide, and Jenkins elements along one cycle of it (compiled).

A rate-independent law is followed from reversal to reversal, which are located from the
harmonics and not at samples. So the memory is that of the continuous motion; a sample takes a few ns
for any number of elements.
"""

from typing import NamedTuple

import numpy as np

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_NO_REFCOUNT


class SlideValues(NamedTuple):
    """Value of a periodic slide and its first two derivatives with respect to the angle [m]."""

    value: float
    rate: float
    bend: float


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def evaluate_slide(re, im, angle):
    """Evaluate a Fourier series Re sum X_k exp(i k angle) and its first two derivatives.

    Parameters
    ----------
    re, im : ndarray
        (H + 1,) real and imaginary parts of the harmonics X_k [m].
    angle : float
        [rad].

    Returns
    -------
    SlideValues
    """
    c = np.cos(angle)
    s = np.sin(angle)
    value = re[0]
    rate = 0.0
    bend = 0.0
    a = 1.0
    b = 0.0
    for k in range(1, re.size):
        next_a = a * c - b * s
        b = a * s + b * c
        a = next_a
        even = re[k] * a - im[k] * b
        odd = re[k] * b + im[k] * a
        value += even
        rate -= k * odd
        bend -= k * k * even
    return SlideValues(value, rate, bend)


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def find_turning_points(re, im, rate, angle, place, cell):
    """Find the reversals of a periodic slide from its harmonics and its sampled rate.

    Parameters
    ----------
    re, im : ndarray
        (H + 1,) harmonics of the slide [m].
    rate : ndarray
        (N,) dq/dtheta [m] at N equidistant angles.
    angle, place, cell : ndarray
        (N,) outputs: angle, slide and index of the sample before each reversal.

    Returns
    -------
    count : int
        Number of reversals.
    start : float
        Direction of the slide at the first sample.
    """
    n = rate.size
    count = 0
    floor = 0.0
    for i in range(n):
        floor = max(floor, 1e-13 * abs(rate[i]))
    width = 2 * np.pi / n
    first = 0.0
    for i in range(n - 1, -1, -1):
        if abs(rate[i]) > floor:
            first = 1.0 if rate[i] > 0 else -1.0
            break
    if first == 0.0:
        return 0, 1.0
    start = first
    if abs(rate[0]) > floor:
        start = 1.0 if rate[0] > 0 else -1.0
    sign = start
    for i in range(n):
        b = rate[(i + 1) % n]
        if abs(b) <= floor:
            continue
        after = 1.0 if b > 0 else -1.0
        if after == sign:
            continue
        low = i * width
        high = (i + 1) * width
        a = rate[i]
        at = low + width * (a / (a - b) if a * b < 0 else 0.0)
        for _ in range(60):
            slide = evaluate_slide(re, im, at)
            if slide.rate * sign > 0:
                low = at
            else:
                high = at
            new = at - slide.rate / slide.bend if slide.bend != 0 else low - 1.0
            if not low <= new <= high:
                new = 0.5 * (low + high)
            if abs(new - at) <= 1e-15 * n * width:
                at = new
                break
            at = new
        angle[count] = at
        place[count] = evaluate_slide(re, im, at).value
        cell[count] = i
        count += 1
        sign = after
    return count, start


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def sample_jenkins(q, turning_points, yield_slides, sums, groups, samples):
    """Compute the periodic force of parallel Jenkins elements at the samples of a cycle.

    The elements start from the virgin state; the second of two cycles is periodic.

    Parameters
    ----------
    q : ndarray
        (N,) slide [m].
    turning_points : laws.TurningPoints
    yield_slides : ndarray
        (t,) yield slides in increasing order [m].
    sums : laws.JenkinsSums
    groups : laws.JenkinsGroups
        Workspace for 2 R + 3 groups.
    samples : laws.JenkinsSamples
        They are written; samples.hold must be 0.
    """
    t = yield_slides.size
    n_turning_points = turning_points.slides.size
    n_groups = 1
    groups.end[0] = t
    groups.mark[0] = -1
    groups.sign[0] = 0.0
    groups.base[0] = 0.0
    n_slipping = 0
    direction = 1.0 if q[0] > 0 else -1.0
    n_groups, n_slipping = _slip_elements(
        q[0], direction, n_slipping, n_groups, groups, yield_slides
    )
    if direction != turning_points.start:
        n_groups = _store_turning_point(q[0], direction, n_slipping, n_groups, groups, -1)
        n_slipping = 0
    direction = turning_points.start
    for cycle in range(2):
        k = 0
        for i in range(q.size):
            n_groups, n_slipping = _slip_elements(
                q[i], direction, n_slipping, n_groups, groups, yield_slides
            )
            if cycle == 1:
                _write_sample(i, q[i], direction, n_slipping, n_groups, groups, sums, samples)
            while k < n_turning_points and turning_points.cells[k] == i:
                slide = turning_points.slides[k]
                n_groups, n_slipping = _slip_elements(
                    slide, direction, n_slipping, n_groups, groups, yield_slides
                )
                n_groups = _store_turning_point(slide, direction, n_slipping, n_groups, groups, k)
                n_slipping = 0
                direction = -direction
                k += 1


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def _write_sample(i, slide, direction, n_slipping, n_groups, groups, sums, samples):
    """Write force, stiffnesses and stretch of the Jenkins elements at a sample."""
    force = direction * sums.limit[n_slipping]
    stretch = direction * sums.square[n_slipping]
    low = n_slipping
    for group in range(n_groups - 1, -1, -1):
        end = groups.end[group]
        sign = groups.sign[group]
        distance = slide - groups.base[group]
        stiffness = sums.stiffness[end] - sums.stiffness[low]
        limit = sums.limit[end] - sums.limit[low]
        force += sign * limit + stiffness * distance
        stretch += sign * (sums.square[end] - sums.square[low]) + limit * distance
        if groups.mark[group] >= 0:
            samples.hold[groups.mark[group], i] -= stiffness
        low = end
    samples.force[i] = force
    samples.stretch[i] = stretch
    samples.slope[i] = sums.stiffness[sums.stiffness.size - 1] - sums.stiffness[n_slipping]


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _slip_elements(slide, direction, n_slipping, n_groups, groups, yield_slides):
    """Update the Jenkins elements that exceed their limit at a slide, so that they slip.

    Returns the number of groups of sticking elements and the number of slipping elements.

    """
    while n_groups > 0:
        group = n_groups - 1
        sign = groups.sign[group]
        base = groups.base[group]
        while n_slipping < groups.end[group]:
            limit = yield_slides[n_slipping]
            if direction * (sign * limit + slide - base) < limit:
                break
            n_slipping += 1
        if n_slipping < groups.end[group]:
            break
        n_groups -= 1
    return n_groups, n_slipping


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _store_turning_point(slide, direction, n_slipping, n_groups, groups, mark):
    """Push the slipping Jenkins elements as a new group at a reversal.

    Returns the number of groups.

    """
    if n_slipping == 0:
        return n_groups
    groups.end[n_groups] = n_slipping
    groups.sign[n_groups] = direction
    groups.base[n_groups] = slide
    groups.mark[n_groups] = mark
    return n_groups + 1
