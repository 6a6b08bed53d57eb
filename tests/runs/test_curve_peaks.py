"""Peaks of curves of steady motions hold within their bars: random rigs and structures against sines one by one.

Each reference is the largest of the same scene's motions under sines, found by the golden section over the
frequency. The seeds from 71_000_000 on were drawn for no other use.
"""

import numpy as np
import pytest
from motion_scenes import draw_log_uniform
from scipy.optimize import minimize_scalar

import patchfem as pf
from patchfem.scene import read_template

LAWS = ("none", "coulomb", "elastic-plastic", "chain", "iwan", "bouc-wen")
FIRST, COUNT = 71_000_000, 30
MAIN = (
    "relative_displacement_amplitude",
    "absolute_acceleration_peak",
    "friction_force_peak",
    "loop_area",
    "slip_amplitude",
    "equivalent_stiffness",
    "equivalent_damping",
)


def scene(seed: int) -> tuple:
    """(law, text without a drive, low and high end of the sweep [Hz], force [N]) of a random rig of 1 to 3 modes under
    a force, or of a chain of three masses of which the last one rubs."""
    r = np.random.default_rng(seed)
    law = LAWS[seed % len(LAWS)]
    own = draw_log_uniform(r, 60, 300)
    mass = draw_log_uniform(r, 0.2, 2)
    force = draw_log_uniform(r, 0.5, 50)
    damping = draw_log_uniform(r, 2e-3, 2e-2)
    reach = force / (mass * (2 * np.pi * own) ** 2 * 2 * damping)
    limit = force * draw_log_uniform(r, 0.05, 3.0)
    slips = f"{reach * draw_log_uniform(r, 0.003, 0.3)!r} m"
    if law == "chain":
        k = mass * (2 * np.pi * own) ** 2
        masses = ", ".join(f'"{mass * r.uniform(0.3, 2)!r} kg"' for _ in range(3))
        text = f"[structure]\nmasses = [{masses}]\n"
        for a, b in ((1, 2), (2, 3), (3, 0)):
            stiff = k * r.uniform(0.5, 2)
            text += (
                f'[[structure.spring]]\nbetween = [{a}, {b}]\nstiffness = "{stiff!r} N/m"\n'
                f'[[structure.damper]]\nbetween = [{a}, {b}]\ncoefficient = "{damping * stiff / (2 * own)!r} N s/m"\n'
            )
        text += (
            f'[[structure.interface]]\nbetween = [3, 0]\nlaw = "elastic-plastic"\nstatic = 0.3\n'
            f'load = "{limit / 0.3!r} N"\nbond_length = "{slips}"\n'
        )
        return law, text, 0.15 * own, 1.2 * own, f'force = "{force!r} N"\nmass = 1\n'
    text = f'[structure]\nmoving_mass = "{mass!r} kg"\n'
    for n in range(int(r.integers(1, 4))):
        text += (
            f'[[structure.mode]]\nname = "m{n}"\nfrequency = "{own * (1 + 0.4 * n * r.uniform(0.5, 1.5))!r} Hz"\n'
            f"damping = {damping!r}\nslide = {1.0 if n == 0 else r.uniform(-1, 1)!r}\n"
            f"output = {1.0 if n == 0 else r.uniform(-1, 1)!r}\n" + "base = 1.0\n" * (n == 0)
        )
    if law != "none":
        stiff = f'stiffness = "{limit / reach * draw_log_uniform(r, 1, 30)!r} N/m"\n'
        keys = {
            "coulomb": "",
            "elastic-plastic": f'bond_length = "{slips}"\n',
            "bouc-wen": stiff,
            "iwan": stiff + "chi = -0.5\nbeta = 0.5\n",
        }[law]
        text += (
            f'[normal]\nload = "{limit / 0.3!r} N"\n[friction]\nlaw = "{law}"\nstatic = 0.3\n{keys}'
        )
    return law, text, 0.7 * own, 2.0 * own, f'force = "{force!r} N"\n'


def swept(seed: int, tolerance: float = 1e-2):
    """(Result of the curve, function frequency [Hz] -> Result of the sine there) of a random scene."""
    law, text, low, high, force = scene(seed)
    how = '[accuracy]\nmethod = "harmonic"\ntolerance = {}\n'
    fine = how.format(1e-4 if law in ("iwan", "bouc-wen") else tolerance)
    text += f'[drive]\nkind = "force"\n{force}'
    curve = pf.run(
        f'{text}waveform = "sweep"\nfrom = "{low!r} Hz"\nto = "{high!r} Hz"\nrate = "1 Hz/s"\n'
        f"{how.format(tolerance)}"
    )
    return curve, lambda f: pf.run(f'{text}frequency = "{f!r} Hz"\ncycles = 2\n{fine}')


