"""Balance of the odd harmonics of friction and linear motion by Newton's method (compiled).

The n unknowns at a frequency are those of all interfaces in a row: the factors of the sines of the slide, then those of its
cosines. `balance` is a `records.Balance`.
"""

import numpy as np

from ..kernel_cache.flags_kernels import NJIT_KERNEL
from ..kernel_cache.jit import njit
from .motion_kernels import copy_values

IS_VECTORISED = False

MAX_EVALUATIONS = 40  # evaluations of the residual in a search
TOLERANCE = (
    1e-3  # largest Newton step of a motion that is balanced, relative to the largest unknown
)


@njit(**NJIT_KERNEL)
def balance_curve(balance):
    """Balance the motions at all frequencies, upwards and then downwards.

    A search begins at the motion of the neighbour, if that is balanced, then at the given slides, and then at those without
    friction.
    """
    n_omega = balance.slides.shape[0]
    for step in (1, -1):
        for count in range(n_omega):
            k = count if step > 0 else n_omega - 1 - count
            before = k - step
            if 0 <= before < n_omega and balance.is_balanced[before] > 0:
                search(balance, k, balance.slides[before])
            search(balance, k, balance.slides[k])
            search(balance, k, balance.driven[k])

    # The friction of all motions, from which those of the modes follow
    for k in range(n_omega):
        find_friction(balance, k, balance.slides[k])


@njit(**NJIT_KERNEL)
def search(balance, place, start):
    """Balance the motion at a frequency, unless it is balanced; a step that does not reduce the residual is halved.

    Parameters
    ----------
    balance : Balance
        Arrays of the rig and the motions.
    place : int
        Number of the frequency.
    start : (n,) array
        Slides from which the search begins.
    """
    if balance.is_balanced[place] > 0:
        return
    trial = balance.work.motions[0]
    best = balance.work.motions[1]
    step = balance.work.motions[2]
    n = trial.size
    copy_values(start, trial)
    least = np.inf
    for _ in range(MAX_EVALUATIONS):
        norm = evaluate(balance, place, trial)
        is_better = norm < least
        largest = change = 0.0

        # Newton step from the best motion, or half of the last one
        if is_better:
            least = norm
            copy_values(trial, best)
            solve(balance.work.matrix, step)
        for a in range(n):
            if not is_better:
                step[a] *= 0.5
            trial[a] = best[a] + step[a]
            largest = max(largest, abs(trial[a]))
            change = max(change, abs(step[a]))

        # A halved step is small, but no sign of convergence.
        if is_better and change <= TOLERANCE * largest:
            copy_values(trial, balance.slides[place])
            balance.is_balanced[place] = 1.0
            return


@njit(**NJIT_KERNEL)
def evaluate(balance, place, slides):
    """Write the equations of a Newton step, U + G F(U) = d, into `balance.work.matrix`; return the largest residual.

    Parameters
    ----------
    balance : Balance
        Arrays of the rig and the motions.
    place : int
        Number of the frequency.
    slides : (n,) array
        Unknowns U.
    """
    matrix = balance.work.matrix
    slopes = balance.work.slopes
    receptance = balance.receptance[place]
    n = slides.size
    n_waves = balance.laws.waves.shape[1]
    find_friction(balance, place, slides)

    # Residual and Jacobian of each unknown
    norm = 0.0
    for a in range(n):
        residual = balance.driven[place, a] - slides[a]
        for b in range(n):
            residual -= receptance[a, b] * balance.forces[place, b]
            # The force of an interface depends on its own slide alone.
            face = b // n_waves
            slope = 1.0 if a == b else 0.0
            for c in range(n_waves):
                slope += receptance[a, face * n_waves + c] * slopes[c, b]
            matrix[a, b] = slope

        matrix[a, n] = residual
        norm = max(norm, abs(residual))
    return norm


