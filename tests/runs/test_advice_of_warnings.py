"""Remedies in warnings and notes have the promised effect, and the main measures of a run are named
first.

The scenes are random ones, a patch, runs with too few steps and bolted joints that stick.
"""

import pytest
from remedies import draw_scene, parse_remedies, run_tables, try_remedy
from scene_texts import DRIVE, JOINT_SHAKEN, MODE, NONLOCAL, POINT

from patchfem import build, run
from patchfem.core import ErrorCauses, Measure
from patchfem.runs.accuracy_warnings import AccuracyContext, tolerance_warnings
from patchfem.scene import choose_law, compose_scene

SHAKEN_RIG = POINT + NONLOCAL + MODE + DRIVE
SIXTEEN_STEPS = "[accuracy]\ntolerance = 1e-2\nsteps_per_cycle = 16\n"
# Seeds of the fastest scenes of every kind, which run in a normal test run.
FAST_SEEDS = (10, 18, 31, 34, 45, 78, 89, 116, 117, 144, 146, 150, 163, 175, 182)
# Seeds whose remedies failed in an earlier version, out of 500 more scenes.
FAILED_SEEDS = 460, 482, 484, 725


def run_text(text: str):
    """Return the result of a scene."""
    return run(text)


def find_failed_remedies(seed: int) -> list:
    """Return the remedies of a random scene that do not have the promised effect."""
    tables = draw_scene(seed)
    result = run_tables(tables)
    sentences = [] if result is None else [*result.warnings, *result.extra.get("notes", [])]
    remedies = [remedy for sentence in sentences for remedy in parse_remedies(sentence)]
    return [
        remedy for remedy in remedies if try_remedy(tables, result, remedy) in ("failed", "refused")
    ]


@pytest.mark.share(*range(len(FAST_SEEDS)))
@pytest.mark.parametrize("seed", [*FAST_SEEDS, *FAILED_SEEDS])
def test_always_printed_remedy_has_promised_effect(seed):
    """A remedy that is applied exactly as printed removes its warning, or halves the error it
    names, or reduces the error to three quarters if it promises only a refinement."""
    assert not find_failed_remedies(seed)


@pytest.mark.slow
def test_always_remedies_of_19_in_20_scenes_have_promised_effect():
    """In 95 % of 200 random scenes all remedies have the promised effect.

    In the 100 scenes from seed 1000 on, which were not used before, 66 of 68 remedies had it. The
    exceptions here are bonds whose creep is slower than a free vibration, and errors of steps and
    meshes that depend on each other.
    """
    failed = [seed for seed in range(200) if find_failed_remedies(seed)]
    assert len(failed) <= 0.05 * 200


def test_always_automatic_steps_meet_tolerance():
    """If the changes of the measures do not fall from 2 to 8 steps per cycle, the warning advises
    automatic steps, which meet the tolerance."""
    eight_steps = SIXTEEN_STEPS.replace("steps_per_cycle = 16", "steps_per_cycle = 8")
    coarse = run(SHAKEN_RIG + eight_steps)
    main = "relative_displacement_amplitude"
    warnings = [
        text for text in coarse.warnings if text.startswith(f"{main} has an estimated error of ")
    ]
    assert len(warnings) == 1
    assert "absolute_acceleration_peak of " in warnings[0]
    assert "loop_area of " in warnings[0]
    assert (
        "; leave out accuracy.steps_per_cycle, so that patchfem doubles the number of steps"
        in warnings[0]
    )
    automatic = run(SHAKEN_RIG + SIXTEEN_STEPS.replace("steps_per_cycle = 16\n", "")).measures[main]
    assert automatic.error <= 1e-2 * automatic.value < coarse.measures[main].error


@pytest.mark.parametrize(
    "errors, warning",
    [
        (
            {"slip_start_phase": 0.5, "relative_displacement_amplitude": 0.08, "loop_area": 0.1},
            "relative_displacement_amplitude has an estimated error of 0.08 of its value, loop_area of 0.1 of its value; "
            "the tolerance is 0.01 (1 other measure also exceeds the tolerance); set accuracy.steps_per_cycle = 64",
        ),
        (
            {"slip_start_phase": 0.5, "stick_fraction": 0.1},
            "slip_start_phase has an estimated error of 0.5 of its value; the tolerance is 0.01 (1 other measure also "
            "exceeds the tolerance); set "
            "accuracy.steps_per_cycle = 128",
        ),
    ],
)
def test_exact_warning_names_main_measures_first(errors, warning):
    """A warning about several measures names the main ones first; errors of second order with 16
    steps fall by 16 with 64 steps and by 64 with 128."""
    measures = {
        name: Measure(1.0, "1", error, causes=ErrorCauses({"steps": error}, 2.0))
        for name, error in errors.items()
    }
    finding = AccuracyContext(
        build(SHAKEN_RIG + SIXTEEN_STEPS), measures, None, {"steps_per_cycle": 16}
    )
    assert tolerance_warnings(finding) == [warning]


def test_error_without_order_of_convergence_meets_tolerance_with_proposed_steps():
    """The steps of the first three runs are too long for bonds that age, so their results show no
    order. The warning proposes twice the steps, which suffice here."""
    slide = '[slide]\nkind = "sine"\namplitude = "10 um"\nfrequency = "1 Hz"\ncycles = 3\n'
    ageing = compose_scene(choose_law("rest", "ageing"))
    scene = ageing[: ageing.index("[slide]")] + slide + "[accuracy]\ntolerance = 1e-2\n"
    result = run(scene)
    assert "results with 32, 64 and 128 steps" in result.warnings[0]
    assert "try accuracy.steps_per_cycle = 256, or use" in result.warnings[0]
    assert not run(scene, **{"accuracy.steps_per_cycle": 256}).warnings


def test_always_unresolved_free_vibration_is_solved_by_exact_engine():
    """Steps of 1/800 cycle are too large for a free vibration with 88 periods per cycle. The
    warning advises the exact engine, which reduces the error at least tenfold."""
    loose = "[accuracy]\ntolerance = 0.3\n"
    marched = run_text(JOINT_SHAKEN + loose + 'method = "march"\n')
    assert marched.extra["engine"] == "march" and 'accuracy.method = "exact"' in marched.warnings[0]
    exact = run_text(JOINT_SHAKEN + loose + 'method = "exact"\n')
    errors = [result.measures["equivalent_damping"].error for result in (marched, exact)]
    assert errors[1] < errors[0] / 10
