"""`pf.sweep` and `pf.run_many`: every case equals a single run."""

import numpy as np
import pytest
import xarray as xr
from scene_texts import BENCH, COULOMB, PATCH, POINT, SHORT

import patchfem as pf

RIG = POINT + COULOMB + SHORT
OVER = {"friction.static": [0.1, 0.3], "drive.acceleration": ["1 g", "5 g"]}


def assert_equals_single_run(found, expected, measure) -> None:
    """Assert that a number equals that of a single run within 1e-12 of the value or of its scale."""
    # scale of the measures: 1 for a distortion, 1 mm for the drift of an amplitude
    size = {"1": 1.0, "m": 1e-3}.get(measure.unit, 0.0)
    np.testing.assert_allclose(
        found, np.nan if expected is None else expected, rtol=1e-12, atol=1e-12 * size
    )


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
    with xr.open_dataset(tmp_path / "a" / "sweep.nc") as stored:
        xr.testing.assert_equal(stored, found)
    xr.testing.assert_equal(pf.sweep(RIG, OVER, out=tmp_path / "a", resume=True), found)


def test_exact_random_cases_are_reproducible():
    """Random cases lie within their ranges and repeat with the same seed.

    Eight Sobol points lie in eight different eighths of each range.
    """
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
    # eight Sobol points have one value in each eighth of every range; the load is sampled in its logarithm
    eighths = np.floor(8 * np.log(first.normal_load) / np.log(1e3)).astype(int)
    assert sorted(eighths.values) == list(range(8))
    assert sorted(np.floor(8 * (first.friction_static.values - 0.1) / 0.4).astype(int)) == list(
        range(8)
    )
    np.testing.assert_allclose(
        first.friction_force_peak, first.friction_static * first.normal_load, rtol=1e-12
    )


def test_refuses_invalid_sweep():
    """A sweep without axes, with an unknown unit or with a negative seed is refused."""
    with pytest.raises(pf.SceneError, match="no key to sweep is given"):
        pf.sweep(RIG)
    with pytest.raises(pf.SceneError, match=r"--over normal.load: .*'lbf'"):
        pf.sweep(RIG, {"normal.load": ["1 lb"]})
    for draw in ({"draw": 2, "seed": -1}, {"draw": -2}, {"sobol": True}):
        with pytest.raises(pf.SceneError, match="whole numbers >= 0"):
            pf.sweep(RIG, {"normal.load": "1 N..2 N"}, **draw)


def test_exact_run_many_accepts_single_scene(tmp_path):
    """`pf.run_many` accepts a single text, path, Scene or Model in place of a list."""
    path = tmp_path / "bench.toml"
    path.write_text(BENCH, encoding="utf-8")
    peak = pf.run(BENCH).measures["friction_force_peak"].value
    for one in (BENCH, str(path), path, pf.load(BENCH), pf.build(BENCH)):
        assert pf.run_many(one).values["friction_force_peak"].tolist() == [peak]


def test_exact_run_many_equals_single_runs():
    """Every measure of `pf.run_many` equals that of a single run within 1e-12."""
    found = pf.run_many([RIG, pf.build(BENCH)])
    for case, text in enumerate((RIG, BENCH)):
        single = pf.run(text)
        assert found.outcome[case] == single.outcome
        for name, measure in single.measures.items():
            assert_equals_single_run(found.values[name][case], measure.value, measure)


def test_exact_run_many_patches_equal_sweep():
    """Patches that differ only in tilt share one mesh, and equal those of a sweep to round-off."""
    angles = [2e-5, 2e-4]
    text = PATCH + "[accuracy]\ntolerance = 1e-2\n"
    swept = pf.sweep(text, {"contact.tilt.angle": angles})
    found = pf.run_many([pf.load(text, **{"contact.tilt.angle": angle}) for angle in angles])
    assert found.numerics[0] == found.numerics[1]
    for (
        name,
        values,
    ) in found.values.items():  # the pressure at an end depends on a cell of 1 um
        tolerance = 1e-9 if name in ("pressure_peak", "loaded_fraction") else 1e-12
        np.testing.assert_allclose(
            values, swept[name].values, rtol=tolerance, atol=tolerance * found.floors[name].max()
        )


def test_exact_sweep_plot_has_hollow_markers_above_tolerance():
    """The plot of a sweep has hollow markers where the error exceeds the tolerance, and one line for each of two loads."""
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
        if line.get_marker() == "o" and line.get_markerfacecolor() != "none"
    ]
    assert [line.get_ydata().tolist() for line in filled] == [
        pytest.approx(row[2:] * 1e3) for row in values
    ]
    others = [line for line in axis.lines if line not in filled]
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
