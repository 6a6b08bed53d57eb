"""Hard cases of dry friction as scenes, through every engine that applies, against closed forms and other programs."""

from functools import lru_cache
from math import asin, cos, pi, sin

import numpy as np
import pytest
from scene_texts import PIECE
from scipy.optimize import brentq

from patchfem.core import Missing, PatchfemError
from patchfem.runs.run import run
from patchfem.scene import loads

W = 2 * pi * 100  # rad/s, of 1 kg
LOAD = 100.0


def rig(friction, drive, damping=0.003, frequency=100.0, more="", law="coulomb"):
    """One mode of 1 kg under 100 N; friction: keys of [friction]; drive: keys of [drive]."""
    return f"""\
[structure]
moving_mass = "1 kg"
{more if more.startswith("travel") else ""}
[[structure.mode]]
name = "axial"
frequency = "{frequency} Hz"
damping = {damping}
slide = 1.0
{more if not more.startswith("travel") else ""}
[normal]
load = "{LOAD} N"
[friction]
law = "{law}"
{friction}
[drive]
{drive}
"""


def base(acceleration, cycles, ratio=1.0):
    return (
        f'kind = "base"\nfrequency = "{100 * ratio!r} Hz"\nacceleration = "{acceleration!r} m/s^2"\n'
        f"cycles = {cycles}"
    )


@lru_cache(maxsize=64)
def result_of(text, *sets, estimate=True):
    return run(loads(text, "a.toml", sets), estimate=estimate)


def value(result, name="relative_displacement_amplitude"):
    return result.measures[name].value


def close(result, name, want, least=0.0):
    """Whether a measure lies within its own error of the truth."""
    one = result.measures[name]
    assert abs(one.value - want) <= one.error + least, (name, one.value, want, one.error)


def balanced(result, bound):
    assert value(result, "energy_balance") <= bound


SECOND = '[[structure.mode]]\nname = "other"\nfrequency = "271 Hz"\ndamping = 0.01\nslide = 0.0\nbase = 0.0\n'


@pytest.mark.parametrize("more", ["", SECOND], ids=["one mode", "general"])
@pytest.mark.parametrize("power", range(4, 11))
def test_exact_grazing_onset(power, more):
    """First slip 9/2 (1 - D)^2 a/omega^2; relative error of order 1 - D, and of round-off over 1 - D."""
    part = 10.0**-power
    result = result_of(
        rig("static = 0.3", base(30.0 / (1 - part), 0.5), 0.0, more=more), estimate=False
    )
    want = 4.5 * part**2 * 30.0 / W**2
    assert abs(result.response.slide[-1]) == pytest.approx(want, rel=3 * part + 1e-14 / part)
    assert result.outcome != "stuck"
    balanced(result, 1e-10)


def two_stops(d):
    """Half peak-to-peak over a/omega^2 of the undamped motion at resonance with two stops, by its half period.

    Released at -q where sin t + q = D; x'' + x = sin t - D until x' = 0, which must be at +q. (Den Hartog's phases.)
    """

    def miss(q):
        begin = asin(d - q)
        a, b = _through(begin, -q, d)
        return a(brentq(b, begin + 0.5, begin + pi)) - q

    grid = np.linspace(1e-3, min(d, 0.7853), 400)
    values = [miss(q) for q in grid]
    k = next(i for i in range(len(grid) - 1) if values[i] * values[i + 1] < 0)
    return brentq(miss, grid[k], grid[k + 1], xtol=1e-15)


def _through(begin, x, d):
    """x(t), x'(t) of x'' + x = sin t - d from (x, 0) at `begin`."""
    one = x + d + begin * cos(begin) / 2
    two = cos(begin) / 2 - begin * sin(begin) / 2

    def place(t):
        return -d - t * cos(t) / 2 + one * cos(t - begin) + two * sin(t - begin)

    def rate(t):
        return -cos(t) / 2 + t * sin(t) / 2 - one * sin(t - begin) + two * cos(t - begin)

    return place, rate


def test_exact_above_the_resonance_threshold():
    """D = pi/4 + 1e-3 without damping: bounded, by the half period; D = 0.8 is the printed 0.299431041748427515."""
    assert two_stops(0.8) == pytest.approx(0.299431041748427515, abs=1e-13)
    d = pi / 4 + 1e-3
    want = two_stops(d)
    condition = (two_stops(d * (1 + 1e-6)) / want - 1) / 1e-6
    assert 5 < abs(condition) < 1e3
    text = rig("static = 0.3", base(30.0 / d, 1500), 0.0)
    result = result_of(text)
    assert result.outcome == "steady"
    assert value(result) * W**2 / (30.0 / d) == pytest.approx(want, rel=1e-12 * abs(condition))
    balanced(result, 1e-10)
    point = result_of(text, "accuracy.method=harmonic")
    close(
        point,
        "relative_displacement_amplitude",
        want * 30.0 / d / W**2,
        1e-9 * want * 30.0 / d / W**2,
    )


