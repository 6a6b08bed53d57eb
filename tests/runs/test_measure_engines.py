"""summary.json names the method that computed each measure, and the patch of a result has its
arrays."""

import numpy as np

from patchfem import run
from patchfem.export import summarise_run
from patchfem.runs.patch.values import compute_static_values
from patchfem.runs.results import patch_rows

PATCH = """
[contact]
length = "12.7 mm"
width = "12.7 mm"
height = "6.35 mm"
load = "26 lbf"
substrate = "Ti-8Al-1Mo-1V"
[contact.crown]
radius = "1 m"
[accuracy]
tolerance = {}
"""
SLIDE = """
[friction]
law = "coulomb"
static = 0.3
[slide]
kind = "sine"
amplitude = "5 um"
frequency = "143 Hz"
"""


def test_always_summary_names_method_of_each_measure():
    """A measure has the value of the finest mesh if and only if the summary names the finest mesh
    as its method."""
    result = run(PATCH.format(1e-3))
    on_mesh = compute_static_values(result.patch)
    methods = summarise_run(result)["numerics"]["measures"]
    assert methods.keys() == {
        name for name, measure in result.measures.items() if measure.value is not None
    }
    assert patch_rows.EXTRAPOLATED_SOURCE in methods.values()
    for name, method in methods.items():
        is_of_mesh = result.measures[name].value == on_mesh[name]
        assert (
            is_of_mesh
            if method == patch_rows.FINEST_MESH_SOURCE
            else on_mesh[name] == 0 or not is_of_mesh
        ), name


def test_always_motion_measures_name_engine_of_run():
    """Measures of the motion name the engine of the run, those of the patch the finite elements."""
    numerics = summarise_run(run(PATCH.format(1e-2) + SLIDE))["numerics"]
    assert numerics["measures"]["secant_stiffness"] == numerics["engine"]
    assert numerics["measures"]["normal_stiffness"].startswith("finite elements")


def test_exact_arrays_of_static_patch_balance_load():
    """The arrays of a static patch are those of its fields: the pressure balances the load and excludes a gap."""
    result = run(PATCH.format(1e-2))
    patch = result.patch
    force = patch.pieces.interface.weight @ patch.normal_stress
    assert abs(force / result.measures["normal_load"].value - 1) < 1e-10
    assert np.array_equal(patch.normal_stress, result.fields["normal_stress"][-1])
    assert np.array_equal(patch.gap, result.fields["gap"][-1])
    assert (patch.gap[patch.normal_stress > 0] == 0).all() and patch.gap.max() > 0
    assert not patch.shear_stress.any() and not patch.slip.any()
    assert patch.shear_stress.shape == patch.slip.shape == patch.x.shape


def test_exact_arrays_of_sliding_patch_are_last_frame():
    """Shear stress and slip of a sliding patch are those of the last frame."""
    bench = PATCH.replace("[accuracy]", "[contact.shear]\n[accuracy]").format(1e-2) + SLIDE
    result = run(bench)
    for name in ("shear_stress", "slip"):
        assert np.array_equal(getattr(result.patch, name), result.fields[name][-1])
    assert result.patch.shear_stress.any() and result.patch.slip.any()
