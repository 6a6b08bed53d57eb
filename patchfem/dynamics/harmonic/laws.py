"""Friction laws and springs along one cycle of a periodic relative displacement.

Forces are taken at instants, not as means over steps: the mean of a trigonometric polynomial over equal samples is
exact up to their number, so only the corners of the force alias, by (slope jump)(2 pi/N)^2/12.
"""

from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_banded

from ...compiled import instantiate, load_compiled_module
from ...core import PatchfemError, frozen_array
from ...friction.protocol import Element
from .series import find_harmonics
from .slides import Slides

# Number of samples while an element passes from one friction limit to the other.
SAMPLES_PER_STICK = 48
MAX_SAMPLES_PER_CYCLE = 65536  # largest number of samples per cycle
MIN_FADED = (
    1e-12  # smallest part of a stretch that fades in a cycle, for derivatives of a periodic stretch
)
MAX_WAVES = 1000.0  # largest number of passed wavelengths for which the samples are increased


@cache
def load_kernels(name: str, law: str):
    """Load the compiled functions of a module of this folder for the law of another module."""
    return instantiate(f"dynamics.harmonic.{name}", {"law": load_compiled_module(law)})


class FlowStates(NamedTuple):
    """Periodic state of a law with one state at the M nodes of a cycle.

    - steps: (3, M) derivatives of the next stretch by stretch, slide and time
    - slopes: (2, M) derivatives of the force by stretch [N/m] and velocity [N s/m]
    """

    steps: np.ndarray
    slopes: np.ndarray


class LawForce(NamedTuple):
    """Force of a law at the M nodes of a cycle, and its derivatives.

    - force: (M,) [N]
    - slope: (M,) derivative by the slide [N/m], or 0
    - holds: (r, M) derivatives by the slides at the reversals of the interface [N/m], or 0
    - states: states of a law whose memory is no slide at a reversal; its derivatives follow from them alone
    """

    force: np.ndarray
    slope: np.ndarray | float = 0.0
    holds: np.ndarray | float = 0.0
    states: FlowStates | None = None


class Law:
    """Force law of an interface for harmonic balance.

    The attribute `total` is the tangent stiffness at rest [N/m], 0 for a law that creeps under any force.
    """

    __slots__ = ()
    total = 0.0

    def count_samples(self, amplitude: float) -> int:
        """Return the number of samples that resolve the corners of the force at an amplitude [m]; 0 without corners."""
        return 0

    def evaluate(self, slides: Slides, row: int) -> LawForce:
        """Return the steady force for the slide of an interface that starts from an unstretched contact.

        Parameters
        ----------
        slides : Slides
            Slides of all interfaces at the M nodes of a cycle.
        row : int
            Index of the interface in `slides`.

        Returns
        -------
        LawForce
            Force (M,) at the nodes, and its derivatives.
        """
        raise NotImplementedError


class Jenkins(Law):
    """Parallel elastic-plastic (Jenkins) elements, each a spring in series with a slider.

    Parameters
    ----------
    stiffness : (t,) array_like
        [N/m], >= 0.
    limit_slide : (t,) array_like
        Slides [m] >= 0 at which the elements yield.
    """

    def __init__(self, stiffness, limit_slide):
        self.stiffness = frozen_array(np.atleast_1d(stiffness))
        self.limit_slide = frozen_array(np.atleast_1d(limit_slide))
        self.total = float(self.stiffness.sum())
        # Sum of the slip forces [N]
        self.limit = float(self.stiffness @ self.limit_slide)

    def count_samples(self, amplitude: float) -> int:
        """Return the number of samples that resolve the phases of stick at an amplitude [m]."""
        yield_slide = self.limit / max(self.total, 1e-300)
        return _count_stick_samples(yield_slide / max(amplitude, 1e-300))

    def evaluate(self, slides: Slides, row: int) -> LawForce:
        """Return the steady force for the slide of an interface that starts from an unstretched contact."""
        q = slides.q[row]
        turns = slides.reversals[row]
        reversal_of_node = np.full(q.size, -1)
        reversal_of_node[turns] = np.arange(turns.size)
        # The largest slide erases the memory of all others; the cycle begins there.
        first = int(turns[np.argmax(np.abs(q[turns]))]) if turns.size else 0

        # Rows: force, stiffness, and derivatives of the force by the slides at the reversals.
        out = np.zeros((2 + turns.size, q.size))
        kernels = load_compiled_module("dynamics.harmonic.element_kernels")
        kernels.follow_elements(self.stiffness, self.limit_slide, q, reversal_of_node, first, out)
        return LawForce(out[0], out[1], out[2:])


@dataclass(frozen=True, slots=True)
class Spring(Law):
    """Spring of the force k L/(2 pi) sin(2 pi q/L) + c q^3.

    - stiffness: k [N/m]
    - cubic: c [N/m3]
    - wavelength: L of interlocking surface peaks [m]; infinite for a linear spring
    """

    stiffness: float = 0.0
    cubic: float = 0.0
    wavelength: float = np.inf

    @property
    def total(self) -> float:
        """Tangent stiffness at rest [N/m]."""
        return self.stiffness

    def count_samples(self, amplitude: float) -> int:
        """Return the number of samples that resolve the wavelengths passed at an amplitude [m]."""
        return int(16 * min(2 * np.pi * amplitude / self.wavelength, MAX_WAVES))

    def evaluate(self, slides: Slides, row: int) -> LawForce:
        """Return the force of the spring."""
        q = slides.q[row]
        waves = 2 * q / self.wavelength
        force = q * (self.stiffness * np.sinc(waves) + self.cubic * q * q)
        return LawForce(force, self.stiffness * np.cos(np.pi * waves) + 3 * self.cubic * q * q)


