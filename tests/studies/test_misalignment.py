"""The misalignment studies: inexpensive cases against closed forms, identities and stated figures."""

from __future__ import annotations

import re

import numpy as np
import pytest
from study_module import make_study_fixture

from patchfem.closed_forms import contact as exact
from patchfem.runs.patch.press import solve_patch_contact
from patchfem.runs.patch.values import compute_static_values

LOAD, LENGTH = 26 * 4.4482216152605, 12.7e-3


fixtures = make_study_fixture("misalignment/fixtures.py")


@pytest.fixture(scope="module")
def tilted(fixtures):
    """Module of the tilted pieces that the study imports."""
    return fixtures.tilted


conclusion = make_study_fixture("misalignment/conclusion_5.py")


roll = make_study_fixture("misalignment/roll.py")


rough = make_study_fixture("misalignment/rough_skin.py")


@pytest.fixture(scope="module")
def asperities(rough):
    """Module of the asperity models that the study imports."""
    return rough.asperities


# ---- fixtures and skins


def solve_coarse(tilted, pieces):
    """Return the measures of a pressed patch on the coarse meshes."""
    return compute_static_values(solve_patch_contact(pieces, tilted.pair(1)))


@pytest.mark.share(2)
@pytest.mark.parametrize("tilt", ["1e-6", "1e-5", "1e-4", "1e-3", "1e-2"])
def test_exact_fixture_table_has_the_computed_values(tilted, fixtures, tilt):
    """The table of the rigid fixture in the docstring has the computed values, to its last digit."""
    row = re.search(rf"(?m)^  {tilt} +(.*)$", fixtures.__doc__)[1]
    names = (
        "contact_fraction",
        "loaded_fraction",
        "pressure_peak",
        "pressure_centre",
        "normal_stiffness",
        "tangential_stiffness",
    )
    measures = tilted.compute_measures(fixtures.held_pieces(float(tilt), None))
    for name, cell in zip(names, re.sub(r" *± *[\d.]+", "", row).split(), strict=True):
        value = measures[name].value * fixtures.COLUMNS[name][1]
        last = 10.0 ** -len(cell.partition(".")[2])
        assert abs(value - float(cell)) <= 0.5001 * last, (name, value, cell)


def test_always_error_estimates_cover_an_independent_solution(tilted, fixtures):
    """The error estimates cover the solution of an independent program with elements of order 5."""
    pieces = fixtures.held_pieces(1e-3, None)
    measures = tilted.estimate_static_measures(
        solve_patch_contact(pieces, tilted.pair(1)), solve_patch_contact(pieces, tilted.pair(0))
    )
    # values of an independent program with elements of order 5
    reference = {
        "contact_fraction": 0.0239193,
        "pressure_peak": 60.8446e6,
        "normal_stiffness": 169.882e6,
    }
    for name, value in reference.items():
        assert abs(measures[name].value - value) <= measures[name].error <= 0.2 * value


def test_always_free_piece_loses_contact_inside_the_kern(tilted, fixtures):
    """A load offset within the middle third opens the contact of elastic pieces, unlike rigid ones."""
    for offset, fraction in ((0.15, 1.0), (1 / 3, 0.445)):
        measures = solve_coarse(tilted, fixtures.free(offset))
        assert measures["contact_fraction"] == pytest.approx(fraction, abs=0.02)
        assert measures["pressure_centre"] == pytest.approx(-offset * LENGTH, rel=1e-9)
    assert (
        solve_coarse(tilted, fixtures.free(0.16))["contact_fraction"]
        < 1
        == exact.core_contact_fraction(0.16, 1.0)
    )


def test_always_soft_surface_layer_keeps_its_normal_stiffness(tilted, fixtures):
    """The softer the surface layer, the less normal stiffness is lost at a tilt of 10 mrad."""
    aligned, inclined = (
        {
            skin: solve_coarse(tilted, fixtures.held_pieces(tilt, None, skin))
            for skin in tilted.SKINS
        }
        for tilt in (1e-6, 1e-2)
    )
    for skin, expected in (
        ("bare", 0.052),
        ("linear", 0.05),
        ("peaks", 0.112),
        ("exponential", 0.824),
    ):
        ratio = inclined[skin]["normal_stiffness"] / aligned[skin]["normal_stiffness"]
        assert ratio == pytest.approx(expected, rel=0.03)


def test_exact_soft_layer_is_a_rigid_wedge_on_asperities(tilted):
    """With a layer much softer than the pieces, the contact agrees with a rigid wedge on asperities."""
    measures = solve_coarse(
        tilted, tilted.case(5e-2, "exponential", "asperities.decay_length=500 um")
    )
    fraction, centre = exact.wedge_on_asperities(5e-2, LENGTH, 500e-6)
    assert measures["loaded_fraction"] == pytest.approx(fraction, rel=3e-4)
    assert measures["pressure_centre"] == pytest.approx(centre, rel=3e-4)
    stiffer = solve_coarse(tilted, tilted.case(1e-3, "exponential"))["loaded_fraction"]
    assert stiffer / exact.wedge_on_asperities(1e-3, LENGTH, 2.5e-6)[0] == pytest.approx(
        1.04, abs=0.005
    )


