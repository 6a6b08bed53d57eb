"""Laws of an interface row for the harmonic balance, each sampled along one cycle of a periodic slide.

Endpoint values are taken, not path means: the mean of a trigonometric polynomial over equal samples is exact up to
their number, so what aliases is only the corners of the force, (slope jump)(2 pi/N)^2/12, while a path mean over a step
damps every harmonic by (k pi/N)^2/6 besides. Turning points lie where the harmonics have them, not at samples.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property
from typing import NamedTuple

import numpy as np

from ...compiled import instance, load
from ...core import PatchfemError, frozen_array
from ...friction.protocol import Element

SHARPEST = 48  # samples while an element goes from one limit to the other


@cache
def kernels():
    """The compiled loops over the samples of a cycle, `cycle_kernels`."""
    return load("dynamics.harmonic.cycle_kernels")


@cache
def speed_kernels(law: str):
    """The loop over the samples of a compiled law without memory."""
    return instance("dynamics.harmonic.speed_kernels", {"law": load(law)})


@cache
def flow_kernels(law: str):
    """The loop over the samples of a compiled law of one number of memory."""
    return instance("dynamics.harmonic.flow_kernels", {"law": load(law)})


class Sampled(NamedTuple):
    """Along N samples: force [N], slope over the slide [N/m], over the rate of the slide [N s/m], derivatives (R, N) to
    the places of the R turning points, friction limit [N] and limit-weighted elastic stretch [N m]; tangent() of a law
    whose memory is not that of turning points: derivatives (N, 2 H + 1) of the force to the harmonics of the slide,
    real parts and then imaginary ones, and (N,) to the frequency of the cycle."""

    force: np.ndarray
    slope: np.ndarray | None = None
    by_rate: np.ndarray | None = None
    hold: np.ndarray | None = None
    limit: float = 0.0
    stretch: np.ndarray | None = None
    tangent: Callable | None = None


class Track:
    """A periodic slide on uniform samples of the cycle.

    x: harmonics (H + 1,) [m]; omega [rad/s]; samples: N; q (N,) [m] and rate (N,), dq/d(omega t) [m]: where they are
    known.
    """

    def __init__(self, x, omega: float, samples: int, q=None, rate=None):
        self.x = x
        self.omega = omega
        self.samples = samples
        self.q = synthesis(x, samples) if q is None else q
        self.rate = synthesis(1j * np.arange(x.size) * x, samples) if rate is None else rate

    @cached_property
    def turning(self) -> tuple:
        """(angles, places, sample before each, direction at the first sample)."""
        n = self.samples
        angle = np.empty(n)
        place = np.empty(n)
        cell = np.empty(n, np.int64)
        re = np.ascontiguousarray(self.x.real)
        im = np.ascontiguousarray(self.x.imag)
        count, start = kernels().turning_points(re, im, self.rate, angle, place, cell)
        return angle[:count], place[:count], cell[:count], start


def synthesis(x, samples: int) -> np.ndarray:
    """Samples (..., N) over one cycle of Re sum X_k exp(i k theta) from harmonics x (..., H + 1); N may be small."""
    if 2 * x.shape[-1] > samples:
        every = -(-2 * x.shape[-1] // samples)
        return synthesis(x, samples * every)[..., ::every]
    spectrum = np.zeros((*x.shape[:-1], samples // 2 + 1), complex)
    spectrum[..., : x.shape[-1]] = x * (samples / 2)
    spectrum[..., 0] *= 2
    return np.fft.irfft(spectrum, samples, axis=-1)


def analysis(values, harmonics: int) -> np.ndarray:
    """Harmonics (..., H + 1) of samples (..., N) over one cycle, H <= N/2; inverse of `synthesis`."""
    n = values.shape[-1]
    out = np.fft.rfft(values, axis=-1)[..., : harmonics + 1] * (2 / n)
    out[..., 0] /= 2
    return out


class Law:
    """A law of a row. total: tangent stiffness at rest [N/m], 0 of one that creeps under any force."""

    __slots__ = ()
    total = 0.0

    def sharpness(self, amplitude: float) -> int:
        """Samples of a cycle that resolve its corners at a slide amplitude [m]; 0 of one that has none."""
        return 0

    def sample(self, track: "Track") -> "Sampled":
        """Its periodic state along a slide, that of a virgin contact where several are."""
        raise NotImplementedError


@dataclass(frozen=True, eq=False, slots=True)
class Jenkins(Law):
    """Parallel elastic-plastic elements: stiffness (t,) [N/m] > 0, limit_slide (t,) [m] >= 0."""

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
            tuple(frozen_array(np.append(0.0, np.cumsum(v))) for v in (k, k * w, k * w * w)),
        )

    @property
    def total(self) -> float:
        """Tangent stiffness at rest [N/m]."""
        return float(self.sums[0][-1])

    def sharpness(self, amplitude: float) -> int:
        """Samples of a cycle that resolve a stick at a slide amplitude [m]."""
        share = float(self.sums[1][-1]) / self.total / max(amplitude, 1e-300)
        return _samples(share)

    def sample(self, track: Track) -> Sampled:
        """The periodic steady state that a virgin contact reaches."""
        _, places, cells, start = track.turning
        n = track.samples
        stiff, full, square = self.sums
        force = np.empty(n)
        slope = np.empty(n)
        stretch = np.empty(n)
        hold = np.zeros((places.size, n))
        workspace = np.empty((2, 2 * places.size + 3), np.int64), np.empty((2, 2 * places.size + 3))
        kernels().jenkins_cycle(
            track.q,
            start,
            cells,
            places,
            self.limit_slide,
            stiff,
            full,
            square,
            workspace,
            force,
            slope,
            hold,
            stretch,
        )
        return Sampled(force, slope, None, hold, float(full[-1]), stretch)


@dataclass(frozen=True, slots=True)
class Spring(Law):
    """Bonded spring: stiffness [N/m], cubic [N/m3] q^3 besides."""

    stiffness: float = 0.0
    cubic: float = 0.0

    @property
    def total(self) -> float:
        """Tangent stiffness at rest [N/m]."""
        return self.stiffness

    def sample(self, track: Track) -> Sampled:
        """Force and slope at the samples."""
        q = track.q
        return Sampled(
            q * (self.stiffness + self.cubic * q * q), self.stiffness + 3 * self.cubic * q * q
        )


@dataclass(frozen=True, slots=True)
class Interlock(Law):
    """Interlocking of wavelength [m]: stiffness wavelength/(2 pi) sin(2 pi q/wavelength), stiffness [N/m] at rest."""

    stiffness: float
    wavelength: float

    @property
    def total(self) -> float:
        """Tangent stiffness at rest [N/m]."""
        return self.stiffness

    def sharpness(self, amplitude: float) -> int:
        """Samples for the waves that a cycle passes."""
        return int(16 * min(2 * np.pi * amplitude / self.wavelength, 1000.0))

    def sample(self, track: Track) -> Sampled:
        """Force and slope at the samples."""
        angle = 2 * np.pi / self.wavelength * track.q
        return Sampled(
            self.stiffness * self.wavelength / (2 * np.pi) * np.sin(angle),
            self.stiffness * np.cos(angle),
        )


@dataclass(frozen=True, eq=False, slots=True)
class OfSpeed(Law):
    """A law without memory, whose force follows the speed of the slide alone: its Element of form "speed"."""

    element: Element

    def sample(self, track: Track) -> Sampled:
        """Force and slope at the samples."""
        force = np.empty(track.samples)
        slope = np.empty(track.samples)
        speed_kernels(self.element.kernels).along(
            self.element.numbers[None], track.omega * track.rate, force, slope
        )
        return Sampled(force, None, slope, None, self.element.limit, np.zeros(track.samples))


@dataclass(frozen=True, eq=False, slots=True)
class Flow(Law):
    """A law whose memory is its stretch alone, which flows along the slide: its Element of form "flow"."""

    element: Element

    @property
    def length(self) -> float:
        """Slide over which it stretches before it slips [m]."""
        return self.element.length

    @property
    def total(self) -> float:
        """Tangent stiffness at rest [N/m]."""
        return self.element.limit / self.element.length

    def sharpness(self, amplitude: float) -> int:
        """Samples of a cycle that resolve a reversal at a slide amplitude [m]."""
        return _samples(self.length / max(amplitude, 1e-300))

    def along(self, track: Track) -> "Nodes":
        """The periodic state, that of a virgin contact where several are, at samples and turning points."""
        angles, places, cells, _ = track.turning
        n = track.samples
        own = np.ones(track.samples + len(cells), bool)
        own[cells + 1 + np.arange(len(cells))] = False
        angle, q, speed = np.zeros((3, own.size))  # the slide rests at a turn
        angle[own] = np.arange(n) * (2 * np.pi / n)
        q[own] = track.q
        speed[own] = track.omega * track.rate
        angle[~own] = angles
        q[~own] = places
        dt = np.maximum(np.diff(angle, append=2 * np.pi) / track.omega, 1e-300)
        z = np.empty(q.size)
        steps = np.empty((3, q.size))
        force = np.empty(q.size)
        slopes = np.empty((2, q.size))
        flow_kernels(self.element.kernels).cycle(
            self.element.numbers[None], q, speed, dt, z, steps, force, slopes
        )
        return Nodes(angle, own, dt, z, steps, force, slopes)

    def sample(self, track: Track) -> Sampled:
        """Force at the samples of the periodic state. Where the law knows no time its slopes are those over the slide
        and the turning places, else those over the harmonics."""
        one = self.along(track)
        own = one.own
        force = one.force[one.own]
        stretch = self.element.limit * one.z[one.own]
        if one.steps[2].any() or one.slopes[1].any():
            return Sampled(
                force,
                limit=self.element.limit,
                stretch=stretch,
                tangent=lambda: self._tangent(track, one),
            )
        # at the end of a step dz/dq is its slope over the slide; at its start, over what it keeps of z, besides
        before = np.roll(one.steps[1], 1)
        after = one.steps[1] / np.maximum(one.steps[0], 1e-300)
        hold = one.kept_from(np.flatnonzero(~own)) * (before - after)[~own, None]
        return Sampled(
            force,
            (one.slopes[0] * before)[own],
            None,
            (one.slopes[0] * hold)[:, own],
            self.element.limit,
            stretch,
        )

    def _tangent(self, track: Track, one: "Nodes") -> tuple:
        """Derivatives of the force at the samples as of `Sampled.tangent`."""
        k = np.arange(track.x.size)
        own = one.own
        turned = np.exp(1j * np.outer(one.angle, k))
        wave, rate = (
            np.concatenate([x.real, -x.imag[:, 1:]], axis=1) for x in (turned, 1j * k * turned)
        )
        out = np.empty((one.angle.size, wave.shape[1] + 1))
        out[:, :-1] = np.roll(wave, -1, axis=0) - wave
        out[:, -1] = -one.dt / track.omega
        flow_kernels(self.element.kernels).tangents(one.steps, out)
        out = out[own] * one.slopes[0, own, None]
        out[:, :-1] += one.slopes[1, own, None] * track.omega * rate[own]
        out[:, -1] += one.slopes[1, own] * track.rate
        return out[:, :-1], out[:, -1]


class Nodes(NamedTuple):
    """A Flow at the M samples and turning points of a cycle: angle (M,), which are samples (M,) bool, the time dt (M,)
    [s] to the next, stretch z (M,) [m], slopes (3, M) of the steps that follow over the stretch, slide and time,
    force (M,) [N] and its slopes (2, M) over the stretch and the speed."""

    angle: np.ndarray
    own: np.ndarray
    dt: np.ndarray
    z: np.ndarray
    steps: np.ndarray
    force: np.ndarray
    slopes: np.ndarray

    def kept_from(self, places) -> np.ndarray:
        """What is left of a disturbance of z at nodes `places` (r,) at every node, (r, M), periodic; 0 of one that
        nothing forgets."""
        fall = np.append(0.0, np.cumsum(np.log(np.maximum(self.steps[0], 1e-300))))
        since = (
            fall[:-1]
            - fall[places, None]
            + np.where(np.arange(self.z.size) < places[:, None], fall[-1], 0.0)
        )
        forgets = -np.expm1(fall[-1])
        return np.exp(since) / forgets if forgets > 1e-12 else np.zeros_like(since)

    def by_cell(self) -> tuple:
        """(what a cell from sample to sample keeps of the stretch, its slope over an even slide), both (N,)."""
        kept, by_slide, _ = self.steps
        first = np.flatnonzero(self.own)
        turns = ~self.own
        share = np.ones(self.z.size)
        share[turns] = self.dt[turns]
        share[np.roll(turns, -1)] = self.dt[np.roll(turns, -1)]
        share[turns | np.roll(turns, -1)] /= self.dt[self.own][0]
        later = np.where(np.roll(turns, -1), np.roll(kept, -1), 1.0)
        return np.multiply.reduceat(kept, first), np.add.reduceat(by_slide * share * later, first)


def _samples(share: float) -> int:
    """Samples of a cycle for a stick over `share` of the amplitude: it takes the angle acos(1 - 2 share)."""
    angle = np.arccos(max(1 - 2 * share, -1.0))
    return int(min(SHARPEST * 2 * np.pi / max(angle, 1e-9), 65536))


def law_of_model(model):
    """The law of a dynamics.march.models.ContactModel; PatchfemError names what cannot be balanced and what to do."""
    one = model.element
    form = one.form if one is not None else ""
    if form == "parallel":
        count = int(one.numbers[1])
        return Jenkins(one.numbers[2 : 2 + count], one.numbers[2 + count :])
    if form == "speed":
        return OfSpeed(one)
    # points of bonds that do not grow and break at once remember one stretch
    if form == "flow" or (form == "points" and one.numbers[3] < 0 and not one.numbers[8]):
        return Flow(one)
    if model.set_valued:
        raise PatchfemError(
            'accuracy.method: "harmonic" '
            "cannot treat rigid friction, because the force of rigid friction jumps; use the exact "
            'solution from event to event, or friction.law = "elastic-plastic" with a short '
            "friction.bond_length"
        )
    raise PatchfemError(
        'accuracy.method: "harmonic" can treat bonds only with friction.reading = "stretch", '
        "friction.order = 1, a constant bond length, friction.breakaway = 0 and pieces that are rigid "
        'in shear; use accuracy.method = "march"'
    )
