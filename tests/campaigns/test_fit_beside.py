"""What a fit settles besides the values of its scene: offsets of the record, a warm-up, any elastic range."""

import json

import numpy as np
import pytest
from command_line import run_cli
from test_fit import LAWS, LOAD, POINT, SINE, dahl, free_of, play, rows, scene_of, table

from patchfem.campaigns import LoopOptions, fit_loop
from patchfem.campaigns.fits.loop_path import count_whole_cycles, prepend_warm_up
from patchfem.core import PatchfemError
from patchfem.inputs import read_loop

TRUTH = [0.31, 2.3e-6]
NAMES = ("friction.static", "friction.bond_length")


def test_exact_a_steady_loop_with_an_offset_of_the_force(tmp_path):
    """Cut out of a running motion, biased by 7 N: a warm-up and a free offset find the numbers again."""
    time, slide = rows(80, 4)
    force = dahl(slide, *TRUTH) + 7.0
    cut = slice(93, 280)
    loop = table(tmp_path / "loop.csv", time[cut], slide[cut], force[cut])
    scene = scene_of(tmp_path, "bonds")
    found = fit_loop(scene, loop, free_of(*NAMES), options=LoopOptions(("force",), True))
    assert found.keys.fit.values == pytest.approx([*TRUTH, 7.0], rel=1e-5)
    assert found.rms < 1e-5 * LOAD and found.keys.warnings == []
    plain = fit_loop(scene, loop, free_of(*NAMES))
    assert plain.rms > 1.0 and any("--warm-up" in one for one in plain.keys.warnings)


def test_exact_the_unstressed_place_is_found(tmp_path):
    """A record that begins 1.1 um beyond the unstressed place."""
    time, slide = rows(80, 1)
    place = 1.1e-6 + slide
    force = play(np.concatenate([[0.0], place]), *TRUTH)[1:]
    loop = table(tmp_path / "loop.csv", time, slide, force)
    found = fit_loop(
        scene_of(tmp_path, "elastic-plastic"),
        loop,
        free_of(*NAMES),
        options=LoopOptions(("displacement",)),
    )
    assert found.keys.fit.values == pytest.approx([*TRUTH, 1.1e-6], rel=1e-5)


def test_exact_a_lead_in_ends_where_the_record_begins(tmp_path):
    """Rows of a sine cut at any phase: one period lies between a warm row and its repetition."""
    time, slide = rows(50, 2)
    place = slide[3:] - slide[3]
    loop = read_loop(table(tmp_path / "loop.csv", time[3:], place, np.ones(place.size)))
    warm = count_whole_cycles(loop)
    assert warm == 50 or warm == 51
    moments, path, before = prepend_warm_up(loop.time, loop.displacement, warm, 2e-6)
    assert before == warm + 1 and path[0] == 0 and np.diff(moments).min() > 0
    assert path[before:] - 2e-6 == pytest.approx(loop.displacement, abs=1e-18)
    assert moments[before] - moments[1] == pytest.approx(1e-2, abs=2e-4 * 1e-2 + 1e-9)


def test_refuses_a_warm_up_of_a_record_without_a_cycle(tmp_path):
    time, slide = rows(80, 1)
    loop = table(tmp_path / "loop.csv", time[:30], slide[:30], np.ones(30))
    with pytest.raises(PatchfemError, match="returns to its first value and passes it"):
        fit_loop(scene_of(tmp_path, "bonds"), loop, free_of(*NAMES), options=LoopOptions((), True))
    with pytest.raises(
        PatchfemError, match="--offset time: not a possible offset; use force or displacement"
    ):
        fit_loop(scene_of(tmp_path, "bonds"), loop, free_of(*NAMES), options=LoopOptions(("time",)))


def test_always_the_verb_writes_its_offsets(tmp_path):
    time, slide = rows(40, 4)
    loop = table(tmp_path / "loop.csv", time[47:], slide[47:], dahl(slide, *TRUTH)[47:] - 3.0)
    (tmp_path / "scene.toml").write_text(POINT + LAWS["bonds"] + SINE, "utf-8")
    done = run_cli(
        "fit",
        tmp_path / "scene.toml",
        "--to",
        loop,
        "--free",
        *free_of(*NAMES),
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
