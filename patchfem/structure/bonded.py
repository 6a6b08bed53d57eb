"""A spring and a damper across an interface, added to the modes of a rig or removed."""

from dataclasses import replace

import numpy as np

from ..core import ModalBasis, PatchfemError
from .matrices import decouple_modes, split_damping, trim_round_off
from .modes import make_basis

# Smallest squared frequency of an elastic mode relative to the largest one; a mode with a smaller
# one is rigid
MIN_ELASTIC_FRACTION = 1e-12


def add_spring(basis: ModalBasis, stiffness: float, damping: float = 0.0) -> ModalBasis:
    """Add a spring and a damper that act along the sliding direction of the first interface.

    The stiffness diag(omega^2) + k s s^T/mass is made diagonal again; the damping matrix couples the new
    modes in general. `shapes` of the result leads back to the named modes or masses of `basis`.

    Parameters
    ----------
    basis : ModalBasis
        Modes of the rig.
    stiffness : float
        Stiffness k >= 0 [N/m] of the spring.
    damping : float
        Coefficient >= 0 [N s/m] of the damper.

    Returns
    -------
    ModalBasis
    """
    slide = basis.interfaces[0]
    spring_row = np.sqrt(stiffness / basis.mass) * slide
    omega, shapes = decouple_modes(np.vstack([np.diag(basis.omega), spring_row]))
    return _change_coordinates(basis, omega, shapes, damping / basis.mass * np.outer(slide, slide))


def remove_springs(basis: ModalBasis, stiffness, damping: float = 0.0) -> ModalBasis:
    """Subtract the springs and the damper that were present when the modes were measured.

    The remaining stiffness is diag(omega^2) - sum k_i s_i s_i^T/mass.

    Parameters
    ----------
    basis : ModalBasis
        Modes of the rig.
    stiffness : (i,) array_like
        Stiffness [N/m] of the spring along the slide of each interface.
    damping : float
        Coefficient [N s/m] of the damper along the slide of the first interface.

    Returns
    -------
    ModalBasis

    Raises
    ------
    PatchfemError
        If the springs or the damper are stronger than those of the modes.
    """
    slides = basis.interfaces
    mass = basis.mass
    joint = slides.T * np.asarray(stiffness, float) @ slides / mass
    squares, shapes = np.linalg.eigh(np.diag(basis.omega**2) - joint)

    # A joint that is stiffer than the modes would leave a negative stiffness.
    min_square = MIN_ELASTIC_FRACTION * float(np.max(basis.omega**2 + np.diag(joint), initial=0.0))
    if squares[0] < -min_square:
        measured_square = float(shapes[:, 0] ** 2 @ basis.omega**2)
        ratio = 1 - squares[0] / measured_square if measured_square else np.inf
        raise PatchfemError(
            f"the stiffness of the joint is {100 * ratio:.4g} % of "
            "the stiffness of the mode that the joint stiffens most, so without the joint this mode "
            f"would have a negative stiffness{_advise_on_slides(basis.omega, joint)}"
        )
    squares[squares <= min_square] = 0.0

    # The damper of the joint must be a part of the damping of the modes.
    damper = -damping / mass * np.outer(slides[0], slides[0])
    if damping:
        decay_rates = np.linalg.eigvalsh(basis.damping_matrix + damper)
        if decay_rates[0] < -(min_square**0.5) * MIN_ELASTIC_FRACTION:
            raise PatchfemError(
                "structure.bonded.damping is larger than the damping of the modes, of which it should be a "
                "part; lower structure.bonded.damping"
            )
    free = _change_coordinates(basis, np.sqrt(squares), shapes, damper)
    # A single mode keeps its coordinate, so no shapes are needed.
    return replace(free, shapes=None) if squares.size == 1 and basis.shapes is None else free


def _advise_on_slides(omega, joint) -> str:
    """Return advice by which factor to multiply `slide` of all modes or their mass so that a joint can be removed.

    Parameters
    ----------
    omega : (n,) array
        Circular frequencies of the modes [rad/s].
    joint : (n, n) array
        Stiffness of the joint over the mass [rad2 s-2].

    Returns
    -------
    str
        "" if no factor suffices, because a mode is rigid.
    """
    if not omega.all():
        return ""
    factor = float(np.linalg.eigvalsh(joint / np.outer(omega, omega))[-1]) ** -0.5
    exponent = np.floor(np.log10(factor)) - 1
    rounded = np.floor(factor / 10**exponent) * 10**exponent
    mass = np.ceil(rounded**-2)
    return (
        "; `slide` of the modes is too large or `moving_mass` too small: multiply `slide` of every mode by "
        f"{rounded:.2g} or less (and give `base`, which is `slide` for the first mode by default), or check whether "
        f"the mass is {mass:.2g} times as large"
    )


def _change_coordinates(basis: ModalBasis, omega, shapes, damper) -> ModalBasis:
    """Transform a modal basis to new modes, and add a damping matrix.

    Parameters
    ----------
    basis : ModalBasis
        Modes of the rig.
    omega : (n,) array_like
        Circular frequencies [rad/s] of the new modes.
    shapes : (n, n) array_like
        New modes in the coordinates of `basis`; their largest entries are made positive.
    damper : (n, n) array_like
        Damping matrix [1/s] that is added.

    Returns
    -------
    ModalBasis
        Basis whose coordinates are those of the new modes.
    """
    # The sign of a mode is free: its largest entry is made positive, so that equal rigs give equal modes.
    largest = np.take_along_axis(shapes, np.abs(shapes).argmax(axis=0)[None], 0)[0]
    shapes = shapes * np.where(largest < 0, -1.0, 1.0)
    # Entries of the damping matrix within the round-off of these products count as zero.
    size = np.abs(shapes)
    D = shapes.T @ (basis.damping_matrix + damper) @ shapes
    scale = size.T @ (np.abs(basis.damping_matrix) + np.abs(damper)) @ size
    zeta, damping = split_damping(trim_round_off(D, scale), omega)
    # Participations, whose rows run over the coordinates
    names = ("slide", "base", "output", "gauge", "normal", "pitch", "yaw", "faces")
    rows = {key: getattr(basis, key) for key in names}
    return make_basis(
        basis.names,
        basis.mass,
        omega=omega,
        zeta=zeta,
        damping=damping,
        shapes=shapes if basis.shapes is None else basis.shapes @ shapes,
        **{key: row @ shapes for key, row in rows.items() if row is not None},
    )
