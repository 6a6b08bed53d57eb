"""Many models solved together agree with single runs of each model."""

import numpy as np
import pytest
from point_cases import LAWS, MANY, compare_answers, draw_points
from scene_runs import load_scene
from scene_texts import (
    BENCH,
    COATED,
    COULOMB,
    CROWNED_JOINT,
    MODE,
    NONLOCAL,
    PLASTIC,
    POINT,
    SHEAR,
    SHORT,
    SLIDE,
)

import patchfem as pf
from patchfem.core import PatchfemError
from patchfem.points.cases import march_cases
from patchfem.runs import FAILED_OUTCOME, solve_with_coarser
from patchfem.runs.batch import batches, lumped, one_by_one
from patchfem.runs.patch import store

PATCH = COATED + '[contact.tilt]\nangle = "0.02 mrad"\n'
SINE = '[drive]\nkind = "base"\nfrequency = "143 Hz"\nacceleration = "5 g"\ncycles = 20\n'
YAW = '[[structure.mode]]\nname = "yaw"\nfrequency = "129 Hz"\ndamping = 0.003\nslide = 0.095\n'
SKIN = (
    '[contact.asperities]\nlaw = "linear"\nnormal_stiffness = "1e14 Pa/m"\ntangential_ratio = 0.8\n'
)
WEAR = '[wear]\ncoefficient = "1e-14 m^2/N"\ncycles = 1000\n'
SHEARED_RIG = PATCH + SHEAR + PLASTIC + MODE + YAW + SINE
TEXTS = {
    "static": PATCH,
    "static skin": PATCH + SKIN,
    "harmonic": SHEARED_RIG + '[accuracy]\nmethod = "harmonic"\n',
    "patch": SHEARED_RIG,
    "patch coulomb": PATCH + SHEAR + COULOMB + MODE + YAW + SINE,
    "bench": PATCH + SHEAR + PLASTIC + SLIDE,
    "bench wear": PATCH + PLASTIC + SLIDE + WEAR,
}
# Relative tolerance of measures of the pressure at an end of uncoated pieces, a mean over one cell.
END_TOLERANCES = {"pressure_peak": 1e-9, "loaded_fraction": 1e-9}
RIG = POINT + COULOMB + SHORT
BONDS = POINT + NONLOCAL + SHORT
STEADY = "relative_displacement_amplitude_steady"
CLOSE_MEASURES = {
    "relative_displacement_amplitude",
    "absolute_acceleration_peak",
    "stick_fraction",
    "slip_start_phase",
    "secant_stiffness",
    "loop_area",
}


def assert_equal_case(results, case: int, single, rel: float = 0.0) -> None:
    """Assert that a case of a batch has the texts, reasons and measures of a single run of one case."""
    assert results.outcome[case] == single.outcome[0] != FAILED_OUTCOME, results.messages
    for name in ("warnings", "notes", "numerics"):
        assert getattr(results, name).get(case) == getattr(single, name).get(0), name
    names = {name for name in single.values if single.has(name, 0)}
    assert names == {name for name in results.values if results.has(name, case)}
    for name, values in single.values.items():
        assert results.reasons.get(name, {}).get(case) == single.reasons.get(name, {}).get(0)
        limit = rel and END_TOLERANCES.get(name, rel) * np.nansum(
            [abs(values[0]), single.floors[name][0]]
        )
        for kind in ("values", "errors", "floors"):
            actual, expected = (getattr(one, kind)[name] for one in (results, single))
            np.testing.assert_allclose(actual[case], expected[0], 0, limit, err_msg=name)


def solve_single(model):
    """Return the results of a single run that starts with an empty cache."""
    store.clear_cache()
    return one_by_one.solve([model])


@pytest.mark.parametrize("kind", TEXTS)
def test_exact_batch_agrees_with_single_runs(kind):
    """A batch of each kind of run agrees with single runs of its cases, which share a tilt."""
    sets = {"contact.tilt.angle": 3e-4}
    sets |= {"drive.acceleration": 40.0} if "drive" in TEXTS[kind] else {}
    sets |= {"slide.amplitude": 2e-5} if "bench" in kind else {}
    loads = (50.0, 400.0)
    models = [pf.build(TEXTS[kind], **sets, **{"contact.load": load}) for load in loads]
    batch = batches.solve_models(models)
    for case, model in enumerate(models):
        assert_equal_case(batch, case, solve_single(model), 1e-12)


# ---- points that are marched together


