"""Histories of a motion that follow from its modal coordinates.

In: modes, modal coordinates and contact forces at k instants. Out: a `core.Response`. All engines use it.
"""

import numpy as np

from ..core import ModalBasis, Response


def find_accelerations(modes: ModalBasis, push, z, rate, pull) -> np.ndarray:
    """Compute the modal accelerations (k, n) [m s-2] relative to the base from eq. 3.4.

    Parameters
    ----------
    modes : ModalBasis
    push : (k,) array
        Acceleration of the drive [m s-2].
    z, rate : (k, n) array
        Modal coordinates [m] and rates [m/s].
    pull : (k, n) array
        Forces of the contact on the coordinates [N], against their motion.
    """
    forced = -np.outer(push, modes.base) - pull / modes.mass
    return forced - rate @ modes.damping_matrix.T - z * modes.omega**2


def make_response(
    modes: ModalBasis, drive, push, motion: tuple, pull, interface: tuple, extra: dict
) -> Response:
    """Return the histories of a motion.

    Parameters
    ----------
    modes : ModalBasis
    drive : object
        With the flag `moving`, whether the base moves.
    push, pull
        See `find_accelerations`.
    motion : tuple
        Times (k,) [s], modal coordinates (k, n) [m] and their rates (k, n) [m/s].
    interface : tuple
        Slide [m], its rate [m/s], friction force [N] and slip [m] of the first interface, (k,) each.
    extra : dict
        Further histories by name.
    """
    time, z, rate = motion
    slide, speed, force, slip = interface
    base = push if drive.moving else np.zeros_like(push)
    acceleration = find_accelerations(modes, push, z, rate, pull) @ modes.output + base
    return Response(
        time, z, rate, slide, speed, z @ modes.output, rate @ modes.output, acceleration, base, force,
        slip, extra,
    )  # fmt: skip
