"""The misalignment studies: inexpensive cases against closed forms, identities and stated figures."""

from __future__ import annotations

import re

import contact_forms as exact
import numpy as np
import pytest
from study_module import make_study_fixture

from patchfem.runs.patch.press import solve_patch_contact
from patchfem.runs.patch.values import compute_static_values

LENGTH = 12.7e-3


fixtures = make_study_fixture("misalignment/fixtures.py")


@pytest.fixture(scope="module")
def tilted(fixtures):
    """Module of the tilted pieces that the study imports."""
    return fixtures.tilted


conclusion = make_study_fixture("misalignment/conclusion_5.py")


rough = make_study_fixture("misalignment/rough_skin.py")


@pytest.fixture(scope="module")
def asperities(rough):
    """Module of the asperity models that the study imports."""
    return rough.asperities


# ---- fixtures and skins


def solve_coarse(tilted, pieces):
    """Return the measures of a pressed patch on the coarse meshes."""
    return compute_static_values(solve_patch_contact(pieces, tilted.pair(1)))


@pytest.mark.slow
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
    meshes = [solve_patch_contact(pieces, tilted.pair(k)) for k in (1, 0)]
    measures = tilted.with_static_measures(meshes, None)[0].measures
    # values of an independent program with elements of order 5
    reference = {
        "contact_fraction": 0.0239193,
        "pressure_peak": 60.8446e6,
        "normal_stiffness": 169.882e6,
    }
    for name, value in reference.items():
        assert abs(measures[name].value - value) <= measures[name].error <= 0.2 * value


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


# ---- the rough skin


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


# ---- in motion


moving = make_study_fixture("misalignment/in_motion.py")


@pytest.fixture(scope="module")
def maps(moving):
    """Maps over three tilts at one load, one with a stuck and one with a slipping interface."""
    found = moving.sweep_measures((1e-6, 3e-5, 1e-4), (26.0,), (3.0, 5.0)).squeeze("contact_load")
    return [found.isel(drive_acceleration=level) for level in (0, 1)]


@pytest.mark.slow
def test_always_tolerated_tilt_changes_the_motion_by_under_five_percent(moving, maps):
    """The tilt that the study tolerates changes stiffness, loop area and amplitude by less than 5 %."""
    stuck, slipping = maps
    assert slipping["contact_fraction"].values == pytest.approx([1.0, 0.49, 0.219], rel=0.03)
    for results, names in (
        (stuck, ("equivalent_stiffness",)),
        (slipping, ("equivalent_stiffness", "loop_area", "relative_displacement_amplitude")),
    ):
        for name in names:
            assert abs(results[name].values[1] / results[name].values[0] - 1) < 0.05, name
    for level, tilts, limit in (
        (5.0, (1e-6, 1e-4, 10**-3.5), "0.11"),
        (3.0, (1e-6, 10**-4.5, 1e-4), "0.047"),
    ):
        verdict = moving.allowed_tilt(26.0, level, tilts)
        allowed = re.search(r"contact.tilt.angle may reach (\S+) urad", verdict)[1]
        assert f"{float(allowed) / 1e3:.2g}" == limit
        assert f"{limit} mrad" in moving.__doc__
    assert (
        0.08
        < 1 - stuck["equivalent_stiffness"].values[2] / stuck["equivalent_stiffness"].values[0]
        < 0.1
    )


@pytest.mark.slow
def test_always_table_of_the_moving_rig_has_stated_values(moving, maps):
    """Stiffness, resonance, loop area and amplitude with and without tilt are those stated."""
    stuck, slipping = maps
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


# ---- both tilts


both = make_study_fixture("misalignment/both_tilts.py")


def test_always_roll_costs_more_stiffness_and_work_than_tilt(both):
    """Tilt and roll take the same contact; stiffness and work of a cycle are those stated."""
    cases = [
        both.run_case(*angles, cells=64) for angles in ((0, 0), (0.1, 0), (0, 0.1), (0.1, 0.1))
    ]
    flat, tilt, roll, _ = cases
    assert tilt["contact"] == pytest.approx(roll["contact"], rel=1e-9)
    assert 100 * np.array([case["contact"] for case in cases[1:]]) == pytest.approx(
        [23, 23, 15], abs=1
    )
    stiffness = 1e-6 * np.array([case["stiffness"] for case in cases])
    assert stiffness == pytest.approx([398, 226, 187, 172], rel=0.02)
    lost = [100 * (1 - case["work"] / flat["work"]) for case in cases[1:]]
    assert lost == pytest.approx([11, 16, 23], abs=1)
    assert "11, 16 and 23 %" in both.__doc__


rolled = make_study_fixture("misalignment/roll.py")


def test_always_roll_moves_the_pressure_as_stated(rolled):
    """Centre of pressure and yaw moment under a roll are those stated."""
    centre = rolled.find_centre(1e-4, cells=64)
    assert abs(centre.value + 5.28e-3) <= centre.error + 0.01e-3
    moment = 1e3 * rolled.FRICTION * rolled.LOAD * abs(centre.value)
    assert moment == pytest.approx(183, abs=1) and "183 N mm" in rolled.__doc__
