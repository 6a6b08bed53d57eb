"""Data of a result for the self-checks: scene, modes, last cycles, two values of the friction force.

In: a Result. Out: `Evidence`.
"""

import tomllib
from functools import cached_property
from typing import NamedTuple

import numpy as np

from patchfem.core import Outcome
from patchfem.runs.results.result import Result
from patchfem.runs.rig import engines

from .finding import CUBIC_QUADRATURE_TOL

MIN_CYCLE_SAMPLES = 40  # Smallest number of samples per cycle at which the checks use a window.


class Evidence:
    """Result of a run, together with its scene as a table of numbers in SI units."""

    def __init__(self, result: Result):
        self.result = result
        self.model = result.plan.model
        self.scene = tomllib.loads(self.model.source.resolved)

    def number(self, *keys) -> float | None:
        """Return the value of a scene key in SI units; None if the scene does not have it."""
        value = self.scene
        for key in keys:
            if not isinstance(value, dict) or key not in value:
                return None
            value = value[key]
        return parse_scene_number(value)

    def value(self, name: str) -> float | None:
        """Return the value of a measure; None if the run has no such measure."""
        measure = self.result.measures.get(name)
        return None if measure is None else measure.value

    def error(self, name: str) -> float:
        """Return the error of a measure plus its floor; 0 if the run has no such measure."""
        measure = self.result.measures.get(name)
        return 0.0 if measure is None else (measure.error or 0.0) + measure.floor

    @property
    def area(self) -> float:
        """Interface area [m2] of all contact pairs together."""
        contact = self.scene["contact"]
        return (
            self.number("contact", "width")
            * self.model.patch.pieces.length
            * contact.get("pairs", 1)
        )

    @cached_property
    def load(self) -> float | None:
        """Normal load [N] of the scene; None if the scene gives an approach instead."""
        return self.number("normal", "load") or self.number("contact", "load")

    @cached_property
    def has_plain_friction(self) -> bool:
        """Whether a single interface slides under constant load with constant coefficients."""
        friction = self.scene.get("friction")
        model = self.model
        if (
            friction is None
            or self.load is None
            or "wear" in self.scene
            or model.grooves is not None
        ):
            return False
        rig = model.rig
        if model.load_varies if rig is None else rig.friction.load_varies:
            return False
        has_several_interfaces = rig is not None and (
            len(rig.modes.interfaces) > 1 or bool(rig.friction.names)
        )
        has_varying_bonds = "temperature" in friction or "spread" in friction
        return not (has_several_interfaces or has_varying_bonds)

    @cached_property
    def modes(self) -> "SceneModes | None":
        """Modes listed in [[structure.mode]]; None if the engine uses other modes.

        This is the case for a reduced structure and for a bonded spring.
        """
        structure = self.scene.get("structure", {})
        if (
            "mode" not in structure
            or "bonded" in structure
            or structure.get("measured", "free") != "free"
        ):
            return None

        def column(key: str) -> np.ndarray:
            """Return the values of a scene key for all modes."""
            return np.array([parse_scene_number(mode[key]) for mode in structure["mode"]])

        has_force = self.scene["drive"]["kind"] == "force"
        return SceneModes(
            2 * np.pi * column("frequency"),
            column("damping"),
            column("slide"),
            -column("output") if has_force else column("base"),
            column("accelerometer"),
            parse_scene_number(structure["moving_mass"]),
        )

    @cached_property
    def window(self):
        """Histories of the last cycles under a sinusoidal drive; None otherwise.

        It is also None if there are too few samples.
        """
        window = self.result.window
        frequency = self.frequency
        if window is None or frequency is None or window.time.size < 3:
            return None
        if self.model.rig is None:
            window = LastCycle(
                window.time[window.first :],
                window.slide[window.first :],
                window.force[window.first :],
            )
        cycles = (window.time[-1] - window.time[0]) * frequency
        is_whole = cycles > 0.5 and abs(cycles - round(cycles)) < 1e-6 * max(cycles, 1.0)
        return window if is_whole and (window.time.size - 1) / cycles >= MIN_CYCLE_SAMPLES else None

    @cached_property
    def frequency(self) -> float | None:
        """Frequency [Hz] of a drive or displacement that is sinusoidal to the end; else None."""
        drive = self.scene.get("drive")
        slide = self.scene.get("slide", {})
        if drive is None:
            return self.number("slide", "frequency") if slide.get("kind") == "sine" else None
        is_sine = drive.get("kind") in ("base", "force") and drive.get("waveform") == "sine"
        return self.number("drive", "frequency") if is_sine else None

    @cached_property
    def balance(self) -> "ForceBalance | None":
        """First harmonic of the friction force from the equation of motion and from samples.

        It is None if other forces act as well.
        """
        rig = self.model.rig
        modes = self.modes
        window = self.window
        if (
            rig is None
            or modes is None
            or window is None
            or not self.has_plain_friction
            or rig.springs.is_nonlinear
        ):
            return None
        engine = engines.ENGINES.get(self.result.extra.get("engine"))
        if engine is None or rig.friction.strips_slide_apart or not modes.slide.any():
            return None
        if self.result.outcome in (Outcome.EXCEEDS_TRAVEL, Outcome.GROWS, Outcome.NOT_CONVERGED):
            return None
        size = self.number("drive", "acceleration")
        force = self.number("drive", "force")
        # The drive is of another kind, for example a displacement of the base.
        if size is None and force is None:
            return None
        drive = force / modes.mass if size is None else size
        return compute_force_balance(modes, window, drive, 2 * np.pi * self.frequency)


