"""Peaks of frequency response curves of random rigs agree with separate sine runs within their
errors.

The reference is the largest response of sine runs of the same scene, found by a golden-section
search over the frequency. Seeds from 71_000_000 are used nowhere else.
"""

import numpy as np
import pytest
from motion_scenes import draw_log_uniform
from scipy.optimize import minimize_scalar

import patchfem as pf
from patchfem.scene import read_template

LAWS = ("none", "coulomb", "elastic-plastic", "chain", "iwan", "bouc-wen")
FIRST_SEED, SEED_COUNT = 71_000_000, 30
MAIN_MEASURES = (
    "relative_displacement_amplitude",
    "absolute_acceleration_peak",
    "friction_force_peak",
    "loop_area",
    "slip_amplitude",
    "equivalent_stiffness",
    "equivalent_damping",
)


def draw_scene(seed: int) -> tuple:
    """Return (law, text without a drive, low and high end of the sweep [Hz], force keys) of a
    random rig.

    The rig has 1 to 3 modes under a force, or is a chain of three masses with friction at the last
    mass.
    """
    r = np.random.default_rng(seed)
    law = LAWS[seed % len(LAWS)]
    frequency = draw_log_uniform(r, 60, 300)
    mass = draw_log_uniform(r, 0.2, 2)
    force = draw_log_uniform(r, 0.5, 50)
    damping = draw_log_uniform(r, 2e-3, 2e-2)
    reach = force / (mass * (2 * np.pi * frequency) ** 2 * 2 * damping)
    limit = force * draw_log_uniform(r, 0.05, 3.0)
    slips = f"{reach * draw_log_uniform(r, 0.003, 0.3)!r} m"
    if law == "chain":
        k = mass * (2 * np.pi * frequency) ** 2
        masses = ", ".join(f'"{mass * r.uniform(0.3, 2)!r} kg"' for _ in range(3))
        text = f"[structure]\nmasses = [{masses}]\n"
        for a, b in ((1, 2), (2, 3), (3, 0)):
            spring = k * r.uniform(0.5, 2)
            text += (
                f'[[structure.spring]]\nbetween = [{a}, {b}]\nstiffness = "{spring!r} N/m"\n'
                f'[[structure.damper]]\nbetween = [{a}, {b}]\ncoefficient = "{damping * spring / (2 * frequency)!r} N s/m"\n'
            )
        text += (
            f'[[structure.interface]]\nbetween = [3, 0]\nlaw = "elastic-plastic"\nstatic = 0.3\n'
            f'load = "{limit / 0.3!r} N"\nbond_length = "{slips}"\n'
        )
        return (
            law,
            text,
            0.15 * frequency,
            1.2 * frequency,
            f'force = "{force!r} N"\nmass = 1\n',
        )
    text = f'[structure]\nmoving_mass = "{mass!r} kg"\n'
    for n in range(int(r.integers(1, 4))):
        text += (
            f'[[structure.mode]]\nname = "m{n}"\nfrequency = "{frequency * (1 + 0.4 * n * r.uniform(0.5, 1.5))!r} Hz"\n'
            f"damping = {damping!r}\nslide = {1.0 if n == 0 else r.uniform(-1, 1)!r}\n"
            f"output = {1.0 if n == 0 else r.uniform(-1, 1)!r}\n" + "base = 1.0\n" * (n == 0)
        )
    if law != "none":
        spring = f'stiffness = "{limit / reach * draw_log_uniform(r, 1, 30)!r} N/m"\n'
        keys = {
            "coulomb": "",
            "elastic-plastic": f'bond_length = "{slips}"\n',
            "bouc-wen": spring,
            "iwan": spring + "chi = -0.5\nbeta = 0.5\n",
        }[law]
        text += (
            f'[normal]\nload = "{limit / 0.3!r} N"\n[friction]\nlaw = "{law}"\nstatic = 0.3\n{keys}'
        )
    return law, text, 0.7 * frequency, 2.0 * frequency, f'force = "{force!r} N"\n'


