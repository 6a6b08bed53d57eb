"""Compiled sums over a piece of the motion: work of the drive, viscous loss, phasors."""

from math import cos, pi, sin

from ...compiled.jit import njit
from ...friction.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from .series_kernels import _PLACE, _WEIGHT, points, value


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def at_four(poly, low, top, u):
    """Values of a polynomial as in `value` at four places."""
    a = b = c = d = poly[top]
    for k in range(top - 1, low - 1, -1):
        part = poly[k]
        a = a * u[0] + part
        b = b * u[1] + part
        c = c * u[2] + part
        d = d * u[3] + part
    return a, b, c, d


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def rates_at_four(coefs, i, top, u):
    """Rates over u of the coordinate i at four places."""
    a = b = c = d = top * coefs[top, i]
    for k in range(top - 1, 0, -1):
        part = k * coefs[k, i]
        a = a * u[0] + part
        b = b * u[1] + part
        c = c * u[2] + part
        d = d * u[3] + part
    return a, b, c, d


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def sums(x, u, h, top, modal_system, time_state, books, workspace):
    """Add the work of the drive, the viscous loss and the phasor of a piece up to u to the books, by Gauss points."""
    n = len(modal_system.square)
    count = points(x * u)
    ledger = books.ledger
    nodes = workspace.nodes
    work = 0.0
    lost = 0.0
    passed_by = 0.0
    for g in range(0, count, 4):  # four points at a time in registers
        place = (
            u * _PLACE[count, g],
            u * _PLACE[count, g + 1],
            u * _PLACE[count, g + 2],
            u * _PLACE[count, g + 3],
        )
        weight = _WEIGHT[count, g : g + 4]
        wave = at_four(workspace.waves[0], 0, top, place)
        push = (0.0, 0.0, 0.0, 0.0)
        for i in range(n):
            rate = rates_at_four(workspace.coefs, i, top, place)
            push = (
                push[0] - modal_system.base[i] * rate[0],
                push[1] - modal_system.base[i] * rate[1],
                push[2] - modal_system.base[i] * rate[2],
                push[3] - modal_system.base[i] * rate[3],
            )
            nodes[i, 0], nodes[i, 1], nodes[i, 2], nodes[i, 3] = rate
            if not modal_system.coupled:
                lost += modal_system.damping[i, i] * (
                    weight[0] * rate[0] ** 2
                    + weight[1] * rate[1] ** 2
                    + weight[2] * rate[2] ** 2
                    + weight[3] * rate[3] ** 2
                )
        if modal_system.coupled:
            for i in range(n):
                for j in range(n):
                    for k in range(4):
                        lost += weight[k] * nodes[i, k] * modal_system.damping[i, j] * nodes[j, k]
        power = (
            weight[0] * push[0] * wave[0],
            weight[1] * push[1] * wave[1],
            weight[2] * push[2] * wave[2],
            weight[3] * push[3] * wave[3],
        )
        work += power[0] + power[1] + power[2] + power[3]
        passed_by += abs(power[0]) + abs(power[1]) + abs(power[2]) + abs(power[3])
    ledger[0] += modal_system.mass * u * work
    ledger[1] += modal_system.mass * u * lost / h
    ledger[2] += modal_system.mass * u * passed_by
    cycle = int(time_state.now[0])
    if books.wanted[cycle] == 1.0:
        for g in range(count):
            share = u * _PLACE[count, g]
            at = time_state.now[1] + h * share
            out = 0.0
            angle = 2 * pi * at / time_state.period[0]
            for i in range(n):
                out += modal_system.output[i] * value(workspace.coefs[:, i], 0, top, share)
            out *= 2 * u * h * _WEIGHT[count, g] / time_state.period[0]
            books.phasors[cycle, 0] += out * cos(angle)
            books.phasors[cycle, 1] -= out * sin(angle)
