"""A run is repeated with a finer resolution until its main measures meet the tolerance."""

import re
from time import process_time

import numpy as np
import pytest

import patchfem as pf
from patchfem import kernel_cache
from patchfem.core import Measure
from patchfem.runs import refine

MAIN_MEASURES = (
    "relative_displacement_amplitude",
    "loop_area",
    "friction_ratio_peak",
    "pressure_peak",
)

# Bonds that weaken over .2 um of slip, which 400 steps of a slide of 40 um do not resolve.
WEAKENING = """
[normal]
load = "1.8 kN"
[friction]
law = "nonlocal"
static = 0.3
kinetic = 0.14
bond_length = ".76 um"
rest_growth = "0.29 mm/s^2"
slip_growth = ".2 um"
rest_speed = "75 um/s"
[slide]
kind = "sine"
amplitude = "40 um"
frequency = "30 Hz"
cycles = 4
"""


BOLTED = """\
[contact]
length = "10.931 mm"
width = "12.534 mm"
height = "2.6951 mm"
load = "458.38 N"
substrate = "Ti-8Al-1Mo-1V"
[contact.tilt]
angle = "0.00016448 rad"
[contact.shear]
[friction]
law = "coulomb"
static = 0.40914
[structure]
measured = "stuck"
moving_mass = "2.0792 kg"
[[structure.mode]]
name = "m0"
frequency = "405.41 Hz"
damping = 0.01166
slide = 0.051239
base = 1.0
output = 1.0
[drive]
kind = "force"
frequency = "368.97 Hz"
force = "3.8025 N"
cycles = 400
"""


def find_excess(result) -> float:
    """Return the largest ratio of error to allowed error of the main measures."""
    tolerance = result.plan.model.accuracy.tolerance
    measures = result.measures.items()
    return max(one.error_ratio(tolerance) for name, one in measures if name in MAIN_MEASURES)


@pytest.mark.long
def test_exact_beam_is_refined_until_its_loop_meets_the_tolerance():
    """The template `beam` misses its tolerance on the first mesh. With more time it meets it, and agrees with the coarse
    run within both errors; the warning of the coarse run names the time that the next pass needs.

    The shear stress of each frame of the fine run adds up to the friction force, although its log of events is full.
    """
    once = pf.run(pf.new("beam"), **{"accuracy.max_seconds": 1e-3})
    done = pf.run(pf.new("beam"))
    assert find_excess(once) > 5
    assert find_excess(done) <= 1
    assert done.patch.x.size >= 4 * once.patch.x.size - 3
    coarse, fine = (run.measures["loop_area"] for run in (once, done))
    assert abs(coarse.value - fine.value) <= coarse.error + fine.error
    assert fine.error < coarse.error / 10
    force = done.fields["shear_stress"] @ done.patch.pieces.interface.weight
    expected = np.interp(done.fields["time"], done.response.time, done.response.force)
    assert np.abs(force - expected)[1:].max() < 1e-5 * expected.max()
    (named,) = set(re.findall(r"set accuracy\.max_seconds = ([\d.]+)", " ".join(once.warnings)))
    assert float(named) > 1e-3


def test_always_mesh_that_the_scene_gives_is_kept():
    """A run does not change an element size that the scene gives."""
    result = pf.run(pf.new("beam"), **{"contact.element_size": "0.5 mm"})
    assert find_excess(result) > 1
    assert result.patch.x.size < 150
    assert not any("max_seconds" in warning for warning in result.warnings)


def test_exact_bench_has_more_steps_until_its_peak_meets_the_tolerance():
    """The peak of the friction of weakening bonds follows with more steps; fixed steps are kept, and their error holds."""
    fixed = pf.run(WEAKENING, **{"accuracy.steps_per_cycle": 400})
    done = pf.run(WEAKENING)
    exact = pf.run(WEAKENING, **{"accuracy.steps_per_cycle": 20000})
    truth = exact.measures["friction_ratio_peak"].value
    assert fixed.settings.steps_per_cycle == 400
    assert done.settings.steps_per_cycle > 400
    assert find_excess(fixed) > 1
    assert find_excess(done) <= 1
    for result in (fixed, done):
        peak = result.measures["friction_ratio_peak"]
        assert abs(peak.value - truth) <= peak.error


@pytest.mark.parametrize("excess, passes", [(1.0, 1), (3.9, 2), (15.0, 3), (15e3, 4)])
@pytest.mark.parametrize("is_short", [False, True])
def test_exact_passes_of_a_run_end_where_it_would_need_more_time(excess, passes, is_short):
    """Each pass takes twice the time of the one before and divides the excess by four; the axis has three finer passes.

    A run whose last pass alone would take more than its time ends with the pass before, and knows what all passes would
    take. The clock is that of the test.
    """
    clock = [100.0]

    def solve(resolution: int, before: int | None) -> int:
        """Take the CPU time of a resolution."""
        clock[0] += resolution
        return resolution

    def judge(solution: int, excesses: list[float]) -> refine.Verdict:
        """Ask for twice the resolution until the excess is met, at most for three passes."""
        left = excess / 4 ** len(excesses)
        if left <= 1 or solution == 8:
            return refine.Verdict(left)
        n_passes = 3 - len(excesses)
        return refine.Verdict(left, 2 * solution, "steps", solution, 2.0, n_passes)

    needed = 2.0**passes - 1
    limit = refine.RunLimit(needed - 0.5 if is_short else needed, 100.0, lambda: clock[0])
    solution, shortage = refine.refine(solve, 1, judge, limit)
    if is_short and passes > 1:
        assert (solution, shortage) == (
            2 ** (passes - 2),
            ("steps", needed, "accuracy.max_seconds"),
        )
    else:
        assert (solution, shortage) == (2 ** (passes - 1), None)


