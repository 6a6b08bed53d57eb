"""The report's implicit procedure: Duhamel's integral of each mode (3.10) with forces that run straight in the step.

The friction at the end of a step is found by relaxed fixed-point iteration and accepted when the displacement, the
speed or the force stops changing. A change of the displacement by d between two iterates leaves the force wrong by up
to 6 m d/(relax h^2), one of the speed by 2 m d/(relax h): the first two say little about the force.
"""

import numpy as np
from scipy.linalg import expm

from patchfem.core import InitialState, ModalBasis, PatchfemError

from .point_laws import elastic_rates, sticking_warnings
from .steps import Comparison, Grid, finish, grid

CRITERIA = ("displacement", "velocity", "force")
ADMITTED = 1e-2  # share of the friction limit that a step may leave open before a run says so
TURN = 0.5  # of the elastic part of the friction in a step [rad], beyond which a run says so


def kernels(modes: ModalBasis, h: float) -> np.ndarray:
    """Maps (n, 2, 4) of (z, z', f at the start, f at the end) to (z, z') after h [s] (eq. 3.10).

    f [m s-2] is linear in time. Dampers that couple the modes are left out; the loop takes them as a force.
    """
    out = np.empty((modes.omega.size, 2, 4))
    for i, (w, d) in enumerate(zip(modes.omega, np.diag(modes.damping_matrix))):
        a = np.zeros((4, 4))
        a[0, 1], a[1, :3], a[2, 3] = 1.0, (-w * w, -d, 1.0), 1.0 / h
        out[i] = expm(a * h)[:2]
        out[i, :, 2] -= out[i, :, 3]
    return out


def admitted(
    modes: ModalBasis, h: float, convergence: str, tolerance: float, relax: float
) -> np.ndarray:
    """Error of the friction (i,) [N] that an accepted step can have."""
    if convergence == "force":
        return np.full(len(modes.interfaces), tolerance)
    at = CRITERIA.index(convergence)
    return tolerance * modes.mass / (relax * (modes.interfaces**2 @ kernels(modes, h)[:, at, 3]))


def run(
    modes: ModalBasis,
    drive,
    laws,
    duration: float,
    steps_per_cycle: int = 400,
    convergence: str = "force",
    tolerance: float = 1e-6,
    relax: float = 0.5,
    start: InitialState | None = None,
    most: int = 200,
) -> Comparison:
    """Run from `start` (rest) for `duration` [s]; laws: one of point_laws per interface.

    convergence: what must not change between two iterates of a step, "displacement" (tolerance in m), "velocity" (m/s)
    or "force" (N); relax in (0, 1]; most: iterations per step. PatchfemError for values that cannot be.
    """
    if convergence not in CRITERIA:
        raise PatchfemError(
            f"accuracy.convergence: '{convergence}' is not possible; use one of {', '.join(CRITERIA)}"
        )
    if not 0 < tolerance < np.inf or not 0 < relax <= 1 or most < 2:
        raise PatchfemError(
            f"accuracy.convergence_tolerance = {tolerance:g}, relax = {relax:g}, most = {most}: the "
            "tolerance must be finite and > 0, relax must be > 0 and <= 1, and most (the number of "
            "iterations) must be at least 2"
        )
    found = grid(modes, drive, laws, (duration, steps_per_cycle), start)
    maps, coupling = (
        kernels(modes, found.h),
        modes.damping_matrix - np.diag(np.diag(modes.damping_matrix)),
    )
    solve = np.linalg.inv(np.eye(modes.omega.size) + maps[:, 1, 3:] * coupling)
    stop = CRITERIA.index(convergence), float(tolerance), float(relax), int(most)
    failures = found.loops.duhamel_loop(
        found.rig, (maps, coupling, solve), stop, found.drive, found.laws, found.filled, found.room
    )
    share = admitted(modes, found.h, convergence, tolerance, relax) / found.laws[:, 1]
    said = [
        *sticking_warnings(modes, laws, found.h),
        *_admitting(convergence, tolerance, float(share.max(initial=0))),
        *_warnings(modes, laws, found, failures, steps_per_cycle),
    ]
    return finish(modes, found, failures, said)


def _admitting(convergence: str, tolerance: float, share: float) -> list:
    """Warning, as a list, of a criterion that allows a friction error of a share of its limit."""
    if share <= ADMITTED:
        return []
    cure = (
        f"divide accuracy.convergence_tolerance by {np.ceil(share / ADMITTED):.0f}"
        if convergence == "force"
        else 'set accuracy.convergence = "force"'
    )
    return [
        f"the iterations end when the {convergence} changes by less than {tolerance:g}, which leaves an error of "
        f"the friction force of up to {share:.3g} of the friction limit; {cure}"
    ]


def _warnings(modes, laws, found: Grid, failures, steps: int) -> list:
    out, (*_, residual, iterations) = [], found.filled
    left = np.abs(residual) / found.laws[:, 1]
    if left.max(initial=0.0) > ADMITTED:
        out.append(
            f"the friction force differs from the friction law by up to {left.max():.3g} of the friction limit, "
            f"and on average over the steps by {left[1:].mean():.3g} of this limit"
        )
    if failures:
        out.append(
            f"{failures} of {iterations.size - 1} time steps did not converge within the permitted number of "
            "iterations"
        )
    turn = found.h * max(elastic_rates(modes, laws), default=0.0)
    if turn > TURN:
        out.append(
            f"in one time step the free vibration of the block on the elastic contact advances by {turn:.2g} "
            f"rad (limit {TURN:g} rad); set accuracy.steps_per_cycle = {steps * int(np.ceil(turn / TURN))}"
        )
    return out
