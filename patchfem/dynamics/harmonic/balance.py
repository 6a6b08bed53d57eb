"""Time histories, energies per cycle and friction regime of a steady motion."""

import numpy as np

from ...core import Response
from ..integrated import find_accelerations
from .laws import Jenkins, SampledSlide, evaluate_series
from .point import SteadyMotion, find_slip, friction_force

# Largest range of slip at which bonds count as sticking, in bond lengths.
STUCK_SLIDE_RATIO = 1e-3


def find_regime(periodic: SteadyMotion) -> tuple:
    """Return the friction regime of a steady motion, and the fraction of the friction limit that slips.

    The regimes are "stuck", "partial slip", "slides" and "no friction". The fraction is that of the
    friction limits of all laws. An elastic-plastic element
    slips if the range of its slide exceeds twice its yield slide, bonds if their slip
    exceeds STUCK_SLIDE_RATIO bond lengths; a velocity-dependent law always slides.
    """
    slipping_limit = 0.0
    total_limit = 0.0
    for track, laws in zip(
        periodic.group.sample_slides(periodic.coefficients, periodic.omega), periodic.group.laws
    ):
        slides = track.turning_points.slides
        slide_range = float(np.ptp(slides)) if slides.size else 0.0
        for law in laws:
            sampled = law.sample(track)
            total_limit += sampled.limit
            if isinstance(law, Jenkins):
                is_slipping = 2 * law.limit_slide < slide_range
                slipping_limit += float(law.stiffness @ (law.limit_slide * is_slipping))
            elif sampled.limit:
                length = getattr(law, "length", 0.0)
                slip = track.q - sampled.stretch / sampled.limit
                if np.ptp(slip) >= STUCK_SLIDE_RATIO * length:
                    slipping_limit += sampled.limit
    if not total_limit:
        return "no friction", 0.0
    if not slipping_limit:
        return "stuck", 0.0
    fraction = slipping_limit / total_limit
    return "slides" if fraction > 1 - 1e-12 else "partial slip", fraction


def find_cycle_energies(periodic: SteadyMotion, modes) -> dict:
    """Return the drive work, viscous loss and friction work per cycle [J] of a steady motion.

    They follow from the harmonics by Parseval's theorem. `balance` is the imbalance of these energies
    relative to the work of the drive [1]. A spring among the laws adds
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


def make_cycle_response(periodic: SteadyMotion, modes, drive, samples: int = 1000) -> Response:
    """Return the time histories of the modes and the first interface over one steady cycle.

    The forces are evaluated from the laws at each instant, so the accelerations do not oscillate like a
    truncated series.

    Parameters
    ----------
    periodic : SteadyMotion
    modes : ModalBasis
    drive
    samples : int, optional
        Number of equal steps of the cycle.

    Returns
    -------
    Response
    """
    omega = periodic.omega
    group = periodic.group
    n_samples = samples * max(1, -(-2 * periodic.samples // samples))
    stride = n_samples // samples

    def sample_cycle(values):
        """Sample one cycle; the last sample equals the first one."""
        selected = values[..., ::stride]
        return np.concatenate([selected, selected[..., :1]], axis=-1).T

    k = np.arange(periodic.modal.shape[0])[:, None]
    z, rate = (evaluate_series((periodic.modal * f).T, n_samples) for f in (1.0, 1j * k * omega))
    forces = group.compute_forces(periodic.coefficients, omega, n_samples)
    base = periodic.level * np.sin(2 * np.pi * np.arange(n_samples) / n_samples)
    accel = find_accelerations(modes, base, z.T, rate.T, forces.T @ group.rows).T
    track = SampledSlide(periodic.coefficients[0], omega, n_samples)
    sampled = [law.sample(track) for law in group.laws[0]]
    floor = base if drive.moving else 0 * base
    return Response(
        np.arange(samples + 1) * (2 * np.pi / omega / samples),
        sample_cycle(z),
        sample_cycle(rate),
        sample_cycle(track.q),
        sample_cycle(omega * track.rate),
        sample_cycle(modes.output @ z),
        sample_cycle(modes.output @ rate),
        sample_cycle(modes.output @ accel + floor),
        sample_cycle(floor),
        sample_cycle(friction_force(group.laws[0], sampled)),
        sample_cycle(find_slip(track, sampled)),
    )
