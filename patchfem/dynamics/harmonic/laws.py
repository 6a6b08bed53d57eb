"""Friction laws and springs sampled over one cycle of a periodic relative displacement.

Forces are taken at instants, not as means over steps: the mean of a trigonometric polynomial over
equal samples is exact up to their number, so only the corners of the force alias, by (slope
jump)(2 pi/N)^2/12, while a mean over a step damps every harmonic by (k pi/N)^2/6. Reversals
are located from the harmonics, not at samples.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property
from typing import NamedTuple

import numpy as np

from ...compiled import instantiate, load
from ...core import PatchfemError, frozen_array
from ...friction.protocol import Element

# Number of samples while an element passes from one friction limit to the other.
SAMPLES_PER_STICK = 48


@cache
def load_cycle_kernels():
    """Load the compiled kernels that find reversals and sample elastic-plastic elements over a cycle."""
    return load("dynamics.harmonic.cycle_kernels")


@cache
def load_speed_kernels(law: str):
    """Load the compiled kernel that samples a velocity-dependent law without memory."""
    return instantiate("dynamics.harmonic.speed_kernels", {"law": load(law)})


@cache
def load_flow_kernels(law: str):
    """Load the compiled kernel that finds the periodic state of a law with one memory variable."""
    return instantiate("dynamics.harmonic.flow_kernels", {"law": load(law)})


class SampledForce(NamedTuple):
    """Force of a friction law at N samples of a cycle, and its derivatives.

    - force, slope, by_rate: force [N], derivative with respect to slide [N/m] and velocity [N s/m]
    - hold: (R, N) derivatives with respect to the slides at R reversals [N/m]
    - limit, stretch: friction limit [N], and elastic stretch times it (N,) [N m]
    - tangent: for a law whose memory is not that of reversals, a function that returns the
      derivatives of the force with respect to the harmonics of the slide (N, 2 H + 1), real parts
      first, and to the frequency (N,)
    """

    force: np.ndarray
    slope: np.ndarray | None = None
    by_rate: np.ndarray | None = None
    hold: np.ndarray | None = None
    limit: float = 0.0
    stretch: np.ndarray | None = None
    tangent: Callable | None = None


class TurningPoints(NamedTuple):
    """Reversals of a periodic relative displacement within a cycle.

    - angles, slides: (R,) angle [rad] and slide [m] at each reversal
    - cells: (R,) index of the sample before each reversal
    - start: direction of the slide at the first sample
    """

    angles: np.ndarray
    slides: np.ndarray
    cells: np.ndarray
    start: float


class JenkinsSums(NamedTuple):
    """Cumulative sums (t + 1,) over Jenkins elements, sorted by yield displacement.

    They are sums of the stiffness k [N/m], k limit [N] and k limit^2 [N m].

    """

    stiffness: np.ndarray
    limit: np.ndarray
    square: np.ndarray


class JenkinsGroups(NamedTuple):
    """Groups of Jenkins elements whose last slip ended at the same reversal (workspace).

    The innermost group is the last one.

    - end: number of elements up to the end of a group
    - mark: index of the reversal, -1 before the first one
    - sign, base: direction of the slip, and slide [m] at the reversal
    """

    end: np.ndarray
    mark: np.ndarray
    sign: np.ndarray
    base: np.ndarray


class JenkinsSamples(NamedTuple):
    """Forces and stiffnesses of parallel Jenkins elements at N samples of a cycle.

    - force: (N,) total force [N]
    - slope: (N,) stiffness of the sticking elements [N/m]
    - hold: (R, N) derivatives of the force with respect to the slides at R reversals [N/m]
    - stretch: (N,) sum of k limit stretch [N m]
    """

    force: np.ndarray
    slope: np.ndarray
    hold: np.ndarray
    stretch: np.ndarray


class SampledSlide:
    """Periodic relative displacement, sampled at equidistant instants of the cycle.

    - x: (H + 1,) harmonics [m]; omega [rad/s]; samples: N
    - q, rate: (N,) slide and dq/d(omega t) [m]
    """

    def __init__(self, x, omega: float, samples: int, q=None, rate=None):
        self.x = x
        self.omega = omega
        self.samples = samples
        self.q = evaluate_series(x, samples) if q is None else q
        self.rate = evaluate_series(1j * np.arange(x.size) * x, samples) if rate is None else rate

    @cached_property
    def turning_points(self) -> "TurningPoints":
        """Reversals of the relative displacement within the cycle."""
        n = self.samples
        angle = np.empty(n)
        slide = np.empty(n)
        cell = np.empty(n, np.int64)
        re = np.ascontiguousarray(self.x.real)
        im = np.ascontiguousarray(self.x.imag)
        count, start = load_cycle_kernels().find_turning_points(
            re, im, self.rate, angle, slide, cell
        )
        return TurningPoints(angle[:count], slide[:count], cell[:count], start)


def evaluate_series(x, samples: int) -> np.ndarray:
    """Evaluate the Fourier series Re sum X_k exp(i k theta) at N samples of a cycle."""
    if 2 * x.shape[-1] > samples:
        stride = -(-2 * x.shape[-1] // samples)
        return evaluate_series(x, samples * stride)[..., ::stride]
    spectrum = np.zeros((*x.shape[:-1], samples // 2 + 1), complex)
    spectrum[..., : x.shape[-1]] = x * (samples / 2)
    spectrum[..., 0] *= 2
    return np.fft.irfft(spectrum, samples, axis=-1)


def find_harmonics(values, harmonics: int) -> np.ndarray:
    """Compute the complex harmonics (..., H + 1) from samples (..., N) of a cycle.

    H must not exceed N/2.

    """
    n = values.shape[-1]
    out = np.fft.rfft(values, axis=-1)[..., : harmonics + 1] * (2 / n)
    out[..., 0] /= 2
    return out


class Law:
    """Force law of an interface row for harmonic balance.

    total: tangent stiffness at rest [N/m], 0 for a law that creeps under any force.
    """

    __slots__ = ()
    total = 0.0

    def count_samples(self, amplitude: float) -> int:
        """Return the number of samples per cycle needed to resolve the kinks of the force.

        amplitude: amplitude of the slide [m]. The number is 0 for a smooth force.

        """
        return 0

    def sample(self, track: "SampledSlide") -> "SampledForce":
        """Sample the steady periodic force for a periodic displacement, from an initially unstretched contact."""
        raise NotImplementedError


@dataclass(frozen=True, eq=False, slots=True)
class Jenkins(Law):
    """Parallel elastic-plastic (Jenkins) elements on an interface row.

    stiffness: (t,) stiffnesses [N/m] > 0; limit_slide: (t,) yield slides [m] >= 0.
    """

    stiffness: np.ndarray
    limit_slide: np.ndarray
    sums: tuple = ()

    def __post_init__(self):
        k, w = (np.atleast_1d(np.asarray(v, float)) for v in (self.stiffness, self.limit_slide))
        if (
            k.shape != w.shape
            or not (np.isfinite(k).all() and np.isfinite(w).all())
            or k.min() <= 0
            or w.min() < 0
        ):
            raise PatchfemError(
                "each Jenkins element needs a finite stiffness > 0 and a finite limit slide >= 0"
            )
        order = np.argsort(w, kind="stable")
        k = k[order]
        w = w[order]
        object.__setattr__(self, "stiffness", frozen_array(k))
        object.__setattr__(self, "limit_slide", frozen_array(w))
        object.__setattr__(
            self,
            "sums",
            JenkinsSums(
                *(frozen_array(np.append(0.0, np.cumsum(v))) for v in (k, k * w, k * w * w))
            ),
        )

    @property
    def total(self) -> float:
        """Tangent stiffness at rest [N/m]."""
        return float(self.sums.stiffness[-1])

    def count_samples(self, amplitude: float) -> int:
        """Return the number of samples per cycle needed to resolve the stick phases.

        amplitude: amplitude of the slide [m].

        """
        stick_fraction = float(self.sums.limit[-1]) / self.total / max(amplitude, 1e-300)
        return _count_samples(stick_fraction)

    def sample(self, track: SampledSlide) -> SampledForce:
        """Sample the steady periodic force for a periodic displacement, from an initially unstretched contact."""
        n = track.samples
        n_turning_points = track.turning_points.slides.size
        max_groups = 2 * n_turning_points + 3
        groups = JenkinsGroups(
            np.empty(max_groups, np.int64),
            np.empty(max_groups, np.int64),
            np.empty(max_groups),
            np.empty(max_groups),
        )
        samples = JenkinsSamples(
            np.empty(n), np.empty(n), np.zeros((n_turning_points, n)), np.empty(n)
        )
        load_cycle_kernels().sample_jenkins(
            track.q, track.turning_points, self.limit_slide, self.sums, groups, samples
        )
        return SampledForce(
            samples.force,
            samples.slope,
            None,
            samples.hold,
            float(self.sums.limit[-1]),
            samples.stretch,
        )


@dataclass(frozen=True, slots=True)
class Spring(Law):
    """Spring across an interface with a linear stiffness [N/m] and a cubic stiffness [N/m3]."""

    stiffness: float = 0.0
    cubic: float = 0.0

    @property
    def total(self) -> float:
        """Tangent stiffness at rest [N/m]."""
        return self.stiffness

    def sample(self, track: SampledSlide) -> SampledForce:
        """Sample the force and its derivative for a periodic relative displacement."""
        q = track.q
        return SampledForce(
            q * (self.stiffness + self.cubic * q * q), self.stiffness + 3 * self.cubic * q * q
        )


@dataclass(frozen=True, slots=True)
class Interlock(Law):
    """Sinusoidal restoring force of interlocking surface peaks.

    The force is stiffness wavelength/(2 pi) sin(2 pi q/wavelength), in [N/m] and [m].

    """

    stiffness: float
    wavelength: float

    @property
    def total(self) -> float:
        """Tangent stiffness at rest [N/m]."""
        return self.stiffness

    def count_samples(self, amplitude: float) -> int:
        """Return the number of samples per cycle needed to resolve the wavelengths passed."""
        return int(16 * min(2 * np.pi * amplitude / self.wavelength, 1000.0))

    def sample(self, track: SampledSlide) -> SampledForce:
        """Sample the force and its derivative for a periodic relative displacement."""
        angle = 2 * np.pi / self.wavelength * track.q
        return SampledForce(
            self.stiffness * self.wavelength / (2 * np.pi) * np.sin(angle),
            self.stiffness * np.cos(angle),
        )


@dataclass(frozen=True, eq=False, slots=True)
class SpeedLaw(Law):
    """Velocity-dependent friction law without memory, made from an Element of form "speed"."""

    element: Element

    def sample(self, track: SampledSlide) -> SampledForce:
        """Sample the force and its derivative for a periodic relative displacement."""
        force = np.empty(track.samples)
        slope = np.empty(track.samples)
        load_speed_kernels(self.element.kernels).sample_forces(
            self.element.numbers[None], track.omega * track.rate, force, slope
        )
        return SampledForce(force, None, slope, None, self.element.limit, np.zeros(track.samples))


@dataclass(frozen=True, eq=False, slots=True)
class FlowLaw(Law):
    """Friction law whose only memory is its elastic stretch, such as an Element of form "flow"."""

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
        """Return the number of samples per cycle needed to resolve the force after a reversal.

        amplitude: amplitude of the slide [m].

        """
        return _count_samples(self.length / max(amplitude, 1e-300))

    def find_periodic_state(self, track: SampledSlide) -> "FlowNodes":
        """Find the periodic state of the law at the samples and reversals of a cycle."""
        angles, slides, cells, _ = track.turning_points
        n = track.samples
        is_sample = np.ones(track.samples + len(cells), bool)
        is_sample[cells + 1 + np.arange(len(cells))] = False
        angle, q, speed = np.zeros((3, is_sample.size))  # the velocity is 0 at a turning point
        angle[is_sample] = np.arange(n) * (2 * np.pi / n)
        q[is_sample] = track.q
        speed[is_sample] = track.omega * track.rate
        angle[~is_sample] = angles
        q[~is_sample] = slides
        dt = np.maximum(np.diff(angle, append=2 * np.pi) / track.omega, 1e-300)
        z = np.empty(q.size)
        steps = np.empty((3, q.size))
        force = np.empty(q.size)
        slopes = np.empty((2, q.size))
        load_flow_kernels(self.element.kernels).solve_cycle(
            self.element.numbers[None], q, speed, dt, z, steps, force, slopes
        )
        return FlowNodes(angle, is_sample, dt, z, steps, force, slopes)

    def sample(self, track: SampledSlide) -> SampledForce:
        """Sample the steady periodic force for a periodic relative displacement.

        For a rate-independent law the derivatives are those with respect to the slide and its
        reversals, otherwise those with respect to the harmonics.
        """
        nodes = self.find_periodic_state(track)
        is_sample = nodes.own
        force = nodes.force[nodes.own]
        stretch = self.element.limit * nodes.z[nodes.own]
        if nodes.steps[2].any() or nodes.slopes[1].any():
            return SampledForce(
                force,
                limit=self.element.limit,
                stretch=stretch,
                tangent=lambda: self._compute_tangent(track, nodes),
            )
        # At the end of a step, dz/dq is the derivative of z with respect to the slide. At its
        # start, this derivative is also divided by the fraction of z that remains after the step.
        before = np.roll(nodes.steps[1], 1)
        after = nodes.steps[1] / np.maximum(nodes.steps[0], 1e-300)
        hold = (
            nodes.find_remainders(np.flatnonzero(~is_sample)) * (before - after)[~is_sample, None]
        )
        return SampledForce(
            force,
            (nodes.slopes[0] * before)[is_sample],
            None,
            (nodes.slopes[0] * hold)[:, is_sample],
            self.element.limit,
            stretch,
        )

    def _compute_tangent(self, track: SampledSlide, nodes: "FlowNodes") -> tuple:
        """Compute the derivatives of the force by the displacement harmonics and by the frequency.

        See `SampledForce.tangent`.

        """
        k = np.arange(track.x.size)
        is_sample = nodes.own
        exponentials = np.exp(1j * np.outer(nodes.angle, k))
        wave, rate = (
            np.concatenate([x.real, -x.imag[:, 1:]], axis=1)
            for x in (exponentials, 1j * k * exponentials)
        )
        out = np.empty((nodes.angle.size, wave.shape[1] + 1))
        out[:, :-1] = np.roll(wave, -1, axis=0) - wave
        out[:, -1] = -nodes.dt / track.omega
        load_flow_kernels(self.element.kernels).solve_tangents(nodes.steps, out)
        out = out[is_sample] * nodes.slopes[0, is_sample, None]
        out[:, :-1] += nodes.slopes[1, is_sample, None] * track.omega * rate[is_sample]
        out[:, -1] += nodes.slopes[1, is_sample] * track.rate
        return out[:, :-1], out[:, -1]


class FlowNodes(NamedTuple):
    """Periodic state of a FlowLaw at the M samples and reversals of a cycle.

    - angle: (M,) [rad]; own: (M,) true for samples; dt: (M,) time to the next node [s]
    - z: (M,) stretch [m]
    - steps: (3, M) derivatives of the next stretch with respect to stretch, slide and time
    - force, slopes: (M,) force [N], (2, M) its derivatives with respect to stretch and velocity
    """

    angle: np.ndarray
    own: np.ndarray
    dt: np.ndarray
    z: np.ndarray
    steps: np.ndarray
    force: np.ndarray
    slopes: np.ndarray

    def find_remainders(self, nodes) -> np.ndarray:
        """Return the fractions (r, M) of stretch perturbations at r nodes that remain at all M nodes.

        It is 0 for a law whose memory does not fade.
        """
        log_decay = np.append(0.0, np.cumsum(np.log(np.maximum(self.steps[0], 1e-300))))
        log_remainder = (
            log_decay[:-1]
            - log_decay[nodes, None]
            + np.where(np.arange(self.z.size) < nodes[:, None], log_decay[-1], 0.0)
        )
        cycle_loss = -np.expm1(log_decay[-1])
        if not cycle_loss > 1e-12:
            return np.zeros_like(log_remainder)
        return np.exp(log_remainder) / cycle_loss

    def find_cell_factors(self) -> tuple:
        """Return the factor (N,) by which the stretch decays in each cell, and its derivative by displacement."""
        decay, by_slide, _ = self.steps
        first = np.flatnonzero(self.own)
        is_reversal = ~self.own
        weight = np.ones(self.z.size)
        weight[is_reversal] = self.dt[is_reversal]
        weight[np.roll(is_reversal, -1)] = self.dt[np.roll(is_reversal, -1)]
        weight[is_reversal | np.roll(is_reversal, -1)] /= self.dt[self.own][0]
        later = np.where(np.roll(is_reversal, -1), np.roll(decay, -1), 1.0)
        return np.multiply.reduceat(decay, first), np.add.reduceat(by_slide * weight * later, first)


def _count_samples(stick_fraction: float) -> int:
    """Return the number of samples per cycle needed to resolve a stick phase.

    stick_fraction: yield slide relative to the amplitude. The stick phase spans the angle acos(1 - 2 stick_fraction).
    """
    angle = np.arccos(max(1 - 2 * stick_fraction, -1.0))
    return int(min(SAMPLES_PER_STICK * 2 * np.pi / max(angle, 1e-9), 65536))


def make_law(element: Element | None):
    """Return the harmonic-balance law of an Element; None means bonds that are no single element.

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
