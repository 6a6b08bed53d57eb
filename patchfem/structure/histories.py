"""Histories of a motion that follow from its modal coordinates.

In: modes, modal coordinates and contact forces at k instants. Out: a `core.Response`. All engines use it.
"""

import numpy as np

from ..core import ModalBasis, Response

# Names of the histories of all interfaces in `core.Response.extra`
INTERFACE_HISTORIES = ("slides", "slide_rates", "forces", "slips")


def find_accelerations(modes: ModalBasis, push, z, rate, pull) -> np.ndarray:
    """Compute the modal accelerations (k, n) [m s-2] relative to the base from eq. 3.4.

    Parameters
    ----------
    modes : ModalBasis
        The n modes of the rig.
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
    modes: ModalBasis,
    drive,
    push,
    motion: tuple[np.ndarray, np.ndarray, np.ndarray],
    pull,
    interfaces: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray],
    extra: dict[str, np.ndarray],
) -> Response:
    """Return the histories of a motion. Those of several interfaces are in `extra` too.

    Parameters
    ----------
    modes : ModalBasis
        The n modes of the rig.
    drive : drives.DriveSignal
        Its flag `moving` tells whether the base moves.
    push : (k,) array
        Acceleration of the drive [m s-2].
    motion : tuple of arrays
        Times (k,) [s], modal coordinates (k, n) [m] and their rates (k, n) [m/s].
    pull : (k, n) array
        Forces of the contact on the coordinates [N], against their motion.
    interfaces : tuple of arrays
        Slides [m], their rates [m/s], friction forces [N] and slips [m] of the interfaces, (k, i) each.
    extra : dict of arrays
        Further histories (k, ...) by name.
    """
    time, z, rate = motion
    count = interfaces[0].shape[1]
    if count > 1:
        extra = extra | dict(zip(INTERFACE_HISTORIES, interfaces))
    if count:
        first = [column[:, 0] for column in interfaces]
    else:
        zeros = np.zeros(time.size)
        first = [z @ modes.slide, rate @ modes.slide, zeros, zeros]

    base = push if drive.moving else np.zeros_like(push)
    acceleration = find_accelerations(modes, push, z, rate, pull) @ modes.output + base
    slide, speed, force, slip = first
    return Response(
        time, z, rate, slide, speed, z @ modes.output, rate @ modes.output, acceleration, base, force,
        slip, extra,
    )  # fmt: skip
