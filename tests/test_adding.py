"""The examples of ADDING.md work exactly as the page prints them, up to the page of a run and a sweep."""

import json
from pathlib import Path

import numpy as np
import pytest
import xarray
from support import adding

from patchfem.core import G_N

PAGE = (adding.PACKAGE / "ADDING.md").read_text("utf-8")
LATER = ("accuracy.method=march", "accuracy.method=harmonic")  # engines that another test compiles
WAVED = """\
[contact]
length = "12.7 mm"
width = "12.7 mm"
height = "12.7 mm"
load = "115 N"
substrate = {young = "120 GPa", poisson = 0.3, density = "4400 kg/m^3"}
[contact.ripple]
height = "35 nm"
wavelength = "1.27 mm"
"""
AVERAGE = 115 / 12.7e-3**2  # Pa, mean pressure of this scene
LIMIT, LENGTH = 0.3 * 115, 0.3 * 115 / 2e7  # N, m of the law on the page


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A copy of the package with all examples, in which the commands of the page have run, but for two engines."""
    folder = tmp_path_factory.mktemp("adding")
    adding.copied(folder, PAGE)
    (folder / "waved.toml").write_text(WAVED, "utf-8")
    lines = [line for line in adding.commands(PAGE) if not any(word in line for word in LATER)]
    adding.run(
        folder,
        [*lines, "plan rig.toml --set drive.waveform=hold", "run waved.toml -o waved --no-page"],
    )
    return folder


def measures_of(folder: Path) -> dict:
    return json.loads((folder / "summary.json").read_text("utf-8"))["measures"]


def test_always_every_kind_has_an_example_with_a_page(folder):
    """Each run has a page and each sweep has one; the text of a drive is that of its phrase."""
    for name in ("smooth", "ripple", "hold", "rig", "holds", "rigs"):
        assert (folder / name / "report.html").stat().st_size > 10_000, name
    assert "base acceleration of 5 g for one second" in (folder / "hold" / "report.html").read_text(
        "utf-8"
    )


def check_law(found: dict) -> None:
    """Compare a steady loop of the law with n = 2 with its closed form (see the page My own law of friction)."""
    amplitude = found["slip_amplitude"]["value"], found["relative_displacement_amplitude"]["value"]
    x = amplitude[1] / LENGTH
    tip = (np.sqrt(1 + 4 * x**2) - 1) / (2 * x)
    area = 2 * LIMIT * LENGTH * (2 * x - np.log1p(2 * x * (1 + tip)))
    assert found["loop_area"]["value"] == pytest.approx(area, rel=2e-4)
    assert found["friction_force_peak"]["value"] == pytest.approx(LIMIT * tip, rel=2e-4)


def test_exact_the_law_has_its_closed_form(folder):
    check_law(measures_of(folder / "smooth"))


@pytest.mark.slow
def test_always_the_law_agrees_in_three_engines(folder):
    adding.run(
        folder, [line for line in adding.commands(PAGE) if any(word in line for word in LATER)]
    )
    smooth = measures_of(folder / "smooth")
    for engine in ("march", "harmonic"):
        found = measures_of(folder / engine)
        check_law(found)
        for name in ("relative_displacement_amplitude", "loop_area", "friction_force_peak"):
            one = found[name]
            other = smooth[name]
            assert abs(one["value"] - other["value"]) <= one["error"] + other["error"], (
                engine,
                name,
            )


def test_always_a_ripple_touches_at_its_crests(folder):
    """Westergaard's waves touch over 2/pi asin(sqrt(p/p*)) of their length; the ends of the piece hardly matter."""
    modulus = 120e9 / (1 - 0.3**2) / 2
    full = np.pi * modulus * 35e-9 / 2 / 1.27e-3
    touching = 2 / np.pi * np.arcsin(np.sqrt(AVERAGE / full))
    assert measures_of(folder / "waved")["contact_fraction"]["value"] == pytest.approx(
        touching, rel=0.1
    )


def test_refuses_a_shape_whose_table_has_no_key_for_its_piece(tmp_path):
    """The table of a shape that somebody adds without `on` is not ignored: the scene has a mistake in its line."""
    on = '    on: key(Piece, "the piece that carries the shape") = "upper"\n'
    assert on in PAGE
    adding.copied(tmp_path, PAGE.replace(on, ""))
    (tmp_path / "waved.toml").write_text(WAVED, "utf-8")
    with pytest.raises(AssertionError, match=r"waved.toml:7: contact.ripple: .* has no key `on`"):
        adding.run(tmp_path, ["check waved.toml"])


def test_always_a_drive_has_its_waveform_and_its_sweep(folder):
    """The base accelerates by 5 g for one second and then rests, and the sweep has each of its cases."""
    run = xarray.load_dataset(folder / "hold" / "result.nc")
    acceleration = run.base_acceleration.values
    late = run.time.values > 1.0001
    assert np.allclose(acceleration[~late & (run.time.values < 0.9999)], 5 * G_N)
    assert not acceleration[late].any()
    cases = xarray.load_dataset(folder / "holds" / "sweep.nc")
    assert cases.sizes["drive_acceleration"] == 3 and set(cases.outcome.values) <= {
        "stuck",
        "steady",
        "transient",
    }


def test_always_a_measure_of_the_whole_run_has_a_small_error(folder):
    """Both measures agree with the histories of the run, have errors, and stand in a sweep."""
    found = measures_of(folder / "rig")
    run = xarray.load_dataset(folder / "rig" / "result.nc")
    slide = run.relative_displacement.values
    assert found["slide_range"]["value"] == pytest.approx(np.ptp(slide), rel=1e-9)
    assert 0 <= found["slide_range"]["error"] < 1e-3 * found["slide_range"]["value"]
    smooth = measures_of(folder / "smooth")["slide_range"]
    assert 0 < smooth["error"] < 1e-3 * smooth["value"]
    rms = found["friction_force_rms"]  # the start adds less than 1 % to that of the last cycles
    late = run.isel(time=run.time.values >= 195 / 143)
    steady = np.sqrt(
        np.trapezoid(late.friction_force.values**2, late.time.values) / np.ptp(late.time.values)
    )
    assert abs(rms["value"] - steady) <= rms["error"] + 0.01 * steady
    assert rms["error"] < 0.02 * rms["value"]
    assert (
        abs(found["slide_mean"]["value"])
        <= found["slide_mean"]["error"] + found["slide_mean"]["floor"]
    )
    cases = xarray.load_dataset(folder / "rigs" / "sweep.nc")
    assert cases.slide_range.values[-1] == pytest.approx(found["slide_range"]["value"], rel=1e-9)
    assert np.isfinite(cases.slide_range_error.values).all()
