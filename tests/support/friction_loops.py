"""Friction forces along given slides in closed form, and tables of measured loops as a laboratory writes them."""

import numpy as np


def elastic_plastic_force(slide, limit: float, length: float) -> np.ndarray:
    """Return the force (n,) [N] of an element that slips at a limit [N] after a length [m], by the play operator."""
    forces = [0.0]
    for step in np.diff(slide):
        forces.append(float(np.clip(forces[-1] + limit / length * step, -limit, limit)))
    return np.array(forces)


def dahl_force(slide, limit: float, length: float) -> np.ndarray:
    """Return the force (n,) [N] of bonds of constant length [m] on a piecewise linear path.

    It solves F' = (limit sgn v - F) |v|/length in closed form on each segment of the path.
    """
    forces = [0.0]
    for step in np.diff(slide):
        end = np.sign(step) * limit
        forces.append(end + (forces[-1] - end) * np.exp(-abs(step) / length))
    return np.array(forces)


def write_loop(path, time, slide, force, cycle=None, quantity="force [N]"):
    """Write a measured loop in ms and um and return its path; `cycle` (n,) adds a column of labels."""
    columns = {"time [ms]": 1e3 * time, "displacement [um]": 1e6 * slide, quantity: force}
    columns |= {} if cycle is None else {"cycle": cycle}
    table = np.transpose([*columns.values()])
    np.savetxt(path, table, fmt="%.17g", delimiter=",", header=",".join(columns), comments="")
    return path
