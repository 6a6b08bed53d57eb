"""Wear beside strips: every strip by its own pressure and slip, against one dense problem and closed forms."""

import h5py
import numpy as np
import pytest
import xarray as xr
from command_line import cli
from scene_texts import COATED, COULOMB, MODE, PIECE, mistakes

import patchfem as pf
from patchfem.runs.rig.strips import estimate_lateral_motion
from patchfem.scene import loads

STRIPS = "[contact.strips]\ncount = 4\n"
ROLLED = STRIPS + 'roll = "0.1 mrad"\n'
TILTED = COATED + '[contact.tilt]\nangle = "0.1 mrad"\n'
SINE = '[slide]\nkind = "sine"\namplitude = "10 um"\nfrequency = "143 Hz"\ncycles = 2\n'
WEAR = '[wear]\ncoefficient = "1e-14 m^2/N"\ncycles = 135723\n'
LOOSE = "[accuracy]\ntolerance = 1e-2\n"
DRIVEN = '[drive]\nkind = "base"\nfrequency = "143 Hz"\nacceleration = "5 g"\ncycles = 60\n'
LOAD, VOLUME = 26 * 4.4482216152605, 1e-14 * 26 * 4.4482216152605 * 40e-6 * 135723


def ran(text, **sets):
    return pf.run(loads(text, "strips.toml"), **sets)


def worn(result) -> np.ndarray:
    return result.fields["worn_depth"][-1]


def test_exact_strips_without_roll_wear_as_one_patch():
    plain, strips = (
        ran(TILTED + beside + COULOMB + SINE + WEAR + LOOSE) for beside in ("", STRIPS)
    )
    assert worn(strips).shape == (4, worn(plain).size)
    assert np.abs(worn(strips) - worn(plain)).max() < 1e-13 * worn(plain).max()
    for name in ("worn_volume", "worn_depth_max", "pressure_peak", "approach", "normal_stiffness"):
        assert strips.measures[name].value == pytest.approx(plain.measures[name].value, rel=1e-9)


def test_exact_volume_and_depth_of_rolled_strips_mirror_with_the_roll():
    one, other = (
        ran(TILTED + ROLLED.replace("0.1", roll) + COULOMB + SINE + WEAR + LOOSE)
        for roll in ("0.1", "-0.1")
    )
    assert one.measures["worn_volume"].value == pytest.approx(VOLUME, rel=1e-12)
    assert np.abs(worn(one) - worn(other)[::-1]).max() < 1e-9 * worn(one).max()
    assert worn(one).max(axis=1)[0] == one.measures["worn_depth_max"].value
    assert (np.diff(worn(one).max(axis=1)) <= 0).all()  # a roll opens at +y


def test_exact_a_rolled_pad_on_springs_evens_its_pressure_out():
    """Winkler: p = p_mean + (p_0 - p_mean) exp(-kappa s k N) in full contact, on pieces that hardly give way."""
    stiff = (
        PIECE
        + 'load = "26 lbf"\nelement_size = "4 mm"\nsubstrate = {young = "1e17 Pa", poisson = 0.3, '
        'density = "1000 kg/m^3"}\n'
    )
    skin = '[contact.asperities]\nlaw = "linear"\nnormal_stiffness = "1e12 Pa/m"\n'
    k = 1e12
    n = 5e4
    found = ran(
        stiff
        + skin
        + ROLLED.replace("0.1", "0.05")
        + COULOMB
        + SINE
        + WEAR.replace("135723", "5e4")
        + "[accuracy]\ntolerance = 1e-4\n"
    )
    y = (np.arange(4) - 1.5) * 12.7e-3 / 4
    mean = LOAD / 12.7e-3**2
    first = -k * 0.05e-3 * y
    assert (mean + first > 0).all()
    share = 1e-14 * 40e-6 * n
    expected = mean * share + first / k * (1 - np.exp(-share * k))
    assert np.abs(worn(found) - expected[:, None]).max() < 2e-4 * expected.max()


@pytest.mark.parametrize("yaw", ["0", "20"])
def test_exact_a_rig_wears_its_strips_by_their_own_slides(yaw):
    mode = MODE + f'yaw = "{yaw} rad/m"\n'
    found = ran(
        COATED
        + STRIPS
        + COULOMB
        + mode
        + DRIVEN
        + WEAR.replace("135723", "1e3")
        + "jumps = 1\n"
        + LOOSE
    )
    slides = found.window.extra.get("slides")
    last = found.window.time >= found.window.time[-1] - (1 + 1e-9) / 143
    volumes = worn(found).mean(axis=1) * 12.7e-3**2 / 4
    if yaw == "0":
        assert slides is None
        expected = np.full(4, found.measures["slip_amplitude"].value)
    else:
        expected = np.ptp(slides[last], axis=0) / 2
        assert np.ptp(expected) > 1e-2 * expected.mean()
    assert volumes == pytest.approx(1e-14 * LOAD / 4 * 4 * expected * 1e3, rel=5e-3)
    said = [note for note in found.extra["notes"] if "across x" in note]
    assert len(said) == (yaw != "0")
    if said:  # the path is longer by the mean of (20 x)^2/2, weighted by the load
        swing, share = estimate_lateral_motion(found.patch, found.window, 1 / 143)
        assert swing == pytest.approx(
            20 * 6.35e-3 * found.measures["relative_displacement_amplitude"].value, rel=0.05
        )
        load = found.patch.strips.force.sum(axis=0)
        expected_share = load @ (20 * found.patch.x) ** 2 / (2 * load.sum())
        assert share == pytest.approx(expected_share, rel=0.01)
        assert f"lengthen the sliding path of the last cycle by {100 * share:.2g} %" in said[0]
        assert "the friction and the wear are computed without" in said[0]


def test_exact_files_hold_the_depth_of_every_strip(tmp_path):
    scene = tmp_path / "strips.toml"
    scene.write_text(TILTED + ROLLED + COULOMB + SINE + WEAR + LOOSE)
    assert cli("run", scene, "-o", tmp_path / "out", "-q").code == 0
    with (
        xr.open_dataset(tmp_path / "out" / "result.nc", engine="h5netcdf") as data,
        h5py.File(tmp_path / "out" / "fields.vtkhdf") as file,
    ):
        assert data.worn_depth.dims == ("frame", "strip", "x") and data.unloaded_gap.dims == (
            "strip",
            "x",
        )
        depth = data.worn_depth.values
        assert float((data.worn_depth[-1] * data.weight / 4).sum()) == pytest.approx(
            VOLUME, rel=1e-12
        )
        block = file["VTKHDF/strips"]
        sides = block["Points"][:].reshape(4, 2, -1, 3)
        held = block["PointData/worn_depth"][:].reshape(len(depth), 4, 2, -1)
        assert np.abs(sides[..., 2].mean(axis=1) - data.strip_offset.values[:, None]).max() < 1e-9
        assert np.abs(held - depth[:, :, None]).max() < 1e-6 * depth.max()
    assert "in every strip over the width" in (tmp_path / "out" / "report.html").read_text()


def test_refuses_what_strips_do_not_wear_beside():
    soft = TILTED + STRIPS + "[contact.shear]\n" + COULOMB + MODE + DRIVEN + WEAR
    assert any("contact.strips with [contact.shear]" in line for line in mistakes(soft))
