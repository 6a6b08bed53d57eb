"""Backbone of a mode in a linear rig, with equal frequency and damping at all amplitudes."""

import numpy as np

from ...core import NotConverged
from .joint import JointMode
from .records import ROUND_OFF_ERROR, Curve, make_curve

# Number of fixed-point steps to the negative damping that sustains the motion; they converge fast.
N_STEPS = 8


def compute_constant_curve(joint: JointMode, amplitudes) -> Curve:
    """Return frequency and damping of a mode of a linear rig, the same at all amplitudes (k,) [m].

    A negative damping g of every coordinate maintains the motion: the frequency is that of this motion, and the damping
    ratio is g/(2 omega).
    """
    negative_damping = 0.0
    for _ in range(N_STEPS):
        negative_damping -= 2 * _find_mode_eigenvalue(joint, negative_damping).real
    omega = abs(_find_mode_eigenvalue(joint, negative_damping))
    damped_root = _find_mode_eigenvalue(joint, 0.0)
    if not (damped_root.imag and negative_damping < 2 * omega):
        raise NotConverged("the mode does not oscillate: its damping ratio is 1 or more")
    damping = negative_damping / (2 * omega)
    values = np.outer([omega / (2 * np.pi), damping], np.ones(amplitudes.size))
    return make_curve(amplitudes, values, ROUND_OFF_ERROR * np.abs(values))


def _find_mode_eigenvalue(joint: JointMode, negative_damping: float) -> complex:
    """Return the eigenvalue of z'' + (D - g) z' + Omega^2 z = 0 that belongs to the mode.

    Its eigenvector has the largest component of the mode.

    negative_damping: g [1/s].
    """
    modes = joint.modes
    n = modes.omega.size
    damping = negative_damping * np.eye(n) - modes.damping_matrix
    matrix = np.block([[np.zeros((n, n)), np.eye(n)], [-np.diag(modes.omega**2), damping]])
    values, vectors = np.linalg.eig(matrix)
    size = np.abs(vectors[joint.mode]) / np.linalg.norm(vectors[:n], axis=0)
    return values[np.argmax(size)]
