"""The three numerical methods of the report, for modes that rub at one interface.

`solve_duhamel` is the implicit procedure: Duhamel's integral of each mode (equation 3.10) with forces that change
linearly in a step. The friction at the end of a step is found by relaxed fixed-point iteration and accepted when the
displacement, the velocity or the force stops changing. A displacement that changes by d between two iterations leaves
the force wrong by up to 6 m d/(relaxation h^2), a velocity by 2 m d/(relaxation h): both say little about the force.

`solve_newmark` is the first method: Newmark's average acceleration with a speed v_th below which the block is called
stuck. A stuck interface is released when it needs more than its friction. If it has not passed v_th one step later it
is stuck again: release takes 2 m v_th/h more than the friction, so that below a certain step nothing ever moves. With
`needs_force` a stop also needs a friction that suffices, which cures that; v_th = limit h/m then makes stick-slip of
second order. Every stop takes away a speed of up to v_th at once. The sign of the sliding friction is that of the speed
at the start of the step, so a reversal without stick is of first order.

`solve_euler` is the explicit method for friction that follows the speed (equations 2.4 to 2.7). It multiplies a free
vibration by |1 + i omega h| in a step, which takes omega h/2 off the damping ratio of every mode.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.linalg import expm

from patchfem import kernel_cache
from patchfem.core import InitialState, ModalBasis
from patchfem.structure.histories import find_accelerations

KERNELS = Path(__file__).with_name("report_methods_kernels.py")
CRITERIA = ("displacement", "velocity", "force")
MAX_ITERATIONS = 200  # iterations of one step of Duhamel's integral


class Law(NamedTuple):
    """Friction law of the interface, as the compiled loops take it: kind, limit [N] and scale."""

    kind: int
    limit: float
    scale: float


def load_kernels():
    """Return the compiled loops, whose machine code is stored as that of the package."""
    text = KERNELS.read_text("utf-8")
    return kernel_cache.make_kernel_module(
        f"report_methods_{kernel_cache.hash_text(text)}", text, KERNELS
    )


def coulomb(limit: float, stick_speed: float = 0.0) -> Law:
    """Return Coulomb's law; below the stick speed [m/s] the friction force is the force that keeps the interface at rest."""
    return Law(load_kernels().COULOMB, limit, stick_speed)


def elastic_plastic(limit: float, yield_displacement: float, *, as_printed: bool = False) -> Law:
    """Return the elastic-plastic law, or equation 3.12, whose force stays at the limit once it is reached.

    Parameters
    ----------
    limit : float
        [N]
    yield_displacement : float
        [m]
    as_printed : bool
        Equation 3.12.
    """
    kernels = load_kernels()
    kind = kernels.ELASTIC_PLASTIC_AS_PRINTED if as_printed else kernels.ELASTIC_PLASTIC
    return Law(kind, limit, yield_displacement)


@dataclass(frozen=True, eq=False, slots=True)
class Motion:
    """Motion of n modes in all k steps.

    - `time` (k,) [s], `drive` (k,) [m s-2]
    - `z`, `v` (k, n): modal coordinates [m] and their rates [m/s]
    - `force` (k,): friction force [N]
    - `residual` (k,): force of the law at the end of the step less the force that the step used [N]
    - `n_failed`: number of steps of Duhamel's integral that did not converge
    """

    time: np.ndarray
    drive: np.ndarray
    z: np.ndarray
    v: np.ndarray
    force: np.ndarray
    residual: np.ndarray
    n_failed: int = 0

    def accelerations(self, modes: ModalBasis) -> np.ndarray:
        """Return the modal accelerations (k, n) [m s-2] relative to the base."""
        friction = np.outer(self.force, modes.slide)
        return find_accelerations(modes, self.drive, self.z, self.v, friction)


class Problem(NamedTuple):
    """Arguments of the compiled loops: step [s], rig, drive (k,), history with its initial state, and workspace."""

    step: float
    rig: tuple
    drive: np.ndarray
    history: tuple
    workspace: np.ndarray

    def motion(self, residual=None, n_failed: int = 0) -> Motion:
        """Return the motion of a filled history."""
        time = self.step * np.arange(self.drive.size)
        if residual is None:
            residual = np.zeros(time.size)
        return Motion(time, self.drive, *self.history, residual, n_failed)


