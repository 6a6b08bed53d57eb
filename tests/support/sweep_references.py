"""Random sweeps of a mode with one sliding point, and their measures by an independent program.

The program shares nothing with patchfem. It integrates the equations of motion by the classical Runge-Kutta method with
equal steps. A step ends at a reversal, at a release, at yield or where a loop closes, so that no step contains a kink.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

import patchfem as pf
from patchfem.api import get_base_scene
from patchfem.scene import format_assignments

LAWS = ("coulomb", "kinetic", "tanh", "elastic-plastic", "iwan", "bouc-wen", "lugre")
COULOMB, TANH, PLASTIC, IWAN, BOUC_WEN, LUGRE = range(6)
CODES = dict(zip(LAWS, (COULOMB, COULOMB, TANH, PLASTIC, IWAN, BOUC_WEN, LUGRE)))
STEPS = (600, 1200)  # per cycle; the difference of both runs is the doubt of a reference
STIFF_FACTOR = (
    5  # more steps for the law tanh, whose force is steep where the velocity changes its sign
)
MEASURES = (
    "relative_displacement_amplitude",
    "absolute_acceleration_peak",
    "friction_force_peak",
    "loop_area",
    "equivalent_stiffness",
    "friction_work",
    "absolute_acceleration_fundamental",
)


class Sweep(NamedTuple):
    """Sweep of 48 cases.

    - models: patchfem models (48,)
    - numbers: SI values by name of each case, and the code of the law
    """

    models: list
    numbers: list[dict]


def draw_sweep(law: str, seed: int) -> Sweep:
    """Draw a sweep of 8 levels or loads times 6 frequencies, stiffnesses or bond lengths."""
    r = np.random.default_rng([seed, LAWS.index(law)])
    frequency, mass = r.uniform(40, 250), r.uniform(0.5, 1.5)
    omega = 2 * np.pi * frequency
    static, load = r.uniform(0.2, 0.5), 10 ** r.uniform(1.2, 1.8)
    force = r.uniform(1.2, 4) * static * load
    stiffness = 10 ** r.uniform(-0.5, 0.8) * mass * omega**2
    speed = 10 ** r.uniform(-2, -0.7) * force / mass / omega
    one = {
        "law": law, "f": frequency, "zeta": 10 ** r.uniform(-2.3, -1.4), "m": mass,
        "slide": r.uniform(0.6, 1.2), "base": r.uniform(0.6, 1), "output": r.uniform(0.5, 1.4),
        "mu": static, "mu_k": static * r.uniform(0.6, 0.95), "N": load, "k": stiffness, "speed": speed,
        "n": r.uniform(1, 3), "s": r.uniform(0.5, 1), "chi": r.uniform(-0.8, 0), "beta": float(r.choice([0, 0.5, 2])),
        "cycles": int(r.choice([50, 80, 120])), "drive": str(r.choice(["base", "force"])),
        "f_drive": frequency * r.uniform(0.9, 1.1),
    }  # fmt: skip
    one["level"] = force / mass if one["drive"] == "base" else force
    first = "level" if r.random() < 0.6 else "N"
    second = "f_drive" if CODES[law] in (COULOMB, TANH) or r.random() < 0.5 else "k"
    grid = [
        one | {first: one[first] * a, second: one[second] * b}
        for a in np.geomspace(0.4, 2.5, 8)
        for b in (np.linspace(0.85, 1.2, 6) if second == "f_drive" else np.geomspace(0.3, 3, 6))
    ]
    base = get_base_scene(pf.load(write_scene(grid[0])))
    key = "drive.acceleration" if one["drive"] == "base" else "drive.force"
    names = {
        "level": key,
        "N": "normal.load",
        "f_drive": "drive.frequency",
        "k": "friction.stiffness",
    }
    models = []
    for case in grid:
        sets = {names[name]: float(case[name]) for name in (first, second)}
        if law == "elastic-plastic":
            sets.pop("friction.stiffness", None)
            sets["friction.bond_length"] = case["mu"] * case["N"] / case["k"]
        models.append(pf.build(base.override(format_assignments(sets))))
    return Sweep(models, grid)


def write_scene(one: dict) -> str:
    """Return the scene of a case."""
    own = {
        "kinetic": f"kinetic = {one['mu_k']!r}",
        "tanh": f'reference_speed = "{one["speed"]!r} m/s"',
        "elastic-plastic": f'bond_length = "{one["mu"] * one["N"] / one["k"]!r} m"',
        "iwan": f'stiffness = "{one["k"]!r} N/m"\nchi = {one["chi"]!r}\nbeta = {one["beta"]!r}',
        "bouc-wen": f'stiffness = "{one["k"]!r} N/m"\nexponent = {one["n"]!r}\nshape = {one["s"]!r}',
        "lugre": f'stiffness = "{one["k"]!r} N/m"\nkinetic = {one["mu_k"]!r}\nstribeck_speed = "{one["speed"]!r} m/s"',
    }
    level = 'acceleration = "{!r} m/s^2"' if one["drive"] == "base" else 'force = "{!r} N"'
    text = f"""[normal]
