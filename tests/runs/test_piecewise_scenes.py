"""Scenes with elastic-plastic elements: the exact engine, which steps between yield events, agrees with the march."""

from __future__ import annotations

import pytest
from support.scene_texts import (
    COULOMB,
    KILOGRAM,
)

import patchfem as pf


def test_exact_errors_of_levels_include_mesh_error():
    """The errors of a drive level of a patch include the error of the mesh: at the first level they
    agree within a factor of 4 with those of a single run, and at the last level with those of the
    final measures. The onset levels of two meshes agree within their errors.

    The errors were 1e-9 of the values in an earlier version.
    """
    text = (
        '[contact]\nlength = "40 mm"\nwidth = "30 mm"\nheight = "10 mm"\nload = "6 kN"\nsubstrate = "steel"\n'
        '[contact.crown]\nradius = "100 m"\n[contact.shear]\n'
        + COULOMB
        + KILOGRAM
        + '[drive]\nkind = "force"\nfrequency = "90 Hz"\ncycles = 10\n'
    )
    # Without a repetition, whether the time of the machine allows it or not.
    single = text + 'force = "600 N"\n[accuracy]\ntolerance = 1e-2\nmax_seconds = 0.01'
    single_force = pf.run(single).measures
    levels = (
        text
        + 'waveform = "levels"\nonset = "slip"\nlevels = ["600 N", "1200 N"]\n[accuracy]\ntolerance = '
    )
    coarse, fine = (pf.run(levels + tolerance) for tolerance in ("1e-2", "3e-3"))
    first_level, last_level = coarse.extra["levels"]
    for name, value in last_level.values.items():
        assert last_level.errors[name] == pytest.approx(
            coarse.measures[name].error, rel=1e-6, abs=3e-9 * abs(value)
        ), name
    assert all(
        1 / 4 < first_level.errors[name] / single_force[name].error < 4
        for name in first_level.values
    )
    a, b = (result.measures["onset_level"] for result in (coarse, fine))
    assert abs(a.value - b.value) <= a.error + b.error and a.error < 0.05 * a.value
    assert any(
        "onset_level: slip counts only if its amplitude" in note for note in coarse.extra["notes"]
    )
