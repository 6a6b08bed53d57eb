"""The sentences of the misalignment studies, from a cheap share of their runs, beside closed forms and identities."""

from __future__ import annotations

import re

import numpy as np
import pytest
from study_module import load_study, make_study_fixture

from patchfem.closed_forms import contact as exact
from patchfem.runs.patch.press import press_patch
from patchfem.runs.patch.values import values

LOAD, LENGTH = 26 * 4.4482216152605, 12.7e-3


fixtures = make_study_fixture("misalignment/fixtures.py")


@pytest.fixture(scope="module")
def tilted(fixtures):
    return fixtures.tilted


conclusion = make_study_fixture("misalignment/conclusion_5.py")


roll = make_study_fixture("misalignment/roll.py")


rough = make_study_fixture("misalignment/rough_skin.py")


@pytest.fixture(scope="module")
def asperities(rough):
    return rough.asperities


# ---- fixtures and skins


def coarse(tilted, found):
    return values(press_patch(found, tilted.pair(1)))


@pytest.mark.share(2)
@pytest.mark.parametrize("tilt", ["1e-6", "1e-5", "1e-4", "1e-3", "1e-2"])
def test_exact_the_docstring_of_fixtures_holds_what_it_prints(tilted, fixtures, tilt):
    """The rows of the rigid fixture, number by number with the digits that stand there."""
    row = re.search(rf"(?m)^  {tilt} +(.*)$", fixtures.__doc__)[1]
    names = (
        "contact_fraction",
        "loaded_fraction",
        "pressure_peak",
        "pressure_centre",
        "normal_stiffness",
        "tangential_stiffness",
    )
    found = tilted.compute_measures(fixtures.held_pieces(float(tilt), None))
    for name, cell in zip(names, re.sub(r" *± *[\d.]+", "", row).split(), strict=True):
        value = found[name].value * fixtures.COLUMNS[name][1]
        last = 10.0 ** -len(cell.partition(".")[2])
        assert abs(value - float(cell)) <= 0.5001 * last, (name, value, cell)


def test_always_errors_of_the_coarse_meshes_hold_the_finest(tilted, fixtures):
    from patchfem.runs import estimate_measures

    found = fixtures.held_pieces(1e-3, None)
    two = estimate_measures(press_patch(found, tilted.pair(1)), press_patch(found, tilted.pair(0)))
    # an independent program with elements of order 5
    best = {
        "contact_fraction": 0.0239193,
        "pressure_peak": 60.8446e6,
        "normal_stiffness": 169.882e6,
    }
    for name, value in best.items():
        assert abs(two[name].value - value) <= two[name].error <= 0.2 * value


@pytest.mark.slow
@pytest.mark.parametrize(("angle", "skin"), [(3e-5, "bare"), (1e-2, "bare"), (1e-2, "linear")])
def test_always_meshes_graded_anew_agree_within_the_errors(tilted, angle, skin):
    from patchfem.runs import estimate_measures, solve_with_coarser

    found = tilted.case(angle, skin)
    ours = tilted.compute_measures(found)
    other = estimate_measures(*solve_with_coarser(found, 1e-3), tolerance=1e-3)
    for name in (
        "contact_fraction",
        "loaded_fraction",
        "pressure_peak",
        "pressure_centre",
        "normal_stiffness",
        "tangential_stiffness",
    ):
        assert abs(ours[name].value - other[name].value) <= ours[name].error + other[name].error


def test_always_a_free_piece_keeps_less_than_the_kern(tilted, fixtures):
    for offset, fraction in ((0.15, 1.0), (1 / 3, 0.445)):
        found = coarse(tilted, fixtures.free(offset))
        assert found["contact_fraction"] == pytest.approx(fraction, abs=0.02)
        assert found["pressure_centre"] == pytest.approx(-offset * LENGTH, rel=1e-9)
    assert (
        coarse(tilted, fixtures.free(0.16))["contact_fraction"]
        < 1
        == exact.kern_contact_fraction(0.16, 1.0)
    )


def test_always_the_soft_skin_keeps_its_stiffness(tilted, fixtures):
    even, tipped = (
        {skin: coarse(tilted, fixtures.held_pieces(tilt, None, skin)) for skin in tilted.SKINS}
        for tilt in (1e-6, 1e-2)
    )
    for skin, left in (("bare", 0.052), ("linear", 0.05), ("peaks", 0.112), ("exponential", 0.824)):
        ratio = tipped[skin]["normal_stiffness"] / even[skin]["normal_stiffness"]
        assert ratio == pytest.approx(left, rel=0.03)


