"""Random joints: force of the phase resonance and effect of the preload, against own computations.

Campaigns `backbone-forces`, `backbone-preload` and `backbone-motions` of `campaigns`, for the joints of `backbone_band`.

- `backbone-forces`: at four amplitudes the backbone states a force at the output. (a) `solve_balance`, a harmonic
balance that shares no code with the package (real harmonics of the slide, laws stepped in time, Jacobian by differences),
computes the force again; rigid friction has none. (b) A stepped sine: `backbone_band.march_steady` drives the joint with
this force and steps the frequency until the output lags the force by 90 degrees; the row is the amplitude there, whose
error is that of the force times the slope of the curve, and whose doubt is the remaining transient and the resolution
of the march.

- `backbone-preload`: frequency and damping ratio of the backbone at four amplitudes for 80, 100 and 120 % of the load,
in one call with `over`, against `solve_balance` with a negative damping of all coordinates.

- `backbone-motions`: the band of the default methods at four amplitudes against the motion that defines the curve, by
`solve_balance` with a negative damping of all coordinates; value and error are the middle and the half-width of the band.

Recipe, written before the first run: seeds 59000 to 59039 for the forces, 59100 to 59109 for the preload (with
elastic-plastic, Iwan, Bouc-Wen, LuGre and tanh joints); none of them was used before.
"""

from pathlib import Path
from time import process_time
from typing import NamedTuple

import numpy as np
from backbone_band import (
    LAWS,
    Joint,
    band_rows,
    compute_backbone,
    draw_joint,
    law_parameters,
    march_steady,
    scene_of_joint,
    step_law,
)
from campaigns import Row
from numba import njit
from scipy.optimize import root

import patchfem as pf

FRACTIONS = (0.35, 0.55, 0.7, 0.85)  # places of the amplitudes in the logarithmic default range
N_HARMONICS = 31  # largest odd harmonic of the own balance
N_SAMPLES = 4096  # of a cycle; twice as many give the doubt
MARCH_DOUBT = 3e-4  # relative: steps of the march, and the change at which it counts as steady
MAX_CYCLES = 200  # laws with a memory need many cycles in micro-slip
MAX_DAMPING = 0.4  # larger damping ratios are not compared
N_FREQUENCY_STEPS = 6  # secant steps of the stepped sine


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


def step_to_phase_resonance(joint: Joint, force: float, frequency: float, amplitude: float):
    """Return the amplitude [m] of the stepped sine whose output lags the force by 90 degrees, and its doubt; or None."""
    # `march_steady` returns sqrt(omega^2 + Re(F conj X)/(m Z^2)), which is the drive's frequency in phase resonance
    points = []
    driven = [frequency, frequency * 1.002]
    for here in driven:
        points.append(march_steady(joint, force, here, amplitude))
    for _ in range(N_FREQUENCY_STEPS):
        mismatch = [point.frequency - here for point, here in zip(points[-2:], driven[-2:])]
        if abs(mismatch[1]) < 1e-5 * frequency or mismatch[0] == mismatch[1]:
            break
        step = mismatch[1] * (driven[-1] - driven[-2]) / (mismatch[1] - mismatch[0])
        driven.append(driven[-1] - float(np.clip(step, -0.05 * frequency, 0.05 * frequency)))
        points.append(march_steady(joint, force, driven[-1], points[-1].amplitude))
    if abs(points[-1].frequency - driven[-1]) > 1e-3 * frequency:
        return None
    doubt = MARCH_DOUBT + points[-1].damping_doubt / max(abs(points[-1].damping), 1e-9)
    return points[-1].amplitude, doubt * amplitude


def build_model(joint: Joint):
    """Return the Model of a joint."""
    drive = {"kind": "force", "frequency": 100.0, "force": 1.0, "cycles": 9}
    return pf.build(scene_of_joint(joint) | {"drive": drive})


def compare_force(seed: int, folder: Path, earlier: dict | None = None) -> dict:
    """Compare the forces of a joint with the own balance and with a stepped sine."""
    joint = draw_joint(seed)
    begin = process_time()
    curves = pf.backbone(scene_of_joint(joint), mode="mode1", method="balance")
    line = {"law": joint.law, "modes": joint.omega.size, "seconds": process_time() - begin}
    rows = []
    if "balance_amplitude" not in curves:
        return line | {"rows": [], "refused": str(curves.attrs)[:200]}
    size = curves.balance_amplitude.size
    for place in (int(part * (size - 1)) for part in FRACTIONS):
        names = ("amplitude", "frequency", "damping", "force", "force_error")
        point = {name: float(curves[f"balance_{name}"][place]) for name in names}
        if not np.isfinite(point["force"]) or point["damping"] > MAX_DAMPING:
            continue
        rows += _compare_point(joint, point, curves, place)
    return line | {"rows": rows}


