"""Drive levels of a patch: their errors include the error of the mesh."""

import pytest
from scene_texts import COULOMB, KILOGRAM

import patchfem as pf


def test_exact_errors_of_levels_include_mesh_error():
    """The errors of a drive level of a patch include the error of the mesh: at the first level they
    agree within a factor of 2 with those of a single run, and at the last level with those of the
    final measures. The onset levels of two meshes agree within their errors.

    The errors were 1e-9 of the values in an earlier version.
    """
    # Without further passes: each that fits into the time is made, and within 1 s their number depends on the machine.
    text = (
        "[accuracy]\nmax_seconds = 0.001\n"
        '[contact]\nlength = "40 mm"\nwidth = "30 mm"\nheight = "10 mm"\nload = "6 kN"\nsubstrate = "steel"\n'
        '[contact.crown]\nradius = "100 m"\n[contact.shear]\n'
        + COULOMB
        + KILOGRAM
        + '[drive]\nkind = "force"\nfrequency = "90 Hz"\ncycles = 10\n'
    )
    single_force = pf.run(text + 'force = "600 N"', **{"accuracy.tolerance": 1e-2}).measures
    levels = text + 'waveform = "levels"\nonset = "slip"\nlevels = ["600 N", "1200 N"]\n'
    coarse, fine = (pf.run(levels, **{"accuracy.tolerance": one}) for one in (1e-2, 3e-3))
    first_level, last_level = coarse.motion.levels
    for name, value in last_level.values.items():
        assert last_level.errors[name] == pytest.approx(
            coarse.measures[name].error, rel=1e-6, abs=3e-9 * abs(value)
        ), name
    # The mesh dominates the errors of these measures.
    for name in ("relative_displacement_amplitude", "loop_area", "equivalent_stiffness"):
        assert 1 / 2 < first_level.errors[name] / single_force[name].error < 2, name
    a, b = (result.measures["onset_level"] for result in (coarse, fine))
    assert abs(a.value - b.value) <= a.error + b.error and a.error < 0.05 * a.value
    assert any("onset_level: slip counts only if its amplitude" in note for note in coarse.notes)