def test_exact_skin_far_softer_than_the_pieces_is_a_rigid_wedge(tilted):
    found = coarse(tilted, tilted.case(5e-2, "exponential", "asperities.decay_length=500 um"))
    fraction, centre = exact.wedge_on_asperities(5e-2, LENGTH, 500e-6)
    assert found["loaded_fraction"] == pytest.approx(fraction, rel=3e-4)
    assert found["pressure_centre"] == pytest.approx(centre, rel=3e-4)
    stiffer = coarse(tilted, tilted.case(1e-3, "exponential"))["loaded_fraction"]
    assert stiffer / exact.wedge_on_asperities(1e-3, LENGTH, 2.5e-6)[0] == pytest.approx(
        1.04, abs=0.005
    )


# ---- conclusion 5


def test_exact_a_spring_adds_what_it_gives_way(tilted, conclusion, fixtures):
    for skin in tilted.SKINS:
        for spring in (1e4, 300.0):
            angle = conclusion.neutral(0.5, skin, spring, 0)
            found = press_patch(fixtures.held_pieces(angle, spring, skin), tilted.pair(0))
            assert tilted.rubbed_portion(found) == pytest.approx(0.5, abs=1e-4)
            assert found.pressure.rotation == pytest.approx(
                conclusion.rigid(0.5, skin, 0)[0], rel=1e-3
            )


def test_always_misalignment_that_each_portion_means(conclusion):
    wanted = {
        ("bare", 0.5): (2.9e-5, 0.46),
        ("linear", 0.5): (7.4e-5, 0.48),
        ("peaks", 0.5): (1.07e-4, 0.53),
        ("exponential", 0.5): (1.8e-3, 0.57),
        ("bare", 0.2): (1.13e-4, 0.63),
        ("linear", 0.2): (4.0e-4, 0.63),
    }
    for (skin, portion), (tilt, moment) in wanted.items():
        found = conclusion.rigid(portion, skin, 1)
        assert found == (pytest.approx(tilt, rel=0.015), pytest.approx(moment, rel=0.015))
    assert round(conclusion.ROCKING) == 298
    assert conclusion.neutral(0.5, "bare", conclusion.ROCKING, 1) == pytest.approx(
        1.57e-3, rel=0.01
    )


def test_always_holders_that_a_thousandth_of_an_inch_allows(conclusion):
    least, most = conclusion.springs_for(2e-3, "bare", halvings=1)
    assert (least, most) == (pytest.approx(125, rel=0.02), pytest.approx(480, rel=0.02))
    assert conclusion.springs_for(2e-3, "linear", halvings=1)[1] == np.inf
    assert conclusion.springs_for(4e-4, "exponential", halvings=1) is None


# ---- roll


def test_exact_strips_are_a_wedge_on_springs(tilted, roll):
    pair = tilted.pair(0)
    k = values(press_patch(tilted.case(0.0), pair))["normal_stiffness"] / LENGTH**2
    for angle in (5e-6, 1e-4):
        fraction, centre, _, _ = exact.wedge_on_linear_foundation(angle, LOAD, LENGTH, LENGTH, k)
        found = values(press_patch(roll.rolled_pieces(angle, 128, "bare"), pair))
        assert found["pressure_centre_lateral"] == pytest.approx(centre, rel=2e-4)
        assert found["contact_fraction"] == pytest.approx(fraction, abs=1 / 128)


def test_always_yaw_moments_of_a_roll(roll):
    for skin, angle, moment in (
        ("bare", 1e-5, 0.074),
        ("bare", 1e-4, 0.173),
        ("linear", 1e-5, 0.0346),
        ("exponential", 1e-3, 0.133),
    ):
        found = roll.case(angle, 16, skin)
        assert found["yaw"] == pytest.approx(moment, rel=0.01)
        assert found["yaw"] == pytest.approx(
            0.3 * LOAD * abs(found["pressure_centre_lateral"].value), rel=1e-9
        )
    assert roll.roll_for(3.8e-3, "bare") == pytest.approx(2.7e-5, rel=0.02)


# ---- the rough skin


def test_exact_equal_ridges_and_equal_peaks(asperities):
    flat = np.zeros(16)
    modulus = exact.combined_modulus(*asperities.CARBIDE)
    closed = exact.westergaard_stiffness(
        asperities.MEAN, asperities.WAVE, asperities.HEIGHT, modulus
    )
    found = asperities.one_each(flat)[0]
    assert found == pytest.approx(closed, rel=1e-12) and found == pytest.approx(4.48e14, rel=2e-3)
    assert asperities.one_each(flat, coat=(600e9, 0.22))[0] == pytest.approx(9.9e14, rel=2e-3)
    force = asperities.MEAN * asperities.WAVE**2
    slope = 2 / 3 * (9 / (16 * asperities.RADIUS * modulus**2 * force)) ** (1 / 3)
    lattice = asperities.LATTICE / (np.pi * modulus * asperities.WAVE)
    found = asperities.one_each(flat, True)[0]
    assert found == pytest.approx(1 / (slope + lattice) / asperities.WAVE**2, rel=1e-3)
    assert found == pytest.approx(2.74e13, rel=2e-3)


