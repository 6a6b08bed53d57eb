"""Energies and output phasor of a time interval, integrated by Gauss points (compiled)."""

from math import cos, pi, sin

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_INLINE
from .positions_kernels import Ledger, Time
from .series_kernels import GAUSS_POINTS, GAUSS_WEIGHTS, count_gauss_points, evaluate_polynomial


@njit(**NJIT_INLINE)
def evaluate_at_four(poly, low, top, u):
    """Evaluate a polynomial at four points at once.

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
        coefficient = poly[k]
        a = a * u[0] + coefficient
        b = b * u[1] + coefficient
        c = c * u[2] + coefficient
        d = d * u[3] + coefficient
    return a, b, c, d


@njit(**NJIT_INLINE)
def evaluate_rates_at_four(coefs, i, top, u):
    """Evaluate the derivative of a modal coordinate with respect to u at four points at once.

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
        coefficient = k * coefs[k, i]
        a = a * u[0] + coefficient
        b = b * u[1] + coefficient
        c = c * u[2] + coefficient
        d = d * u[3] + coefficient
    return a, b, c, d


@njit(**NJIT_INLINE)
def add_piece_sums(u, piece, run):
    """Add drive work, viscous loss and output phasor of part of a time interval to the sums.

    Four points are evaluated at a time, in registers.

    Parameters
    ----------
    u : float
        Fraction of the piece.
    piece : Piece
    run : RunArrays
    """
    h = piece.duration
    top = piece.top
    modal_system = run.modal_system
    time_state = run.time_state
    run_sums = run.sums
    workspace = run.workspace
    n = len(modal_system.omega_squared)
    count = count_gauss_points(piece.rate * piece.duration * u)
    ledger = run_sums.ledger
    nodes = workspace.rates
    work = 0.0
    loss = 0.0
    power_size = 0.0
    for g in range(0, count, 4):  # four points fill a vector register
        positions = (
            u * GAUSS_POINTS[count, g],
            u * GAUSS_POINTS[count, g + 1],
            u * GAUSS_POINTS[count, g + 2],
            u * GAUSS_POINTS[count, g + 3],
        )
        weight = GAUSS_WEIGHTS[count, g : g + 4]
        drive = evaluate_at_four(workspace.drive[0], 0, top, positions)
        base_rate = (0.0, 0.0, 0.0, 0.0)
        for i in range(n):
            rate = evaluate_rates_at_four(workspace.coefficients, i, top, positions)
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
    ledger[Ledger.DRIVE_WORK] += modal_system.mass * u * work
    ledger[Ledger.VISCOUS_LOSS] += modal_system.mass * u * loss / h
    ledger[Ledger.DRIVE_POWER] += modal_system.mass * u * power_size
    cycle = int(time_state.now[Time.CYCLE])
    if run_sums.is_phasor_wanted[cycle] == 1.0:
        for g in range(count):
            fraction = u * GAUSS_POINTS[count, g]
            time = time_state.now[Time.OFFSET] + h * fraction
            output = 0.0
            angle = 2 * pi * time / time_state.period[0]
            for i in range(n):
                output += modal_system.output[i] * evaluate_polynomial(
                    workspace.coefficients[:, i], 0, top, fraction
                )
            output *= 2 * u * h * GAUSS_WEIGHTS[count, g] / time_state.period[0]
            run_sums.phasors[cycle, 0] += output * cos(angle)
            run_sums.phasors[cycle, 1] -= output * sin(angle)
