"""Points under constant loads along a prescribed slide, without modes and pieces that deform (compiled).

It computes the same as `march_kernels` for this case. Its code is compiled in a quarter of the time, which a first bench
would otherwise spend on modes, shear of the pieces and changing loads that it does not have.
"""

from ..compiled.flags_kernels import NJIT_KERNEL
from ..compiled.jit import njit
from .march_rows import DONE, Point, Sample
from .return_maps_kernels import Step, advance, mean_force, prepare, read


@njit(cache=True, **NJIT_KERNEL)
def read_points(system, forces, stretch):
    """Write friction force [N] and elastic stretch [m] of all points (m,).

    Parameters
    ----------
    system : march_rows.System
        Arrays of the march, changed in place.
    forces : (m,) array
        Forces of the points [N], output.
    stretch : (m,) array
        Elastic stretches of the points [m], output.
    """
    points = system.points
    for j in range(points.port.size):
        state = read(points.numbers, points.memory, j, points.values[Point.LOAD, j])
        forces[j] = state.force
        stretch[j] = state.stretch


@njit(cache=True, **NJIT_KERNEL)
def march(system, steps, samples):
    """Move the points along the prescribed slide over a number of steps.

    Parameters
    ----------
    system : march_rows.System
        Changed in place.
    steps : int
        Number of steps.
    samples : (steps + 1, k) array
        Samples before each step and at the end; output.

    Returns
    -------
    int
        Number of steps done.
    int
        Status, which is `DONE`.
    """
    points = system.points
    values = points.values
    path = system.structure.path
    h = system.options.step
    count = points.port.size
    for i in range(steps + 1):
        # Force, stored energy, and the mean slip, weighted by the friction limits.
        force = energy = slip = limit = 0.0
        for j in range(count):
            load = values[Point.LOAD, j]
            state = read(points.numbers, points.memory, j, load)
            weight = load * points.numbers[1, j]
            force += state.force
            energy += state.energy
            slip += weight * (values[Point.TOTAL, j] - state.stretch)
            limit += weight
        samples[i, Sample.ENERGY] = energy
        samples[i, Sample.PORTS] = force
        samples[i, Sample.PORTS + 1] = slip / limit if limit > 0 else path[i]
        samples[i, Sample.PORTS + 2] = 0.0
        samples[i, Sample.WORK] = 0.0
        if i == steps:
            break

        # All points have the same slide. Their work is the mean force times the slide.
        slide = path[i + 1] - path[i]
        velocity = slide / h
        step = Step(slide, h, velocity, velocity, 0.0)
        for j in range(count):
            load = values[Point.LOAD, j]
            prepare(points.numbers, points.memory, j, step)
            mean = mean_force(points.numbers, points.memory, j, load, step).force
            advance(points.numbers, points.memory, j, load, step)
            values[Point.TOTAL, j] += slide
            samples[i, Sample.PORTS + 2] += mean
            samples[i, Sample.WORK] += mean * slide
    return steps, DONE
