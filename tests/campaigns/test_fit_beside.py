"""Fits with offsets of the record and with a cycle before its first row (warm-up)."""

import json

import numpy as np
import pytest
from command_line import run_cli
from test_fit import (
    LAWS,
    LOAD,
    POINT,
    SINE,
    dahl_force,
    elastic_plastic_force,
    free_ranges,
    load_scene,
    sine_path,
    write_loop,
)

from patchfem.campaigns import LoopOptions, fit_hysteresis_loop
from patchfem.campaigns.fits.loop_path import count_warm_up_rows, prepend_warm_up
from patchfem.core import PatchfemError
from patchfem.inputs import read_loop

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


def test_exact_warm_up_path_ends_at_first_row(tmp_path):
    """The warm-up path ends at the first row of a sine that begins at an arbitrary phase.

    One period lies between a row of the warm-up and the same row of the record.
    """
    time, slide = sine_path(50, 2)
    position = slide[3:] - slide[3]
    loop = read_loop(write_loop(tmp_path / "loop.csv", time[3:], position, np.ones(position.size)))
    warm_up_rows = count_warm_up_rows(loop)
    assert warm_up_rows == 50 or warm_up_rows == 51
    times, path, before = prepend_warm_up(loop.time, loop.displacement, warm_up_rows, 2e-6)
    assert before == warm_up_rows + 1 and path[0] == 0 and np.diff(times).min() > 0
    assert path[before:] - 2e-6 == pytest.approx(loop.displacement, abs=1e-18)
    assert times[before] - times[1] == pytest.approx(1e-2, abs=2e-4 * 1e-2 + 1e-9)


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


def test_always_fit_command_writes_offsets(tmp_path):
    """The command writes the fitted offset of the force and the effective number of rows."""
    time, slide = sine_path(40, 4)
    loop = write_loop(
        tmp_path / "loop.csv", time[47:], slide[47:], dahl_force(slide, *TRUTH)[47:] - 3.0
    )
    (tmp_path / "scene.toml").write_text(POINT + LAWS["bonds"] + SINE, "utf-8")
    done = run_cli(
        "fit",
        tmp_path / "scene.toml",
        "--to",
        loop,
        "--free",
        *free_ranges(*NAMES),
        "--offset",
        "force",
        "--warm-up",
        "--json",
        "-o",
        tmp_path / "out",
    )
    answer = json.loads(done.out)
    assert answer["offsets"]["force"]["value"] == pytest.approx(-3.0, rel=1e-4)
    assert answer["values"]["friction.static"]["low"] <= answer["values"]["friction.static"]["high"]
    assert answer["effective_rows"] <= answer["rows"]