@njit(**NJIT_KERNEL)
def find_friction(balance, place, slides):
    """Write the harmonics of the friction into `forces`, and their derivatives by the slides into `slopes`.

    Parameters
    ----------
    balance : Balance
        Arrays of the rig and the motions.
    place : int
        Number of the frequency.
    slides : (n,) array
        Harmonics of the slides.
    """
    waves = balance.laws.waves
    first_element = balance.laws.first
    path = balance.work.path
    friction = balance.work.friction
    follows = balance.work.follows
    slopes = balance.work.slopes
    n_samples, n_waves = waves.shape
    forces = balance.forces[place]
    for face in range(first_element.size - 1):
        # Slide at the samples, and friction of all elements there
        first = face * n_waves
        for s in range(n_samples):
            path[s] = friction[s] = 0.0
            for a in range(n_waves):
                path[s] += waves[s, a] * slides[first + a]
                follows[s, a] = 0.0
        for e in range(first_element[face], first_element[face + 1]):
            follow_element(balance, balance.laws.lengths[e], balance.laws.stiffness[e])

        # The sines and cosines of odd harmonics are orthogonal over half a period.
        for a in range(n_waves):
            forces[first + a] = 0.0
            for b in range(n_waves):
                slopes[a, first + b] = 0.0
            for s in range(n_samples):
                factor = 2 / n_samples * waves[s, a]
                forces[first + a] += factor * friction[s]
                for b in range(n_waves):
                    slopes[a, first + b] += factor * follows[s, b]


@njit(**NJIT_KERNEL)
def follow_element(balance, length, stiffness):
    """Add the friction of an element in the second half of the period to that of its interface, with the opposite sign.

    The first half leaves the stretch with which the second one begins. An element that sticks follows the slide since its
    last slip, or that of the whole motion if it never slips.

    Parameters
    ----------
    balance : Balance
        Arrays of the rig and the motions; `path` has the slide in the first half.
    length : float
        Stretch at which the element slips [m].
    stiffness : float
        Stiffness of the element [N/m].
    """
    waves = balance.laws.waves
    path = balance.work.path
    n_samples, n_waves = waves.shape
    slide = path[0]
    stretch = min(max(slide, -length), length)
    last = 0 if stretch != slide else -1
    last_sign = 1.0

    # The first half period leaves the stretch of a periodic motion.
    for k in range(1, 2 * n_samples):
        sign = 1.0 if k < n_samples else -1.0
        s = k % n_samples
        moved = stretch + sign * path[s] - slide
        slide = sign * path[s]
        stretch = min(max(moved, -length), length)
        if stretch != moved:
            last = s
            last_sign = sign
        if k < n_samples:
            continue

        # The second half has the opposite sign.
        balance.work.friction[s] -= stiffness * stretch
        if stretch == moved:
            for a in range(n_waves):
                follow = waves[s, a]
                if last >= 0:
                    follow += last_sign * waves[last, a]
                balance.work.follows[s, a] += stiffness * follow


@njit(**NJIT_KERNEL)
def solve(matrix, solution):
    """Solve linear equations by Gaussian elimination with partial pivoting.

    Parameters
    ----------
    matrix : (n, n + 1) array
        Equations, the right side in the last column; it is overwritten.
    solution : (n,) array
        The solution, which is written.
    """
    n = solution.size
    for k in range(n):
        pivot = k
        for r in range(k + 1, n):
            if abs(matrix[r, k]) > abs(matrix[pivot, k]):
                pivot = r

        # Exchange of rows, and elimination below the pivot
        for c in range(k, n + 1):
            value = matrix[k, c]
            matrix[k, c] = matrix[pivot, c]
            matrix[pivot, c] = value
        for r in range(k + 1, n):
            factor = matrix[r, k] / matrix[k, k]
            for c in range(k, n + 1):
                matrix[r, c] -= factor * matrix[k, c]

    # Back substitution
    for k in range(n - 1, -1, -1):
        solution[k] = matrix[k, n]
        for c in range(k + 1, n):
            solution[k] -= matrix[k, c] * solution[c]
        solution[k] /= matrix[k, k]