def test_exact_below_the_resonance_threshold():
    """D = pi/4 - 1e-3 without damping: no bounded motion; the amplitude rises by pi - 4 D (a/omega^2) a cycle."""
    d = pi / 4 - 1e-3
    short, long = (result_of(rig("static = 0.3", base(30.0 / d, n), 0.0)) for n in (900, 1500))
    assert short.outcome == long.outcome == "grows"
    assert long.measures["relative_displacement_amplitude"].error is None
    rise = (value(long) - value(short)) / 600 * W**2 / (30.0 / d)
    assert rise == pytest.approx(pi - 4 * d, rel=1e-2)
    balanced(long, 1e-10)


def test_exact_a_rigid_mode_slides_under_a_force():
    """A block on a table under F sin w t: from rest it slides (cos a - cos b) - D (b - a) F/(m w^2) ... and stops."""
    d = 0.8
    w = 2 * pi * 50
    text = rig(
        "static = 0.3",
        f'kind = "force"\nfrequency = "50 Hz"\nforce = "{30 / d!r} N"\ncycles = 30',
        0.0,
        0.0,
    )
    begin = asin(d)
    end = brentq(lambda t: cos(begin) - cos(t) - d * (t - begin), begin + 0.1, begin + pi)
    far = cos(begin) * (end - begin) - sin(end) + sin(begin) - d * (end - begin) ** 2 / 2
    exact = result_of(text)
    assert exact.plan.model.rig.structure.frequencies.tolist() == [0]
    assert value(exact) == pytest.approx(far / 2 * (30 / d) / w**2, rel=1e-11)
    assert value(exact, "stick_fraction") == pytest.approx(1 - (end - begin) / pi, rel=1e-9)
    assert abs(value(exact, "drift_per_cycle")) <= 1e-12 * value(exact)
    balanced(exact, 1e-10)
    marched = result_of(text, "accuracy.method=march")
    close(marched, "relative_displacement_amplitude", far / 2 * (30 / d) / w**2)
    balanced(marched, 1e-8)


# amplitude of the slip [m] and loop area [J] by an event search on DOP853 at 1e-11, a program of its own
PEERS = {
    "overdamped": (2.0, 1.0, 10.0, 0.05, 20, 2.177447050215183e-06, 4.354894097337636e-05),
    "eight stops": (0.01, 1 / 16, 10.0, 0.05, 12, 1.3238644852087504e-05, 2.6477289704175477e-4),
}


@pytest.mark.parametrize("name", PEERS)
@pytest.mark.parametrize("method", ["auto", "march", "harmonic"])
def test_exact_against_another_program(name, method):
    damping, ratio, level, static, cycles, slip, area = PEERS[name]
    result = result_of(
        rig(f"static = {static}", base(level, cycles, ratio), damping), f"accuracy.method={method}"
    )
    if name == "eight stops" and method == "auto":
        late = result.response.time > (cycles - 1) / (100 * ratio)
        still = result.response.slide_rate[late] == 0
        assert np.count_nonzero(still[1:] & ~still[:-1]) == 8
    share = {"auto": 1e-9, "march": 5e-4, "harmonic": 1e-9}[method]
    assert value(result, "slip_amplitude") == pytest.approx(slip, rel=share)
    assert value(result, "loop_area") == pytest.approx(area, rel=share)
    if method != "harmonic":
        balanced(result, 1e-10 if method == "auto" else 1e-8)


@pytest.mark.share(1)
@pytest.mark.parametrize(
    "damping, want", [(0.0, 0.29943104174842751488), (0.003, 0.28704671337871602595)]
)
def test_exact_steady_at_resonance(damping, want):
    """Printed numbers of D = 0.8."""
    text = rig("static = 0.3", base(37.5, 200), damping)
    assert value(result_of(text)) == pytest.approx(want * 37.5 / W**2, rel=1e-11)
    for method in ("march", "harmonic"):
        close(
            result_of(text, f"accuracy.method={method}"),
            "relative_displacement_amplitude",
            want * 37.5 / W**2,
            1e-10 * want * 37.5 / W**2,
        )


