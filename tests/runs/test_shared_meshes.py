"""Shared meshes of a sweep: they do not depend on the order of the cases and give the results of
single runs."""

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


def build_model(angle=1e-4, load=100.0, keys="", tail=""):
    """Return the model of a patch with a tilt [rad] and a load [N]."""
    return build(
        scene.loads(TEXT.format(load, angle, tail).replace("substrate", keys + "substrate", 1))
    )


def build_family(*angles, **keys):
    """Return models of all angles."""
    return [build_model(angle, **keys) for angle in angles]


def test_always_shared_mesh_meets_tolerance_of_every_case():
    """The mesh is refined until the errors of the worst case are below the tolerance."""
    text = TEXT.replace("1e-2", "1e-3")
    cases = [build(scene.loads(text.format(100, angle, ""))) for angle in (2e-5, 1e-3)]
    for case in with_shared_meshes(cases):
        measures = run(case).measures
        for measure in (measures["pressure_peak"], measures["normal_stiffness"]):
            assert measure.error <= 1e-3 * measure.value + measure.floor


def test_exact_single_cases_keep_their_own_mesh():
    """Only cases with the same pieces share a mesh; a single case, a prescribed mesh and a refused
    case are left unchanged."""
    plane = build_family(1e-4, 1e-5, keys='plane = "stress"\n')
    fault = PatchfemError("a case that was refused")
    models = with_shared_meshes(
        [*build_family(1e-4), fault, *plane, *build_family(1e-4, keys='element_size = "0.4 mm"\n')]
    )
    assert models[1] is fault
    cases = [models[0], *models[2:]]
    assert [case.patch.mesh.shared is None for case in cases] == [True, False, False, True]


@pytest.mark.filterwarnings("error")
def test_always_case_that_tips_over_keeps_shared_mesh_of_others():
    """A case that tips over does not change the shared mesh of the others and fails only when it is run."""
    valid = build_family(1e-5, 1e-4)
    tipped = [
        replace(case, patch=case.patch.with_loading(load=100.0, line_moment=10.0, can_rotate=True))
        for case in valid[:1]
    ]
    models = with_shared_meshes([*valid, *tipped])
    assert models[0].patch.mesh.shared.name == with_shared_meshes(valid)[0].patch.mesh.shared.name
    with pytest.raises(PatchfemError, match="tips over"):
        run(models[2])


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


def test_always_loop_errors_of_sweep_are_close_to_single_runs():
    """On a shared mesh the error of the loop area is at most 1.5 times that of a single run, and
    the values agree within the errors."""
    cases = [build(scene.loads(JOINT.format(size))) for size in (0.2, 1.4, 10.0)]
    for single_case, shared_case in zip(cases, with_shared_meshes(cases), strict=True):
        single, on_shared_mesh = (
            run(case).measures["loop_area"] for case in (single_case, shared_case)
        )
        assert on_shared_mesh.error <= 1.5 * single.error
        assert abs(on_shared_mesh.value - single.value) <= on_shared_mesh.error + single.error
