"""summary.json names the method that computed each measure, and the patch of a result has its
arrays."""

import numpy as np

from patchfem import run

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
