"""One mesh for all cases of a sweep: whatever the order, as good as each case's own, and the same answers as a cold
run on it."""

from dataclasses import replace

import pytest
from scene_texts import COATING, CROWNED_JOINT, PIECE

from patchfem import build
from patchfem.core import PatchfemError
from patchfem.runs import with_shared_meshes
from patchfem.runs.run import run
from patchfem.scene import scene

TEXT = (
    PIECE
    + """\
load = "{} N"
substrate = "Ti-8Al-1Mo-1V"
"""
    + COATING
    + """
[contact.tilt]
angle = "{} rad"
{}
[accuracy]
tolerance = 1e-2
"""
)


def model(angle=1e-4, load=100.0, keys="", tail=""):
    return build(
        scene.loads(TEXT.format(load, angle, tail).replace("substrate", keys + "substrate", 1))
    )


def family(*angles, **keys):
    return [model(angle, **keys) for angle in angles]


@pytest.mark.parametrize("angle", [1e-6, 1e-3])
def test_exact_a_case_is_the_cold_run_on_the_shared_mesh(angle):
    one = next(
        m for m in with_shared_meshes(family(1e-6, 1e-5, 1e-3)) if m.patch.gap.angle == angle
    )
    run(one)
    warm = run(one)
    cold = run(one, fresh=True)
    assert warm.patch.x.size == cold.patch.x.size
    for name, m in cold.measures.items():
        same = warm.measures[name]
        assert same.value == pytest.approx(m.value, rel=1e-12, abs=1e-12 * m.floor), name
        assert same.error == pytest.approx(m.error, rel=1e-12, abs=1e-12 * abs(m.value)), name


def test_exact_other_geometries_and_lonely_cases_keep_their_own_mesh():
    plane = family(1e-4, 1e-5, keys='plane = "stress"\n')
    fault = PatchfemError("a case that was refused")
    found = with_shared_meshes(
        [*family(1e-4), fault, *plane, *family(1e-4, keys='element_size = "0.4 mm"\n')]
    )
    assert found[1] is fault
    cases = [found[0], *found[2:]]
    assert [one.patch.mesh.shared is None for one in cases] == [True, False, False, True]


@pytest.mark.filterwarnings("error")
def test_always_a_case_that_cannot_be_pressed_costs_the_others_nothing():
    good = family(1e-5, 1e-4)
    tipped = [
        replace(one, patch=one.patch.with_loading(load=100.0, line_moment=10.0, can_rotate=True))
        for one in good[:1]
    ]
    found = with_shared_meshes([*good, *tipped])
    assert found[0].patch.mesh.shared.name == with_shared_meshes(good)[0].patch.mesh.shared.name
    with pytest.raises(PatchfemError, match="tips over"):
        run(found[2])


JOINT = (
    CROWNED_JOINT
    + """\
[slide]
kind = "sine"
amplitude = "{} um"
frequency = "1 Hz"
cycles = 3
[accuracy]
tolerance = 1e-2
"""
)


def test_always_loops_of_a_sweep_have_errors_like_those_of_single_runs():
    cases = [build(scene.loads(JOINT.format(size))) for size in (0.2, 1.4, 10.0)]
    for own, shared in zip(cases, with_shared_meshes(cases), strict=True):
        alone, found = (run(one).measures["loop_area"] for one in (own, shared))
        assert found.error <= 1.5 * alone.error
        assert abs(found.value - alone.value) <= found.error + alone.error


def test_always_cases_of_a_sweep_have_the_remedies_of_single_runs():
    """A shared mesh has other nodes, so that errors differ a little; what cures them is the same."""
    text = JOINT.replace("tolerance = 1e-2", "tolerance = 1e-3")
    cases = [build(scene.loads(text.format(size))) for size in (0.2, 1.4)]
    for own, shared in zip(cases, with_shared_meshes(cases), strict=True):
        alone = run(own)
        found = run(shared)
        assert any("the mesh (" in one for one in alone.warnings)
        assert [one.rpartition("; ")[2] for one in found.warnings] == [
            one.rpartition("; ")[2] for one in alone.warnings
        ]
