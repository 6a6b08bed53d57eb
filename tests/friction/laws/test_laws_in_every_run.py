"""One law in every engine: time integration against harmonic balance, two alike interfaces, and the fit to a loop."""

import numpy as np
import pytest
from law_runs import bench_along, fitted, masses, plain_masses, released, rig, shrinking
from march_paths import share_one_loop
from scene_texts import COATED, DRIVE, MODE, mistakes, only

from patchfem import load

IWAN = 'law = "iwan"\nstatic = 0.31\nstiffness = "1.3e7 N/m"\nchi = -0.4\nbeta = 0.3\n'
BOUC_WEN = 'law = "bouc-wen"\nstatic = 0.31\nstiffness = "1.3e7 N/m"\nexponent = {}\nshape = {}\n'
DAHL = 'law = "lugre"\nstatic = 0.31\nstiffness = "1.3e7 N/m"\nstribeck_speed = "2 mm/s"\n'
LUGRE = DAHL + "kinetic = 0.22\n"
BONDS = 'law = "nonlocal"\nstatic = 0.3\nbond_length = "10 um"\n'
DAMPED = LUGRE + 'micro_damping = "900 N s/m"\nviscous = "300 N s/m"\n'


@pytest.mark.share(0)  # each other law is a loop to compile
@pytest.mark.parametrize(
    "law",
    [IWAN, BOUC_WEN.format(1.0, 0.5), BOUC_WEN.format(2.5, 0.5), DAHL, DAMPED],
    ids=["iwan", "bouc-wen 1", "bouc-wen 2.5", "dahl", "lugre"],
)
def test_exact_a_march_settles_on_the_harmonic_balance(law):
    """The measures of the two engines differ by no more than their stated errors."""
    marched = rig(law)
    steady = rig(law, "accuracy.method=harmonic")
    assert marched.outcome.value == "steady"
    for name in ("relative_displacement_amplitude", "friction_force_peak", "loop_area"):
        a = marched.measures[name]
        b = steady.measures[name]
        assert abs(a.value - b.value) <= a.error + b.error + 1e-3 * abs(b.value), name
    assert marched.measures["energy_balance"].value < 1e-9
    assert (
        marched.measures["energy_created"].value
        <= 1e-12 * marched.measures["energy_dissipated"].value
    )


@pytest.mark.share(0)
@pytest.mark.parametrize("more", ["", "breakaway = 0.2\n", "initial_bonds = 0.0\n"])
def test_exact_bonds_released_from_a_displaced_start_slip_as_in_the_smooth_engine(more):
    """Slip is the relative displacement less the stretch of the bonds, which is zero at the start."""
    smooth = released(BONDS + more)
    marched = released(BONDS + more, "accuracy.method=march")
    for run in (smooth, marched):
        assert run.slide[0] == run.slip[0] == 60e-6
        # the stretch that the slip leaves is that of the bonds
        assert np.abs(run.slide - run.slip).max() <= 10e-6
    for name in ("slide", "slip"):
        other = np.interp(smooth.time, marched.time, getattr(marched, name))
        assert getattr(smooth, name) == pytest.approx(other, abs=5e-9), name


@pytest.mark.share(0)
@pytest.mark.parametrize(
    "law", [IWAN, BOUC_WEN.format(2.0, 0.7), DAMPED], ids=["iwan", "bouc-wen", "lugre"]
)
def test_exact_two_alike_interfaces_move_alike(law, monkeypatch):
    if law == IWAN:
        share_one_loop(monkeypatch)
    both = masses(law, 2)
    slides = both.response.extra["slides"]
    alone = masses(law, 1).response.slide
    assert slides[:, 0] == pytest.approx(slides[:, 1], abs=1e-12 * np.abs(slides).max())
    assert slides[:, 0] == pytest.approx(alone, abs=1e-7 * np.abs(alone).max())


@pytest.mark.slow
def test_exact_two_alike_interfaces_move_alike_without_compilation():
    both, alone, peaks = plain_masses(BOUC_WEN.format(2.0, 0.7))
    assert both[0] == pytest.approx(both[1], abs=1e-12 * np.abs(both).max())
    assert both[0] == pytest.approx(alone, abs=1e-7 * np.abs(alone).max())
    assert np.abs(alone).max() > 3 * 31 / 1.3e7 and max(peaks) > 0.9 * 31  # the interface slips