def _compare_point(joint: Joint, point: dict, curves, place: int) -> list[Row]:
    """Return the rows of one amplitude."""
    rows = []
    guess = Balance(point["frequency"], point["force"])
    if joint.law != "coulomb":
        known = [
            solve_balance(joint, point["amplitude"], guess, is_forced=True, samples=samples)
            for samples in (N_SAMPLES, 2 * N_SAMPLES)
        ]
        if None not in known:
            doubt = 2 * abs(known[1].strength - known[0].strength)
            rows.append(
                Row("force", point["force"], point["force_error"], 0.0, known[1].strength, doubt)
            )
    stepped = step_to_phase_resonance(joint, point["force"], point["frequency"], point["amplitude"])
    if stepped is not None:
        forces = np.log(curves.balance_force.values)
        slope = np.gradient(np.log(curves.balance_amplitude.values), forces)[place]
        error = abs(slope) * point["force_error"] / point["force"] * point["amplitude"]
        amplitude, doubt = stepped
        doubt *= max(abs(slope), 1.0)
        rows.append(Row("stepped_amplitude", point["amplitude"], error, 0.0, amplitude, doubt))
    return rows


def compare_motions(seed: int, folder: Path, earlier: dict | None = None) -> dict:
    """Compare the band of frequency and damping ratio with the motions that define the curve."""
    joint = draw_elastic_joint(seed)
    begin = process_time()
    backbone = compute_backbone(build_model(joint), "mode1")
    line = {"law": joint.law, "modes": joint.omega.size, "seconds": process_time() - begin}
    if "balance" not in backbone.curves:
        return line | {"rows": [], "refused": str(backbone.missing)}
    curve = backbone.curves["balance"]
    points = []
    for place in (int(part * (curve.amplitude.size - 1)) for part in FRACTIONS):
        guess = Balance(float(curve.frequency[place]), float(curve.damping[place]))
        amplitude = float(curve.amplitude[place])
        known = find_free_motion(joint, amplitude, guess)
        if known is not None:
            coarse, fine = known
            doubts = (2 * abs(one - other) for one, other in zip(fine, coarse))
            points.append((amplitude, *fine, *doubts))
    return line | {"rows": band_rows(backbone.band, "motion", points)}


def draw_elastic_joint(seed: int) -> Joint:
    """Draw the joint of a seed; an elastic-plastic one takes the place of one with rigid friction."""
    joint = draw_joint(seed)
    if joint.law != "coulomb":
        return joint
    joint = draw_joint(seed + 6000)._replace(law="elastic-plastic")
    slip = joint.static * joint.load / (0.3 * joint.mass * joint.omega[0] ** 2)
    return joint._replace(numbers={"bond_length": float(slip)})


def find_free_motion(joint: Joint, amplitude: float, guess: "Balance") -> list | None:
    """Return the free motion at an amplitude with N_SAMPLES and twice as many; None if a balance finds none."""
    if guess.strength > MAX_DAMPING:
        return None
    known = [
        solve_balance(joint, amplitude, guess, is_forced=False, samples=samples)
        for samples in (N_SAMPLES, 2 * N_SAMPLES)
    ]
    return None if None in known else known


def compare_preload(seed: int, folder: Path, earlier: dict | None = None) -> dict:
    """Compare frequency and damping ratio at three preloads with the own balance."""
    joint = draw_elastic_joint(seed)
    begin = process_time()
    loads = [part * joint.load for part in (0.8, 1.0, 1.2)]
    curves = pf.backbone(
        scene_of_joint(joint), mode="mode1", method="balance", over={"normal.load": loads}
    )
    line = {"law": joint.law, "modes": joint.omega.size, "seconds": process_time() - begin}
    rows = []
    size = curves.balance_amplitude.size
    for place in (int(part * (size - 1)) for part in FRACTIONS):
        for case, load in enumerate(loads):
            rows += _compare_preload_point(joint._replace(load=load), curves, (case, place))
    return line | {"rows": rows}


def _compare_preload_point(joint: Joint, curves, at: tuple[int, int]) -> list[Row]:
    """Return the rows of one amplitude at one preload."""
    amplitude = float(curves.balance_amplitude[at[1]])
    frequency, damping = (float(curves[f"balance_{name}"][at]) for name in ("frequency", "damping"))
    known = None
    if np.isfinite(frequency):
        known = find_free_motion(joint, amplitude, Balance(frequency, damping))
    if known is None:
        return []
    rows = []
    for name, value, truths in (
        ("frequency", frequency, [one.frequency for one in known]),
        ("damping", damping, [one.strength for one in known]),
    ):
        error = float(curves[f"balance_{name}_error"][at])
        doubt = 2 * abs(truths[1] - truths[0])
        rows.append(Row(f"preload_{name}", value, error, 0.0, truths[1], doubt))
    return rows
