"""pf.sweep and pf.run_many: many runs from Python, each as a single run."""

import numpy as np
import pytest
import xarray as xr
from scene_texts import BENCH, COULOMB, PATCH, POINT, SHORT

import patchfem as pf

RIG = POINT + COULOMB + SHORT
OVER = {"friction.static": [0.1, 0.3], "drive.acceleration": ["1 g", "5 g"]}


def alike(found, single, one) -> None:
    """The number of a single run to 1e-12 of it or of what it is a part of; nothing where that has none."""
    # a distortion is a share, a drift that of an amplitude
    size = {"1": 1.0, "m": 1e-3}.get(one.unit, 0.0)
    np.testing.assert_allclose(
        found, np.nan if single is None else single, rtol=1e-12, atol=1e-12 * size
    )


@pytest.fixture(scope="module")
def swept():
    return pf.sweep(RIG, OVER)


def test_exact_numbers_texts_ranges_and_the_table_say_the_same(swept):
    table = '[sweep]\n"friction.static" = "0.1,0.3"\n"drive.acceleration" = "1 g..5 g:2"\n'
    numbers = {
        "friction.static": np.array([0.1, 0.3]),
        "drive.acceleration": swept.drive_acceleration.values,
    }
    for found in (pf.sweep(pf.load(RIG), numbers), pf.sweep(RIG + table)):
        xr.testing.assert_equal(found, swept)


def test_exact_a_folder_holds_the_same(swept, tmp_path):
    found = pf.sweep(RIG, OVER, out=tmp_path / "a")
    xr.testing.assert_equal(found.drop_vars("folder"), swept)
    with xr.open_dataset(tmp_path / "a" / "sweep.nc") as kept:
        xr.testing.assert_equal(kept, found)
    xr.testing.assert_equal(pf.sweep(RIG, OVER, out=tmp_path / "a", resume=True), found)


def test_exact_drawn_cases_lie_in_their_ranges_and_come_again():
    ranges = {
        "friction.static": "0.1..0.5",
        "normal.load": "1 N..1 kN",
        "slide.speed": ["1 mm/s", "2 mm/s"],
    }
    found = [
        pf.sweep(BENCH, ranges, draw=8, seed=seed, sobol=sobol)
        for seed, sobol in ((1, True), (1, True), (2, True), (1, False))
    ]
    first = found[0]
    assert dict(first.sizes) == {"case": 8}
    assert ((0.1 <= first.friction_static) & (first.friction_static <= 0.5)).all()
    assert set(first.slide_speed.values) == {1e-3, 2e-3}
    xr.testing.assert_equal(first, found[1])
    assert not (first.friction_static == found[2].friction_static).any()
    assert not (first.friction_static == found[3].friction_static).any()
    # eight points of Sobol's sequence have one value in each eighth of every range, the load in its logarithm
    eighths = np.floor(8 * np.log(first.normal_load) / np.log(1e3)).astype(int)
    assert sorted(eighths.values) == list(range(8))
    assert sorted(np.floor(8 * (first.friction_static.values - 0.1) / 0.4).astype(int)) == list(
        range(8)
    )
    np.testing.assert_allclose(
        first.friction_force_peak, first.friction_static * first.normal_load, rtol=1e-12
    )


def test_refuses_what_is_no_sweep():
    with pytest.raises(pf.SceneError, match="no key to sweep is given"):
        pf.sweep(RIG)
    with pytest.raises(pf.SceneError, match=r"--over normal.load: .*'lbf'"):
        pf.sweep(RIG, {"normal.load": ["1 lb"]})
    for draw in ({"draw": 2, "seed": -1}, {"draw": -2}, {"sobol": True}):
        with pytest.raises(pf.SceneError, match="whole numbers >= 0"):
            pf.sweep(RIG, {"normal.load": "1 N..2 N"}, **draw)


def test_exact_one_scene_is_a_list_of_one(tmp_path):
    """A text was read sign by sign: "[: not valid TOML"."""
    path = tmp_path / "bench.toml"
    path.write_text(BENCH, encoding="utf-8")
    peak = pf.run(BENCH).measures["friction_force_peak"].value
    for one in (BENCH, str(path), path, pf.load(BENCH), pf.build(BENCH)):
        assert pf.run_many(one).values["friction_force_peak"].tolist() == [peak]


def test_exact_many_models_are_single_runs():
    found = pf.run_many([RIG, pf.build(BENCH)])
    for case, text in enumerate((RIG, BENCH)):
        single = pf.run(text)
        assert found.outcome[case] == single.outcome
        for name, one in single.measures.items():
            alike(found.values[name][case], one.value, one)


def test_exact_many_patches_of_one_geometry_are_those_of_a_sweep():
    """They share its mesh, so that they are alike to round-off; a patch alone chooses its own."""
    angles = [2e-5, 2e-4]
    text = PATCH + "[accuracy]\ntolerance = 1e-2\n"
    swept = pf.sweep(text, {"contact.tilt.angle": angles})
    found = pf.run_many([pf.load(text, **{"contact.tilt.angle": angle}) for angle in angles])
    assert found.numerics[0] == found.numerics[1]
    for (
        name,
        values,
    ) in found.values.items():  # the digits of a pressure at an end are those of a cell of a micron
        near = 1e-9 if name in ("pressure_peak", "loaded_fraction") else 1e-12
        np.testing.assert_allclose(
            values, swept[name].values, rtol=near, atol=near * found.floors[name].max()
        )


def test_exact_a_picture_of_a_sweep_is_hollow_where_the_tolerance_is_missed():
    """Values over three decades, the first two known to 100 and 5 %, a line for each of two loads."""
    values = np.array([[1e-6, 1e-5, 1e-4, 1e-3], [2e-6, 2e-5, 2e-4, 2e-3]])
    errors = values * [1.0, 0.05, 1e-3, 0.0]
    found = xr.Dataset(
        {
            "loop_area": (("normal_load", "slide_amplitude"), values, {"units": "J"}),
            "loop_area_error": (("normal_load", "slide_amplitude"), errors, {"units": "J"}),
        },
        {
            "normal_load": ("normal_load", [10.0, 20.0], {"units": "N"}),
            "slide_amplitude": ("slide_amplitude", [1e-7, 1e-6, 1e-5, 1e-4], {"units": "m"}),
        },
        {"tolerance": 0.01},
    )
    axis = pf.plot.sweep(found, "loop_area")
    filled = [
        line
        for line in axis.lines
        if line.get_marker() == "o" and line.get_markerfacecolor() != "white"
    ]
    assert [line.get_ydata().tolist() for line in filled] == [
        pytest.approx(row[2:] * 1e3) for row in values
    ]
    others = [line for line in axis.lines if line not in filled]
    assert list(axis.lines)[len(others) :] == filled
    assert min(one.zorder for one in filled) >= max(one.zorder for one in others)
    assert (axis.get_xscale(), axis.get_yscale(), axis.get_ylabel()) == (
        "log",
        "log",
        "loop area [mJ]",
    )
    assert [text.get_text() for text in axis.get_legend().get_texts()] == [
        "normal load 10 N",
        "normal load 20 N",
    ]
    one = found.isel(normal_load=[0]) * 1.0
    assert pf.plot.sweep(one.assign(loop_area=one.loop_area - 1e-4), "loop_area", ax=axis) is axis
    with pytest.raises(pf.PatchfemError, match="no measure 'loop'; there are loop_area"):
        pf.plot.sweep(found, "loop")