@pytest.mark.parametrize(
    "law, start, free, values",
    [
        (
            IWAN,
            {"0.31": "0.4", "-0.4": "-0.6"},
            "friction.static=0.1..0.7,friction.chi=-0.9..-0.1",
            [0.31, -0.4],
        ),
        (
            BOUC_WEN.format(1.8, 0.7),
            {"0.31": "0.4", "1.8": "1.0", "0.7": "0.5"},
            "friction.static=0.1..0.7,friction.exponent=1..4,friction.shape=0.3..1",
            [0.31, 1.8, 0.7],
        ),
        (
            LUGRE,
            {"0.31": "0.4", "0.22": "0.3"},
            "friction.static=0.25..0.7,friction.kinetic=0.1..0.24,friction.stribeck_speed=0.5 mm/s..10 mm/s",
            [0.31, 0.22, 2e-3],
        ),
    ],
    ids=["iwan", "bouc-wen", "lugre"],
)
def test_exact_a_fit_finds_the_parameters_of_a_loop(tmp_path, law, start, free, values):
    time, slide = shrinking(60)
    force = bench_along(law, time, slide).force
    guess = law
    for value, other in start.items():
        guess = guess.replace(value, other)
    assert fitted(tmp_path, guess, (time, slide, force), free).keys.fit.values == pytest.approx(
        values, rel=1e-5
    )


TANH = 'law = "tanh"\nstatic = 0.3\nreference_speed = "1 mm/s"\n'
POWER = BOUC_WEN.format(2.0, 0.5)


def rig_scene(law: str) -> str:
    """Return the scene of one mode under 100 N with a law."""
    return '[normal]\nload = "100 N"\n[friction]\n' + law + MODE + DRIVE


def without_key(scene: str, key: str) -> str:
    """Return a scene without the lines of a key."""
    return "".join(line for line in scene.splitlines(True) if not line.startswith(f"{key} ="))


@pytest.mark.parametrize(
    "law, keys",
    [
        (IWAN, "stiffness chi beta"),
        (POWER, "stiffness"),
        (DAMPED, "stiffness stribeck_speed"),
        (TANH, "reference_speed"),
    ],
)
def test_refuses_a_law_without_a_key_that_it_needs(law, keys):
    for key in keys.split():
        assert f"friction.{key}: missing" in only(without_key(rig_scene(law), key))


@pytest.mark.parametrize(
    "law, change, message",
    [
        (IWAN, "chi=0.1", "friction.chi"),
        (IWAN, "chi=-1", "friction.chi"),
        (IWAN, "stiffness=3", "5e6 N/m"),
        (IWAN, "static=0", "static: must be > 0"),
        (IWAN, "kinetic=0.2", "laws with a kinetic coefficient are coulomb"),
        (POWER, "exponent=0", "friction.exponent"),
        (POWER, "shape=0", "friction.shape"),
        (POWER, "shape=1.1", "friction.shape"),
        (DAMPED, "kinetic=0.4", "larger than static"),
        (DAMPED, "viscous=3", "10 N s/m"),
        (DAMPED, "viscous=-1 N s/m", "friction.viscous"),
    ],
)
def test_refuses_a_value_outside_the_range_of_a_law(law, change, message):
    assert message in only(rig_scene(law), f"friction.{change}")


@pytest.mark.parametrize("law", [IWAN, POWER, DAHL, TANH])
def test_refuses_a_law_with_partial_slip(law):
    scene = COATED + "[contact.shear]\n[friction]\n" + law + MODE + DRIVE
    assert "with [contact.shear]" in only(scene)


@pytest.mark.parametrize("law", [IWAN, POWER, DAMPED])
def test_refuses_a_law_under_a_varying_load(law):
    sets = ("normal.amplitude=1 N", "normal.frequency=3 Hz")
    assert "with normal.amplitude" in mistakes(rig_scene(law), *sets)[0]


def test_exact_keys_left_out_have_their_defaults():
    assert load(without_key(rig_scene(POWER), "exponent")).friction.exponent == 1
    assert load(rig_scene(DAHL)).friction.kinetic == 0.31