def _set_up(
    modes: ModalBasis, drive, law: Law, steps: tuple, start: InitialState | None
) -> Problem:
    """Return the problem of a motion with its initial state.

    `steps` contains the duration [s] and the steps per period of the drive.
    """
    duration, steps_per_cycle = steps
    step = drive.period / steps_per_cycle
    count = round(duration / step) + 1
    n = modes.omega.size
    z = np.zeros((count, n))
    v = np.zeros((count, n))
    force = np.zeros(count)
    if start is not None:
        z[0] = start.z
        v[0] = start.v
    arrays = (modes.omega, modes.damping_matrix, modes.slide, modes.base)
    rig = (*(np.array(array, float, order="C") for array in arrays), float(modes.mass))
    push = np.array(drive.values(step * np.arange(count)), float)
    # friction force that keeps the interface stuck at the start
    free = find_accelerations(modes, push[:1], z[:1], v[:1], np.zeros((1, n)))[0]
    hold = free @ modes.slide * modes.mass / (modes.slide @ modes.slide)
    force[0] = load_kernels().law_force(
        tuple(law), float(modes.slide @ v[0]), 0.0, 0.0, float(hold)
    )
    return Problem(step, rig, push, (z, v, force), np.zeros((4, n)))


def duhamel_maps(modes: ModalBasis, step: float) -> np.ndarray:
    """Return the maps (n, 2, 4) of (z, z', f at the start, f at the end) to (z, z') after a step [s].

    The acceleration f [m s-2] is linear in time (equation 3.10). Damping must not couple the modes.
    """
    maps = np.empty((modes.omega.size, 2, 4))
    for i, (omega, damping) in enumerate(zip(modes.omega, np.diag(modes.damping_matrix))):
        system = np.zeros((4, 4))
        system[0, 1] = 1.0
        system[1, :3] = -omega * omega, -damping, 1.0
        system[2, 3] = 1.0 / step
        maps[i] = expm(system * step)[:2]
        maps[i, :, 2] -= maps[i, :, 3]
    return maps


def solve_duhamel(
    modes: ModalBasis,
    drive,
    law: Law,
    steps: tuple,
    *,
    criterion: str = "force",
    tolerance: float = 1e-6,
    relaxation: float = 0.5,
    start: InitialState | None = None,
) -> Motion:
    """Integrate by Duhamel's integral and fixed-point iteration of the friction force.

    Parameters
    ----------
    modes : ModalBasis
    drive : signal
    law : Law
    steps : (float, int)
        Duration [s], and steps per period of the drive.
    criterion : str
        What must not change by more than the tolerance between two iterations: "displacement" [m], "velocity" [m/s]
        or "force" [N].
    tolerance, relaxation : float
    start : InitialState, optional
        State of rest if omitted.

    Returns
    -------
    Motion
    """
    problem = _set_up(modes, drive, law, steps, start)
    residual = np.zeros(problem.drive.size)
    stop = (CRITERIA.index(criterion), float(tolerance), float(relaxation), MAX_ITERATIONS)
    n_failed = load_kernels().duhamel_loop(
        problem.rig,
        duhamel_maps(modes, problem.step),
        stop,
        problem.drive,
        tuple(law),
        problem.history,
        residual,
        problem.workspace,
    )
    return problem.motion(residual, n_failed)


def solve_newmark(
    modes: ModalBasis,
    drive,
    law: Law,
    steps: tuple,
    *,
    needs_force: bool = False,
    start: InitialState | None = None,
) -> Motion:
    """Integrate by Newmark's average acceleration method with Coulomb's law."""
    problem = _set_up(modes, drive, law, steps, start)
    h = problem.step
    stiffness = h * h / 4 * np.diag(modes.omega**2)
    inverse = np.linalg.inv(np.eye(modes.omega.size) + h / 2 * modes.damping_matrix + stiffness)
    softness = float(modes.slide @ inverse @ modes.slide * (h / 2 / modes.mass))
    load_kernels().newmark_loop(
        problem.rig,
        (h, inverse, softness),
        problem.drive,
        tuple(law),
        int(needs_force),
        problem.history,
        problem.workspace,
    )
    return problem.motion()


def solve_euler(
    modes: ModalBasis,
    drive,
    limit: float,
    transition_speed: float,
    steps: tuple,
    start: InitialState | None = None,
) -> Motion:
    """Integrate with the friction force limit tanh(v/transition_speed) by explicit Euler steps.

    Parameters
    ----------
    modes : ModalBasis
    drive : drive
    limit : float
        [N]
    transition_speed : float
        [m/s]
    steps : tuple
        Duration [s] and number of steps.
    start : InitialState, optional
    """
    law = Law(load_kernels().RATE, limit, transition_speed)
    problem = _set_up(modes, drive, law, steps, start)
    load_kernels().euler_loop(
        problem.rig, problem.step, problem.drive, tuple(law), problem.history, problem.workspace
    )
    return problem.motion()
