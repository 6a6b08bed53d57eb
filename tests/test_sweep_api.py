"""`pf.sweep` and `pf.run_many`: every case equals a single run."""

import numpy as np
import pytest
import xarray as xr
from command_line import read_page
from scene_texts import BENCH, COULOMB, POINT, SHORT

import patchfem as pf
from patchfem.export import store

RIG = POINT + COULOMB + SHORT
OVER = {"friction.static": [0.1, 0.3], "drive.acceleration": ["1 g", "5 g"]}


@pytest.fixture(scope="module")
def swept_rig():
    """Return a sweep of a rig over friction coefficient and acceleration."""
    return pf.sweep(RIG, OVER)


def test_exact_sweep_axes_in_numbers_texts_and_table_agree(swept_rig):
    """A sweep gives the same Dataset for axes given as numbers, as texts and ranges, or as the table [sweep]."""
    table = '[sweep]\n"friction.static" = "0.1,0.3"\n"drive.acceleration" = "1 g..5 g:2"\n'
    numbers = {
        "friction.static": np.array([0.1, 0.3]),
        "drive.acceleration": swept_rig.drive_acceleration.values,
    }
    for found in (pf.sweep(pf.load(RIG), numbers), pf.sweep(RIG + table)):
        xr.testing.assert_equal(found, swept_rig)


def test_exact_sweep_folder_has_same_data(swept_rig, tmp_path):
    """The folder of a sweep contains the same Dataset, and a resumed sweep returns it unchanged."""
    found = pf.sweep(RIG, OVER, out=tmp_path / "a")
    xr.testing.assert_equal(found.drop_vars("folder"), swept_rig)
    with xr.open_dataset(tmp_path / "a/sweep.nc") as stored:
        xr.testing.assert_equal(stored, found)
    xr.testing.assert_equal(pf.sweep(RIG, OVER, out=tmp_path / "a", resume=True), found)


def test_exact_page_names_command(tmp_path):
    """The page of a sweep in Python names the command that repeats it, with the keywords of the scene and random cases."""
    scene = tmp_path / "rig.toml"
    scene.write_text(RIG, "utf-8")
    loaded = pf.load(scene, **{"drive.cycles": 10})
    pf.sweep(loaded, {"friction.static": "0.1..0.3"}, draw=2, seed=4, out=tmp_path / "drawn")
    command = "patchfem sweep rig.toml --set drive.cycles=10 --over friction.static=0.1..0.3 --random 2 --seed 4"
    assert store.read_answer(tmp_path / "drawn").origin["command"] == command
    assert command in read_page(tmp_path / "drawn")


def test_exact_page_of_scene_without_file_names_no_command(tmp_path):
    """A scene that is given as a text has no file that a command could name, in a sweep and in a run."""
    pf.sweep(BENCH, {"friction.static": [0.1, 0.3]}, out=tmp_path / "swept")
    pf.run(BENCH).save(tmp_path / "run")
    for name in ("swept", "run"):
        assert not store.read_answer(tmp_path / name).origin["command"]
        assert "To repeat it" not in read_page(tmp_path / name)


def test_refuses_all_keys_without_values():
    """Each key with an empty list of values is named."""
    with pytest.raises(pf.SceneError) as caught:
        pf.sweep(BENCH, {"friction.static": [], "normal.load": ""})
    assert all(
        f"{key}: the sweep has no value" in str(caught.value)
        for key in ("friction.static", "normal.load")
    )


def test_refuses_invalid_sweep():
    """A sweep with a negative seed or number of cases, or with a truth value as number, is refused."""
    for draw in ({"draw": 2, "seed": -1}, {"draw": -2}, {"sobol": True}):
        with pytest.raises(pf.SceneError, match="whole numbers >= 0"):
            pf.sweep(RIG, {"normal.load": "1 N..2 N"}, **draw)


def test_exact_run_many_equals_single_runs():
    """Every measure of `pf.run_many` equals that of a single run within 1e-12."""
    found = pf.run_many([RIG, pf.build(BENCH)])
    for case, text in enumerate((RIG, BENCH)):
        single = pf.run(text)
        assert found.outcome[case] == single.outcome
        for name, measure in single.measures.items():
            expected = np.nan if measure.value is None else measure.value
            # scale of the measures: 1 for a distortion, 1 mm for the drift of an amplitude
            size = {"1": 1.0, "m": 1e-3}.get(measure.unit, 0.0)
            np.testing.assert_allclose(
                found.values[name][case], expected, rtol=1e-12, atol=1e-12 * size
            )
