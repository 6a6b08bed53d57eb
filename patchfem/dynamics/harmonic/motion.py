"""Steady motion in one cycle: amplitude, reversals, regime, energies and histories."""

from dataclasses import dataclass

import numpy as np

from ...core import Response
from ...structure.histories import make_response
from .forces import LawGroup
from .laws import Jenkins, LawForce, Spring
from .series import half_range
from .slides import Slides, make_slides

# Largest range of slip at which bonds count as sticking, in bond lengths.
STUCK_SLIDE_RATIO = 1e-3
# Largest magnitude of a multiplier of a stable motion. It is above 1, because the multipliers are those of differences.
MAX_STABLE_MULTIPLIER = 1 + 1e-5


@dataclass(frozen=True, eq=False, slots=True)
class SteadyMotion:
    """Steady periodic motion under a sinusoidal drive, from harmonic balance.

    - omega, level: frequency [rad/s] and amplitude [m s-2] of the drive
    - slides, forces: (i, H + 1) harmonics of the slides [m] and forces [N] of the rows of `group`
    - modal: (H + 1, n) harmonics of the modal coordinates [m]
    - samples: samples per cycle
    - error: relative error of the motion
    - iterations: number of Newton steps
    - multipliers: Floquet multipliers in decreasing magnitude, or None until they are computed
    """

    omega: float
    level: float
    slides: np.ndarray
    forces: np.ndarray
    modal: np.ndarray
    samples: int
    error: float
    iterations: int
    group: LawGroup
    multipliers: np.ndarray | None = None

    @property
    def harmonics(self) -> int:
        """Number of harmonics H."""
        return self.slides.shape[1] - 1

    @property
    def stable(self) -> bool:
        """Whether disturbances do not grow, once the multipliers are known."""
        return bool(np.abs(self.multipliers).max(initial=0.0) <= MAX_STABLE_MULTIPLIER)

    @property
    def modal_state(self) -> np.ndarray:
        """Modal coordinates [m] and velocities [m/s] (2 n,) at phase 0 of the drive."""
        speeds = 1j * self.omega * np.arange(len(self.modal))[:, None] * self.modal
        return np.concatenate([self.modal, speeds], axis=1).sum(axis=0).real

    def amplitude(self, row) -> float:
        """Return the displacement amplitude [m]: half the range of row @ modal coordinates, for a row (n,)."""
        return half_range(self.modal @ np.asarray(row, float))

    def sample(self, samples: int = 0) -> Slides:
        """Return the slides of a cycle; samples: samples per cycle, 0 for those of the motion."""
        return make_slides(self.slides, self.omega, samples or self.samples)

    def find_reversals(self) -> tuple[tuple[float, float, float], ...]:
        """Return displacement [m], friction force [N] and slip [m] of the first row at its lowest and highest reversal.

        The result is () for an interface at rest.
        """
        slides = self.sample()
        q = slides.q[0]
        turns = slides.reversals[0]
        if not turns.size:
            return ()
        forces = [law.evaluate(slides, 0) for law in self.group.laws[0]]
        friction = sum_friction(self.group.laws[0], forces)
        slip = find_slip(q, forces)
        ends = (turns[np.argmin(q[turns])], turns[np.argmax(q[turns])])
        return tuple((float(q[k]), float(friction[k]), float(slip[k])) for k in ends)


def sum_friction(laws: tuple[object, ...], forces: list[LawForce]) -> np.ndarray:
    """Return the friction force (M,) [N] of an interface row.

    Springs are parallel to the contact, such as the interlock of [structure.bonded], so their forces are not friction.
    """
    friction = [force.force for law, force in zip(laws, forces) if not isinstance(law, Spring)]
    return sum(friction or [force.force for force in forces])


def find_slip(q, forces: list[LawForce]) -> np.ndarray:
    """Return the slip (M,) [m] of an interface row: its slide less the mean elastic stretch; 0 without friction."""
    limit = sum(force.limit for force in forces)
    return q - sum(force.stretch for force in forces) / limit if limit > 0 else 0 * q


