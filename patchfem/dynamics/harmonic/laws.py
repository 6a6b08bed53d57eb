"""Friction laws and springs along one cycle of a periodic relative displacement.

Forces are taken at instants, not as means over steps: the mean of a trigonometric polynomial over equal samples is
exact up to their number, so only the corners of the force alias, by (slope jump)(2 pi/N)^2/12.
"""

from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np

from ...compiled import instantiate, load
from ...core import PatchfemError, frozen_array
from ...friction.protocol import Element
from .series import find_harmonics
from .slides import Slides

# Number of samples while an element passes from one friction limit to the other.
SAMPLES_PER_STICK = 48
MAX_SAMPLES_PER_CYCLE = 65536  # largest number of samples per cycle
MAX_WAVES = 1000.0  # largest number of passed wavelengths for which the samples are increased


@cache
def load_kernels(name: str, law: str):
    """Load the compiled functions of a module of this folder for the law of another module."""
    return instantiate(f"dynamics.harmonic.{name}", {"law": load(law)})


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
    - slope, by_velocity: (M,) derivatives by slide [N/m] and velocity [N s/m], or 0
    - holds: (r, M) derivatives by the slides at the reversals of the interface [N/m], or 0
    - limit, stretch: friction limit [N], and the elastic stretch times it (M,) [N m]
    - states: states of a law whose memory is no slide at a reversal; its derivatives follow from them alone
    """

    force: np.ndarray
    slope: np.ndarray | float = 0.0
    by_velocity: np.ndarray | float = 0.0
    holds: np.ndarray | float = 0.0
    limit: float = 0.0
    stretch: np.ndarray | float = 0.0
    states: FlowStates | None = None


class Law:
    """Force law of an interface for harmonic balance.

    total: tangent stiffness at rest [N/m], 0 for a law that creeps under any force.
    """

    __slots__ = ()
    total = 0.0

    def count_samples(self, amplitude: float) -> int:
        """Return the number of samples that resolve the corners of the force at an amplitude [m]; 0 without corners."""
        return 0

    def evaluate(self, slides: Slides, row: int) -> LawForce:
        """Return the steady force for the slide of an interface that starts from an unstretched contact."""
        raise NotImplementedError


class _Reversal(NamedTuple):
    """Reversal in the memory of parallel elements.

    Contains its number in the cycle, the slide [m], the force [N], the stretch times the limit [N m] and the derivatives
    (r,) of the force by the slides at all reversals.
    """

    number: int
    slide: float
    force: float
    stretch: float
    holds: np.ndarray


@dataclass(frozen=True, eq=False, slots=True)
class Jenkins(Law):
    """Parallel elastic-plastic (Jenkins) elements, by Masing's rules.

    On first loading to the slide x the force is B(x) = sum k min(x, w). From a reversal at (q_r, F_r) in the direction
    d it is F_r + 2 d B(d (q - q_r)/2), until the branch before the last one is met.

    stiffness: (t,) [N/m] >= 0; limit_slide: (t,) slides w [m] >= 0 at which the elements yield.
    """

    stiffness: np.ndarray
    limit_slide: np.ndarray
    curve: tuple[np.ndarray, ...] = ()

    def __post_init__(self):
        k, w = (np.atleast_1d(np.asarray(v, float)) for v in (self.stiffness, self.limit_slide))
        object.__setattr__(self, "stiffness", frozen_array(k))
        object.__setattr__(self, "limit_slide", frozen_array(w))

        # Corners of the curve of first loading; before each of them the elements beyond it stick.
        ends, which = np.unique(w, return_inverse=True)
        parts = np.bincount(which, k)
        sticking = np.cumsum(parts[::-1])[::-1]
        rises = np.diff(ends, prepend=0.0)
        forces = np.append(0.0, np.cumsum(sticking * rises))
        limits = np.cumsum((parts * ends)[::-1])[::-1]
        stretches = np.append(0.0, np.cumsum(limits * rises))
        corners = np.append(0.0, ends)
        object.__setattr__(self, "curve", (corners, forces, stretches, np.append(sticking, 0.0)))

    @property
    def total(self) -> float:
        """Tangent stiffness at rest [N/m]."""
        return float(self.stiffness.sum())

    @property
    def limit(self) -> float:
        """Sum of the slip forces [N]."""
        return float(self.stiffness @ self.limit_slide)

    def count_samples(self, amplitude: float) -> int:
        """Return the number of samples that resolve the phases of stick at an amplitude [m]."""
        yield_slide = self.limit / max(self.total, 1e-300)
        return _count_stick_samples(yield_slide / max(amplitude, 1e-300))

    def load_first(self, x) -> np.ndarray:
        """Return force, stretch times limit, and stiffness (3, ...) on first loading to slides x >= 0 [m]."""
        corners, forces, stretches, sticking = self.curve
        number = np.searchsorted(corners[1:], x, side="right")
        loaded = (np.interp(x, corners, forces), np.interp(x, corners, stretches), sticking[number])
        return np.array(loaded)

    def evaluate(self, slides: Slides, row: int) -> LawForce:
        """Return the steady force for the slide of an interface that starts from an unstretched contact."""
        q = slides.q[row]
        turns = slides.reversals[row]
        if not turns.size:
            force, stretch, slope = self.load_first(np.abs(q))
            return LawForce(np.sign(q) * force, slope, 0.0, 0.0, self.limit, np.sign(q) * stretch)

        # The largest slide erases the memory of all others; the cycle begins there.
        first = int(np.argmax(np.abs(q[turns])))
        sign = np.sign(q[turns[first]])
        force, stretch, slope = self.load_first(abs(q[turns[first]]))
        holds = slope * (np.arange(turns.size) == first)
        memory = [_Reversal(first, q[turns[first]], sign * force, sign * stretch, holds)]
        out = np.empty((3 + turns.size, q.size))
        for begin in (first + np.arange(turns.size)) % turns.size:
            end = (begin + 1) % turns.size
            count = (turns[end] - turns[begin] - 1) % q.size + 1
            nodes = (turns[begin] + 1 + np.arange(count)) % q.size
            self._follow_branches(q[nodes], nodes, memory, out)
            force, slope, stretch = out[:3, turns[end]]
            holds = out[3:, turns[end]] + slope * (np.arange(turns.size) == end)
            memory.append(_Reversal(end, q[turns[end]], force, stretch, holds))
        return LawForce(out[0], out[1], 0.0, out[3:], self.limit, out[2])

    def _follow_branches(self, q, nodes, memory: list[_Reversal], out) -> None:
        """Write the force between two reversals, and remove the reversals that are passed from the memory.

        Parameters
        ----------
        q, nodes : (k,) array
            Slides [m] after the last reversal in the memory up to the next one, and their columns in `out`.
        memory : list of _Reversal
            Reversals that are not yet passed, the last one at the end.
        out : (3 + r, M) array
            Force, stiffness, stretch times limit, and derivatives by the slides at reversals.
        """
        direction = np.sign(q[-1] - memory[-1].slide)
        done = 0
        while done < q.size:
            last = memory[-1]
            end = q.size
            if len(memory) > 2:
                end = int(np.sum(direction * (q - memory[-2].slide) <= 0))
            part = nodes[done:end]
            x = np.maximum(direction * (q[done:end] - last.slide) / 2, 0.0)
            force, stretch, slope = self.load_first(x)
            out[0, part] = last.force + 2 * direction * force
            out[1, part] = slope
            out[2, part] = last.stretch + 2 * direction * stretch
            out[3:, part] = last.holds[:, None]
            out[3 + last.number, part] -= slope
            done = end
            if done < q.size:
                del memory[-2:]


@dataclass(frozen=True, slots=True)
class Spring(Law):
    """Spring across an interface with a linear stiffness [N/m] and a cubic stiffness [N/m3]."""

    stiffness: float = 0.0
    cubic: float = 0.0

    @property
    def total(self) -> float:
        """Tangent stiffness at rest [N/m]."""
        return self.stiffness

    def evaluate(self, slides: Slides, row: int) -> LawForce:
        """Return the force of the spring."""
        q = slides.q[row]
        force = q * (self.stiffness + self.cubic * q * q)
        return LawForce(force, self.stiffness + 3 * self.cubic * q * q)


@dataclass(frozen=True, slots=True)
class Interlock(Law):
    """Force k L/(2 pi) sin(2 pi q/L) of interlocking surface peaks, of stiffness k [N/m] and wavelength L [m]."""

    stiffness: float
    wavelength: float

    @property
    def total(self) -> float:
        """Tangent stiffness at rest [N/m]."""
        return self.stiffness

    def count_samples(self, amplitude: float) -> int:
        """Return the number of samples that resolve the wavelengths passed at an amplitude [m]."""
        return int(16 * min(2 * np.pi * amplitude / self.wavelength, MAX_WAVES))

    def evaluate(self, slides: Slides, row: int) -> LawForce:
        """Return the force of the interlocking peaks."""
        wave = 2 * np.pi / self.wavelength
        angle = wave * slides.q[row]
        return LawForce(self.stiffness / wave * np.sin(angle), self.stiffness * np.cos(angle))


@dataclass(frozen=True, eq=False, slots=True)
class SpeedLaw(Law):
    """Friction law that is a function of the velocity, from an Element of form "speed"."""

    element: Element

    def evaluate(self, slides: Slides, row: int) -> LawForce:
        """Return the force at the velocities of the cycle."""
        velocity = slides.omega * slides.rate[row]
        force, slope = np.empty((2, velocity.size))
        kernels = load_kernels("speed_kernels", self.element.kernels)
        kernels.sample_forces(self.element.numbers, velocity, force, slope)
        return LawForce(force, 0.0, slope, 0.0, self.element.limit)


@dataclass(frozen=True, eq=False, slots=True)
class FlowLaw(Law):
    """Friction law whose only memory is its elastic stretch, from an Element of form "flow" or "points"."""

    element: Element

    @property
    def length(self) -> float:
        """Stretch [m] at which the law slips."""
        return self.element.length

    @property
    def total(self) -> float:
        """Tangent stiffness at rest [N/m]."""
        return self.element.limit / self.element.length

    def count_samples(self, amplitude: float) -> int:
        """Return the number of samples that resolve the force after a reversal at an amplitude [m]."""
        return _count_stick_samples(self.length / max(amplitude, 1e-300))

    def evaluate(self, slides: Slides, row: int) -> LawForce:
        """Return the periodic force that a cycle from an unstretched contact reaches."""
        q = slides.q[row]
        dt = np.maximum(slides.widths / slides.omega, 1e-300)
        force, stretch = np.empty((2, q.size))
        states = FlowStates(np.empty((3, q.size)), np.empty((2, q.size)))
        load_kernels("flow_kernels", self.element.kernels).solve_cycle(
            self.element.numbers,
            q,
            slides.omega * slides.rate[row],
            dt,
            stretch,
            states.steps,
            force,
            states.slopes,
        )
        limit = self.element.limit
        return LawForce(force, limit=limit, stretch=limit * stretch, states=states)

    def differentiate(
        self, slides: Slides, row: int, states: FlowStates
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the derivatives of the harmonics of the force by those of the slide and by the frequency.

        Returns
        -------
        by_slide : (H + 1, 2 H + 1) array
            By the real parts of k = 0 to H, then the imaginary parts of k = 1 to H [N/m].
        by_omega : (H + 1,) array
            [N s].
        """
        h = slides.harmonics.shape[1] - 1
        solve = load_kernels("flow_kernels", self.element.kernels).solve_recursion
        decay, by_increment, by_time = states.steps
        by_stretch, by_velocity = states.slopes

        def find_force_harmonics(source, velocity) -> np.ndarray:
            """Return the harmonics of the force (2, H + 1) for real and negative imaginary part of the changes."""
            solve(decay, source)
            force = (by_stretch * source + by_velocity * velocity)[slides.is_sample]
            return find_harmonics(np.array([force.real, -force.imag]), h)

        by_slide = np.empty((h + 1, 2 * h + 1), complex)
        for k in range(h + 1):
            wave = np.exp(1j * k * slides.angle)
            source = by_increment * (np.roll(wave, -1) - wave)
            real, imaginary = find_force_harmonics(source, 1j * k * slides.omega * wave)
            by_slide[:, k] = real
            if k:
                by_slide[:, h + k] = imaginary
        source = -by_time * slides.widths / slides.omega**2 + 0j
        return by_slide, find_force_harmonics(source, slides.rate[row])[0]


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
    if form == "speed":
        return SpeedLaw(element)
    # If bonds do not grow, one stretch describes the memory of a bond point.
    if form == "flow" or (form == "points" and element.numbers[3] < 0):
        return FlowLaw(element)
    if form == "rigid":
        raise PatchfemError(
            'accuracy.method: "harmonic" '
            "cannot treat rigid friction, because the force of rigid friction jumps; use the exact "
            'solution from event to event, or friction.law = "elastic-plastic" with a short '
            "friction.bond_length"
        )
    raise PatchfemError(
        'accuracy.method: "harmonic" can treat bonds only with friction.reading = "stretch", '
        "friction.order = 1, a constant bond length and pieces that are rigid "
        'in shear; use accuracy.method = "march"'
    )
