"""A modal basis with one mode, and contact points along a prescribed path."""

from typing import NamedTuple

import numpy as np

from patchfem.time_steps.slides import follow

OMEGA = 2 * np.pi * 143


class Path(NamedTuple):
    """Forces (k, 3): at the samples, means of the steps, slip; energies (k, 2): lost in a step, stored; steps without
    solution; the SlideMotion."""

    forces: np.ndarray
    energies: np.ndarray
    n_unsolved: int
    motion: object


def follow_path(contact, path, dt=0.3, frames=()) -> Path:
    """Move contact points along a path in steps of dt."""
    path = np.asarray(path, float)
    motion = follow(contact, dt * np.arange(path.size), path, frames)
    forces = np.zeros((path.size, 3))
    energies = np.zeros((path.size, 2))
    forces[:, 0] = motion.force
    forces[:-1, 1] = motion.mean
    forces[:, 2] = motion.slip
    energies[:-1, 0] = motion.losses
    energies[:, 1] = motion.stored
    return Path(forces, energies, motion.n_unsolved, motion)