@pytest.mark.parametrize("cycles", [4000, 60_000, pytest.param(1_000_000, marks=pytest.mark.slow)])
def test_exact_many_cycles_keep_their_phase(cycles):
    """Amplitude and the phase of the release, 0.538622 rad after the drive, as in the first two hundred."""
    short, long = (
        result_of(rig("static = 0.3", base(37.5, n)), estimate=False) for n in (200, cycles)
    )
    want = 0.28704671337871602595 * 37.5 / W**2
    assert value(long) == pytest.approx(want, rel=1e-12)
    assert value(long, "slip_start_phase") == pytest.approx(0.538622, abs=1e-6)
    assert value(long, "slip_start_phase") == pytest.approx(
        value(short, "slip_start_phase"), abs=1e-11
    )
    assert abs(value(long, "drift_per_cycle")) <= 1e-12 * want and long.outcome == "steady"
    balanced(long, 1e-10)


def test_exact_static_above_kinetic_is_bistable():
    """6 g at 135 Hz of 143 Hz under friction of 7 g at rest, 4 g in motion: at rest for ever, or 4.83011 a/omega^2."""
    text = rig("static = 0.7\nkinetic = 0.4", base(60.0, 400, 135 / 143))
    rest = result_of(text)
    moving = result_of(text, 'structure.start={velocity = ["0.5 m/s"]}')
    assert rest.outcome == "stuck" and value(rest) == 0.0
    assert moving.outcome == "steady"
    # the printed number is over omega_n^2
    assert value(moving) == pytest.approx(4.83011 * 60.0 / W**2, rel=1e-5)
    for one in (rest, moving):
        balanced(one, 1e-10)
    marched = result_of(text, 'structure.start={velocity = ["0.5 m/s"]}', "accuracy.method=march")
    close(marched, "relative_displacement_amplitude", value(moving))


HEAVE = (
    PIECE
    + """\
load = "100 N"
element_size = "1.27 mm"
substrate = {young = "1e6 GPa", poisson = 0.3, density = "4370 kg/m^3"}
[contact.asperities]
law = "linear"
normal_stiffness = "1e11 Pa/m"
[friction]
law = "%s"
static = 0.3
[structure]
moving_mass = "1 kg"
[[structure.mode]]
name = "axial"
frequency = "100 Hz"
damping = 0.003
slide = 0.9
[[structure.mode]]
name = "bounce"
frequency = "250 Hz"
damping = 0.02
slide = 0.1
normal = 0.8
base = 0.4
output = 1.0
[drive]
kind = "base"
frequency = "100 Hz"
acceleration = "400 m/s^2"
cycles = 4
"""
)


@pytest.mark.share(1, 2)  # Coulomb: a loop to compile for this alone
@pytest.mark.parametrize(
    "law", ["coulomb", 'elastic-plastic"\nbond_length = "1 um', 'nonlocal"\nbond_length = "1 um']
)
def test_always_lift_off_closes_its_energy(law):
    found = result_of(HEAVE % law, estimate=False)
    load = found.response.extra["normal_load"]
    assert load.min() == 0.0 and (np.abs(found.response.force) <= 0.3 * load + 1e-9).all()
    balanced(found, 1e-8)


def test_refuses_a_start_beyond_the_travel():
    text = rig(
        "static = 0.05",
        'kind = "free"\ndisplacement = "0.5 mm"\ncycles = 10',
        more='travel = "0.4 mm"',
    )
    for method in ("exact", "march"):
        with pytest.raises(
            PatchfemError, match=r"structure\.travel: the motion starts beyond this travel"
        ):
            result_of(text, f"accuracy.method={method}")


def test_refuses_a_block_too_light_for_its_steps():
    """A block of milligrams rings on its printed bonds far above any step: it ran without end."""
    text = (
        '[normal]\nload = "26 lbf"\n[friction]\nlaw = "nonlocal"\nreading = "report"\nstatic = 0.3\n'
        'bond_length = "1 um"\n[structure]\nmoving_mass = "6.5 mg"\n[[structure.mode]]\nname = "axial"\n'
        'frequency = "143 Hz"\ndamping = 0.0015\nslide = 1.0\n[drive]\nkind = "base"\nfrequency = "143 Hz"\n'
        'acceleration = "2.9 g"\ncycles = 12\n[accuracy]\ntolerance = 1e-5\n'
    )
    with pytest.raises(Missing, match=r"the vibration of the block on its bonds, at 3\.68e\+05 Hz"):
        run(loads(text))