def largest(at, curve) -> float:
    """Frequency [Hz] of the largest amplitude of sines, from the highest of 9 even places about that of the curve."""
    f = curve.extra["curve"]["frequency"]
    span = 0.01 * (f.max() - f.min())

    def height(x):
        return -at(float(x)).measures[MAIN[0]].value

    places = np.clip(
        curve.measures["peak_frequency"].value + np.linspace(-span, span, 9), f.min(), f.max()
    )
    k = int(np.argmin([height(x) for x in places]))
    ends = places[max(k - 1, 0)], places[min(k + 1, 8)]
    return float(
        minimize_scalar(height, bounds=ends, method="bounded", options={"xatol": 1e-8 * ends[1]}).x
    )


def outside(seed: int) -> list:
    """(name, error over its bar) of the measures of a random scene."""
    curve, at = swept(seed)
    place = largest(at, curve)
    true = at(place).measures
    mine = curve.measures
    out = []
    peak = mine["peak_frequency"]
    out.append(("peak_frequency", abs(peak.value - place) / (peak.error + 2e-7 * place)))
    for name in MAIN:
        if name in mine and mine[name].value is not None and true[name].value is not None:
            gap = abs(mine[name].value - true[name].value)
            out.append(
                (
                    name,
                    gap
                    / max(
                        mine[name].error + true[name].error + 1e-9 * abs(mine[name].value), 1e-15
                    ),
                )
            )
    return out


@pytest.mark.share(1, 5)
@pytest.mark.parametrize("seed", range(FIRST, FIRST + COUNT))
def test_always_the_peak_of_a_random_rig_is_within_its_bars(seed):
    """Largest error over its bar seen: .34, of an Iwan balance; the median is .004, as a smooth peak is bracketed."""
    assert [one for one in outside(seed) if one[1] > 1] == []


def test_exact_the_curve_of_a_stuck_interface_has_the_peak_of_the_bonded_structure():
    """patchfem new damper under 100 kN: the platform stays on its spring, and the force meets one receptance."""
    text = read_template("damper")
    one = text[: text.index("\n[sweep]")] + text[text.index("\n[accuracy]") :]
    found = pf.run(one, **{"structure.interface[1].load": "100 kN"}).measures
    mass = np.diag([0.15, 0.25])
    damp = np.array([[2.0, -2], [-2, 12]])
    stiff = np.array([[1e6, -1e6], [-1e6, 6e6 + 70e6]])

    def height(f):
        w = 2 * np.pi * f
        return -20 * abs(np.linalg.inv(stiff - w**2 * mass + 1j * w * damp)[0, 0])

    true = minimize_scalar(height, bounds=(405, 415), method="bounded", options={"xatol": 1e-10})
    size = found[MAIN[0]]
    place = found["peak_frequency"]
    assert abs(size.value + true.fun) <= size.error < 1e-6 * size.value
    assert abs(place.value - true.x) <= place.error < 1e-2


def settles(seed: int) -> tuple | None:
    """(amplitude at the end of a run of 40 to 250 cycles, its steady estimate or None, that of the motion that repeats)
    of a random rig that is steady to 1 %; None of one that is not."""
    law, text, low, _, force = scene(seed)
    r = np.random.default_rng(seed + 1)
    f = low / 0.15 * r.uniform(0.4, 0.7) if law == "chain" else low / 0.7 * r.uniform(0.9, 1.1)
    text += f'[drive]\nkind = "force"\n{force}frequency = "{f!r} Hz"\ncycles = {int(r.integers(40, 250))}\n'
    run = pf.run(text + "[accuracy]\ntolerance = 1e-2\n")
    steady = pf.run(text + '[accuracy]\ntolerance = 1e-4\nmethod = "harmonic"\n')
    if (run.outcome, steady.outcome) != ("steady", "steady"):
        return None
    return run.measures[MAIN[0]], run.measures.get(f"{MAIN[0]}_steady"), steady.measures[MAIN[0]]


@pytest.mark.share(0, 1)
@pytest.mark.parametrize(
    "seeds", [(73_000_045,), (73_000_047,), tuple(range(73_000_000, 73_000_070))]
)
def test_always_the_steady_amplitude_of_a_run_holds_that_of_the_harmonic_balance(seeds):
    """Of 25 held-out runs that were steady, 18 ended outside the bar of their last window, one by 1.3 %; of the 19
    estimates 18 hold."""
    told = []
    for seed in seeds:
        if LAWS[seed % len(LAWS)] in ("none", "iwan") or (one := settles(seed)) is None:
            continue
        last, steady, truth = one
        if steady is None:
            assert (
                abs(last.value - truth.value) <= last.error + truth.error + 0.02 * 0.01 * last.value
            )
        else:
            told.append(abs(steady.value - truth.value) <= steady.error + truth.error)
    assert np.mean(told or [1]) >= (0.9 if len(told) > 9 else 1)
