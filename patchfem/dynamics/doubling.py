"""Exact step of modes much faster than the step, by repeated doubling of a short step.

Numerical integration over a step does not resolve a motion that decays in a millionth of it. Over a
short step it is exact to round-off. Two successive steps make one of twice the length, whose motion
is a product and whose energies are a sum. The map is stored as its difference from the identity, so
slow modes lose no digits in the doublings.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False, slots=True)
class StepMap:
    """Linear map and energies of a step as functions of y = (z, z', f, a).

    The entries of y are coordinates, rates and constant accelerations (n,), and the drive (m,) at
    nodes.

    - change: (2 n, 2 n) change of (z, z') per (z, z') at the start
    - push, drive: (2 n, n), (2 n, m) change of (z, z') per f and per a
    - work, lost: (3 n + m, 3 n + m) work of the drive and viscous loss [J] as quadratic forms of y
    """

    change: np.ndarray
    push: np.ndarray
    drive: np.ndarray
    work: np.ndarray
    lost: np.ndarray


def make_short_step(square, damping, push, parts: dict, quadratic) -> StepMap:
    """Return the Step of a short step, from the numbers of `propagator`.

    Parameters
    ----------
    square, damping : ndarray
        (n, n) omega^2 and D.
    push : tuple
        Two (n, n): z and z' per constant acceleration.
    parts, quadratic
        As `propagator._drive_weights` gives them where damping couples the modes.

    Returns
    -------
    Step
    """
    far, near = push
    stay = -far @ square  # z keeps 1 + stay of its value; computed without cancellation
    change = np.block([[stay, near], [-near @ square, stay - near @ damping]])
    n = len(far)
    m = len(parts["z"])
    work, lost = np.zeros((2, 3 * n + m, 3 * n + m))
    for form, names, own in (
        (work, ("wz", "wv", "wf"), "work"),
        (lost, ("dz", "dv", "df"), "lost"),
    ):
        form[3 * n :, : 3 * n] = np.concatenate([parts[name] for name in names], axis=1) / 2
        form[: 3 * n, 3 * n :] = form[3 * n :, : 3 * n].T
        form[3 * n :, 3 * n :] = (parts[own] + parts[own].T) / 2
    lost[: 3 * n, : 3 * n] = (quadratic + quadratic.T) / 2
    return StepMap(
        change, np.concatenate(push), np.concatenate([parts["z"].T, parts["v"].T]), work, lost
    )


def double_step(step: StepMap, halves) -> StepMap:
    """Return the Step of twice the length.

    halves: two (m, m), the drive at the nodes of each half from that at those of the whole.
    """
    first, second = halves
    size = len(step.change)
    n = step.push.shape[1]
    m = len(first)
    one = np.eye(size + n + m)
    two = np.eye(size + n + m)
    one[size + n :, size + n :] = first
    two[size + n :, size + n :] = second
    begun = step.drive @ first
    two[:size, :size] += step.change
    two[:size, size : size + n] = step.push
    two[:size, size + n :] = begun
    return StepMap(
        2 * step.change + step.change @ step.change,
        2 * step.push + step.change @ step.push,
        begun + step.change @ begun + step.drive @ second,
        *(one.T @ form @ one + two.T @ form @ two for form in (step.work, step.lost)),
    )


def split_step(step: StepMap) -> tuple:
    """Return parts and quadratic form of a Step, like `propagator._drive_weights` for coupled modes."""
    n = step.push.shape[1]
    cut = 3 * n
    parts = {
        "z": step.drive[:n].T,
        "v": step.drive[n:].T,
        "work": step.work[cut:, cut:],
        "lost": step.lost[cut:, cut:],
    }
    for form, names in ((step.work, ("wz", "wv", "wf")), (step.lost, ("dz", "dv", "df"))):
        parts |= {name: 2 * form[cut:, k * n : (k + 1) * n] for k, name in enumerate(names)}
    return parts, step.lost[:cut, :cut]
