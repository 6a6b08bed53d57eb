"""Lumped cases in lanes beside the exact engine: their bars hold, and what they cannot tell goes to it.

The whole campaign, beside single runs, is `lanes` of tests/support/campaigns.py.
"""

import numpy as np
import pytest
from lane_cases import LAWS, SCENE, draw_points, rows
from test_lumped import solve_by_group

from patchfem.api import build, get_base_scene, load, run_many
from patchfem.runs import CaseResults
from patchfem.runs.batch import batches, one_by_one
from patchfem.runs.batch.lumped import (
    lane_check,
    lane_numbers,
    lane_refinement,
    lane_runs,
    lumped,
)
from patchfem.scene import format_assignments

# beside others, without an exact batch, stand single runs
EXACT = ("coulomb", "weakening", "elastic-plastic", "iwan")


def models(law: str, seed: int, count: int) -> list:
    """Random cases of a law that lanes take."""
    return draw_points(law, seed, count)


def missed(found, ones) -> int:
    """Cases of lanes with a measure beyond the sum of both bars, or with another outcome, or of which one says more."""
    return sum(
        found.outcome[case] != ones.outcome[case] or not all(row.holds for row in some)
        for case, some in enumerate(rows(found, ones))
    )


def held(law: str, seed: int, count: int, most: int | None = None) -> None:
    """most: of the cases in lanes so many are compared; all without it."""
    cases = models(law, seed, count)
    found = batches.solve_models(cases)
    mine = [case for case in range(count) if found.numerics[case]["engine"] == "lanes"]
    assert len(mine) > count / 3 and not any(
        "the fast" in one for notes in found.notes.values() for one in notes
    )
    mine = mine[:most]
    some = [cases[case] for case in mine]
    ones = solve_by_group(some) if law in EXACT else one_by_one.solve(some)
    lanes_of = found.select(np.array(mine))
    assert (lanes_of.outcome == ones.outcome).all()
    assert np.mean([row.holds for some in rows(lanes_of, ones) for row in some]) >= 0.97


# each other law is a loop in lanes and one of single runs to compile
@pytest.mark.share(0, 1, 2, 4, 5)
@pytest.mark.parametrize("law", LAWS)
def test_always_97_of_100_measures_lie_within_both_errors(law):
    few = law not in EXACT[:3]  # what stands beside Iwan or in single runs takes seconds
    held(law, 1, 64 if few else 150, 20 if few else None)


def test_exact_few_cases_are_those_of_single_runs():
    cases = models("coulomb", 3, 31)
    assert all(batches.choose_batch(one, 31).name == "lumped.lumped" for one in cases)
    assert all(batches.choose_batch(one, 64).name == "lumped.lanes" for one in cases)
    found = batches.solve_models(cases)
    ones = solve_by_group(cases)
    for name, values in ones.values.items():
        np.testing.assert_array_equal(found.values[name], values)


def test_exact_chunks_of_a_study_are_its_whole():
    """To the last bit, and a chunk of few cases too: what is beside a case does not touch it."""
    cases = models("coulomb", 4, 80)
    whole = batches.solve_models(cases)
    parts = [batches.solve_models(part, study=80) for part in (cases[:1], cases[1:30], cases[30:])]
    for name, values in whole.values.items():
        joined = np.concatenate(
            [part.values.get(name, np.full(len(part), np.nan)) for part in parts]
        )
        np.testing.assert_array_equal(joined, values)


def test_always_a_batch_that_is_contradicted_is_exact(monkeypatch):
    """Where the exact engine finds another motion in a case that it checks, all are its, and say so."""
    cases = models("coulomb", 5, 64)
    real = lane_runs.collect_runs

    def wrong(models, *given):
        runs, *rest = real(models, *given)
        runs.values["loop_area"][:] *= 1.01
        return runs, *rest

    monkeypatch.setattr(lane_runs, "collect_runs", wrong)
    found = batches.solve_models(cases)
    ones = solve_by_group(cases)
    assert all(one["engine"] == "exact" for one in found.numerics.values())
    assert all(
        "checked against the exact engine and" in notes[-1] and "loop_area" in notes[-1]
        for notes in found.notes.values()
    )
    assert len(found.notes) == 64
    np.testing.assert_array_equal(found.values["loop_area"], ones.values["loop_area"])