def find_regime(motion: SteadyMotion) -> str:
    """Return the friction regime of a motion.

    The regimes are "stuck", "partial slip", "slides" and "no friction". An elastic-plastic element slips if the range
    of its slide exceeds twice its yield slide, bonds if their slip exceeds STUCK_SLIDE_RATIO bond lengths; a law of the
    velocity always slides.
    """
    slides = motion.sample()
    # Sums of the friction limits [N] of all laws, and of those that slip
    slipping = 0.0
    total = 0.0
    for i, laws in enumerate(motion.group.laws):
        q = slides.q[i]
        for law in laws:
            force = law.evaluate(slides, i)
            total += force.limit
            if isinstance(law, Jenkins):
                slips = 2 * law.limit_slide < np.ptp(q)
                slipping += float(law.stiffness @ (law.limit_slide * slips))
            elif force.limit:
                length = getattr(law, "length", 0.0)
                if np.ptp(find_slip(q, [force])) >= STUCK_SLIDE_RATIO * length:
                    slipping += force.limit
    if not total:
        return "no friction"
    if not slipping:
        return "stuck"
    return "slides" if slipping > (1 - 1e-12) * total else "partial slip"


def find_cycle_energies(motion: SteadyMotion, modes) -> dict[str, float]:
    """Return the drive work, viscous loss and friction work per cycle [J] of a motion, by Parseval's theorem.

    `balance` is the imbalance of these energies relative to the work of the drive [1]. A spring among the laws adds
    nothing.
    """
    k = np.arange(len(motion.modal))
    speed = 1j * (k * motion.omega)[:, None] * motion.modal
    half = np.pi / motion.omega
    work = -modes.mass * half * float((1j * motion.level * (speed[1] @ modes.base)).real)
    lost = np.einsum("ka,ab,kb->", speed.conj(), modes.damping_matrix, speed).real
    viscous = modes.mass * half * float(lost)
    friction = find_loss(motion.slides, motion.forces)
    return {
        "work_in": work,
        "viscous": viscous,
        "friction": friction,
        "balance": abs(work - viscous - friction) / max(abs(work), 1e-300),
    }


def find_loss(slides, forces) -> float:
    """Return the work per cycle [J] of forces [N] on slides [m], both (i, H + 1) harmonics."""
    k = np.arange(slides.shape[1])
    return np.pi * float(np.sum(k * (slides.conj() * forces).imag))


def make_cycle_response(motion: SteadyMotion, modes, drive, samples: int = 1000) -> Response:
    """Return the histories of the modes and the first interface over one cycle.

    The forces are those of the laws at each instant, so the accelerations do not oscillate like a truncated series.

    Parameters
    ----------
    motion : SteadyMotion
        Motion, with its level and frequency.
    modes : ModalBasis
        Modes of the structure without the contact.
    drive : core.SineDrive
        Drive of the motion.
    samples : int, optional
        Number of equal steps of the cycle.
    """
    omega = motion.omega
    stride = max(1, -(-2 * motion.samples // samples))
    slides = motion.sample(samples * stride)
    forces = motion.group.evaluate(slides)

    def select(values):
        """Return the values (..., M) at the ends of the steps; the last one equals the first one."""
        chosen = values[..., slides.is_sample][..., ::stride]
        return np.concatenate([chosen, chosen[..., :1]], axis=-1).T

    # Modal motion z = Re sum z_k exp(i k omega t) and its rate.
    k = np.arange(len(motion.modal))[:, None]
    waves = np.exp(1j * k * np.linspace(0, 2 * np.pi, samples + 1))
    z = (motion.modal.T @ waves).real.T
    rate = ((1j * k * omega * motion.modal).T @ waves).real.T

    total = select(np.array([sum(force.force for force in row) for row in forces]))
    time = np.arange(samples + 1) * (2 * np.pi / omega / samples)

    interface = (
        slides.q[0],
        omega * slides.rate[0],
        sum_friction(motion.group.laws[0], forces[0]),
        find_slip(slides.q[0], forces[0]),
    )
    return make_response(
        modes,
        drive,
        motion.level * waves[1].imag,
        (time, z, rate),
        total @ motion.group.rows,
        tuple(map(select, interface)),
        {},
    )
