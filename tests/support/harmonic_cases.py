"""Structures and a plain march that the tests of harmonic balance share."""

import numpy as np
from modal_bases import basis_of
from scipy.linalg import expm

from patchfem.dynamics.harmonic.laws import FlowLaw, SpeedLaw
from patchfem.friction import Bonds, TanhLaw, points_element


def of_speed(limit, speed):
    """limit tanh(v/speed)."""
    return SpeedLaw(TanhLaw(limit, speed).element(1.0))


def bonds(limit, length):
    """The bond recursion u' = sgn - u per length, F = limit u."""
    return FlowLaw(points_element(Bonds(limit, length), np.ones(1), np.ones(1)))


def sdof(xi=0.003, omega=1.0, mass=1.0):
    return basis_of(omega, xi, mass=mass)


def five(damping=None, zeta=0.02):
    """Five modes with a first one near 1."""
    omega = np.array([1.0, 2.3, 3.9, 6.1, 8.8])
    slide = np.array([1.0, 0.7, -0.5, 0.4, 0.3])
    base = np.array([1.0, 0.3, 0.2, -0.1, 0.1])
    return basis_of(
        omega, zeta, slide, base, [1.0, -0.6, 0.4, 0.5, -0.2], mass=2.0, damping=damping
    )


def many(count=100, total=6.0, limit=1.2):
    """(stiffness, limit slide) of parallel elements with a force limit in all."""
    k = np.full(count, total / count)
    w = np.linspace(0.2, 1.8, count)
    return k, w * limit / (k @ w)


def plain_jenkins(places, stiffness, limit):
    """Forces along a path from the virgin state at 0, element by element; and the last stretch."""
    stretch = np.zeros(len(stiffness))
    last = 0.0
    out = []
    for q in places:
        stretch = np.clip(stretch + q - last, -limit, limit)
        last = q
        out.append(stiffness @ stretch)
    return np.array(out), stretch


def march(modes, drive, stiffness, limit, state, stretch, steps, cycles=1):
    """Exact propagation of the modes under a force linear in each step, found by fixed point: rows (z, v), forces."""
    n = modes.omega.size
    m = modes.mass
    w = drive.omega
    a = np.zeros((2 * n + 4, 2 * n + 4))
    a[:n, n : 2 * n] = np.eye(n)
    a[n : 2 * n, :n] = -np.diag(modes.omega**2)
    a[n : 2 * n, n : 2 * n] = -modes.damping_matrix
    a[n : 2 * n, 2 * n] = -modes.base * drive.acceleration
    a[n : 2 * n, 2 * n + 2] = -modes.slide / m
    a[2 * n, 2 * n + 1] = w
    a[2 * n + 1, 2 * n] = -w
    a[2 * n + 2, 2 * n + 3] = 1.0
    dt = drive.period / steps
    e = expm(a * dt)[: 2 * n]
    y = np.array(state, float)
    force = stiffness @ stretch
    rows = [y]
    forces = [force]
    gain = modes.slide @ e[:n, 2 * n + 3] / dt  # slide per change of the force over the step
    for i in range(steps * cycles):
        s = np.array([np.sin(w * i * dt), np.cos(w * i * dt)])
        q = modes.slide @ y[:n]
        free = e[:, : 2 * n] @ y + e[:, 2 * n : 2 * n + 2] @ s + e[:, 2 * n + 2] * force
        end = force
        for _ in range(50):
            new = np.clip(
                stretch + modes.slide @ free[:n] + gain * (end - force) - q, -limit, limit
            )
            before = end
            end = stiffness @ new
            if abs(end - before) < 1e-14:
                break
        y = free + e[:, 2 * n + 3] * (end - force) / dt
        stretch = new
        force = end
        rows.append(y)
        forces.append(force)
    return np.array(rows), np.array(forces)