def test_always_only_the_case_that_is_contradicted_is_exact(monkeypatch):
    """A single wrong case among those that are checked is computed anew, and the others stay as they are."""
    cases = models("coulomb", 7, 96)
    untouched = batches.solve_models(cases)
    numbers = np.column_stack(lane_numbers.make_cases(cases)[0])
    is_fast = np.array([untouched.numerics[case]["engine"] == "lanes" for case in range(96)])
    checked = lane_check.select_checked_cases(numbers, is_fast)[0]
    real = lane_runs.collect_runs

    def wrong(models, *given):
        runs, *rest = real(models, *given)
        is_checked = np.array([model is cases[checked] for model in models])
        runs.values["loop_area"][is_checked] *= 1.01
        return runs, *rest

    monkeypatch.setattr(lane_runs, "collect_runs", wrong)
    found = batches.solve_models(cases)
    assert found.numerics[checked]["engine"] == "exact"
    assert "differed from it in 1, in loop_area of this case" in found.notes[checked][-1]
    others = np.arange(96) != checked
    for name, values in untouched.values.items():
        np.testing.assert_array_equal(found.values[name][others], values[others])


@pytest.mark.parametrize("law", EXACT[:3])
def test_exact_lanes_answer_stuck_cases(law):
    """Cases that end stuck, with their rings: the answers of the exact batch within the bars, and no measure less."""
    base = get_base_scene(load(SCENE.format(law=LAWS[law])))
    cases = [
        build(base.override([f"normal.load={load} N", f"structure.mode.axial.damping={damping}"]))
        for load in (300, 1000, 3000)
        for damping in (0.003, 0.03)
    ]
    found = batches.solve_models(cases, study=64)
    ones = solve_by_group(cases)
    assert np.sum(found.outcome == "stuck") > 2 and all(
        one["engine"] == "lanes" for one in found.numerics.values()
    )
    assert missed(found, ones) == 0
    assert ("ring_frequency" in found.values) == (law == "elastic-plastic")


def test_exact_where_a_motion_that_will_yield_no_more_goes_is_within_its_bar():
    """It slips in the last of its 30 cycles, and sticks once it has settled. An extrapolation of the cycles in which it
    slips was off by 4 of its bars."""
    law = 'law = "elastic-plastic"\nstatic = 0.3\nstiffness = "176715.00010433397 N/m"'
    base = get_base_scene(load(SCENE.format(law=law)))
    sets = {
        "normal.load": 100.0,
        "structure.moving_mass": 1.0,
        "structure.mode.axial.frequency": 76.31354241232849,
        "structure.mode.axial.damping": 0.0056184949428447605,
        "drive.frequency": 100.0,
        "accuracy.tolerance": 0.01,
    }
    found = run_many(
        [
            build(
                base.override(
                    format_assignments(sets | {"drive.cycles": 30, "drive.acceleration": level})
                )
            )
            for level in (2.090740650793879, *np.geomspace(1, 60, 71).tolist())
        ]
    )
    far = build(
        base.override(
            format_assignments(
                sets | {"drive.cycles": 6000, "drive.acceleration": 2.090740650793879}
            )
        )
    )
    name = "relative_displacement_amplitude"
    end = lumped.solve([far]).values[name][0]
    assert end == pytest.approx(1.697322e-4, rel=1e-6)
    assert (
        abs(found.values[name + "_steady"][0] - end)
        <= found.errors[name + "_steady"][0]
        < 1e-3 * end
    )


def test_always_cases_that_all_run_away_are_not_judged_by_a_loop():
    """Motions that grow have no friction loop; the damping ratio was held against it, and the whole batch was lost."""
    cases = models("lugre", 5, 3)
    found = CaseResults.blank(3)
    found.measure("equivalent_damping", "1")
    assert "loop_area" not in found.values
    assert not lane_refinement.has_large_error(cases, found).any()
