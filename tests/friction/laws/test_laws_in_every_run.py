"""Each law in each engine: time integration against harmonic balance, a release, and the fit to a loop."""

import numpy as np
import pytest
from law_runs import (
    fit_law,
    run_bench_along_path,
    run_release,
    run_rig,
    shrinking_sine,
)
from scene_texts import DRIVE, MODE, get_only_mistake
from scipy.interpolate import CubicSpline

from patchfem import load

IWAN = 'law = "iwan"\nstatic = 0.31\nstiffness = "1.3e7 N/m"\nchi = -0.4\nbeta = 0.3\n'
BOUC_WEN = 'law = "bouc-wen"\nstatic = 0.31\nstiffness = "1.3e7 N/m"\nexponent = {}\nshape = {}\n'
DAHL = 'law = "lugre"\nstatic = 0.31\nstiffness = "1.3e7 N/m"\nstribeck_speed = "2 mm/s"\n'
LUGRE = DAHL + "kinetic = 0.22\n"
BONDS = 'law = "nonlocal"\nstatic = 0.3\nbond_length = "10 um"\n'
DAMPED = LUGRE + 'micro_damping = "900 N s/m"\nviscous = "300 N s/m"\n'


@pytest.mark.share(0)  # each further law needs a time loop of its own, which takes long to compile
@pytest.mark.parametrize(
    "law",
    [IWAN, BOUC_WEN.format(1.0, 0.5), BOUC_WEN.format(2.5, 0.5), DAHL, DAMPED],
    ids=["iwan", "bouc-wen 1", "bouc-wen 2.5", "dahl", "lugre"],
)
def test_exact_march_agrees_with_harmonic_balance(law):
    """The measures of a march and of the harmonic balance differ by no more than their stated errors."""
    marched = run_rig(law)
    steady = run_rig(law, "accuracy.method=harmonic")
    assert marched.outcome.value == "steady"
    for name in ("relative_displacement_amplitude", "friction_force_peak", "loop_area"):
        marched_measure = marched.measures[name]
        steady_measure = steady.measures[name]
        assert abs(
            marched_measure.value - steady_measure.value
        ) <= marched_measure.error + steady_measure.error + 1e-3 * abs(steady_measure.value), name
    # The tolerance of a step is 1e-8.
    assert marched.measures["energy_balance"].value < 1e-8
    assert (
        marched.measures["energy_created"].value
        <= 1e-12 * marched.measures["energy_dissipated"].value
    )


@pytest.mark.share(0)
@pytest.mark.parametrize("extra_keys", ["", "initial_bonds = 0.0\n"])
def test_exact_released_bonds_agree_in_both_engines(extra_keys):
    """Displacement and slip after a release agree between the march and the engine `event_driven` within 5 nm.

    Slip is the relative displacement less the stretch of the bonds, which is zero at the start.
    """
    event_driven = run_release(BONDS + extra_keys)
    marched = run_release(
        BONDS + extra_keys, "accuracy.method=march", "accuracy.steps_per_cycle=800"
    )
    for run in (event_driven, marched):
        assert run.slide[0] == run.slip[0] == 60e-6
        # displacement and slip differ by the stretch of the bonds
        assert np.abs(run.slide - run.slip).max() <= 10e-6
    for name in ("slide", "slip"):
        interpolated = CubicSpline(marched.time, getattr(marched, name))(event_driven.time)
        assert getattr(event_driven, name) == pytest.approx(interpolated, abs=5e-9), name


@pytest.mark.parametrize(
    "law, initial_values, free_parameters, values",
    [
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
    ids=["bouc-wen", "lugre"],
)
def test_exact_fit_recovers_parameters_of_loop(
    tmp_path, law, initial_values, free_parameters, values
):
    """A fit to a loop computed with known parameters recovers them within 1e-5."""
    time, slide = shrinking_sine(60)
    force = run_bench_along_path(law, time, slide).force
    guess = law
    for value, initial_value in initial_values.items():
        guess = guess.replace(value, initial_value)
    assert fit_law(
        tmp_path, guess, (time, slide, force), free_parameters
    ).fit.values == pytest.approx(values, rel=1e-5)


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
def test_refuses_law_without_required_key(law, keys):
    """A law without one of its required keys is refused."""
    for key in keys.split():
        assert f"friction.{key}: missing" in get_only_mistake(without_key(rig_scene(law), key))


@pytest.mark.parametrize(
    "law, change, message",
    [
        (IWAN, "chi=0.1", "friction.chi"),
        (IWAN, "chi=-1", "friction.chi"),
        (IWAN, "stiffness=3", "5e6 N/m"),
        (IWAN, "static=0", "static: must be > 0"),
        (IWAN, "kinetic=0.2", "laws with it are coulomb"),
        (POWER, "exponent=0", "friction.exponent"),
        (POWER, "shape=0", "friction.shape"),
        (POWER, "shape=1.1", "friction.shape"),
        (DAMPED, "kinetic=0.4", "larger than static"),
        (DAMPED, "viscous=3", "10 N s/m"),
        (DAMPED, "viscous=-1 N s/m", "friction.viscous"),
    ],
)
def test_refuses_law_parameter_out_of_range(law, change, message):
    """A parameter outside the range of its law is refused with the name of the key or the reason."""
    assert message in get_only_mistake(rig_scene(law), f"friction.{change}")


def test_exact_missing_keys_have_defaults():
    """A missing exponent is 1, and a missing kinetic coefficient is the static coefficient."""
    assert load(without_key(rig_scene(POWER), "exponent")).friction.exponent == 1
    assert load(rig_scene(DAHL)).friction.kinetic == 0.31
