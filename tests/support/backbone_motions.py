"""Random joints: force of the phase resonance and band of a backbone curve, against an own harmonic balance.

Campaigns `backbone-forces` and `backbone-motions` of `campaigns`.

A joint has 1 + (seed // 6) % 3 modes and law LAWS[seed % 6]. Mass 0.3 to 3 kg, first mode 50 to 300
Hz, each further frequency 1.25 to 2.5 times the previous one, damping ratios of 2e-3 to 2e-2, a
joint stiffness of 0.05 to 1 times that of the first mode, a load of 20 to 500 N and a friction
coefficient of 0.2 to 0.6, all log-uniform. The first mode has a participation of 1 in the interface
and the output, the others 0.2 to 1 with either sign.

`solve_balance` shares no code with the package: real harmonics of the slide, laws stepped in time, Jacobian by
differences.

- `backbone-forces`: the force at the output that the backbone states at four amplitudes; rigid friction has none.

- `backbone-motions`: the band of the default methods at four amplitudes against the motion that defines the curve, which
a negative damping of all coordinates sustains; value and error are the middle and the half-width of the band.

Version 1.9 also compares with marched steady responses, with a stepped sine and at three preloads.
"""

from pathlib import Path
from time import process_time
from typing import NamedTuple

import numpy as np
from campaigns import Row
from numba import njit
from scipy.optimize import root

import patchfem as pf
from patchfem.campaigns.backbone.curves import compute_backbone

LAWS = ("elastic-plastic", "iwan", "bouc-wen", "lugre", "tanh", "coulomb")
FRACTIONS = (0.35, 0.55, 0.7, 0.85)  # places of the amplitudes in the logarithmic default range
N_SLIDERS = 400  # sliders of a power-law joint
BETA = 0.5  # factor beta of its law
N_HARMONICS = 31  # largest odd harmonic of the own balance
N_SAMPLES = 4096  # of a cycle; twice as many give the doubt
MAX_CYCLES = 200  # laws with a memory need many cycles in micro-slip
MAX_DAMPING = 0.4  # larger damping ratios are not compared


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


@njit
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


@njit
def trace_cycle(kind, numbers, limits, slides, speeds):
    """Return the friction force (N,) of the first repeated cycle of sampled slides (N,), with speeds (N,)."""
    state = np.zeros(numbers.size)
    force = np.zeros(slides.size)
    last = 0.0
    for _ in range(MAX_CYCLES):
        change = 0.0
        for k in range(slides.size):
            new = step_law(kind, numbers, limits, state, slides[k] - last, speeds[k])
            change = max(change, abs(new - force[k]))
            force[k] = new
            last = slides[k]
        if change < 1e-10 * limits[0]:
            break
    return force


class Balance(NamedTuple):
    """Periodic motion of the own balance: frequency [Hz], and the damping ratio or the force [N]."""

    frequency: float
    strength: float


def solve_balance(
    joint: Joint, amplitude: float, guess: Balance, *, is_forced: bool, samples: int
) -> Balance | None:
    """Solve the harmonic balance of a joint at an amplitude of the output [m]; None if it does not converge.

    is_forced: with a force at the output in quadrature to its motion, else with a negative damping of all coordinates.
    """
    kind = LAWS.index(joint.law)
    numbers, limits = law_parameters(joint)
    order = np.arange(1, N_HARMONICS + 1, 2)
    angles = 2 * np.pi * np.arange(samples) / samples
    waves = np.exp(1j * np.outer(order, angles))
    scale = np.array([2 * np.pi * guess.frequency, guess.strength])

    def compute_motion(x):
        """Return the harmonics of the slide and of the modal coordinates for the unknowns."""
        slide = (x[2 : 2 + order.size] + 1j * x[2 + order.size :]) * amplitude
        omega, strength = x[:2] * scale
        motion = (slide[:, None] * waves).real.sum(axis=0)
        speed = (1j * omega * order[:, None] * slide[:, None] * waves).real.sum(axis=0)
        force = trace_cycle(kind, numbers, limits, motion, speed)
        friction = 2 / samples * np.conj(waves) @ force
        damping = 2 * joint.zeta * joint.omega
        load = -np.outer(friction, joint.slide).astype(complex)
        if is_forced:
            load[0] += 1j * strength * joint.output
        else:
            damping = damping - 2 * strength * omega
        rates = (order * omega)[:, None]
        stiffness = joint.omega**2 - rates**2 + 1j * rates * damping
        return slide, load / joint.mass / stiffness

    def find_residual(x):
        """Return the differences of the slides, the phase of the output and its amplitude."""
        slide, modal = compute_motion(x)
        difference = (slide - modal @ joint.slide) / amplitude
        output = modal @ joint.output
        half_range = np.ptp((output[:, None] * waves).real.sum(axis=0)) / 2
        phase = output[0].imag / amplitude if is_forced else slide[0].imag / amplitude
        return np.concatenate(
            [difference.real, difference.imag, [phase, half_range / amplitude - 1]]
        )

    start = np.zeros(2 + 2 * order.size)
    start[:2] = 1.0
    # the slide that belongs to the output if the first mode alone moves
    start[2] = joint.slide[0] / joint.output[0]
    solution = root(find_residual, start, method="hybr", options={"xtol": 1e-12})
    if np.abs(solution.fun).max() > 1e-6:
        solution = root(find_residual, start, method="lm", options={"xtol": 1e-13})
    if np.abs(solution.fun).max() > 1e-6:
        return None
    omega, strength = solution.x[:2] * scale
    return Balance(float(omega) / (2 * np.pi), float(strength))