class LastCycle(NamedTuple):
    """Time [s], displacement [m] and friction force [N] (k,) in the last cycle of the slide of a bench."""

    time: np.ndarray
    slide: np.ndarray
    force: np.ndarray


class SceneModes(NamedTuple):
    """Natural frequencies, damping ratios and participations of the modes in the scene.

    omega [rad/s]; zeta, slide, base and output [1]; (n,) each; and the mass [kg].
    """

    omega: np.ndarray
    zeta: np.ndarray
    slide: np.ndarray
    base: np.ndarray
    output: np.ndarray
    mass: float


class ForceBalance(NamedTuple):
    """First harmonics of displacement and friction force, the latter computed in two ways.

    - from_motion: harmonic of the force from the equation of motion [N].
    - from_samples: harmonic of the force from its samples [N].
    - slide: harmonic of the displacement [m].
    - sampling: error of `from_samples` due to the sampling [N].
    - terms: sum of the magnitudes of the terms whose sum is `from_motion` [N].
    """

    from_motion: complex
    from_samples: complex
    slide: complex
    sampling: float
    terms: float

    @property
    def threshold(self) -> float:
        """Largest difference [N] of the two force harmonics in a correct run."""
        return self.sampling + CUBIC_QUADRATURE_TOL * self.terms


def parse_scene_number(value) -> float | None:
    """Return the number in a scene value such as 0.3 or "700.0 N"; None for other values."""
    if isinstance(value, str):
        head = value.split()[0] if value else ""
        try:
            return float(head)
        except ValueError:
            return None
    return float(value) if isinstance(value, int | float) else None


def integrate_harmonic_by_cubics(time, value, rate, omega: float) -> complex:
    """Compute a Fourier coefficient of samples (k,) from their piecewise cubic interpolation.

    The interpolant is integrated by Simpson's rule.

    Parameters
    ----------
    time, value, rate : (k,)
        Times [s], samples, and their derivatives with respect to time.
    omega : float
        Angular frequency [rad/s].
    """
    step = np.diff(time)
    middle = (value[1:] + value[:-1]) / 2 + step * (rate[:-1] - rate[1:]) / 8
    wave = np.exp(-1j * omega * time)
    wave_middle = np.exp(-1j * omega * (time[1:] + time[:-1]) / 2)
    node_values = value * wave
    total = np.sum(step / 6 * (node_values[:-1] + 4 * middle * wave_middle + node_values[1:]))
    return complex(2 / (time[-1] - time[0]) * total)


def compute_force_balance(
    modes: SceneModes, window, acceleration: float, omega: float
) -> ForceBalance:
    """Compute the first harmonic of the friction force from the motion and from samples.

    The equation of motion times exp(-i omega t) is integrated by parts over the window: the
    harmonic of z'' is [v e + i omega z e] 2/T - omega^2 z1, that of v is [z e] 2/T + i omega z1.
    The harmonic from samples uses the trapezoidal rule, whose error is at most h |change of F|/2
    per step if the force is monotonic between samples. Twice as much is allowed, for a force that
    reverses within a step.

    Parameters
    ----------
    modes : SceneModes
    window : Response
    acceleration : float
        Acceleration of the drive, or its force divided by the mass [m s-2].
    omega : float
        Angular frequency of the drive [rad/s].
    """
    time = window.time
    span = window.time[-1] - window.time[0]
    wave = np.exp(-1j * omega * time)
    displacement_harmonic = np.zeros(modes.omega.size, complex)
    force_harmonic = np.zeros(modes.omega.size, complex)
    sum_of_magnitudes = 0.0
    drive = -1j * acceleration
    for i in range(modes.omega.size):
        z = window.modal[:, i]
        v = window.modal_rate[:, i]
        displacement_harmonic[i] = integrate_harmonic_by_cubics(time, z, v, omega)
        boundary_term = 2 / span * (z[-1] * wave[-1] - z[0] * wave[0])
        velocity_harmonic = boundary_term + 1j * omega * displacement_harmonic[i]
        inertia = 2 / span * (v[-1] * wave[-1] - v[0] * wave[0]) + 1j * omega * velocity_harmonic
        terms = (
            inertia,
            2 * modes.zeta[i] * modes.omega[i] * velocity_harmonic,
            modes.omega[i] ** 2 * displacement_harmonic[i],
            modes.base[i] * drive,
        )
        force_harmonic[i] = -sum(terms)
        sum_of_magnitudes += abs(modes.slide[i]) * sum(abs(term) for term in terms)
    scale = modes.mass / (modes.slide @ modes.slide)
    step = np.diff(time)
    product = window.force * wave
    samples = 2 / span * np.sum(step * (product[1:] + product[:-1]) / 2)
    sampling = 2 / span * np.sum(step * np.abs(np.diff(window.force)))
    return ForceBalance(
        complex(scale * (modes.slide @ force_harmonic)),
        complex(samples),
        complex(modes.slide @ displacement_harmonic),
        float(sampling),
        float(scale * sum_of_magnitudes),
    )
