"""Does a backbone of several modes tell where a marched steady motion resonates, and what it loses there?

Up to the square of its damping ratio zeta. Of seven rigs of seed 59, 21 amplitudes: where zeta is above .003, the
marched frequency differs from the backbone's by .1 to 1.1 zeta^2 where the base drives all modes, by .032 zeta^2 at
most where it drives the first alone; the damping ratio by 5.6 and 2.6 zeta^2 at most. Below .003, frequencies differ by
1.2e-6 and ratios by 6.4e-6 at most: the resonance is found to some 1e-6. A point of a backbone costs some .1 CPU
seconds, a marched resonance 11.

The recipe: the joints of `three_ways.py` in rigs of two or three modes, each 1.4 to 3.5 times as high as the one
before, with random slides, outputs and shares of the base motion. At LEVELS of the amplitudes of a balanced backbone
the base is driven as hard as the first mode would need; the frequency is moved until the base feeds no reactive power
(phase resonance: at a given level the amplitude is largest there, up to the square of the damping ratio). The march
runs until its amplitude holds. Beside the backbone, read at the marched amplitude, stand the marched frequency and
(loss in a cycle)/(2 pi m omega^2 Z^2), Z^2 the sum over the modes. What is left beyond both bars is no error of either:
the base drives the other modes too, and at its own frequency only, where the damping of a backbone drives every
harmonic.

Run: python studies/steady/swept_modes.py [COUNT] [SEED]
"""

import sys
from time import process_time

import numpy as np
from scipy.interpolate import CubicSpline, PchipInterpolator
from three_ways import LAWS, joint

import patchfem as pf

LEVELS, LONGEST, CLOSE, TURNS = (0.25, 0.5, 0.75), 20000, 1e-6, 12
AMPLITUDE, AREA = "relative_displacement_amplitude", "loop_area"
MODE = """[[structure.mode]]
name = "{name}"
frequency = "{frequency!r} Hz"
damping = {damping!r}
slide = {slide!r}
base = {base!r}
output = {output!r}
"""


def rigs(rng, kind: str) -> list:
    """(scene, (mass [kg], own omegas [rad/s], damping ratio, shares of the base (n,))) of one draw, its base driving
    all modes and the first alone."""
    text, _, (mass, omega, zeta) = joint(rng, kind)
    count = int(rng.integers(2, 4))
    omegas = omega * np.cumprod(np.append(1.0, rng.uniform(1.4, 3.5, count - 1)))
    base = rng.uniform(0.3, 1, count) * rng.choice([-1, 1], count)
    base /= 1.01 * np.linalg.norm(base)
    first = np.append(base[0], np.zeros(count - 1))
    slides, outputs = (np.append(1.0, rng.uniform(-1, 1, count - 1)) for _ in range(2))
    head, tail = text.split("[[structure.mode]]")
    out = []
    for shares in (base, first):
        modes = "".join(MODE.format(name=name, frequency=float(w / (2 * np.pi)), damping=float(zeta), slide=float(s),
                                    base=float(b), output=float(o))
                        for name, w, s, b, o in zip("abc", omegas, slides, shares, outputs))
        out.append((head + modes + "[drive]" + tail.split("[drive]")[1], (mass, omegas, zeta, shares)))
    return out


def steady(text: str, numbers, frequency: float, level: float, zeta: float):
    """(reactive over apparent power of the base, amplitude, its bar, damping ratio, its bar) of a marched motion;
    None where it does not settle."""
    mass, omegas, own, base = numbers
    cycles = max(100, int(3 / max(zeta, 1e-4)))
    while cycles <= LONGEST:
        found = pf.run(text, **{"drive.frequency": frequency, "drive.acceleration": level, "drive.cycles": cycles,
                                "accuracy.method": "march"})
        if found.outcome in ("steady", "stuck"):
            break
        cycles *= 2
    else:
        return None
    data = found.to_xarray()
    time = data["time"].values
    turns, end = CubicSpline(time, data["modal_coordinate"].values * np.exp(-2j * np.pi * frequency * time)[:, None]), \
        time[-1]
    first = 2 * frequency * turns.integrate(end - 1 / frequency, end)
    omega, fed = 2 * np.pi * frequency, np.sum(base * first)  # beside a base acceleration of the phase of a sine
    size, area = np.sum(np.abs(first)**2), found.measures[AREA]
    lost = area.value + np.pi * omega * np.sum(2 * own * omegas * mass * np.abs(first)**2)
    unit = 2 * np.pi * mass * omega**2 * size
    one = found.measures[AMPLITUDE]
    return fed.imag / abs(fed), one.value, one.error, lost / unit, \
        area.error / unit + 2 * lost / unit * one.error / one.value