def solve_finer(joint: Joint, amplitude: float, guess: Balance, *, is_forced: bool) -> list | None:
    """Return the balances with N_SAMPLES and twice as many; None if one does not converge."""
    if guess.strength > MAX_DAMPING and not is_forced:
        return None
    known = [
        solve_balance(joint, amplitude, guess, is_forced=is_forced, samples=samples)
        for samples in (N_SAMPLES, 2 * N_SAMPLES)
    ]
    return None if None in known else known


def list_places(count: int) -> list:
    """Return the places of the four amplitudes among `count` points of a curve."""
    return [int(part * (count - 1)) for part in FRACTIONS]


def compare_force(seed: int, folder: Path, earlier: dict | None = None) -> dict:
    """Compare the forces of a joint with the own balance."""
    joint = draw_elastic_joint(seed)
    begin = process_time()
    curves = pf.backbone(scene_of_joint(joint), mode="mode1", method="balance")
    line = {"law": joint.law, "modes": joint.omega.size, "seconds": process_time() - begin}
    rows = []
    if "balance_amplitude" not in curves:
        return line | {"rows": [], "refused": str(curves.attrs)[:200]}
    for place in list_places(curves.balance_amplitude.size):
        names = ("amplitude", "frequency", "damping", "force", "force_error")
        point = {name: float(curves[f"balance_{name}"][place]) for name in names}
        if not np.isfinite(point["force"]) or point["damping"] > MAX_DAMPING:
            continue
        guess = Balance(point["frequency"], point["force"])
        known = solve_finer(joint, point["amplitude"], guess, is_forced=True)
        if known is not None:
            truth, doubt = known[1].strength, 2 * abs(known[1].strength - known[0].strength)
            rows.append(Row("force", point["force"], point["force_error"], 0.0, truth, doubt))
    return line | {"rows": rows}


def compare_motions(seed: int, folder: Path, earlier: dict | None = None) -> dict:
    """Compare the band of frequency and damping ratio with the motions that define the curve."""
    joint = draw_elastic_joint(seed)
    drive = {"kind": "force", "frequency": 100.0, "force": 1.0, "cycles": 9}
    begin = process_time()
    backbone = compute_backbone(pf.build(scene_of_joint(joint) | {"drive": drive}), "mode1")
    line = {"law": joint.law, "modes": joint.omega.size, "seconds": process_time() - begin}
    if "balance" not in backbone.curves:
        return line | {"rows": [], "refused": str(backbone.missing)}
    curve = backbone.curves["balance"]
    x = np.log(backbone.band.amplitude)
    rows = []
    for place in list_places(curve.amplitude.size):
        amplitude = float(curve.amplitude[place])
        guess = Balance(float(curve.frequency[place]), float(curve.damping[place]))
        known = solve_finer(joint, amplitude, guess, is_forced=False)
        if known is None or not x[0] - 1e-9 <= np.log(amplitude) <= x[-1] + 1e-9:
            continue
        for k, quantity in enumerate(("frequency", "damping")):
            low, high = (
                np.interp(np.log(amplitude), x, getattr(backbone.band, f"{quantity}_{side}"))
                for side in ("low", "high")
            )
            doubt = 2 * abs(known[1][k] - known[0][k])
            row = Row(
                f"motion_{quantity}", (low + high) / 2, (high - low) / 2, 0.0, known[1][k], doubt
            )
            rows.append(row)
    return line | {"rows": rows}


def draw_elastic_joint(seed: int) -> Joint:
    """Draw the joint of a seed; an elastic-plastic one takes the place of one with rigid friction."""
    joint = draw_joint(seed)
    if joint.law != "coulomb":
        return joint
    joint = draw_joint(seed + 6000)._replace(law="elastic-plastic")
    slip = joint.static * joint.load / (0.3 * joint.mass * joint.omega[0] ** 2)
    return joint._replace(numbers={"bond_length": float(slip)})
