"""Random joints: error band of a backbone curve against marched steady responses and released decays.

Campaign `backbone-bands` of `campaigns`. A row is a frequency or a damping ratio at an amplitude:
its value is the middle of the band, its error the half-width of the band, and its truth the value
from a simulated test.

A joint has 1 + (seed // 6) % 3 modes and law LAWS[seed % 6]. Mass 0.3 to 3 kg, first mode 50 to 300
Hz, each further frequency 1.25 to 2.5 times the previous one, damping ratios of 2e-3 to 2e-2, a
joint stiffness of 0.05 to 1 times that of the first mode, a load of 20 to 500 N and a friction
coefficient of 0.2 to 0.6, all log-uniform. The first mode has a participation of 1 in the interface
and the output, the others 0.2 to 1 with either sign.

- Steady responses: `march_steady` integrates the equation of motion under a sinusoidal force at the
output with a leapfrog scheme and separate code for each law, from the wanted amplitude until the
cycles repeat. It shares no code with the package. F conj(X) = m Z^2 (w0^2 - w^2 + 2 i zeta w0^2)
gives the frequency w0 and the damping ratio, with the first harmonics X of the output and Z of the
modes. A second run is driven at the frequency that the first one gave. There are four forces.

- Decays: method `decay` of the package, at every third amplitude.

The band is computed at the amplitudes of the simulated tests.

Seeds below 58000 were used in developing the band, those from 58000 on only to test it.
"""

from pathlib import Path
from time import process_time
from typing import NamedTuple

import numba
import numpy as np
from campaigns import Row

import patchfem as pf
from patchfem.campaigns.backbone.curves import compute_backbone
from patchfem.core import PatchfemError

LAWS = ("elastic-plastic", "iwan", "bouc-wen", "lugre", "tanh", "coulomb")
# Positions in the logarithmic range of amplitudes at which the forces aim.
FRACTIONS = (0.3, 0.6, 0.72, 0.88)
STEPS = {"iwan": 1000}  # Steps per cycle of the drive; laws not named here need MOST_STEPS.
MOST_STEPS = 4000
MAX_CYCLES = 1500
BLOCK = 25  # Cycles between two checks of whether the motion repeats.
N_SLIDERS = 400  # sliders of a power-law joint
BETA = 0.5  # factor beta of its law
REPEATS = 1e-4  # Expected further change, relative to the response, at which the march ends.


class Joint(NamedTuple):
    """Random joint: arrays of modes (n,), the friction law and its parameters."""

    law: str
    mass: float
    omega: np.ndarray
    zeta: np.ndarray
    slide: np.ndarray
    output: np.ndarray
    load: float
    static: float
    numbers: dict


def make_sliders(stiffness: float, force: float, chi: float) -> tuple:
    """Return stiffness (s,) [N/m] and slip force (s,) [N] of the sliders of a power-law joint (Segalman 2005)."""
    max_displacement = force * (1 + BETA) / (stiffness * (BETA + (chi + 1) / (chi + 2)))
    edges = np.linspace(0, 1, N_SLIDERS + 1) ** (1 / (1 + chi / 2))
    k = np.append(np.diff(edges ** (chi + 1)), BETA) / (1 + BETA)
    moment = np.append((chi + 1) / (chi + 2) * np.diff(edges ** (chi + 2)), BETA) / (1 + BETA)
    return stiffness * k, stiffness * max_displacement * moment


class SteadyPoint(NamedTuple):
    """Amplitude [m], frequency [Hz] and damping ratio of a steady response, with the uncertainties of the last two."""

    amplitude: float
    frequency: float
    damping: float
    frequency_doubt: float
    damping_doubt: float