def test_exact_pass_follows_that_the_time_allows_although_all_passes_would_not():
    """A pass of 2 s follows one of 1 s within 4 s, although three passes are expected; it meets the tolerance by itself."""
    clock = [0.0]

    def solve(resolution: int, before: int | None) -> int:
        """Take the CPU time of a resolution."""
        clock[0] += resolution
        return resolution

    def judge(solution: int, excesses: list[float]) -> refine.Verdict:
        """Find an error 44 times the allowed one in the first pass, and an allowed one in the second."""
        return refine.Verdict(0.5) if excesses else refine.Verdict(44.0, 2, "mesh", 1.0, 2.0)

    limit = refine.RunLimit(4.0, 0.0, lambda: clock[0])
    assert judge(1, []).predict_seconds() > 4.0
    assert refine.refine(solve, 1, judge, limit) == (2, None)


def test_compiling_takes_no_time_of_a_run():
    """The CPU time in which code is compiled is left out, so that the first run on a machine is refined like the others."""
    limit = refine.RunLimit(1.0, refine.measure_cpu_time())
    begin = process_time()
    with kernel_cache.measure_compile_time():
        sum(range(10**6))
    assert limit.clock() - limit.begin < process_time() - begin


def test_exact_steps_of_a_rig_are_refined_within_its_time():
    """The steps of a rig are refined until its main measures meet the tolerance, or else a finding names axis and key."""
    scene = pf.new("rig")
    march = {"accuracy.method": "march"}
    once = pf.run(scene, **march, **{"accuracy.max_seconds": 1e-6})
    done = pf.run(scene, **march)
    assert once.settings.steps_per_cycle == 400 < done.settings.steps_per_cycle
    assert find_excess(done) <= 1 and not done.warnings and done.shortage is None
    (finding,) = once.findings
    assert finding.advice.axis == once.shortage.axis == "steps"
    assert finding.advice.key == "accuracy.max_seconds"
    assert finding.advice.value >= once.shortage.needed > 1e-6
    assert once.warnings == [finding.sentence]

    # A method without steps does not use the key, and says so.
    fixed = {"accuracy.method": "harmonic", "accuracy.max_seconds": 1e-6}
    (remark,) = [text for text in pf.run(scene, **fixed).warnings if "max_seconds" in text]
    assert "is not used, because this run is never repeated" in remark


@pytest.mark.parametrize(
    "parts, axis",
    [
        ({"steps": 8e-4, "mesh": 4e-4}, "steps"),  # most of the error
        ({"steps": 3e-4, "mesh": 9e-4}, "steps"),  # the mesh alone meets the tolerance
        ({"steps": 3e-4, "mesh": 1.1e-3}, ""),  # smaller steps do not help
        ({"mesh": 2e-3}, ""),
    ],
)
def test_exact_steps_are_refined_where_they_alone_bring_a_measure_inside(parts, axis):
    """Smaller steps follow if they have most of an error, or if a measure meets its tolerance without their part."""
    error = sum(parts.values())
    measure = Measure(1.0, "m", error, 0.0, parts=parts)
    worst = refine.find_worst_measure({"loop_area": measure}, 1e-3, ["steps"])
    assert worst.axis == axis
    assert worst.excess == (pytest.approx(error / 1e-3) if axis else 0.0)


def test_exact_errors_of_a_pass_are_bounded_with_their_causes():
    """An error that vanishes by chance is a quarter of that of the pass before, with the shares of its axes."""
    before = {"a": Measure(1.0, "m", 4.0, 0.0, parts={"steps": 4.0})}
    now = {"a": Measure(1.0, "m", 0.0, 0.0, parts={"steps": 0.0})}
    bounded = refine.bound_errors(now, before)["a"]
    assert (bounded.error, bounded.parts) == (1.0, {"steps": 1.0})


def test_exact_mesh_beyond_the_memory_is_not_computed():
    """A joint whose next mesh needs more than accuracy.max_memory keeps its mesh, and its warning names a larger value."""
    result = pf.run(pf.load(BOLTED), **{"accuracy.max_memory": "300 MB"})
    (warning,) = [text for text in result.warnings if "max_memory" in text]
    assert result.shortage.axis == "mesh" and 300e6 < result.shortage.needed < 2e9
    assert float(re.search(r'set accuracy\.max_memory = "([\d.]+) GB"', warning)[1]) > 0.3
    assert find_excess(result) > 1
