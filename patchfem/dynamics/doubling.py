"""Exact time step for modes whose periods are much shorter than the step, by repeated doubling.

Numerical integration over a step does not resolve a motion that decays in a millionth of it. Over a
short step it is exact to round-off. Two successive steps make a step of twice the length, whose motion
is a product and whose energies are a sum. The map is stored as its difference from the identity, so
slow modes lose no digits in the doublings.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False, slots=True)
class StepMap:
    """Linear map of the modal state over a time step, and the step's energies as quadratic forms.

    Both are functions of y = (z, z', f, a): coordinates, rates and constant accelerations (n,), and the drive (m,) at
    nodes.

    - change: (2 n, 2 n) change of (z, z') per (z, z') at the start
    - force_response, drive: (2 n, n), (2 n, m) change of (z, z') per acceleration f and per drive a
    - work, lost: (3 n + m, 3 n + m) work of the drive and viscous loss [J] as quadratic forms of y
    """

    change: np.ndarray
    force_response: np.ndarray
    drive: np.ndarray
    work: np.ndarray
    lost: np.ndarray


def make_short_step(square, damping, force_response, parts: dict, quadratic) -> StepMap:
    """Return the step map for a step that is short compared with the periods of the modes.

    Parameters
    ----------
    square, damping : ndarray
        (n, n) omega^2 and D.
    force_response : tuple
        Two (n, n): z and z' at the end of the step per constant acceleration.
    parts, quadratic
        Results of `propagator._compute_drive_weights` for coupled damping.

    Returns
    -------
    Step
    """
    position_response, rate_response = force_response
    # The deviation of the free motion of z from the identity is computed without cancellation.
    position_change = -position_response @ square
    change = np.block(
        [
            [position_change, rate_response],
            [-rate_response @ square, position_change - rate_response @ damping],
        ]
    )
    n = len(position_response)
    m = len(parts["z"])
    work, loss = np.zeros((2, 3 * n + m, 3 * n + m))
    for form, names, drive_part in (
        (work, ("wz", "wv", "wf"), "work"),
        (loss, ("dz", "dv", "df"), "lost"),
    ):
        form[3 * n :, : 3 * n] = np.concatenate([parts[name] for name in names], axis=1) / 2
        form[: 3 * n, 3 * n :] = form[3 * n :, : 3 * n].T
        form[3 * n :, 3 * n :] = (parts[drive_part] + parts[drive_part].T) / 2
    loss[: 3 * n, : 3 * n] = (quadratic + quadratic.T) / 2
    return StepMap(
        change,
        np.concatenate(force_response),
        np.concatenate([parts["z"].T, parts["v"].T]),
        work,
        loss,
    )


def double_step(step: StepMap, halves) -> StepMap:
    """Return the step map for two successive equal steps.

    halves: two (m, m), interpolation of the drive from the nodes of the double step to those of each half.
    """
    first, second = halves
    size = len(step.change)
    n = step.force_response.shape[1]
    m = len(first)
    first_state = np.eye(size + n + m)
    second_state = np.eye(size + n + m)
    first_state[size + n :, size + n :] = first
    second_state[size + n :, size + n :] = second
    first_drive = step.drive @ first
    second_state[:size, :size] += step.change
    second_state[:size, size : size + n] = step.force_response
    second_state[:size, size + n :] = first_drive
    work, lost = (
        first_state.T @ form @ first_state + second_state.T @ form @ second_state
        for form in (step.work, step.lost)
    )
    return StepMap(
        2 * step.change + step.change @ step.change,
        2 * step.force_response + step.change @ step.force_response,
        first_drive + step.change @ first_drive + step.drive @ second,
        work,
        lost,
    )


def split_step(step: StepMap) -> tuple:
    """Return the weights of the drive signal, and the quadratic form of the loss, from a step map.

    They are those of `propagator._compute_drive_weights` for coupled damping.

    """
    n = step.force_response.shape[1]
    n_states = 3 * n
    parts = {
        "z": step.drive[:n].T,
        "v": step.drive[n:].T,
        "work": step.work[n_states:, n_states:],
        "lost": step.lost[n_states:, n_states:],
    }
    for form, names in ((step.work, ("wz", "wv", "wf")), (step.lost, ("dz", "dv", "df"))):
        parts |= {name: 2 * form[n_states:, k * n : (k + 1) * n] for k, name in enumerate(names)}
    return parts, step.lost[:n_states, :n_states]
