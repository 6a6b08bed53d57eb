"""Points that all have bonds whose length does not grow, as those of a patch that slips part by part (compiled).

The compiler vectorises these loops: all points have one law, and paths shorter than `MAX_SERIES_PATH` need no branch. The
march of the 1985 rig takes half the time of one that asks every point for its law.
"""

from typing import NamedTuple

from ..compiled.flags_kernels import NJIT_CALL
from ..compiled.jit import njit
from ..friction.bonds.point_kernels import MAX_SERIES_PATH, bond_mean, bond_step, shape_series
from .march_rows import Point


class PortState(NamedTuple):
    """Sums over the points of a port.

    - force, energy: friction force [N] and stored energy [J]
    - slip, weight: sum of slip times friction limit [N m], and sum of the friction limits [N]
    """

    force: float
    energy: float
    slip: float
    weight: float


@njit(**NJIT_CALL)
def are_paths_short(points):
    """Return whether the slides of all points in this step are short enough for the series of the shape functions.

    `points` are the `march_rows.Points`, with the slides of the step in row SLIDE.
    """
    slides = points.values[Point.SLIDE]
    lengths = points.trial[4]
    n_long = 0
    for j in range(lengths.size):
        if abs(slides[j]) >= MAX_SERIES_PATH * lengths[j]:
            n_long += 1
    return n_long == 0


@njit(**NJIT_CALL)
def write_means(points):
    """Write the mean forces [N] of short slides of all points to row FORCE of their values, and the slopes to BY_SLIDE.

    `points` are the `march_rows.Points`, with the slides of the step in row SLIDE.
    """
    values = points.values
    trial = points.trial
    for j in range(points.port.size):
        slide = values[Point.SLIDE, j]
        shapes = shape_series(abs(slide) / trial[4, j])
        load = values[Point.LOAD, j]
        bonds = bond_mean(trial[1, j], trial[2, j], slide, load, trial[4, j], shapes)
        stiffness = points.numbers[1, j] / points.numbers[2, j]
        values[Point.FORCE, j] = stiffness * bonds.mean
        values[Point.BY_SLIDE, j] = stiffness * bonds.slope


@njit(**NJIT_CALL)
def advance_all(points):
    """Advance the trial memory and the total slides of all points by their short slides.

    `points` are the `march_rows.Points`, with the slides of the step in row SLIDE.
    """
    values = points.values
    trial = points.trial
    for j in range(points.port.size):
        slide = values[Point.SLIDE, j]
        values[Point.TOTAL, j] += slide
        shapes = shape_series(abs(slide) / trial[4, j])
        before = trial[1, j], trial[2, j], trial[3, j]
        bonds = bond_step(before, slide, values[Point.LOAD, j], trial[4, j], shapes)
        trial[1, j] = bonds.m
        trial[2, j] = bonds.z
        trial[3, j] = bonds.s2


@njit(**NJIT_CALL)
def read_port(points, first, end):
    """Return force, energy and slip of a port after an accepted step, as a `PortState`.

    The friction limits are those of the loads at the end of the step.

    Parameters
    ----------
    points : march_rows.Points
        Points.
    first : int
        First point of the port.
    end : int
        First point of the next port.
    """
    static = points.numbers[1, first:end]
    first_lengths = points.numbers[2, first:end]
    m = points.memory[1, first:end]
    z = points.memory[2, first:end]
    s2 = points.memory[3, first:end]
    loads = points.values[Point.END_LOAD, first:end]
    totals = points.values[Point.TOTAL, first:end]
    force = 0.0
    energy = 0.0
    slip = 0.0
    weight = 0.0
    for j in range(m.size):
        stiffness = static[j] / first_lengths[j]
        force += stiffness * z[j]
        energy += 0.5 * stiffness * s2[j]
        limit = loads[j] * static[j]
        weight += limit
        slip += limit * (totals[j] - (z[j] / m[j] if m[j] > 0 else 0.0))
    return PortState(force, energy, slip, weight)