@pytest.mark.share(1, 2, 3, 4, 5)
@pytest.mark.parametrize("law", LAWS)
def test_always_95_of_100_measures_lie_within_both_errors(law):
    """Outcomes are those of single runs, and at least 95 % of the measures agree within the sum of both errors.

    Motion, stick and forces meet the tolerance. 99 of 100 measures differ by at most five times the errors, also where a
    change between two marches is small by accident, or where the secant stiffness of `tanh` is 0.
    """
    cases = draw_points(law, 11, 8)
    results = batches.solve_models(cases, n_study_cases=MANY)
    assert sum(one["engine"] == lumped.BATCH_ENGINE for one in results.numerics.values()) >= 4
    singles = one_by_one.solve(cases)
    assert (results.outcome == singles.outcome).all() and results.notes == singles.notes
    rows = [row for case_rows in compare_answers(results, singles) for row in case_rows]
    assert np.mean([row.holds for row in rows]) >= 0.95
    enlarged = [row._replace(error=5 * row.error, doubt=5 * row.doubt) for row in rows]
    assert np.mean([row.holds for row in enlarged]) >= 0.99
    n_compared = 0
    for name in CLOSE_MEASURES & singles.values.keys():
        expected = singles.values[name]
        is_known = np.isfinite(expected)
        allowed = cases[0].accuracy.tolerance * np.abs(expected) + singles.floors[name]
        difference = np.abs(results.values[name] - expected)
        assert (difference <= allowed)[is_known].all(), name
        n_compared += is_known.any()
    assert n_compared >= 4


def test_always_error_of_drift_holds_where_it_changes_little_by_accident():
    """The errors of the drift contain that of a march with far more steps in at least 95 % of cases at resonance."""
    rng = np.random.default_rng(5)
    keys = {
        "friction.static": rng.uniform(0.1, 0.5, 100),
        "drive.acceleration": rng.uniform(10, 60, 100),
    }
    models = [pf.build(BONDS, **dict(zip(keys, map(float, row)))) for row in zip(*keys.values())]
    group = lumped.collect_cases(models)
    exact = march_cases(group.cases, 4 * lumped.BATCH_STEPS_PER_CYCLE[-1]).values["drift_per_cycle"]
    holds = []
    for cases, refined in lumped.march_group(group):
        difference = refined.march.values["drift_per_cycle"] - exact[cases]
        holds += (np.abs(difference) <= refined.errors["drift_per_cycle"])[
            np.isfinite(difference)
        ].tolist()
    assert len(holds) == 100 and np.mean(holds) >= 0.95


def test_always_sticking_points_are_computed_together():
    """Elastic-plastic cases need no single run, neither where a mode rings above a stuck point nor near the limit."""
    cases = draw_points("elastic-plastic", 78, 24)
    results = batches.solve_models(cases, n_study_cases=MANY)
    assert all(one["engine"] == lumped.BATCH_ENGINE for one in results.numerics.values())
    singles = one_by_one.solve(cases)
    assert (results.outcome == singles.outcome).all() and results.reasons == singles.reasons
    rows = [row for case_rows in compare_answers(results, singles) for row in case_rows]
    assert np.mean([row.holds for row in rows]) >= 0.99
    ringing = [
        case
        for case in range(24)
        if any("free vibration" in w for w in singles.warnings.get(case, ()))
    ]
    assert ringing and all(
        results.warnings[case][0] == singles.warnings[case][0] for case in ringing
    )


# Changes after which a rig is not one mode with one point under a sine, or has no motion.
OTHER_KINDS = [
    "wear.coefficient=1e-14 m^2/N; wear.cycles=1000",
    "structure.travel=10 um",
    "drive.cycles=20.5",
    "drive.cycles=12",
    "structure.mode.axial.output=0",
    "structure.mode.axial.gauge=0.5",
    "friction.law=convolution; friction.bond_length=1 um",
    "normal.amplitude=10 N; normal.frequency=50 Hz",
    "structure.stiffening.cubic=1e12 N/m^3",
    "accuracy.method=march; drive.cycles=24",
    "normal.load=0 N",
]


@pytest.mark.parametrize("changes", OTHER_KINDS)
def test_exact_other_kinds_of_motion_run_alone(changes):
    """A rig that is not one mode with one sliding point under a sine runs alone, also in a large study."""
    model = pf.build(load_scene(RIG, changes))
    results = batches.solve_models([model], n_study_cases=MANY)
    assert_equal_case(results, 0, one_by_one.solve([model]))


def test_exact_points_without_friction_have_no_equivalent_damping():
    """Without friction the loop has no area, and the equivalent damping and its error are 0 as in a single run."""
    model = pf.build(load_scene(RIG, "friction.static=0"))
    results = batches.solve_models([model, model], n_study_cases=MANY)
    assert results.numerics[0]["engine"] == lumped.BATCH_ENGINE
    assert results.values["loop_area"].tolist() == [0.0, 0.0]
    assert results.values["equivalent_damping"].tolist() == [0.0, 0.0]
    assert results.errors["equivalent_damping"].tolist() == [0.0, 0.0]


