"""Fits with offsets of the record and with a cycle before its first row (warm-up)."""

import numpy as np
import pytest
from test_fit import (
    LOAD,
    dahl_force,
    elastic_plastic_force,
    free_ranges,
    load_scene,
    sine_path,
    write_loop,
)

from patchfem.campaigns.fits.loop import fit_hysteresis_loop
from patchfem.campaigns.fits.loop_path import LoopOptions
from patchfem.core import PatchfemError

TRUTH = [0.31, 2.3e-6]
NAMES = ("friction.static", "friction.bond_length")


def test_exact_offset_of_force_is_recovered_from_steady_loop(tmp_path):
    """Parameters and a force offset of 7 N are recovered from a loop cut out of a steady motion.

    Without warm-up and offset the fit is poor and proposes `--warm-up`.
    """
    time, slide = sine_path(80, 4)
    force = dahl_force(slide, *TRUTH) + 7.0
    cut = slice(93, 280)
    loop = write_loop(tmp_path / "loop.csv", time[cut], slide[cut], force[cut])
    scene = load_scene(tmp_path, "bonds")
    result = fit_hysteresis_loop(
        scene, loop, free_ranges(*NAMES), options=LoopOptions(("force",), True)
    )
    assert result.keys.fit.values == pytest.approx([*TRUTH, 7.0], rel=1e-5)
    assert result.rms < 1e-5 * LOAD and result.keys.warnings == []
    plain = fit_hysteresis_loop(scene, loop, free_ranges(*NAMES))
    assert plain.rms > 1.0 and any("--warm-up" in one for one in plain.keys.warnings)


def test_exact_offset_of_displacement_is_recovered(tmp_path):
    """The offset of a record that begins 1.1 um from the unstressed position is recovered within 1e-5."""
    time, slide = sine_path(80, 1)
    position = 1.1e-6 + slide
    force = elastic_plastic_force(np.concatenate([[0.0], position]), *TRUTH)[1:]
    loop = write_loop(tmp_path / "loop.csv", time, slide, force)
    result = fit_hysteresis_loop(
        load_scene(tmp_path, "elastic-plastic"),
        loop,
        free_ranges(*NAMES),
        options=LoopOptions(("displacement",)),
    )
    assert result.keys.fit.values == pytest.approx([*TRUTH, 1.1e-6], rel=1e-5)


def test_refuses_warm_up_of_record_without_full_cycle(tmp_path):
    """A warm-up of a record that is shorter than one cycle is refused, as is an unknown offset."""
    time, slide = sine_path(80, 1)
    loop = write_loop(tmp_path / "loop.csv", time[:30], slide[:30], np.ones(30))
    with pytest.raises(PatchfemError, match="returns to its first value and passes it"):
        fit_hysteresis_loop(
            load_scene(tmp_path, "bonds"), loop, free_ranges(*NAMES), options=LoopOptions((), True)
        )
    with pytest.raises(
        PatchfemError, match="--offset time: not a possible offset; use force or displacement"
    ):
        fit_hysteresis_loop(
            load_scene(tmp_path, "bonds"), loop, free_ranges(*NAMES), options=LoopOptions(("time",))
        )
