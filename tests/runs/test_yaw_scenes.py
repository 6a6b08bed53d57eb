"""Bands of a face under a yaw mode: exact engine against the march, and the limit without yaw."""

import numpy as np
import pytest
from scene_texts import BLOCK, DRIVE, MODE, make_friction_table

from patchfem import load, plan
from patchfem.export.run_data import collect_data
from patchfem.runs.interfaces.bands import compute_band_loads, number_bands
from patchfem.runs.run import run

AREA = "[contact.area]\ncells = 32\n"
YAWED = (
    BLOCK
    + AREA
    + '[contact.tilt]\nangle = "0 mrad"\nroll = "0.2 mrad"\n[contact.shear]\n'
    + make_friction_table("coulomb")
    + MODE.replace("0.003", "0.05")
    + '[[structure.mode]]\nname = "yaw"\nfrequency = "129 Hz"\ndamping = 0.003\nslide = 0.0\nyaw = "30 rad/m"\n'
    + DRIVE.replace("cycles = 30", "cycles = 2")
    + '[accuracy]\nsteps_per_cycle = 100\nmethod = "march"\n'
)


def test_exact_bands_of_a_rolled_face_carry_their_part_of_the_load():
    """A band slides by q - y yaw, no band carries more than its friction limit, and the yaw moment is sum y f."""
    result = run(load(YAWED), estimate=False)
    response = result.response
    extra = response.extra
    y = (np.arange(8) - 3.5) * 12.7e-3 / 8
    np.testing.assert_allclose(
        extra["slides"],
        response.modal[:, :1] - 30 * np.outer(response.modal[:, 1], y),
        atol=1e-13 * np.abs(extra["slides"]).max(),
    )
    limits = 0.3 * compute_band_loads(result.patch)
    assert limits.sum() == pytest.approx(0.3 * 115, rel=1e-9) and (limits == 0).any()
    largest = np.abs(extra["forces"]).max(axis=0)
    assert (largest <= limits * (1 + 1e-6)).all() and largest.max() > 0.5 * limits.max()
    np.testing.assert_allclose(extra["yaw_moment"], extra["forces"] @ y, atol=1e-15)
    np.testing.assert_array_equal(collect_data(result)["yaw_moment"].values, extra["yaw_moment"])
    assert result.measures["energy_balance"].value < 1e-10
    moment = extra["forces"][-1] @ np.ones(8)
    shear = result.fields["shear_stress"][-1] @ result.patch.pieces.interface.weight
    assert shear == pytest.approx(moment, abs=1e-6 * limits.sum())


def test_bands_of_a_face_wear_by_their_own_slip():
    """The worn volume of each band follows from its load and its own slip amplitude."""
    wear = '[wear]\ncoefficient = "1e-14 m^2/N"\ncycles = 1e3\njumps = 1\n[accuracy]\ntolerance = 1e-2\n'
    mode = MODE + 'yaw = "20 rad/m"\n'
    text = BLOCK + AREA + make_friction_table("coulomb") + mode
    result = run(load(text + DRIVE.replace("cycles = 30", "cycles = 60") + wear))
    slides = result.window.extra["slides"]
    period = result.histories.period
    is_last = result.window.time >= result.window.time[-1] - (1 + 1e-9) * period
    amplitudes = np.ptp(slides[is_last], axis=0) / 2
    volumes = np.bincount(
        number_bands(result.patch),
        result.fields["worn_depth"][-1] * result.patch.pieces.interface.weight,
    )
    assert np.ptp(amplitudes) > 1e-2 * amplitudes.mean()
    expected = 1e-14 * compute_band_loads(result.patch) * 4 * amplitudes * 1e3
    assert volumes == pytest.approx(expected, rel=1e-2)


DAMPED_LUGRE = 'micro_damping = "100 N s/m"\nviscous = "3 N s/m"\n'


def _shake_bands(law: str, yaw: str):
    """Return the text of a rig with a face under a friction law, whose only mode yaws the patch by `yaw`."""
    friction = make_friction_table(law) + (DAMPED_LUGRE if law == "lugre" else "")
    mode = MODE + f'yaw = "{yaw}"\n'
    return BLOCK + AREA + friction + mode + DRIVE.replace("cycles = 30", "cycles = 10")


@pytest.mark.parametrize("law", ["iwan", "bouc-wen", "lugre"])
def test_exact_bands_that_hardly_yaw_share_stiffness_and_damping_of_the_contact(law):
    """Keys that refer to the whole contact are divided among the bands, as the load is."""
    whole = run(load(_shake_bands(law, "0 rad/m")), estimate=False)
    apart = run(load(_shake_bands(law, "1e-6 rad/m")), estimate=False)
    assert apart.response.slides.shape[1] == 8
    for name in ("relative_displacement_amplitude", "loop_area", "slip_amplitude"):
        assert apart.measures[name].value == pytest.approx(whole.measures[name].value, rel=1e-4)
    plans = [plan(load(_shake_bands(law, yaw))) for yaw in ("0 rad/m", "1e-6 rad/m")]
    stuck = [planned.modes(planned.chain)[0]["stuck_frequency"] for planned in plans]
    assert stuck[1] == pytest.approx(stuck[0], rel=1e-9)


def test_exact_bands_move_in_two_modes_with_yaw():
    """A second mode that yaws the patch moves the contact too, so that there is no damping of the first mode alone."""
    second = '[[structure.mode]]\nname = "second"\nfrequency = "129 Hz"\ndamping = 0.01\nslide = 0.2\nyaw = "60 rad/m"\n'
    drive = DRIVE.replace("cycles = 30", "cycles = 10")
    text = BLOCK + AREA + make_friction_table("elastic-plastic") + MODE + second + drive
    measures = run(load(text), estimate=False).measures
    assert measures["loop_area"].value > 0
    assert measures["equivalent_damping"].value is None


@pytest.mark.long
def test_wear_of_bands_that_slip_part_by_part_tends_to_that_without_yaw():
    """The worn depth of a face that slips part by part hardly changes with a yaw that vanishes, and does with another."""
    wear = '[wear]\ncoefficient = "1e-14 m^2/N"\ncycles = 1e3\njumps = 1\n[accuracy]\ntolerance = 1e-2\n'
    text = BLOCK + AREA + "[contact.shear]\n" + make_friction_table("lugre") + "{}" + DRIVE + wear
    text = text.replace("cycles = 30", "cycles = 10") + 'method = "march"\nsteps_per_cycle = 200\n'
    depths = [
        run(load(text.format(MODE + yaw)), estimate=False).fields["worn_depth"][-1]
        for yaw in ("", 'yaw = "1e-6 rad/m"\n', 'yaw = "20 rad/m"\n')
    ]
    assert depths[1] == pytest.approx(depths[0], rel=1e-6, abs=1e-9 * depths[0].max())
    assert np.abs(depths[2] - depths[0]).max() > 1e-3 * depths[0].max()