load = "{one["N"]!r} N"
[friction]
law = "{"coulomb" if one["law"] == "kinetic" else one["law"]}"
static = {one["mu"]!r}
{own.get(one["law"], "")}
[structure]
moving_mass = "{one["m"]!r} kg"
[[structure.mode]]
name = "a"
frequency = "{one["f"]!r} Hz"
damping = {one["zeta"]!r}
slide = {one["slide"]!r}
base = {one["base"]!r}
output = {one["output"]!r}
[drive]
kind = "{one["drive"]}"
frequency = "{one["f_drive"]!r} Hz"
{level.format(one["level"])}
cycles = {one["cycles"]}
"""
    return text.replace("np.float64(", "").replace(")", "")


def compute_references(one: dict) -> tuple[dict[str, float], dict[str, float]]:
    """Return the measures of a case by name, and twice their change between two numbers of steps."""
    factor = STIFF_FACTOR if one["law"] == "tanh" else 1
    coarse, fine = (dict(zip(MEASURES, _run(one, factor * steps))) for steps in STEPS)
    return fine, {name: 2 * abs(fine[name] - coarse[name]) for name in MEASURES}


def _run(one: dict, steps: int) -> np.ndarray:
    """Return the MEASURES of a case with a number of steps per cycle."""
    omega = 2 * np.pi * one["f"]
    is_base = one["drive"] == "base"
    push = -one["base"] * one["level"] if is_base else one["output"] * one["level"] / one["m"]
    limit = one["mu"] * one["N"]
    kinetic = one["mu_k"] * one["N"] if one["law"] in ("kinetic", "lugre") else limit
    rig = np.array([
        2 * one["zeta"] * omega, omega**2, one["slide"] * push, one["slide"] ** 2 / one["m"], 2 * np.pi * one["f_drive"],
        one["output"] / one["slide"], one["level"] if is_base else 0.0,
    ])  # fmt: skip
    # Segalman's relations between the four parameters of Iwan sliders
    chi, beta = one["chi"], one["beta"]
    ratio = beta + (chi + 1) / (chi + 2)
    end = limit * (1 + beta) / (one["k"] * ratio)
    density = limit * (chi + 1) / (end ** (chi + 2) * ratio)
    law = np.array(
        [
            limit,
            kinetic,
            one["k"],
            one["speed"],
            one["n"],
            one["s"],
            chi,
            density,
            limit / end * beta / ratio,
            end,
        ]
    )
    window = max(1, min(10, one["cycles"] // 10))
    return integrate(CODES[one["law"]], rig, law, one["cycles"], window, steps)


@njit
def iwan_curve(u, law):
    """Return the force of first loading of Iwan sliders at a displacement u >= 0."""
    chi, density, last, end = law[6], law[7], law[8], law[9]
    if u >= end:
        return law[0]
    part = density * u ** (chi + 2) / (chi + 2)
    return part + u * (density * (end ** (chi + 1) - u ** (chi + 1)) / (chi + 1) + last)


@njit
def find_force(code, t, y, rig, law, regime, turns):
    """Return the friction force; `regime` is the direction of slip, and `turns` are reversals of Iwan sliders."""
    if code == COULOMB:
        hold = (rig[2] * np.sin(rig[4] * t) - rig[1] * y[0]) / rig[3]
        return hold if regime == 0 else regime * law[1]
    if code == TANH:
        return law[0] * np.tanh(y[1] / law[3])
    if code == PLASTIC:
        return law[2] * y[2]
    if code == BOUC_WEN:
        return law[0] * y[2]
    if code == LUGRE:
        return law[2] * y[2]
    depth = int(turns[0, 0])
    if depth == 0:
        return np.sign(y[0]) * iwan_curve(abs(y[0]), law)
    start, force = turns[depth, 0], turns[depth, 1]
    return force + np.sign(y[0] - start) * 2 * iwan_curve(abs(y[0] - start) / 2, law)


@njit
def rates(code, t, y, rig, law, regime, turns, direction):
    """Return the derivatives of slide, velocity, state of the law, work and the integrals of the harmonics."""
    force = find_force(code, t, y, rig, law, regime, turns)
    x, v = y[0], y[1]
    out = np.zeros(8)
    sine, cosine = np.sin(rig[4] * t), np.cos(rig[4] * t)
    if not (code == COULOMB and regime == 0):
        out[0] = v
        out[1] = rig[2] * sine - rig[0] * v - rig[1] * x - rig[3] * force
    if code == PLASTIC and regime == 0:
        out[2] = v
    elif code == BOUC_WEN:
        z = y[2]
        shape = law[5] * np.sign(direction * z) + 1 - law[5]
        out[2] = v * law[2] / law[0] * (1 - abs(z) ** law[4] * shape)
    elif code == LUGRE:
        limit = law[1] + (law[0] - law[1]) * np.exp(-((v / law[3]) ** 2))
        out[2] = v - law[2] * direction * v * y[2] / limit
    out[3] = force * out[0]
    out[4], out[5], out[6], out[7] = x * cosine, x * sine, force * cosine, force * sine
    return out


@njit
def step(code, t, h, y, rig, law, regime, turns, direction):
    """Return the state after a step of the classical Runge-Kutta method."""
    a = rates(code, t, y, rig, law, regime, turns, direction)
    b = rates(code, t + h / 2, y + h / 2 * a, rig, law, regime, turns, direction)
    c = rates(code, t + h / 2, y + h / 2 * b, rig, law, regime, turns, direction)
    d = rates(code, t + h, y + h * c, rig, law, regime, turns, direction)
    return y + h / 6 * (a + 2 * b + 2 * c + d)


@njit
def margins(code, t, y, rig, law, regime, turns, direction):
    """Return what is positive as long as no event occurs: of the direction of motion, and of the law."""
    turn = direction * y[1]
    if code == COULOMB and regime == 0:
        return 1.0, law[0] - abs(find_force(code, t, y, rig, law, regime, turns))
    if code == PLASTIC and regime == 0:
        return turn, law[0] / law[2] - direction * y[2]
    if code == IWAN:
        depth = int(turns[0, 0])
        start = turns[depth, 0] if depth else 0.0
        length = abs(y[0] - start) / (2 if depth else 1)
        # A branch ends where it meets the branch from which it started, and has a kink where all sliders slip.
        goal = np.inf
        if depth > 1:
            goal = abs(turns[depth - 1, 0] - start) / 2
        elif depth == 1:
            goal = abs(start)
        kink = law[9] if length < law[9] and regime == 0 else np.inf
        return turn, min(goal, kink) - length
    return turn, 1.0


@njit
def parabola_peak(a, b, c):
    """Return the largest magnitude of the parabola through three equidistant values."""
    peak = max(abs(a), abs(c))
    bend, tilt = a - 2 * b + c, c - a
    if abs(tilt) < 2 * abs(bend):
        peak = max(peak, abs(b - tilt * tilt / (8 * bend)))
    return peak


@njit
def integrate(code, rig, law, cycles, window, steps):
    """Return the MEASURES of a motion from rest."""
    y = np.zeros(8)
    turns = np.zeros((4000, 2))
    regime, direction = 0.0, (1.0 if rig[2] > 0 else -1.0)
    h = 2 * np.pi / rig[4] / steps
    low, high, acceleration_peak, force_peak = np.inf, -np.inf, 0.0, 0.0
    first = np.zeros(8)
    first_x, first_v = 0.0, 0.0
    for count in range(cycles * steps):
        if count == (cycles - window) * steps:
            first, first_x, first_v = y.copy(), y[0], y[1]
            low = high = y[0]
        observes = count >= (cycles - window) * steps
        t, rest = count * h, h
        while rest > 0:
            # The step ends at the first event, found by bisection and secants.
            before = margins(code, t, y, rig, law, regime, turns, direction)
            size, end = rest, step(code, t, rest, y, rig, law, regime, turns, direction)
            after = margins(code, t + rest, end, rig, law, regime, turns, direction)
            event = -1
            for k in range(2):
                if after[k] < 0 and (before[k] > 0 or k == 0):
                    good, bad = 0.0, size
                    for _ in range(60):
                        middle = (good + bad) / 2
                        state = step(code, t, middle, y, rig, law, regime, turns, direction)
                        if (
                            margins(code, t + middle, state, rig, law, regime, turns, direction)[k]
                            < 0
                        ):
                            bad = middle
                        else:
                            good = middle
                        if bad - good <= 1e-14 * h:
                            break
                    if bad < size or event < 0:
                        size, event = bad, k
                        end = step(code, t, size, y, rig, law, regime, turns, direction)
            if observes:
                half = step(code, t, size / 2, y, rig, law, regime, turns, direction)
                values, forces = np.zeros(3), np.zeros(3)
                for k, state in enumerate((y, half, end)):
                    now = t + k * size / 2
                    forces[k] = find_force(code, now, state, rig, law, regime, turns)
                    rate = rates(code, now, state, rig, law, regime, turns, direction)[1]
                    values[k] = rig[5] * rate + rig[6] * np.sin(rig[4] * now)
                acceleration_peak = max(
                    acceleration_peak, parabola_peak(values[0], values[1], values[2])
                )
                # A parabola may exceed the limit of the law tanh.
                force = (
                    np.abs(forces).max()
                    if code == TANH
                    else parabola_peak(forces[0], forces[1], forces[2])
                )
                force_peak = max(force_peak, force)
                low, high = min(low, end[0]), max(high, end[0])
            t, rest, y = t + size, rest - size, end
            if event < 0:
                break

            # The law changes at the event.
            depth = int(turns[0, 0])
            if code == COULOMB and regime == 0:
                direction = np.sign(find_force(code, t, y, rig, law, regime, turns))
                regime = direction
            elif code == IWAN and event == 1:
                length = abs(y[0] - (turns[depth, 0] if depth else 0.0)) / (2 if depth else 1)
                goal = (
                    np.inf
                    if depth == 0
                    else abs((turns[depth - 1, 0] if depth > 1 else 0.0) - turns[depth, 0])
                )
                goal /= 2 if depth > 1 else 1
                if length >= goal:
                    turns[0, 0] = depth - 2 if depth > 1 else 0
                else:
                    regime = 1.0
            elif event == 1:
                regime = direction
            else:
                # Reversal of the motion
                force = find_force(code, t, y, rig, law, regime, turns)
                if code == COULOMB:
                    hold = (rig[2] * np.sin(rig[4] * t) - rig[1] * y[0]) / rig[3]
                    y[1] = 0.0
                    regime = 0.0 if abs(hold) <= law[0] else np.sign(hold)
                    direction = regime
                else:
                    direction = -direction
                    regime = 0.0
                    if code == IWAN:
                        turns[0, 0] = depth + 1
                        turns[depth + 1, 0], turns[depth + 1, 1] = y[0], force

    change = y - first
    span = window * 2 * np.pi / rig[4]
    slide = complex(change[4], -change[5])
    omega = rig[4]
    # Integral of the acceleration times exp(-i omega t), by parts
    total = (y[1] - first_v) + 1j * omega * ((y[0] - first_x) + 1j * omega * slide)
    total = rig[5] * total - 0.5j * span * rig[6]
    ratio = complex(change[6], -change[7]) / slide if abs(slide) > 0 else 0j
    return np.array([
        rig[5] * (high - low) / 2 if rig[5] > 0 else -rig[5] * (high - low) / 2, acceleration_peak, force_peak,
        change[3] / window, ratio.real, y[3], 2 / span * abs(total),
    ])  # fmt: skip
