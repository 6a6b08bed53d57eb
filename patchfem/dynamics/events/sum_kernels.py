"""Energies and phasor of a piece of the motion, summed by Gauss points (compiled)."""

from math import cos, pi, sin

from ...compiled.jit import njit
from ...friction.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from .positions_kernels import LEDGER, TIME
from .series_kernels import GAUSS_POINTS, GAUSS_WEIGHTS, count_gauss_points, evaluate_polynomial


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def evaluate_at_four(poly, low, top, u):
    """Return the values of a polynomial at four points, as `evaluate_polynomial` does.

    Parameters
    ----------
    poly : ndarray
        Coefficients of the polynomial.
    low : int
        Index of the lowest coefficient.
    top : int
        Index of the highest coefficient.
    u : tuple of float
        The four points.

    Returns
    -------
    tuple of float
    """
    a = b = c = d = poly[top]
    for k in range(top - 1, low - 1, -1):
        part = poly[k]
        a = a * u[0] + part
        b = b * u[1] + part
        c = c * u[2] + part
        d = d * u[3] + part
    return a, b, c, d


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def evaluate_rates_at_four(coefs, i, top, u):
    """Return the derivatives of a coordinate with respect to u at four points.

    Parameters
    ----------
    coefs : ndarray
        (terms, n) series of the coordinates.
    i : int
        Number of the coordinate.
    top : int
        Highest power of the series.
    u : tuple of float
        The four points.

    Returns
    -------
    tuple of float
    """
    a = b = c = d = top * coefs[top, i]
    for k in range(top - 1, 0, -1):
        part = k * coefs[k, i]
        a = a * u[0] + part
        b = b * u[1] + part
        c = c * u[2] + part
        d = d * u[3] + part
    return a, b, c, d


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def add_piece_sums(x, u, h, top, modal_system, time_state, run_sums, workspace):
    """Add drive work, viscous loss and output phasor of a piece up to u to the sums.

    Four points are evaluated at a time, in registers.

    Parameters
    ----------
    x : float
        Duration of the piece times the fastest rate.
    u : float
        Fraction of the piece.
    h : float
        Duration of the piece [s].
    top : int
        Highest power of the series.
    modal_system : ModalSystem
    time_state : TimeState
    run_sums : RunSums
    workspace : Workspace
    """
    n = len(modal_system.omega_squared)
    count = count_gauss_points(x * u)
    ledger = run_sums.ledger
    nodes = workspace.rates
    work = 0.0
    loss = 0.0
    power_size = 0.0
    for g in range(0, count, 4):  # four points at a time in registers
        place = (
            u * GAUSS_POINTS[count, g],
            u * GAUSS_POINTS[count, g + 1],
            u * GAUSS_POINTS[count, g + 2],
            u * GAUSS_POINTS[count, g + 3],
        )
        weight = GAUSS_WEIGHTS[count, g : g + 4]
        drive = evaluate_at_four(workspace.drive[0], 0, top, place)
        base_rate = (0.0, 0.0, 0.0, 0.0)
        for i in range(n):
            rate = evaluate_rates_at_four(workspace.coefficients, i, top, place)
            base_rate = (
                base_rate[0] - modal_system.base[i] * rate[0],
                base_rate[1] - modal_system.base[i] * rate[1],
                base_rate[2] - modal_system.base[i] * rate[2],
                base_rate[3] - modal_system.base[i] * rate[3],
            )
            nodes[i, 0], nodes[i, 1], nodes[i, 2], nodes[i, 3] = rate
            if not modal_system.is_coupled:
                loss += modal_system.damping[i, i] * (
                    weight[0] * rate[0] ** 2
                    + weight[1] * rate[1] ** 2
                    + weight[2] * rate[2] ** 2
                    + weight[3] * rate[3] ** 2
                )
        if modal_system.is_coupled:
            for i in range(n):
                for j in range(n):
                    for k in range(4):
                        loss += weight[k] * nodes[i, k] * modal_system.damping[i, j] * nodes[j, k]
        power = (
            weight[0] * base_rate[0] * drive[0],
            weight[1] * base_rate[1] * drive[1],
            weight[2] * base_rate[2] * drive[2],
            weight[3] * base_rate[3] * drive[3],
        )
        work += power[0] + power[1] + power[2] + power[3]
        power_size += abs(power[0]) + abs(power[1]) + abs(power[2]) + abs(power[3])
    ledger[LEDGER.drive_work] += modal_system.mass * u * work
    ledger[LEDGER.viscous_loss] += modal_system.mass * u * loss / h
    ledger[LEDGER.drive_power] += modal_system.mass * u * power_size
    cycle = int(time_state.now[TIME.cycle])
    if run_sums.is_phasor_wanted[cycle] == 1.0:
        for g in range(count):
            share = u * GAUSS_POINTS[count, g]
            at = time_state.now[TIME.offset] + h * share
            out = 0.0
            angle = 2 * pi * at / time_state.period[0]
            for i in range(n):
                out += modal_system.output[i] * evaluate_polynomial(
                    workspace.coefficients[:, i], 0, top, share
                )
            out *= 2 * u * h * GAUSS_WEIGHTS[count, g] / time_state.period[0]
            run_sums.phasors[cycle, 0] += out * cos(angle)
            run_sums.phasors[cycle, 1] -= out * sin(angle)