def compute_curve(seed: int, tolerance: float = 1e-2):
    """Return the curve of a random scene and a function of the frequency [Hz] that runs a sine."""
    law, text, low, high, force = draw_scene(seed)
    accuracy = '[accuracy]\nmethod = "harmonic"\ntolerance = {}\n'
    sine_accuracy = accuracy.format(1e-4 if law in ("iwan", "bouc-wen") else tolerance)
    text += f'[drive]\nkind = "force"\n{force}'
    curve = pf.run(
        f'{text}waveform = "sweep"\nfrom = "{low!r} Hz"\nto = "{high!r} Hz"\nrate = "1 Hz/s"\n'
        f"{accuracy.format(tolerance)}"
    )
    return curve, lambda f: pf.run(f'{text}frequency = "{f!r} Hz"\ncycles = 2\n{sine_accuracy}')


def peak_of_sine_runs(run_sine, curve) -> float:
    """Return the frequency [Hz] of the largest amplitude of sine runs, searched from the highest of
    9 equally spaced frequencies."""
    f = curve.extra["curve"]["frequency"]
    span = 0.01 * (f.max() - f.min())

    def height(x):
        return -run_sine(float(x)).measures[MAIN_MEASURES[0]].value

    places = np.clip(
        curve.measures["peak_frequency"].value + np.linspace(-span, span, 9), f.min(), f.max()
    )
    k = int(np.argmin([height(x) for x in places]))
    bounds = places[max(k - 1, 0)], places[min(k + 1, 8)]
    return float(
        minimize_scalar(
            height, bounds=bounds, method="bounded", options={"xatol": 1e-8 * bounds[1]}
        ).x
    )


def error_ratios(seed: int) -> list:
    """Return (name, true error over stated error) of the measures of a random scene."""
    curve, run_sine = compute_curve(seed)
    peak_frequency = peak_of_sine_runs(run_sine, curve)
    reference = run_sine(peak_frequency).measures
    measures = curve.measures
    ratios = []
    peak = measures["peak_frequency"]
    ratios.append(
        ("peak_frequency", abs(peak.value - peak_frequency) / (peak.error + 2e-7 * peak_frequency))
    )
    for name in MAIN_MEASURES:
        if (
            name in measures
            and measures[name].value is not None
            and reference[name].value is not None
        ):
            difference = abs(measures[name].value - reference[name].value)
            ratios.append(
                (
                    name,
                    difference
                    / max(
                        measures[name].error
                        + reference[name].error
                        + 1e-9 * abs(measures[name].value),
                        1e-15,
                    ),
                )
            )
    return ratios


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(FIRST_SEED, FIRST_SEED + SEED_COUNT))
def test_always_peak_of_random_rig_is_within_errors(seed):
    """The peak of the curve agrees with sine runs within its errors. The largest ratio of true to
    stated error was 0.34 (Iwan law), the median 0.004."""
    assert [ratio for ratio in error_ratios(seed) if ratio[1] > 1] == []


def test_exact_peak_of_stuck_damper_agrees_with_receptance():
    """Under a normal load of 100 kN the damper template sticks; the peak of its curve agrees with
    the receptance of the bonded structure."""
    text = read_template("damper")
    single_scene = text[: text.index("\n[sweep]")] + text[text.index("\n[accuracy]") :]
    measures = pf.run(single_scene, **{"structure.interface[1].load": "100 kN"}).measures
    mass = np.diag([0.15, 0.25])
    damping = np.array([[2.0, -2], [-2, 12]])
    stiffness = np.array([[1e6, -1e6], [-1e6, 6e6 + 70e6]])

    def height(f):
        w = 2 * np.pi * f
        return -20 * abs(np.linalg.inv(stiffness - w**2 * mass + 1j * w * damping)[0, 0])

    reference = minimize_scalar(
        height, bounds=(405, 415), method="bounded", options={"xatol": 1e-10}
    )
    amplitude = measures[MAIN_MEASURES[0]]
    frequency = measures["peak_frequency"]
    assert abs(amplitude.value + reference.fun) <= amplitude.error < 1e-6 * amplitude.value
    assert abs(frequency.value - reference.x) <= frequency.error < 1e-2