# ---- conclusion 5


def test_exact_fixture_spring_adds_its_rotation(tilted, conclusion, fixtures):
    """A fixture spring adds its own rotation to the tilt that gives a contact fraction of 0.5."""
    for skin in tilted.SKINS:
        for spring in (1e4, 300.0):
            angle = conclusion.neutral(0.5, skin, spring, 0)
            patch = solve_patch_contact(fixtures.held_pieces(angle, spring, skin), tilted.pair(0))
            assert tilted.rubbed_portion(patch) == pytest.approx(0.5, abs=1e-4)
            assert patch.pressure.rotation == pytest.approx(
                conclusion.rigid(0.5, skin, 0)[0], rel=1e-3
            )


def test_always_tilt_and_moment_of_a_contact_fraction(conclusion):
    """The tilt and the moment at a given contact fraction are those stated in the study."""
    expected = {
        ("bare", 0.5): (2.9e-5, 0.46),
        ("linear", 0.5): (7.4e-5, 0.48),
        ("peaks", 0.5): (1.07e-4, 0.53),
        ("exponential", 0.5): (1.8e-3, 0.57),
        ("bare", 0.2): (1.13e-4, 0.63),
        ("linear", 0.2): (4.0e-4, 0.63),
    }
    for (skin, portion), (tilt, moment) in expected.items():
        result = conclusion.rigid(portion, skin, 1)
        assert result == (pytest.approx(tilt, rel=0.015), pytest.approx(moment, rel=0.015))
    assert round(conclusion.ROCKING) == 298
    assert conclusion.neutral(0.5, "bare", conclusion.ROCKING, 1) == pytest.approx(
        1.57e-3, rel=0.01
    )


# ---- roll


def test_exact_roll_by_strips_agrees_with_linear_foundation(tilted, roll):
    """A patch divided into strips and rolled agrees with a wedge on a linear foundation."""
    pair = tilted.pair(0)
    k = (
        compute_static_values(solve_patch_contact(tilted.case(0.0), pair))["normal_stiffness"]
        / LENGTH**2
    )
    for angle in (5e-6, 1e-4):
        fraction, centre, _, _ = exact.wedge_on_linear_foundation(angle, LOAD, LENGTH, LENGTH, k)
        measures = compute_static_values(
            solve_patch_contact(roll.rolled_pieces(angle, 128, "bare"), pair)
        )
        assert measures["pressure_centre_lateral"] == pytest.approx(centre, rel=2e-4)
        assert measures["contact_fraction"] == pytest.approx(fraction, abs=1 / 128)


def test_always_yaw_moment_of_a_rolled_patch(roll):
    """The yaw moment of a rolled patch is friction force times centre of pressure, as stated."""
    for skin, angle, moment in (
        ("bare", 1e-5, 0.074),
        ("bare", 1e-4, 0.173),
        ("linear", 1e-5, 0.0346),
        ("exponential", 1e-3, 0.133),
    ):
        measures = roll.case(angle, 16, skin)
        assert measures["yaw"] == pytest.approx(moment, rel=0.01)
        assert measures["yaw"] == pytest.approx(
            0.3 * LOAD * abs(measures["pressure_centre_lateral"].value), rel=1e-9
        )
    assert roll.roll_for(3.8e-3, "bare") == pytest.approx(2.7e-5, rel=0.02)


# ---- the rough skin


def test_exact_stiffness_of_equal_ridges_and_peaks(asperities):
    """Stiffnesses of equal ridges and equal peaks agree with Westergaard's and Hertz's solutions."""
    flat = np.zeros(16)
    modulus = exact.combined_modulus(*asperities.CARBIDE)
    closed = exact.westergaard_stiffness(
        asperities.MEAN, asperities.WAVE, asperities.HEIGHT, modulus
    )
    stiffness = asperities.one_each(flat)[0]
    assert stiffness == pytest.approx(closed, rel=1e-12) and stiffness == pytest.approx(
        4.48e14, rel=2e-3
    )
    assert asperities.one_each(flat, coat=(600e9, 0.22))[0] == pytest.approx(9.9e14, rel=2e-3)
    force = asperities.MEAN * asperities.WAVE**2
    slope = 2 / 3 * (9 / (16 * asperities.RADIUS * modulus**2 * force)) ** (1 / 3)
    lattice = asperities.LATTICE / (np.pi * modulus * asperities.WAVE)
    stiffness = asperities.one_each(flat, True)[0]
    assert stiffness == pytest.approx(1 / (slope + lattice) / asperities.WAVE**2, rel=1e-3)
    assert stiffness == pytest.approx(2.74e13, rel=2e-3)