OUTCOMES = {  # Changes of the rig: outcome, and whether the steady amplitude is estimated.
    "structure.mode.axial.damping=0; normal.load=1 lbf": ("grows", False),
    "drive.cycles=60; structure.mode.axial.damping=0.01; normal.load=12 lbf": ("transient", True),
    "drive.cycles=200; drive.acceleration=40 g; normal.load=1 lbf; drive.frequency=120 Hz": (
        "transient",
        True,
    ),
    "structure.mode.axial.damping=0.3": ("steady", False),
    "drive.acceleration=0.1 g": ("stuck", False),
    "drive.onset_length=0.01 mil": ("steady", True),
}


@pytest.mark.parametrize("law", ["coulomb", "elastic-plastic; friction.bond_length=1 um"])
@pytest.mark.parametrize("changes", OUTCOMES)
def test_always_outcomes_agree_with_single_runs(changes, law):
    """A batch gives the outcome of a single run, whether a motion grows, settles, beats, is steady or sticks.

    It has the same measures, reasons and warnings, except those on the size of errors, which are other numbers; values
    agree within the sum of both errors.
    """
    outcome, has_steady_estimate = OUTCOMES[changes]
    model = pf.build(load_scene(RIG, f"{changes}; friction.law={law}"))
    batch, single = batches.solve_models([model], n_study_cases=MANY), one_by_one.solve([model])
    assert batches.find_group(model, MANY) and batch.outcome[0] == single.outcome[0]
    texts = [text for text in single.warnings.get(0, ()) if "has an estimated error" not in text]
    assert list(batch.warnings.get(0, ())) == texts and batch.reasons == single.reasons
    # The extrapolation of a motion that has almost settled is a measure if its error is large enough.
    rows = compare_answers(batch, single)[0]
    assert all(row.holds for row in rows if law == "coulomb" or row.name != STEADY)
    if law == "coulomb":
        assert batch.outcome[0] == outcome and (STEADY in batch.values) == has_steady_estimate
        assert bool(batch.warnings) == ("onset_length" in changes)


def test_exact_mixed_cases_agree_with_single_runs_in_order():
    """Cases of different kinds keep their order and agree with single runs; a model that is an error fails with its
    message."""
    models = [
        pf.build(text)
        for text in (RIG, BENCH, POINT + PLASTIC + SHORT, RIG.replace("26 lbf", "1 N"))
    ]
    refused = PatchfemError("friction.static: refused here")
    results = batches.solve_models([models[0], refused, *models[1:]])
    assert results.outcome[1] == FAILED_OUTCOME and results.messages == {1: str(refused)}
    for case, model in zip((0, 2, 3, 4), models):
        assert_equal_case(results, case, one_by_one.solve([model]))


@pytest.mark.parametrize("fault", [ZeroDivisionError("a fault"), PatchfemError("refused here")])
def test_always_fault_of_batch_falls_back_to_single_runs(fault, monkeypatch):
    """If computing cases together fails, they run one by one. A fault is printed once; an error of a case is left to its
    single run."""

    def fail(models, say):
        raise fault

    monkeypatch.setattr(batches, "MIN_CASES_TO_GROUP", 1)
    monkeypatch.setattr(lumped, "solve", fail)
    models = [pf.build(text) for text in (RIG, BENCH, RIG)]
    messages = []
    results = batches.solve_models(models, report=messages.append)
    for case, model in enumerate(models):
        assert_equal_case(results, case, one_by_one.solve([model]))
    sentences = [text for text in messages if text.startswith("cases are run one by one")]
    assert len(sentences) == isinstance(fault, ZeroDivisionError)
    assert results.faults == sentences


def test_always_internal_fault_of_case_keeps_results_of_others():
    """A case that ends with an unexpected exception fails with a message that asks to report it; the others are run."""
    results = one_by_one.solve([None, pf.build(BENCH)])
    assert results.outcome[0] == FAILED_OUTCOME != results.outcome[1]
    assert "internal fault, please report it: " in results.messages[0]


# ---- patches of benches

LOOP = '[slide]\nkind = "sine"\namplitude = "0.2 um"\nfrequency = "1 Hz"\ncycles = 3\n'


def test_exact_benches_with_equal_patches_press_them_once():
    """Cases that differ in the slide alone have the patch of the first one; a case with another load has its own."""
    changes = ("slide.cycles=3", "slide.cycles=4", "contact.load=50 N")
    models = [pf.build(load_scene(CROWNED_JOINT + LOOP, change)) for change in changes]
    first, same, other = (solve_with_coarser(model.patch, 1e-2) for model in models)
    assert first is same and first is not other
