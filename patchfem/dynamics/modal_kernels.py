"""Motion and energies of the modes over a step of a march (compiled).

Parameters that the functions share:

- motion: (2, n) coordinates and rates of the modes
- modal_system: `interfaces.arrays.ModalArrays`
- table, i: table[i] is the row of `propagator.Propagator.tables` for the step
- accel: (n,) modal accelerations [m s-2] due to interface forces, which are constant over the step
- ledger: energy sums and counters of a march, see `ledger.Ledger`
"""

from typing import NamedTuple

import numpy as np

from ..compiled.jit import njit
from ..friction.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from .ledger import Ledger, SampleColumn

# Status codes that `write_interface_sample` returns.
WITHIN_TRAVEL = 0
EXCEEDS_TRAVEL = 1
NOT_FINITE = 3


class Bracket(NamedTuple):
    """Bracket of a root, and the point at which the function is evaluated next.

    An end is infinite while no bound is known.

    """

    low: float
    high: float
    point: float


class ModalSample(NamedTuple):
    """Slide [m] and slide speed [m/s] of the first interface, and output displacement [m]."""

    slide: float
    speed: float
    output: float


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def project_modes(row, values):
    """Return the slide or slide speed of a port from modal coordinates or rates.

    Parameters
    ----------
    row : (n,) array
        Slide of the port per coordinate.
    values : (n,) array
        Coordinates or rates of the modes.

    Returns
    -------
    float
    """
    total = 0.0
    for k in range(row.size):
        total += row[k] * values[k]
    return total


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def free_increment(motion, modal_system, port, table, i):
    """Return the force-free slide increment [m] of a port in a step.

    Parameters
    ----------
    motion, modal_system, table, i
        See the top of the module.
    port : int

    Returns
    -------
    float
    """
    n = motion.shape[1]
    slide_response = modal_system.slide_response
    increment = table[i, 8 * n + 3 + port]
    for k in range(n):
        increment += (
            slide_response[port, k] * motion[0, k] + slide_response[port, n + k] * motion[1, k]
        )
    return increment


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def free_rate(motion, slide_row, modal_system, table, i):
    """Return the force-free slide speed [m/s] at the end of a step.

    Parameters
    ----------
    slide_row : ndarray
        (n,) slide per coordinate.
    motion, modal_system, table, i
        See the top of the module.

    Returns
    -------
    float
    """
    n = slide_row.size
    free = modal_system.free
    dense = modal_system.dense
    rate = 0.0
    for j in range(n):
        modal_rate = table[i, n + j]
        if dense.size == 0:
            modal_rate += free[2, j] * motion[0, j] + free[3, j] * motion[1, j]
        else:
            for k in range(n):
                modal_rate += dense[n + j, k] * motion[0, k] + dense[n + j, n + k] * motion[1, k]
        rate += slide_row[j] * modal_rate
    return rate


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def write_friction_accelerations(force, slide_row, mass, accel):
    """Write the modal accelerations due to a friction force that resists a slide.

    Parameters
    ----------
    force : float
        Friction force [N].
    slide_row : ndarray
        (n,) slide per coordinate.
    mass : float
        Modal mass [kg].
    accel : ndarray
        (n,) modal accelerations [m s-2]; output.
    """
    for k in range(accel.size):
        accel[k] = -slide_row[k] * force / mass


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def move_modes(motion, modal_system, table, i, accel, ledger):
    """Advance the modes by one step, and add drive work and viscous loss to the ledger.

    Parameters
    ----------
    motion, modal_system, table, i, accel, ledger
        See the top of the module; motion and ledger are changed.
    """
    n = motion.shape[1]
    free = modal_system.free
    force_response = modal_system.force_response
    loss = modal_system.loss
    work = table[i, 8 * n]
    lost = table[i, 8 * n + 1]
    for k in range(n):
        z = motion[0, k]
        v = motion[1, k]
        f = accel[k]
        work += table[i, 2 * n + k] * z + table[i, 3 * n + k] * v + table[i, 4 * n + k] * f
        lost += table[i, 5 * n + k] * z + table[i, 6 * n + k] * v + table[i, 7 * n + k] * f
    if modal_system.dense.size == 0:
        for k in range(n):
            z = motion[0, k]
            v = motion[1, k]
            f = accel[k]
            lost += (
                (loss[0, k] * z + loss[1, k] * v + loss[3, k] * f) * z
                + (loss[2, k] * v + loss[4, k] * f) * v
                + loss[5, k] * f * f
            )
            motion[0, k] = free[0, k] * z + free[1, k] * v + force_response[0, k] * f + table[i, k]
            motion[1, k] = (
                free[2, k] * z + free[3, k] * v + force_response[1, k] * f + table[i, n + k]
            )
    else:
        lost += _move_coupled_modes(motion, modal_system, table, i, accel)
    ledger[Ledger.DRIVE_WORK] += work
    ledger[Ledger.VISCOUS_LOSS] += lost
    ledger[Ledger.DRIVE_POWER] += abs(work)


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def _move_coupled_modes(motion, modal_system, table, row_index, accel):
    """Advance modes with coupled damping by one step.

    Returns the quadratic part of the viscous loss [J].
    """
    n = motion.shape[1]
    dense = modal_system.dense
    loss = modal_system.dense_loss
    end = modal_system.workspace[1:]
    lost = 0.0
    for i in range(3 * n):
        x = accel[i - 2 * n] if i >= 2 * n else motion[i // n, i % n]
        part = 0.0
        for j in range(2):
            for k in range(n):
                part += loss[i, j * n + k] * motion[j, k]
        for k in range(n):
            part += loss[i, 2 * n + k] * accel[k]
        lost += x * part
    for i in range(2 * n):
        part = table[row_index, i]
        for j in range(2):
            for k in range(n):
                part += dense[i, j * n + k] * motion[j, k]
        for k in range(n):
            part += dense[i, 2 * n + k] * accel[k]
        end[i // n, i % n] = part
    for i in range(n):
        motion[0, i] = end[0, i]
        motion[1, i] = end[1, i]
    return lost


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def modal_energy(motion, modal_system):
    """Return the sum of kinetic and elastic energy [J] of the modes."""
    omega = modal_system.omega
    energy = 0.0
    for k in range(omega.size):
        energy += motion[1, k] * motion[1, k] + omega[k] * omega[k] * motion[0, k] * motion[0, k]
    return 0.5 * modal_system.mass * energy


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def write_accelerations(motion, modal_system, drive, accel, out):
    """Write the modal accelerations relative to the base at an instant.

    Parameters
    ----------
    motion, modal_system, accel
        See the top of the module.
    drive : float
        Acceleration of the base [m s-2].
    out : ndarray
        (1, n) or larger; its first row is the output.
    """
    omega = modal_system.omega
    damping = modal_system.damping
    for i in range(omega.size):
        out[0, i] = accel[i] - modal_system.base[i] * drive - omega[i] ** 2 * motion[0, i]
        if damping.size == 0:
            out[0, i] -= modal_system.damp[i] * motion[1, i]
        else:
            for k in range(omega.size):
                out[0, i] -= damping[i, k] * motion[1, k]


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def choose_point_in_bracket(low, high, guess):
    """Return a guess if it lies inside a bracket, otherwise the midpoint of the bracket.

    Parameters
    ----------
    low, high : float
        Ends of the bracket.
    guess : float

    Returns
    -------
    float
    """
    if low < guess < high and np.isfinite(guess):
        return guess
    return 0.5 * (low + high)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def narrow_bracket(bracket, residual, slope, n_late):
    """Take a safeguarded Newton step towards the root of an increasing function.

    Parameters
    ----------
    bracket : Bracket
        Its point is the one at which the function was evaluated.
    residual, slope : float
        Value of the function at this point, and its slope or an approximation of it.
    n_late : int
        Number of evaluations beyond those that usually suffice. From 1 on every other step is a
        bisection, because kinks can make the steps alternate; without a bracket the steps grow.

    Returns
    -------
    Bracket
        One end is moved to the point. The next point is the midpoint if Newton's step leaves the bracket.
    """
    low = bracket.low
    high = bracket.high
    if residual > 0:
        high = bracket.point
    else:
        low = bracket.point
    following = bracket.point - residual / slope
    if low > -np.inf and high < np.inf:
        following = choose_point_in_bracket(low, high, following)
        if n_late > 0 and n_late % 2:
            following = 0.5 * (low + high)
    elif n_late > 0:
        following = bracket.point - residual * 2.0 ** min(n_late, 60)
    return Bracket(low, high, following)


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def write_modal_sample(row, motion, modal_system):
    """Write modal coordinates, rates, slide and slide speed into a sample row of a march.

    They are its first 2 n + 2 entries.

    Returns
    -------
    ModalSample
    """
    n = motion.shape[1]
    slide_row = modal_system.slide
    slide = 0.0
    speed = 0.0
    output = 0.0
    for k in range(n):
        row[k] = motion[0, k]
        row[n + k] = motion[1, k]
        slide += slide_row[k] * motion[0, k]
        speed += slide_row[k] * motion[1, k]
        output += modal_system.output[k] * motion[0, k]
    row[2 * n + SampleColumn.SLIDE] = slide
    row[2 * n + SampleColumn.SPEED] = speed
    return ModalSample(slide, speed, output)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def write_interface_sample(row, reading, output, travel, stored, ledger):
    """Write force, slip and energy of the interface into a sample row of a march.

    The largest stored energy of the ledger is updated.

    Parameters
    ----------
    row : ndarray
        (2 n + 6,) sample row of `loop_kernels.march`.
    reading : friction.protocol_kernels.Reading
        Force [N], energy [J] and slip [m] of the interface.
    output, travel : float
        Displacement of the output, and the largest permitted magnitude [m].
    stored : float
        Stored energy of modes and interfaces [J].
    ledger : ndarray

    Returns
    -------
    int
        WITHIN_TRAVEL, EXCEEDS_TRAVEL or NOT_FINITE.
    """
    n = row.size - SampleColumn.STEP_WORK
    row[n + SampleColumn.FORCE] = reading.force
    row[n + SampleColumn.SLIP] = reading.slip
    row[n + SampleColumn.MEAN_FORCE] = reading.force
    row[n + SampleColumn.ENERGY] = reading.stored_energy
    ledger[Ledger.MAX_STORED] = max(ledger[Ledger.MAX_STORED], stored)
    if not np.isfinite(row[n + SampleColumn.SLIDE] + row[n + SampleColumn.SPEED] + reading.force):
        return NOT_FINITE
    return EXCEEDS_TRAVEL if abs(output) > travel else WITHIN_TRAVEL


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def count_iterations(n_iterations, work, ledger):
    """Add the iterations and the friction work of a step to the ledger of a march.

    Parameters
    ----------
    n_iterations : int
        Less than 0 if the step failed.
    work : float
        Friction work of the step [J].
    ledger : ndarray
        See `ledger.Ledger`; it is changed.
    """
    ledger[Ledger.N_ITERATIONS] += abs(n_iterations)
    ledger[Ledger.MAX_ITERATIONS] = max(ledger[Ledger.MAX_ITERATIONS], abs(n_iterations))
    ledger[Ledger.N_UNCONVERGED] += 1.0 if n_iterations < 0 else 0.0
    ledger[Ledger.FRICTION_WORK] += work


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def write_end_state(motion, modal_system, table, row_index, accel, end):
    """Write the modal coordinates and rates at the end of a step, but do not take the step.

    The motion and the ledger do not change.

    Parameters
    ----------
    motion, modal_system, table, accel
        See the top of the module.
    row_index : int
        Row of the table for the step.
    end : ndarray
        (2, n) output.
    """
    n = motion.shape[1]
    free = modal_system.free
    force_response = modal_system.force_response
    dense = modal_system.dense
    for i in range(n):
        z = table[row_index, i]
        v = table[row_index, n + i]
        if dense.size == 0:
            z += (
                free[0, i] * motion[0, i]
                + free[1, i] * motion[1, i]
                + force_response[0, i] * accel[i]
            )
            v += (
                free[2, i] * motion[0, i]
                + free[3, i] * motion[1, i]
                + force_response[1, i] * accel[i]
            )
        else:
            for k in range(n):
                z += (
                    dense[i, k] * motion[0, k]
                    + dense[i, n + k] * motion[1, k]
                    + dense[i, 2 * n + k] * accel[k]
                )
                v += (
                    dense[n + i, k] * motion[0, k]
                    + dense[n + i, n + k] * motion[1, k]
                    + dense[n + i, 2 * n + k] * accel[k]
                )
        end[0, i] = z
        end[1, i] = v
