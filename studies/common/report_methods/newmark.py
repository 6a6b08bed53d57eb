"""The report's first method: Newmark's average acceleration with a speed below which the block is called stuck.

A stuck interface is released when it needs more than its static friction. If it has not passed the stick speed v_th
one step later it is stuck again: release takes 2 m v_th/h more than the kinetic friction, so that below a certain step
nothing ever moves (by_force: a stop also asks whether the static friction suffices, which cures that; v_th of limit h/m
then makes stick-slip of second order). Every stop takes away a speed of up to v_th at once. The sign of the sliding
friction is that of the speed at the start of the step, so a reversal without stick is of first order.
"""

import numpy as np

from patchfem.core import InitialState, ModalBasis, PatchfemError

from .point_laws import Coulomb, added_static, low_speed, sticking_warnings
from .steps import Comparison, Grid, finish, grid


def run(
    modes: ModalBasis,
    drive,
    laws,
    duration: float,
    steps_per_cycle: int = 400,
    stick_speed: float | None = None,
    by_force: bool = False,
    start: InitialState | None = None,
) -> Comparison:
    """Run from `start` (rest) for `duration` [s]; laws: one of point_laws per interface.

    stick_speed [m/s] of every Coulomb interface, None: each law's own. by_force: stop only where the static force
    suffices. Other laws are solved at the end of the step. PatchfemError for values that cannot be.
    """
    if stick_speed is not None and not (np.isfinite(stick_speed) and stick_speed >= 0):
        raise PatchfemError(
            f"accuracy.stick_speed = {stick_speed:g} m/s: the speed must be finite and >= 0"
        )
    found = grid(modes, drive, laws, (duration, steps_per_cycle), start, stick_speed)
    h, faces = found.h, modes.interfaces
    inverse = np.linalg.inv(
        np.eye(modes.omega.size)
        + h / 2 * modes.damping_matrix
        + h * h / 4 * np.diag(modes.omega**2)
    )
    soft = faces @ inverse @ faces.T * (h / 2 / modes.mass)
    maps, room = (h, inverse, (soft, soft * (h / 2))), (*found.room, np.zeros(len(faces), bool))
    stops = found.loops.newmark_loop(
        found.rig, maps, found.drive, found.laws, int(by_force), found.filled, room
    )
    return finish(
        modes,
        found,
        stops,
        [
            *sticking_warnings(modes, laws, h, stick_speed),
            *_warnings(modes, laws, found, by_force, stops),
        ],
    )


def _warnings(modes, laws, found: Grid, by_force, stops) -> list:
    out, h = [], found.h
    for one, row, face in zip(laws, found.laws, modes.interfaces):
        if not isinstance(one, Coulomb) or not row[3]:
            continue
        static = row[2] + added_static(modes, face, row[3], h)
        if not by_force and static > 1.01 * row[1]:
            out.append(
                f"with the stick speed {row[3]:g} m/s and steps of {h:.3g} s the interface sticks up to a force "
                f"of {static:.3g} N instead of {row[1]:.3g} N; smaller steps raise this force further; set "
                f'accuracy.stick_speed = "{low_speed(modes, face, row[1], h):.2g} m/s"'
            )
        drop = 0.5 * stops * modes.mass * row[3] ** 2 / np.sum(face**2)
        out.append(
            f"below {row[3]:g} m/s the method stops the interface at once, which rigid friction does not do; "
            f"this happened {stops} times and removed up to {drop:.3g} J of energy in all"
        )
    return out
