"""Points with compliance that yield at a limit, solved without the elements of `patchfem.partial_slip`."""

import numpy as np


def jenkins_forces(path, stiffness, limit):
    """Return the forces of parallel Jenkins elements along a path from the virgin state at 0, and the last stretches."""
    stretch = np.zeros(len(stiffness))
    last = 0.0
    out = []
    for q in path:
        stretch = np.clip(stretch + q - last, -limit, limit)
        last = q
        out.append(stiffness @ stretch)
    return np.array(out), stretch


def solve_box_problem(c, limit, free_slide, force):
    """Return the forces and the slip that minimise f.C f/2 - f.free_slide subject to |f| <= limit.

    A primal-dual active-set method starts from `force`. The optimality conditions are checked: C f
    = free_slide at points that stick, C f <= free_slide at +limit and C f >= free_slide at -limit.
    """
    scale = np.abs(free_slide).max() + np.abs(c @ limit).max()
    bound = np.where(force >= limit, 1, np.where(force <= -limit, -1, 0))
    for _ in range(60 + 3 * limit.size):
        stuck = bound == 0
        force = bound * limit
        if stuck.any():
            force[stuck] = np.linalg.solve(
                c[np.ix_(stuck, stuck)],
                free_slide[stuck] - c[np.ix_(stuck, ~stuck)] @ force[~stuck],
            )
        slip = free_slide - c @ force
        next_bound = np.where(
            stuck,
            np.where(force > limit, 1, np.where(force < -limit, -1, 0)),
            np.where(bound * slip > -1e-15 * scale, bound, 0),
        )
        if np.array_equal(next_bound, bound):
            break
        bound = next_bound
    slip = free_slide - c @ force
    assert np.all(np.abs(force) <= limit * (1 + 1e-12))
    assert np.abs(slip[bound == 0]).max(initial=0) <= 1e-12 * scale
    assert (bound * slip).min() >= -1e-12 * scale
    return force, slip


def solve_all_points(c, limit, path):
    """Return the forces of points (k, m) [N] coupled by the compliance c at every slide of a path (k,) [m].

    One box-constrained problem is solved per stroke.
    """
    slip = np.zeros(limit.size)
    force = np.zeros(limit.size)
    forces = []
    for slide in path:
        force, slip_increment = solve_box_problem(c, limit, slide - slip, force)
        slip = slip + slip_increment
        forces.append(force)
    return np.array(forces)


def solve_after_each_yield(c, limit):
    """Return the slides at which points yield (t,) [m] and the force rates before each yield (t, n)
    [N/m].

    The points are coupled by the compliance c (n, n) and yield at the forces `limit` (n,) [N].
    """
    stick = np.ones(limit.size, bool)
    force = np.zeros(limit.size)
    slide = 0.0
    yield_slides = []
    rates = []
    while stick.any():
        rate = np.zeros(limit.size)
        rate[stick] = np.linalg.solve(c[np.ix_(stick, stick)], np.ones(stick.sum()))
        increments = np.where(
            stick & (rate > 0), (limit - force) / np.where(rate > 0, rate, 1.0), np.inf
        )
        increment = max(increments.min(), 0.0)
        slide = slide + increment
        force = force + rate * increment
        yield_slides.append(slide)
        rates.append(rate)
        stick &= increments > increment * (1 + 1e-9)
    return np.array(yield_slides), np.array(rates)
