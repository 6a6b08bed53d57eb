"""Peaks of curves of steady motions hold within their bars: random rigs and structures against sines one by one.

Each reference is the largest of the same scene's motions under sines, found by the golden section over the frequency;
that of a structure without friction is its frequency response. The seeds from 71_000_000 on were drawn for no other use.
"""

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

import patchfem as pf

LAWS = ("none", "coulomb", "elastic-plastic", "chain", "iwan", "bouc-wen")
FIRST, COUNT = 71_000_000, 30
MAIN = ("relative_displacement_amplitude", "absolute_acceleration_peak", "friction_force_peak", "loop_area",
        "slip_amplitude", "equivalent_stiffness", "equivalent_damping")


def wide(r, low, high):
    return float(np.exp(r.uniform(np.log(low), np.log(high))))


def scene(seed: int) -> tuple:
    """(law, text without a drive, low and high end of the sweep [Hz], force [N]) of a random rig of 1 to 3 modes under
    a force, or of a chain of three masses of which the last one rubs."""
    r, law = np.random.default_rng(seed), LAWS[seed % len(LAWS)]
    own, mass, force, damping = wide(r, 60, 300), wide(r, 0.2, 2), wide(r, 0.5, 50), wide(r, 2e-3, 2e-2)
    reach = force / (mass * (2 * np.pi * own)**2 * 2 * damping)
    limit, slips = force * wide(r, 0.05, 3.0), f"{reach * wide(r, 0.003, 0.3)!r} m"
    if law == "chain":
        k = mass * (2 * np.pi * own)**2
        masses = ", ".join(f'"{mass * r.uniform(0.3, 2)!r} kg"' for _ in range(3))
        text = f"[structure]\nmasses = [{masses}]\n"
        for a, b in ((1, 2), (2, 3), (3, 0)):
            stiff = k * r.uniform(0.5, 2)
            text += f'[[structure.spring]]\nbetween = [{a}, {b}]\nstiffness = "{stiff!r} N/m"\n' \
                f'[[structure.damper]]\nbetween = [{a}, {b}]\ncoefficient = "{damping * stiff / (2 * own)!r} N s/m"\n'
        text += f'[[structure.interface]]\nbetween = [3, 0]\nlaw = "elastic-plastic"\nstatic = 0.3\n' \
            f'load = "{limit / 0.3!r} N"\nbond_length = "{slips}"\n'
        return law, text, 0.15 * own, 1.2 * own, f'force = "{force!r} N"\nmass = 1\n'
    text = f'[structure]\nmoving_mass = "{mass!r} kg"\n'
    for n in range(int(r.integers(1, 4))):
        text += f'[[structure.mode]]\nname = "m{n}"\nfrequency = "{own * (1 + 0.4 * n * r.uniform(0.5, 1.5))!r} Hz"\n' \
            f"damping = {damping!r}\nslide = {1.0 if n == 0 else r.uniform(-1, 1)!r}\n" \
            f"output = {1.0 if n == 0 else r.uniform(-1, 1)!r}\n" + "base = 1.0\n" * (n == 0)
    if law != "none":
        stiff = f'stiffness = "{limit / reach * wide(r, 1, 30)!r} N/m"\n'
        keys = {"coulomb": "", "elastic-plastic": f'bond_length = "{slips}"\n', "bouc-wen": stiff,
                "iwan": stiff + "chi = -0.5\nbeta = 0.5\n"}[law]
        text += f'[normal]\nload = "{limit / 0.3!r} N"\n[friction]\nlaw = "{law}"\nstatic = 0.3\n{keys}'
    return law, text, 0.7 * own, 2.0 * own, f'force = "{force!r} N"\n'


def swept(seed: int, tolerance: float = 1e-2):
    """(Result of the curve, function frequency [Hz] -> Result of the sine there) of a random scene."""
    law, text, low, high, force = scene(seed)
    how = '[accuracy]\nmethod = "harmonic"\ntolerance = {}\n'
    fine = how.format(1e-4 if law in ("iwan", "bouc-wen") else tolerance)
    curve = pf.run(f'{text}[drive]\nkind = "force"\n{force}waveform = "sweep"\nfrom = "{low!r} Hz"\nto = "{high!r} Hz"\n'
                   f'rate = "1 Hz/s"\n{how.format(tolerance)}')
    return curve, lambda f: pf.run(f'{text}[drive]\nkind = "force"\n{force}frequency = "{f!r} Hz"\ncycles = 2\n{fine}')


def largest(at, curve) -> float:
    """Frequency [Hz] of the largest amplitude of sines, from the highest of 9 even places about that of the curve."""
    f = curve.extra["curve"]["frequency"]
    span = 0.01 * (f.max() - f.min())

    def height(x):
        return -at(float(x)).measures[MAIN[0]].value
    places = np.clip(curve.measures["peak_frequency"].value + np.linspace(-span, span, 9), f.min(), f.max())
    k = int(np.argmin([height(x) for x in places]))
    ends = places[max(k - 1, 0)], places[min(k + 1, 8)]
    return float(minimize_scalar(height, bounds=ends, method="bounded", options={"xatol": 1e-8 * ends[1]}).x)


def outside(seed: int) -> list:
    """Names of the measures whose truth lies outside, of those that are compared: [(name, errors away)], (name, within)
    for all."""
    curve, at = swept(seed)
    place = largest(at, curve)
    true, mine, out = at(place).measures, curve.measures, []
    peak = mine["peak_frequency"]
    out.append(("peak_frequency", abs(peak.value - place) / (peak.error + 2e-7 * place)))
    for name in MAIN:
        if name in mine and mine[name].value is not None and true[name].value is not None:
            gap = abs(mine[name].value - true[name].value)
            out.append((name, gap / max(mine[name].error + true[name].error + 1e-9 * abs(mine[name].value), 1e-15)))
    return out
