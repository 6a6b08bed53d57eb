"""Structures for tests of harmonic balance."""

import numpy as np
from modal_bases import make_modal_basis

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


def make_sdof(xi=0.003, omega=1.0, mass=1.0):
    """Return a modal basis with a single mode."""
    return make_modal_basis(omega, xi, mass=mass)


def make_five_modes(damping=None, zeta=0.02):
    """Return a basis of five modes with the first frequency at 1 rad/s."""
    omega = np.array([1.0, 2.3, 3.9, 6.1, 8.8])
    slide = np.array([1.0, 0.7, -0.5, 0.4, 0.3])
    base = np.array([1.0, 0.3, 0.2, -0.1, 0.1])
    return make_modal_basis(
        omega, zeta, slide, base, [1.0, -0.6, 0.4, 0.5, -0.2], mass=2.0, damping=damping
    )


def make_elements(count=100, total=6.0, limit=1.2):
    """Return stiffnesses and yield displacements of parallel elements with a given total stiffness and force limit."""
    k = np.full(count, total / count)
    w = np.linspace(0.2, 1.8, count)
    return k, w * limit / (k @ w)