@pytest.mark.parametrize("scatter", [1e-6, 5e-6])
def test_exact_one_force_per_ridge_is_the_resolved_ridge(asperities, scatter):
    depth = asperities.depths(32, scatter, "uniform")
    assert asperities.one_each(depth)[0] == pytest.approx(
        asperities.explicit(depth, 2**15), rel=0.01
    )


def test_always_scatter_that_makes_1e13(rough, asperities):
    for scatter, shape in ((4.5e-6, "uniform"), (0.2e-6, "gaussian")):
        many = [
            asperities.one_each(asperities.depths(160, scatter, shape, seed))[0]
            for seed in range(5)
        ]
        assert np.median(many) == pytest.approx(1e13, rel=0.15)
    for scatter, shape in ((0.68e-6, "uniform"), (0.127e-6, "gaussian")):
        assert asperities.separate(scatter, shape) == pytest.approx(1e13, rel=0.01)
    found = rough.row(0.2e-6, "gaussian", side=16, seeds=1)
    assert found["separate"] == pytest.approx(7.2e12, rel=2e-3)
    assert found["peaks"] == pytest.approx(found["separate"], rel=0.02)
    assert found["touching"] == pytest.approx(0.18, abs=0.01)


def test_always_opening_tilt_is_that_of_the_pieces_and_of_the_skin(rough):
    own = rough.opening(None, 1)
    assert own == pytest.approx(9.28e-6, rel=3e-3)
    for k in (1e15, 1e13, 5e11):
        rigid = exact.wedge_opening_tilt(LOAD, LENGTH, LENGTH, k)
        assert own < rough.opening(k, 1) == pytest.approx(own + rigid, rel=0.01)


@pytest.mark.slow
def test_always_the_picture_names_its_curves(tmp_path):
    picture = load_study("misalignment/picture.py")
    text = picture.main(tmp_path / "x.svg", np.array([1e-5, 1e-4])).read_text()
    for word in (
        "misalignment [mrad]",
        "height over the patch [um]",
        *picture.FIXTURES.values(),
        *picture.SKINS.values(),
    ):
        assert word in text
    assert np.all(np.diff(picture.portions(None, "bare", 10.0 ** np.arange(-5.5, -2), 0)) < 0)


# ---- in motion


moving = make_study_fixture("misalignment/in_motion.py")


@pytest.fixture(scope="module")
def maps(moving):
    """Aligned, at the tilt that may be left alone, and at one that may not; stuck and slipping."""
    return moving.sweep_measures((1e-6, 3e-5, 1e-4), (26.0,), (3.0, 5.0))


@pytest.fixture(scope="module")
def moved(maps):
    return maps.squeeze("contact_load")


@pytest.mark.slow
def test_always_the_motion_hardly_feels_the_tilt_that_the_study_tolerates(moving, moved):
    stuck = moved.isel(drive_acceleration=0)
    slipping = moved.isel(drive_acceleration=1)
    assert slipping["contact_fraction"].values == pytest.approx([1.0, 0.49, 0.219], rel=0.03)
    for found, names in (
        (stuck, ("equivalent_stiffness",)),
        (slipping, ("equivalent_stiffness", "loop_area", "relative_displacement_amplitude")),
    ):
        for name in names:
            assert abs(found[name].values[1] / found[name].values[0] - 1) < 0.05, name
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


def test_always_the_table_of_the_rig_in_motion(moving, moved):
    stuck = moved.isel(drive_acceleration=0)
    slipping = moved.isel(drive_acceleration=1)
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


def test_always_a_stuck_interface_is_a_little_softer_than_pieces_and_bonds_in_series(moved):
    """What the patch shears by and what the bonds stretch by add up, and the first of its nodes have yielded."""
    stuck = moved.isel(drive_acceleration=0)
    bonds = 0.30 * LOAD / 1e-6
    both = 1 / (1 / bonds + 1 / stuck["tangential_stiffness"].values)
    assert stuck["equivalent_stiffness"].values[0] == pytest.approx(both[0], rel=0.06)
    assert (stuck["equivalent_stiffness"].values < both).all()


@pytest.mark.slow
def test_always_the_maps_name_what_they_show(moving, maps, tmp_path):
    text = moving.picture(maps, tmp_path / "x.svg").read_text()
    for word in (
        "misalignment [mrad]",
        "26 lbf, 5 g",
        "rubbed share",
        "loop energy, to that at 1e-06 rad",
    ):
        assert word in text
