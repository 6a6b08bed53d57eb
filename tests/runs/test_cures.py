"""The cure that a warning names: that it acts, and that what a run answers first is named before all else."""

from dataclasses import replace
from types import SimpleNamespace

import pytest
from scene_texts import DRIVE, MODE, NONLOCAL, POINT, SMALL_PATCH

from patchfem.core import Measure
from patchfem.model.model import build
from patchfem.runs.patch import ladder
from patchfem.runs.plan import plan
from patchfem.runs.results.loose import loose
from patchfem.runs.run import run
from patchfem.scene.scene import loads

PATCH = SMALL_PATCH.replace('element_size = "0.5 mm"\n', "")
SHAKEN = POINT + NONLOCAL + MODE + DRIVE
FEW = "[accuracy]\ntolerance = 1e-2\nsteps_per_cycle = 16\n"


@pytest.mark.slow
def test_exact_a_tolerance_that_is_advised_climbs_and_none_is_where_the_ladder_ends():
    asked, tolerance, nodes = replace(build(loads(PATCH)).patch, still=False), 1e-2, []
    while tolerance is not None:
        found = ladder.climbed(asked, tolerance)
        nodes.append(found[0].x.size)
        tolerance = ladder.climbs_at(asked, found, tolerance)
    assert len(nodes) > 1 and nodes == sorted(set(nodes))
    assert ladder.climbed(asked, 1e-6)[0].x.size == nodes[-1]


@pytest.mark.slow
def test_always_a_mesh_at_its_cap_is_not_refined_by_a_tolerance(monkeypatch):
    """A measure for which no mesh is chosen misses the tolerance beside the peak: no tolerance refines it."""
    monkeypatch.setattr(ladder, "SPENT", {True: 0.0, False: 0.0})
    found = run(plan(loads(PATCH + '[contact.upper]\nchamfer = "0.2 mm"\n[accuracy]\ntolerance = 1e-6\n')))
    said = [text for text in found.warnings if "the tolerance is 1e-06" in text]
    wide = {name: one.error / abs(one.value) for name, one in found.measures.items() if one.value and one.error}
    assert max(wide, key=wide.get) != "contact_fraction"  # and yet that is what a patch answers first
    assert len(said) == 1 and said[0].startswith("contact_fraction is known to ")
    assert said[0].endswith(f"a mesh finer than {found.patch.x.size} interface nodes would take too long; read them "
                            "by their errors")


def test_always_steps_that_are_left_out_cure_what_few_steps_do_not_show():
    """The change of no measure falls from 4 to 16 steps; those that the tolerance chooses meet it."""
    few, main = run(plan(loads(SHAKEN + FEW))), "relative_displacement_amplitude"
    said = [text for text in few.warnings if text.startswith(f"{main} is known to ")]
    assert len(said) == 1 and "absolute_acceleration_peak to " in said[0] and "loop_area to " in said[0]
    assert "; leave out accuracy.steps_per_cycle, and they are doubled" in said[0]
    again = run(plan(loads(SHAKEN + FEW.replace("steps_per_cycle = 16\n", "")))).measures[main]
    assert again.error <= 1e-2 * again.value < few.measures[main].error


@pytest.mark.parametrize("wide, first", [
    ({"slip_start_phase": 0.5, "relative_displacement_amplitude": 0.08, "loop_area": 0.1},
     "relative_displacement_amplitude is known to 0.08 of its value, loop_area to 0.1 of its value, the tolerance is "
     "0.01 (1 other measure beside them); set accuracy.steps_per_cycle = 64"),
    ({"slip_start_phase": 0.5, "stick_fraction": 0.1},
     "slip_start_phase is known to 0.5 of its value, the tolerance is 0.01 (1 other measure beside it); set "
     "accuracy.steps_per_cycle = 128")])
def test_exact_what_a_run_answers_first_is_named_first(wide, first):
    """Errors of 16 steps; that of second order falls by 16 at 64 steps, by 64 at 128."""
    measures = {name: Measure(1.0, "1", error) for name, error in wide.items()}
    left = {"steps": wide, "space": {}, "orders": dict.fromkeys(wide, 2.0)}
    asked = SimpleNamespace(model=build(loads(SHAKEN + FEW)))
    seen = SimpleNamespace(plan=asked, measures=measures, patch=None, extra={"steps_per_cycle": 16, "left_open": left})
    assert loose(seen) == [first]