def resonance(text: str, numbers, guess: float, level: float, zeta: float):
    """(frequency [Hz], what `steady` gives there); None where it is not found."""
    x, seen = [guess, guess * (1 + 0.3 * zeta)], []
    for step in range(TURNS):
        one = steady(text, numbers, x[step], level, zeta)
        if one is None:
            return None
        seen.append(one[0])
        if abs(one[0]) * zeta < CLOSE:
            return x[step], one
        if step:
            new = x[-1] - seen[-1] * (x[-1] - x[-2]) / (seen[-1] - seen[-2] or 1.0)
            x.append(float(np.clip(new, guess * (1 - 3 * zeta), guess * (1 + 3 * zeta))))
    return None


def beside(curve, text: str, numbers, k: int):
    """(damping ratio, relative differences of frequency and of damping (2,), over both bars (2,)) at the resonance near
    point k of a curve (5, n); None where none is found on the curve."""
    a, f, fe, z, ze = curve
    level = 2 * z[k] * (2 * np.pi * f[k])**2 * a[k] / abs(numbers[3][0])
    got = resonance(text, numbers, float(f[k]), float(level), float(z[k]))
    if got is None or not a[0] < got[1][1] < a[-1]:
        return None
    at, (_, amplitude, _, ratio, ratio_bar) = got
    here = [float(PchipInterpolator(np.log(a), part)(np.log(amplitude))) for part in (f, z)]
    bars = [float(np.interp(np.log(amplitude), np.log(a), part)) for part in (fe, ze)]
    off = np.array([at / here[0] - 1, ratio / here[1] - 1])
    return here[1], off, np.abs(off) / np.array([bars[0] / here[0], (bars[1] + ratio_bar) / here[1]])


def main(count: int = 7, seed: int = 59) -> list:
    """(law, level, which modes the base drives, damping ratio, differences of `beside`) of each, printed."""
    rng, rows = np.random.default_rng(seed), []
    for number in range(count):
        kind = LAWS[number % len(LAWS)]
        both, begin = rigs(rng, kind), process_time()
        found = pf.backbone(both[0][0], method="balance")
        took = process_time() - begin
        if "balance_amplitude" not in found.coords:
            print(number, kind, "no balanced backbone", flush=True)
            continue
        curve = np.array([found[f"balance_{name}"].values for name in
                          ("amplitude", "frequency", "frequency_error", "damping", "damping_error")])
        for place in LEVELS:
            for driven, one in zip(("all", "first"), both):
                begin, seen = process_time(), beside(curve, *one, int(place * (curve.shape[1] - 1)))
                if seen is None:
                    print(f"{number} {kind} {place} {driven}: no resonance on the backbone", flush=True)
                    continue
                zeta, off, bars = seen
                rows.append((kind, place, driven, *seen))
                print(f"{number} {kind} {place} {driven}: zeta {zeta:.3g}, over zeta^2: frequency "
                      f"{off[0] / zeta**2:+.2g}, damping {off[1] / zeta**2:+.2g}; {bars[0]:.2g}, {bars[1]:.2g} bars; "
                      f"{off[0]:+.1e}, {off[1]:+.1e}; {took:.1f}, {process_time() - begin:.1f} s", flush=True)
    return rows


if __name__ == "__main__":
    main(*map(int, sys.argv[1:3]))
