"""Entry to harmonic balance, and a steady motion as histories and energies.

`point` finds one steady motion, `branches` all of them at a drive, `response` and `levels` curves
over frequency and drive through folds, `with_stability` the multipliers, `backbone` frequency and
damping over amplitude.
"""

import numpy as np

from ...core import Response
from ..integrated import find_accelerations
from .branch import Backbone, Branch, backbone, branches, levels, response
from .forces import Group
from .laws import Flow, Interlock, Jenkins, SpeedLaw, Spring, Track, make_law, synthesis
from .point import Periodic, find_slip, friction_force, point
from .stability import with_stability

__all__ = [
    "Backbone",
    "Branch",
    "Flow",
    "Group",
    "Interlock",
    "Jenkins",
    "Periodic",
    "SpeedLaw",
    "Spring",
    "backbone",
    "branches",
    "cycle_energy",
    "find_regime",
    "levels",
    "make_law",
    "periodic_response",
    "point",
    "response",
    "with_stability",
]


# slip over the bond length, below which bonds count as sticking
STUCK_SLIDE_RATIO = 1e-3


def find_regime(periodic: Periodic) -> tuple:
    """Return the regime of a motion and the fraction of the friction limit that slips.

    The regimes are "stuck", "partial slip", "slides" and "no friction". An elastic-plastic element
    slips where the range of its slide exceeds twice its yield slide, bonds where their slip
    exceeds STUCK_SLIDE_RATIO bond lengths; a law of the velocity always slides.
    """
    slips = whole = 0.0
    for track, laws in zip(
        periodic.group.tracks(periodic.coefficients, periodic.omega), periodic.group.laws
    ):
        places = track.turning[1]
        swing = float(np.ptp(places)) if places.size else 0.0
        for law in laws:
            found = law.sample(track)
            whole += found.limit
            if isinstance(law, Jenkins):
                slips += float(law.stiffness @ (law.limit_slide * (2 * law.limit_slide < swing)))
            elif found.limit:
                length = getattr(law, "length", 0.0)
                held = np.ptp(track.q - found.stretch / found.limit) < STUCK_SLIDE_RATIO * length
                slips += 0.0 if held else found.limit
    share = slips / whole if whole else 0.0
    return (
        "no friction"
        if not whole
        else "stuck"
        if not slips
        else "slides"
        if share > 1 - 1e-12
        else "partial slip"
    ), share


def cycle_energy(periodic: Periodic, modes) -> dict:
    """Return work of the drive, viscous loss and work of the laws in a cycle [J], by Parseval.

    `balance` is what is missing over the work of the drive [1]. A spring among the laws adds
    nothing.
    """
    k = np.arange(periodic.modal.shape[0])
    speed = 1j * (k * periodic.omega)[:, None] * periodic.modal
    half = np.pi / periodic.omega
    work = -modes.mass * half * float((1j * periodic.level * (speed[1] @ modes.base)).real)
    viscous = (
        modes.mass
        * half
        * float(np.einsum("ka,ab,kb->", speed.conj(), modes.damping_matrix, speed).real)
    )
    friction = np.pi * float(np.sum(k * (periodic.coefficients.conj() * periodic.forces).imag))
    return {
        "work_in": work,
        "viscous": viscous,
        "friction": friction,
        "balance": abs(work - viscous - friction) / max(abs(work), 1e-300),
    }


def periodic_response(periodic: Periodic, modes, drive, samples: int = 1000) -> Response:
    """Return one cycle of a steady motion as histories of the first row.

    The forces are those of the laws at each instant, so the accelerations do not oscillate as a
    truncated series.

    Parameters
    ----------
    periodic : Periodic
    modes : ModalBasis
    drive
    samples : int, optional
        Equal steps of the cycle.

    Returns
    -------
    Response
    """
    omega = periodic.omega
    group = periodic.group
    inner = samples * max(1, -(-2 * periodic.samples // samples))
    every = inner // samples

    def cycle(values):
        kept = values[..., ::every]
        return np.concatenate([kept, kept[..., :1]], axis=-1).T

    k = np.arange(periodic.modal.shape[0])[:, None]
    z, rate = (synthesis((periodic.modal * f).T, inner) for f in (1.0, 1j * k * omega))
    forces = group.forces(periodic.coefficients, omega, inner)
    base = periodic.level * np.sin(2 * np.pi * np.arange(inner) / inner)
    accel = find_accelerations(modes, base, z.T, rate.T, forces.T @ group.rows).T
    track = Track(periodic.coefficients[0], omega, inner)
    found = [law.sample(track) for law in group.laws[0]]
    floor = base if drive.moving else 0 * base
    return Response(
        np.arange(samples + 1) * (2 * np.pi / omega / samples),
        cycle(z),
        cycle(rate),
        cycle(track.q),
        cycle(omega * track.rate),
        cycle(modes.output @ z),
        cycle(modes.output @ rate),
        cycle(modes.output @ accel + floor),
        cycle(floor),
        cycle(friction_force(group.laws[0], found)),
        cycle(find_slip(track, found)),
    )
