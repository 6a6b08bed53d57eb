"""Tests of fitting a wear coefficient to a measured depth."""

import json

import pytest
from command_line import run_cli, run_successfully
from scene_texts import COATED, COULOMB, POINT

import patchfem as pf
from patchfem import load
from patchfem.campaigns.fits.wear import read_measured_depth
from patchfem.core import PatchfemError

SINE = '[slide]\nkind = "sine"\namplitude = "10 um"\nfrequency = "143 Hz"\ncycles = 2\n'
WEAR = '[wear]\ncoefficient = "3e-15 m^2/N"\ncycles = 100000\n'
WORN = COATED + '[contact.tilt]\nangle = "0.1 mrad"\n' + COULOMB + SINE + WEAR
FREE = ("--free", "wear.coefficient=1e-16 m^2/N..1e-13 m^2/N")


@pytest.fixture
def scene(tmp_path, monkeypatch):
    """Path of the scene of a tilted patch that wears, in a folder of its own."""
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "worn.toml"
    path.write_text(WORN)
    return path


@pytest.mark.share(1)
@pytest.mark.parametrize(
    "name, source, area",
    [("worn_depth_max", "worn_depth_max", 1), ("worn_depth_mean", "worn_volume", 12.7e-3**2)],
)
def test_wear_coefficient_is_recovered_from_computed_depth(scene, tmp_path, name, source, area):
    """The wear coefficient is recovered from the computed worn depth within 1e-3."""
    measures = pf.run(load(WORN)).measures
    measure = measures[source]
    value = measure.value / area
    content = run_successfully(
        "fit", scene, "--to", f"{name}={value!r} m", *FREE, "-o", tmp_path / "fit", "--json"
    ).content
    fitted = content["values"]["wear.coefficient"]
    assert fitted["value"] == pytest.approx(3e-15, rel=1e-3, abs=0)
    assert "without an interval" in content["warnings"][-1]

    # A depth without an interval leaves the numerical error of the run, to which the rounding of the fit is added.
    relative_error = measure.error / measure.value
    assert relative_error > 0
    for end in ("low", "high"):
        deviation = abs(fitted[end] / fitted["value"] - 1)
        assert relative_error * (1 - 1e-2) <= deviation <= 1.5 * relative_error + 1e-3
    assert fitted["low"] <= 3e-15 <= fitted["high"]
    refitted = pf.run(tmp_path / "fit/scene.fitted.toml").measures
    assert refitted["worn_volume"].value == pytest.approx(
        measures["worn_volume"].value, rel=1e-3, abs=0
    )


def test_interval_of_depth_scales_interval_of_coefficient(scene, tmp_path):
    """The interval of the coefficient has the relative ends of the interval of the depth.

    The worn volume is proportional to the coefficient.
    """
    page = tmp_path / "compare.json"
    page.write_text(
        json.dumps(
            {
                "worn_depth_max": None,
                "measures": {"loop_area": {}},
                "worn_depth_mean": {"value": 20e-9, "low": 15e-9, "high": 30e-9, "unit": "m"},
            }
        )
    )
    content = run_cli("fit", scene, "--to", page, *FREE, "-o", tmp_path / "fit", "--json").content
    fitted = content["values"]["wear.coefficient"]
    assert fitted["low"] / fitted["value"] == pytest.approx(0.75, rel=2e-3)
    assert fitted["high"] / fitted["value"] == pytest.approx(1.5, rel=2e-3)
    # the error of the computed depth adds to both sides
    error = content["model_error"] / 20e-9
    assert 0 < error < 2e-3 and not content["warnings"]
    assert fitted["low"] / fitted["value"] < 0.75 < 1.5 < fitted["high"] / fitted["value"]
    # a bound within this error ends the interval of the coefficient, which is said
    high = fitted["value"] * (1 + error / 2)
    low = ("--free", f"wear.coefficient=1e-16 m^2/N..{high} m^2/N")
    content = run_cli("fit", scene, "--to", "worn_depth_mean=20 nm", *low, "--json").content
    assert "its interval ends: widen the range" in content["warnings"][0]
    for name in ("common_length", "registration"):  # 1.0 wrote no common length
        page.write_text(f'{{"{name}": {{}}, "worn_depth_max": {{}}}}')
        assert "--predicted" in run_cli("fit", scene, "--to", page, *FREE).err


def test_warns_of_an_unknown_numerical_error(scene):
    """On a mesh so coarse that its error cannot be estimated, the fit says that its interval lacks this error."""
    coarse = ("--set", "contact.element_size=2 mm")
    content = run_cli(
        "fit", scene, *coarse, "--to", "worn_depth_mean=15 nm..30 nm", *FREE, "--json"
    ).content
    assert content["model_error"] is None
    assert content["warnings"] == [
        "the numerical error of the computed depth is unknown, so the interval of the coefficient does not contain it"
    ]


def test_refuses_unsuitable_depths_and_parameters(scene, tmp_path):
    """Depths outside the bounds, other quantities, other parameters and scenes without a patch are refused."""

    def fit_error(*words):
        """Return the error message of a refused fit."""
        answer = run_cli("fit", scene, *words)
        assert answer.code == 2
        assert "Traceback" not in answer.err
        assert not (tmp_path / "out").exists()
        return answer.err

    assert "raise the high bound" in fit_error("--to", "worn_depth_max=1 mm", *FREE)
    assert "lower the low bound" in fit_error("--to", "worn_depth_max=1e-3 nm", *FREE)
    assert "only wear.coefficient" in fit_error(
        "--to", "worn_depth_max=1 um", "--free", "friction.static=0.1..0.6"
    )
    assert "is not a possible quantity; use" in fit_error("--to", "depth=1 um", *FREE)
    (tmp_path / "nothing.json").write_text('{"worn_depth_mean": null}')
    assert "no worn depth" in fit_error("--to", tmp_path / "nothing.json", *FREE)
    (tmp_path / "nothing.json").write_text("[" * 100_000)
    assert "not the JSON" in fit_error("--to", tmp_path / "nothing.json", *FREE)
    scene.write_text(POINT + COULOMB + SINE + WEAR)
    assert "use [contact]" in fit_error("--to", "worn_depth_max=1 um", *FREE)
    with pytest.raises(PatchfemError, match="above zero"):
        read_measured_depth("worn_depth_max=0 um")
