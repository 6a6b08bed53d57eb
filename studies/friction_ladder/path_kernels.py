"""Bare compiled loops of the laws along a path: mean force and new memory of every step, nothing else."""

import numpy as np
from numba import njit

from patchfem.friction.bonds.list_kernels import list_mean, list_step
from patchfem.friction.bonds.point_kernels import bond_mean, bond_step, grow, loose_mean, loose_step
from patchfem.friction.laws import elastic_plastic_kernels as law


@njit(error_model="numpy")
def coulomb(path, force):
    for i in range(path.size - 1):
        dq = path[i + 1] - path[i]
        force[i] = 1.0 if dq > 0 else -1.0


@njit(error_model="numpy")
def tanh(path, dt, speed, force):
    for i in range(path.size - 1):
        force[i] = np.tanh((path[i + 1] - path[i]) / (dt * speed))


@njit(error_model="numpy")
def jenkins(path, num, mem, force):
    for i in range(path.size - 1):
        dq = path[i + 1] - path[i]
        force[i] = law.mean(num, mem, 0, path[i], dq, 0.0, 1.0)[0]
        law.commit(num, mem, 0, dq, force[i], 0.0, 0.0, 1.0, 0.0)


@njit(error_model="numpy")
def bond(path, dt, growth, force):
    m, z, s2, eps = 1.0, 0.0, 0.0, growth[3]
    for i in range(path.size - 1):
        dq = path[i + 1] - path[i]
        v, middle = dq / dt, eps
        if growth[0] >= 0:
            middle = grow(eps, v, v, abs(dq) / 2, dt / 2, growth)[0]
            eps = grow(eps, v, v, abs(dq), dt, growth)[0]
        force[i] = bond_mean(m, z, dq, 1.0, middle)[0] / growth[3]
        m, z, s2, _ = bond_step(m, z, s2, dq, 1.0, middle)
    return s2


@njit(error_model="numpy")
def loose(path, growth, force):
    m, z, s2, play, eps = 1.0, 0.0, 0.0, 0.0, growth[3]
    for i in range(path.size - 1):
        dq = path[i + 1] - path[i]
        force[i] = loose_mean(m, z, play, growth[5] * eps, dq, 1.0, eps)[0] / eps
        m, z, s2, play, _ = loose_step(m, z, s2, play, growth[5] * eps, dq, 1.0, eps)
    return s2


@njit(error_model="numpy")
def listed(path, dt, c, force):
    """Steps that a list of bonds took before it was full."""
    for i in range(path.size - 1):
        dq = path[i + 1] - path[i]
        force[i] = list_mean(dq, c, dq / dt, dt)
        if not list_step(dq, c, dq / dt, dq / dt, dt):
            return i
    return path.size - 1


@njit(error_model="numpy")
def bouc_wen(path, power, force):
    """gamma = beta = 1/2, one Runge-Kutta step of order 4 per step of the path (bond lengths)."""
    z = 0.0
    for i in range(path.size - 1):
        h = path[i + 1] - path[i]
        way = 1.0 if h > 0 else -1.0
        a = _slope(z, way, power)
        b = _slope(z + h / 2 * a, way, power)
        c = _slope(z + h / 2 * b, way, power)
        d = _slope(z + h * c, way, power)
        force[i] = z
        z += h / 6 * (a + 2 * b + 2 * c + d)


@njit(error_model="numpy")
def _slope(z, way, power):
    size = abs(z)
    up = size
    for _ in range(power - 1):
        up *= size
    return 1.0 - up if z * way > 0 else 1.0