@dataclass(frozen=True, eq=False, slots=True)
class FlowLaw(Law):
    """Friction law whose only memory is its elastic stretch, from an Element of form "flow" or "points".

    A law that is a function of the velocity, of form "speed", has no stretch and no stiffness at rest.

    - element: law of the whole contact, with its compiled functions and numbers
    """

    element: Element

    @property
    def length(self) -> float:
        """Stretch [m] at which the law slips."""
        return self.element.length

    @property
    def total(self) -> float:
        """Tangent stiffness at rest [N/m]."""
        return self.element.limit / self.length if self.length else 0.0

    def count_samples(self, amplitude: float) -> int:
        """Return the number of samples that resolve the force after a reversal at an amplitude [m]."""
        if not self.length:
            return 0
        return _count_stick_samples(self.length / max(amplitude, 1e-300))

    def evaluate(self, slides: Slides, row: int) -> LawForce:
        """Return the periodic force that a cycle from an unstretched contact reaches."""
        q = slides.q[row]
        numbers = self.element.numbers
        velocity = slides.omega * slides.rate[row]
        force, stretch = np.zeros((2, q.size))
        states = FlowStates(np.zeros((3, q.size)), np.zeros((2, q.size)))
        if self.element.form == "speed":
            kernels = load_kernels("speed_kernels", self.element.kernels)
            kernels.sample_forces(numbers, velocity, force, states.slopes[1])
        else:
            dt = np.maximum(slides.widths / slides.omega, 1e-300)
            kernels = load_kernels("flow_kernels", self.element.kernels)
            kernels.solve_cycle(
                numbers, q, velocity, dt, stretch, states.steps, force, states.slopes
            )
        return LawForce(force, states=states)

    def differentiate(
        self, slides: Slides, row: int, states: FlowStates
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the derivatives of the harmonics of the force by those of the slide and by the frequency.

        Harmonics are complex: q = Re sum q_k exp(i k theta) with k = 0 to H, and the same for the force.

        Parameters
        ----------
        slides : Slides
            Slides of all interfaces, with H + 1 harmonics each.
        row : int
            Index of the interface in `slides`.
        states : FlowStates
            States of the law for these slides, from `evaluate`.

        Returns
        -------
        by_slide : (H + 1, 2 H + 1) complex array
            Derivatives of the harmonics of the force [N/m]: columns 0 to H by the real parts of q_0 to q_H, the
            others by the imaginary parts of q_1 to q_H.
        by_omega : (H + 1,) complex array
            Derivatives by the circular frequency [N s].
        """
        h = slides.harmonics.shape[1] - 1
        decay, by_increment, by_time = states.steps
        by_stretch, by_velocity = states.slopes

        def find_force_harmonics(source, velocity) -> np.ndarray:
            """Return the harmonics of the force (2, H + 1) for real and negative imaginary part of the changes."""
            changes = by_stretch * solve_recursion(decay, source) + by_velocity * velocity
            force = changes[slides.is_sample]
            return find_harmonics(np.array([force.real, -force.imag]), h)

        by_slide = np.empty((h + 1, 2 * h + 1), complex)
        for k in range(h + 1):
            wave = np.exp(1j * k * slides.angle)
            source = by_increment * (np.roll(wave, -1) - wave)
            real, imaginary = find_force_harmonics(source, 1j * k * slides.omega * wave)
            by_slide[:, k] = real
            if k:
                by_slide[:, h + k] = imaginary
        source = -by_time * slides.widths / slides.omega**2
        return by_slide, find_force_harmonics(source, slides.rate[row])[0]


def solve_recursion(decay, source) -> np.ndarray:
    """Return the periodic z (M,) with z[i + 1] = decay[i] z[i] + source[i]; 0 if it does not fade within a cycle.

    Parameters
    ----------
    decay : (M,) array
        Factor from one node to the next, from 0 to 1.
    source : (M,) array
        Change from one node to the next.
    """
    kept = np.cumprod(decay)
    if kept[-1] >= 1 - MIN_FADED:
        return np.zeros_like(source)
    # The solution that begins at 0, and the part of it that a cycle leaves.
    bands = np.array([np.ones(decay.size), -np.roll(decay, -1)])
    end = solve_banded((1, 0), bands, source, check_finite=False)
    first = end[-1] / (1 - kept[-1])
    return np.roll(end + kept * first, 1)


def _count_stick_samples(stick_ratio: float) -> int:
    """Return the number of samples that resolve a phase of stick over the angle acos(1 - 2 stick_ratio)."""
    angle = np.arccos(max(1 - 2 * stick_ratio, -1.0))
    return int(min(SAMPLES_PER_STICK * 2 * np.pi / max(angle, 1e-9), MAX_SAMPLES_PER_CYCLE))


def make_law(element: Element | None) -> Law:
    """Return the law of harmonic balance for an Element; None stands for bonds that are no single element.

    Raises
    ------
    PatchfemError
        If harmonic balance cannot treat it; the message says what to do.
    """
    form = element.form if element is not None else ""
    if form == "parallel":
        count = int(element.numbers[1])
        return Jenkins(element.numbers[2 : 2 + count], element.numbers[2 + count :])
    # If bonds do not grow, one stretch describes the memory of a bond point.
    if form in ("flow", "speed") or (form == "points" and element.numbers[3] < 0):
        return FlowLaw(element)
    if form == "rigid":
        raise PatchfemError(
            "harmonic balance cannot treat rigid friction, because the force of rigid friction jumps; use the exact "
            'solution from event to event, or friction.law = "elastic-plastic" with a short friction.bond_length'
        )
    raise PatchfemError(
        'harmonic balance can treat bonds only with friction.reading = "stretch", friction.order = 1, a constant bond '
        "length and pieces that are rigid in shear; run the scene in time instead"
    )
