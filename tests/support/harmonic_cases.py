"""Structures and a simple time march for tests of harmonic balance."""

import numpy as np
from modal_bases import make_modal_basis
from scipy.linalg import expm

from patchfem.dynamics.harmonic.laws import FlowLaw
from patchfem.friction import Bonds, LuGre, points_element
from patchfem.friction.laws.tanh import TanhLaw


def make_speed_law(limit, speed):
    """Return the law limit tanh(v/speed)."""
    return FlowLaw(TanhLaw(limit, speed).element(1.0))


def make_bond_law(limit, length):
    """Return the law of bonds, F = limit u with du/dq = sgn(v) - u per unit of length."""
    return FlowLaw(points_element(Bonds(limit, length), 1.0))


def make_lugre_law():
    """Return a LuGre law with Stribeck effect and damping, whose memory depends on time."""
    return FlowLaw(LuGre(0.8, 0.6, 8.0, 0.5, 0.02, 0.01).element(1.0))


def make_sdof(xi=0.003):
    """Return a modal basis with a single mode."""
    return make_modal_basis(1.0, xi)


def make_five_modes(damping=None):
    """Return a basis of five modes with the first frequency at 1 rad/s."""
    omega = np.array([1.0, 2.3, 3.9, 6.1, 8.8])
    slide = np.array([1.0, 0.7, -0.5, 0.4, 0.3])
    base = np.array([1.0, 0.3, 0.2, -0.1, 0.1])
    return make_modal_basis(
        omega, 0.02, slide, base, [1.0, -0.6, 0.4, 0.5, -0.2], mass=2.0, damping=damping
    )


def make_elements(count=100, total=6.0, limit=1.2):
    """Return stiffnesses and yield displacements of parallel elements with a given total stiffness and force limit."""
    k = np.full(count, total / count)
    w = np.linspace(0.2, 1.8, count)
    return k, w * limit / (k @ w)


def march_exactly(modes, drive, stiffness, limit, state, stretch, steps):
    """Propagate the modes exactly under a force that is linear in each step, found by fixed-point iteration.

    Returns rows (z, v) and forces.
    """
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
    # Displacement at the interface per change of the force over a step.
    gain = modes.slide @ e[:n, 2 * n + 3] / dt
    for i in range(steps):
        s = np.array([np.sin(w * i * dt), np.cos(w * i * dt)])
        q = modes.slide @ y[:n]
        free = e[:, : 2 * n] @ y + e[:, 2 * n : 2 * n + 2] @ s + e[:, 2 * n + 2] * force
        end = force
        for _ in range(50):
            new = np.clip(
                stretch + modes.slide @ free[:n] + gain * (end - force) - q, -limit, limit
            )
            previous = end
            end = stiffness @ new
            if abs(end - previous) < 1e-14:
                break
        y = free + e[:, 2 * n + 3] * (end - force) / dt
        stretch = new
        force = end
        rows.append(y)
        forces.append(force)
    return np.array(rows), np.array(forces)