@pytest.mark.parametrize("scatter", [1e-6, 5e-6])
def test_exact_one_force_per_ridge_agrees_with_resolved_ridges(asperities, scatter):
    """One force per ridge gives the stiffness of the resolved ridges within 1 %."""
    depth = asperities.depths(32, scatter, "uniform")
    assert asperities.one_each(depth)[0] == pytest.approx(
        asperities.explicit(depth, 2**15), rel=0.01
    )


def test_always_height_scatter_for_a_stiffness_of_1e13(rough, asperities):
    """The stated scatter of ridge and peak heights gives a stiffness of 1e13 Pa/m."""
    for scatter, shape in ((4.5e-6, "uniform"), (0.2e-6, "gaussian")):
        stiffnesses = [
            asperities.one_each(asperities.depths(160, scatter, shape, seed))[0]
            for seed in range(5)
        ]
        assert np.median(stiffnesses) == pytest.approx(1e13, rel=0.15)
    for scatter, shape in ((0.68e-6, "uniform"), (0.127e-6, "gaussian")):
        assert asperities.separate(scatter, shape) == pytest.approx(1e13, rel=0.01)
    row = rough.row(0.2e-6, "gaussian", side=16, seeds=1)
    assert row["separate"] == pytest.approx(7.2e12, rel=2e-3)
    assert row["peaks"] == pytest.approx(row["separate"], rel=0.02)
    assert row["touching"] == pytest.approx(0.18, abs=0.01)


def test_always_opening_tilts_of_pieces_and_layer_add(rough):
    """The tilt at which contact opens is the sum of those of the pieces and of the surface layer."""
    pieces_alone = rough.opening(None, 1)
    assert pieces_alone == pytest.approx(9.28e-6, rel=3e-3)
    for k in (1e15, 1e13, 5e11):
        rigid = exact.wedge_opening_tilt(LOAD, LENGTH, LENGTH, k)
        assert pieces_alone < rough.opening(k, 1) == pytest.approx(pieces_alone + rigid, rel=0.01)


# ---- in motion


moving = make_study_fixture("misalignment/in_motion.py")


@pytest.fixture(scope="module")
def maps(moving):
    """Maps over three tilts, with a stuck and a slipping interface."""
    return moving.sweep_measures((1e-6, 3e-5, 1e-4), (26.0,), (3.0, 5.0))


@pytest.fixture(scope="module")
def maps_at_one_load(maps):
    """The maps without the dimension of the contact load."""
    return maps.squeeze("contact_load")


@pytest.mark.slow
def test_always_tolerated_tilt_changes_the_motion_by_under_five_percent(moving, maps_at_one_load):
    """The tilt that the study tolerates changes stiffness, loop area and amplitude by less than 5 %."""
    stuck = maps_at_one_load.isel(drive_acceleration=0)
    slipping = maps_at_one_load.isel(drive_acceleration=1)
    assert slipping["contact_fraction"].values == pytest.approx([1.0, 0.49, 0.219], rel=0.03)
    for results, names in (
        (stuck, ("equivalent_stiffness",)),
        (slipping, ("equivalent_stiffness", "loop_area", "relative_displacement_amplitude")),
    ):
        for name in names:
            assert abs(results[name].values[1] / results[name].values[0] - 1) < 0.05, name
    for level, tilts, limit in (
        (5.0, (1e-6, 1e-4, 10**-3.5), "0.1"),
        (3.0, (1e-6, 10**-4.5, 1e-4), "0.053"),
    ):
        assert (
            re.search(r"[Tt]ilt may reach (\S+) mrad \(", moving.allowed_tilt(26.0, level, tilts))[
                1
            ]
            == limit
        )
        assert f"{limit} mrad" in moving.__doc__
    assert (
        0.08
        < 1 - stuck["equivalent_stiffness"].values[2] / stuck["equivalent_stiffness"].values[0]
        < 0.1
    )


def test_always_table_of_the_moving_rig_has_stated_values(moving, maps_at_one_load):
    """Stiffness, resonance, loop area and amplitude with and without tilt are those stated."""
    stuck = maps_at_one_load.isel(drive_acceleration=0)
    slipping = maps_at_one_load.isel(drive_acceleration=1)
    at = [0, 2]
    assert 1e-6 * stuck["equivalent_stiffness"].values[at] == pytest.approx([31.9, 29.2], abs=0.15)
    assert moving.resonance(stuck["equivalent_stiffness"].values[at]) == pytest.approx(
        [967, 926], abs=2
    )
    assert stuck["stick_fraction"].values[at] == pytest.approx([1, 1])
    assert 1e3 * slipping["loop_area"].values[at] == pytest.approx([1.699, 1.617], rel=2e-3)
    assert 1e6 * slipping["relative_displacement_amplitude"].values[at] == pytest.approx(
        [12.91, 12.38], rel=2e-3
    )