def draw_joint(seed: int) -> Joint:
    """Draw the random joint of a seed."""
    rng = np.random.default_rng(seed)

    def log_uniform(low, high, size=None):
        """Draw from a log-uniform distribution."""
        return np.exp(rng.uniform(np.log(low), np.log(high), size))

    count = 1 + (seed // 6) % 3
    law = LAWS[seed % 6]
    mass = float(log_uniform(0.3, 3))
    ratios = np.append(1.0, np.cumprod(log_uniform(1.25, 2.5, count - 1)))
    omega = 2 * np.pi * float(log_uniform(50, 300)) * ratios
    signs = rng.choice([-1.0, 1.0], (2, count - 1))
    slide = np.append(1.0, signs[0] * rng.uniform(0.2, 1, count - 1))
    output = np.append(1.0, signs[1] * rng.uniform(0.2, 1, count - 1))
    load = float(log_uniform(20, 500))
    static = float(log_uniform(0.2, 0.6))
    stiffness = float(log_uniform(0.05, 1)) * mass * omega[0] ** 2
    slip = static * load / stiffness
    numbers = {
        "elastic-plastic": {"bond_length": slip},
        "iwan": {"stiffness": stiffness, "chi": float(rng.uniform(-0.8, -0.1)), "beta": 0.5},
        "bouc-wen": {"stiffness": stiffness, "exponent": float(rng.uniform(1, 3))},
        "lugre": {
            "stiffness": stiffness,
            "stribeck_speed": slip * omega[0] * float(log_uniform(0.3, 3)),
        },
        "tanh": {"reference_speed": slip * omega[0] * float(log_uniform(0.3, 3))},
        "coulomb": {},
    }[law]
    if law == "lugre":
        numbers["kinetic"] = static * float(rng.uniform(0.8, 1))
    return Joint(
        law, mass, omega, log_uniform(2e-3, 2e-2, count), slide, output, load, static, numbers
    )


def scene_of_joint(joint: Joint) -> dict:
    """Return the scene tables of a joint."""
    modes = [
        {
            "name": f"mode{k + 1}",
            "frequency": joint.omega[k] / (2 * np.pi),
            "damping": joint.zeta[k],
            "slide": joint.slide[k],
            "output": joint.output[k],
            "base": 0.0,
        }
        for k in range(joint.omega.size)
    ]
    return {
        "normal": {"load": joint.load},
        "friction": {"law": joint.law, "static": joint.static, **joint.numbers},
        "structure": {"moving_mass": joint.mass, "mode": modes},
    }


def law_parameters(joint: Joint) -> tuple:
    """Return stiffness (s,) [N/m] and slip force (s,) [N] of the sliders.

    Other laws have their parameters in the first array.
    """
    limit = joint.static * joint.load
    numbers = joint.numbers
    if joint.law == "iwan":
        return make_sliders(numbers["stiffness"], limit, numbers["chi"])
    if joint.law == "elastic-plastic":
        return np.array([limit / numbers["bond_length"]]), np.array([limit])
    if joint.law == "bouc-wen":
        return np.array([numbers["stiffness"], numbers["exponent"]]), np.array([limit])
    if joint.law == "lugre":
        kinetic = numbers["kinetic"] * joint.load
        return np.array([numbers["stiffness"], numbers["stribeck_speed"], kinetic]), np.array(
            [limit]
        )
    return np.array([numbers.get("reference_speed", 0.0)]), np.array([limit])


@numba.njit
def step_law(kind, numbers, limits, state, displacement, speed):
    """Return the friction force after a displacement step at a given speed, and update the state in place."""
    if kind <= 1:
        force = 0.0
        for k in range(numbers.size):
            state[k] = min(max(state[k] + numbers[k] * displacement, -limits[k]), limits[k])
            force += state[k]
        return force
    if kind == 2:  # Bouc-Wen with both weights 1/2, by the midpoint rule.
        middle = state[0]
        for part in (0.5, 1.0):
            saturation = abs(middle) ** numbers[1] * (0.5 * np.sign(displacement * middle) + 0.5)
            middle = state[0] + part * displacement * numbers[0] / limits[0] * (1 - saturation)
        state[0] = middle
        return limits[0] * middle
    if kind == 3:  # LuGre without damping, by the midpoint rule
        g = numbers[2] + (limits[0] - numbers[2]) * np.exp(-((speed / numbers[1]) ** 2))
        half = state[0] + 0.5 * (displacement - numbers[0] * abs(displacement) * state[0] / g)
        state[0] += displacement - numbers[0] * abs(displacement) * half / g
        return numbers[0] * state[0]
    return limits[0] * np.tanh(speed / numbers[0])


@numba.njit
def march(kind, numbers, limits, state, modes, mass, drive, steps, cycles, motion, q, v, force):
    """March some cycles with the leapfrog scheme and return the friction force at the end.

    The last two cycles are stored in `motion` (2 steps, n).
    """
    omega, zeta, slide, output = modes
    size, frequency = drive
    dt = 2 * np.pi / frequency / steps
    total = cycles * steps
    damping_factor = 1 / (1 + zeta * omega * dt)
    compliance = (slide * slide * damping_factor).sum() / mass
    for n in range(total):
        drive_force = size * np.cos(2 * np.pi * (n % steps) / steps)
        acceleration = -omega * omega * q + drive_force * output / mass
        v[:] = ((1 - zeta * omega * dt) * v + dt * acceleration) * damping_factor
        if kind == 5:
            speed = (slide * v).sum()
            impulse = min(max(speed / compliance, -limits[0] * dt), limits[0] * dt)
            v[:] -= slide * impulse / mass * damping_factor
        else:
            v[:] -= dt * slide * force / mass * damping_factor
        q[:] += dt * v
        if kind != 5:
            speed = (slide * v).sum()
            force = step_law(kind, numbers, limits, state, speed * dt, speed)
        sample = n - (total - 2 * steps)
        if sample >= 0:
            motion[sample] = q
    return force


def march_steady(joint: Joint, force: float, frequency: float, start: float) -> SteadyPoint:
    """March a joint under a sinusoidal force at the output until its cycles repeat, and evaluate its last cycle.

    force [N], frequency [Hz], start: displacement of the first mode [m].
    """
    steps = STEPS.get(joint.law, MOST_STEPS)
    numbers, limits = law_parameters(joint)
    state = np.zeros(numbers.size)
    modes = np.array([joint.omega, joint.zeta, joint.slide, joint.output])
    omega = 2 * np.pi * frequency
    q = np.zeros(joint.omega.size)
    v = np.zeros(joint.omega.size)
    v[0] = omega * start
    motion = np.empty((2 * steps, joint.omega.size))
    kind = LAWS.index(joint.law)
    drive = (force, omega)
    friction = 0.0
    for _ in range(MAX_CYCLES // BLOCK):
        friction = march(
            kind,
            numbers,
            limits,
            state,
            modes,
            joint.mass,
            drive,
            steps,
            BLOCK,
            motion,
            q,
            v,
            friction,
        )
        previous, last = (evaluate_cycle(joint, part, force, omega) for part in np.split(motion, 2))
        # The transient decays by at least exp(-2 pi zeta) per cycle.
        remaining_cycles = 1 / max(1 - np.exp(-2 * np.pi * joint.zeta.min()), 1e-3)
        change = remaining_cycles * np.abs(np.subtract(last, previous))
        if (change <= REPEATS * np.abs(last)).all():
            break
    return SteadyPoint(*last, change[1], change[2])


def evaluate_cycle(joint: Joint, motion, force: float, omega: float) -> tuple:
    """Return amplitude [m], frequency [Hz] and damping ratio of a cycle (steps, n) of modal coordinates."""
    steps = len(motion)
    output = motion @ joint.output
    # Each sample is taken at the end of its step, so its phase is one step later than its index.
    first_harmonic = np.exp(-2j * np.pi * np.arange(1, steps + 1) / steps) * 2 / steps
    modal = first_harmonic @ motion
    work = force * np.conj(first_harmonic @ output) / (joint.mass * np.sum(np.abs(modal) ** 2))
    square = omega**2 + work.real
    natural_frequency = np.sqrt(max(square, 0.0))
    return (
        np.ptp(output) / 2,
        natural_frequency / (2 * np.pi),
        work.imag / (2 * max(square, 1e-300)),
    )


def band_rows(band, name: str, points) -> list:
    """Return the rows of the points that lie within the amplitudes of a band.

    points: (amplitude, frequency, damping, uncertainties of both).
    """
    rows = []
    x = np.log(band.amplitude)
    for amplitude, *values in points:
        log_amplitude = np.log(amplitude)
        if not x[0] - 1e-9 <= log_amplitude <= x[-1] + 1e-9 or not np.isfinite(values).all():
            continue
        for k, quantity in enumerate(("frequency", "damping")):
            low = np.interp(log_amplitude, x, getattr(band, f"{quantity}_low"))
            high = np.interp(log_amplitude, x, getattr(band, f"{quantity}_high"))
            middle = (low + high) / 2
            rows.append(
                Row(f"{name}_{quantity}", middle, (high - low) / 2, 0.0, values[k], values[2 + k])
            )
    return rows


def band_at(model, points):
    """Return the band at the amplitudes of some points, which are their first values."""
    amplitudes = np.unique([point[0] for point in points])
    return compute_backbone(model, "mode1", amplitudes, ("balance", "quasi-static")).band


def march_steady_points(joint: Joint, curve) -> list:
    """Return steady responses whose forces aim at some amplitudes of a curve."""
    points = []
    for fraction in FRACTIONS:
        k = int(fraction * (curve.amplitude.size - 1))
        amplitude = curve.amplitude[k]
        square = (2 * np.pi * curve.frequency[k]) ** 2
        force = 2 * curve.damping[k] * joint.mass * square * amplitude
        first = march_steady(joint, force, curve.frequency[k], amplitude)
        if first.frequency > 0:
            points.append(march_steady(joint, force, first.frequency, first.amplitude))
    return points


def compare_band(seed: int, folder: Path, earlier: dict | None = None) -> dict:
    """Compare the band of a joint with steady responses; see `campaigns`."""
    joint = draw_joint(seed)
    scene = scene_of_joint(joint)
    model = pf.build(
        scene | {"drive": {"kind": "force", "frequency": 100.0, "force": 1.0, "cycles": 9}}
    )
    begin = process_time()
    try:
        backbone = compute_backbone(model, "mode1", methods=("balance", "quasi-static"))
    except PatchfemError as reason:
        return {"rows": [], "refused": str(reason)}
    seconds = process_time() - begin
    line = {"law": joint.law, "modes": joint.omega.size, "seconds": seconds, "rows": []}
    if "balance" not in backbone.curves:
        return line | {"refused": str(backbone.missing)}
    curve = backbone.curves["balance"]
    points = march_steady_points(joint, curve)
    line["rows"] += band_rows(band_at(model, points), "steady", points)
    return line
