"""Spread of the bonds across the sliding direction (equation 2.15): the factor of a pad, and scenes with spread."""

import re

import numpy as np
import pytest
from scene_texts import NONLOCAL, POINT, SHEAR, SHORT, SMALL_PATCH, TRIANGLE
from scipy.integrate import dblquad

from patchfem import SceneError, build, plan
from patchfem.friction import carried_fraction
from patchfem.runs.bench import bench
from patchfem.runs.run import run
from patchfem.scene import loads

NONLOCAL_2UM = NONLOCAL.replace("1 um", "2 um")
SPREAD = ["friction.spread=4 mm"]


@pytest.mark.parametrize("width", [1e-9, 0.05, 0.7, 1.0, 4.0])
def test_exact_spread_factor_equals_double_integral(width):
    """The spread factor of a pad equals the double integral of the Gaussian weight over its width."""
    total, _ = dblquad(
        lambda y, y1: np.exp(-((y - y1) ** 2) / 2) / np.sqrt(2 * np.pi),
        0,
        width,
        0,
        lambda y1: y1,
        epsabs=1e-13,
        epsrel=1e-12,
    )
    assert carried_fraction(width, 1.0) == pytest.approx(2 * total / width, rel=1e-11)


@pytest.mark.parametrize("law", ["", 'reading = "report"\n', "order = 2\n"])
def test_exact_bench_forces_scale_with_spread_factor(law):
    """Every force and the loop area of a bench with spread are those without spread times the factor."""
    factor = carried_fraction(12.7e-3, 4e-3)
    text = POINT + 'width = "12.7 mm"\n' + NONLOCAL_2UM + law + TRIANGLE
    full, reduced = (
        bench.run_bench(build(loads(text, sets=sets)), None, 80) for sets in ([], SPREAD)
    )
    limit = np.abs(full.force).max()
    assert reduced.force == pytest.approx(factor * full.force, rel=1e-12, abs=1e-12 * limit)
    areas = [one.values["loop_area"] for one in (reduced, full)]
    assert areas[0] == pytest.approx(factor * areas[1], rel=1e-12)
    assert reduced.slip == pytest.approx(full.slip, rel=1e-9, abs=1e-18)


def test_exact_face_uses_spread_of_full_width():
    """A contact over a face has the spread factor of the full width."""
    patch = re.sub("element_size = .*\n", "", SMALL_PATCH)
    plane, face = (
        build(loads(patch + NONLOCAL_2UM + TRIANGLE, sets=SPREAD + extra_sets)).friction
        for extra_sets in ([], ["contact.area.cells=64"])
    )
    assert (
        plane.static
        == face.static
        == pytest.approx(0.3 * carried_fraction(12.7e-3, 4e-3), rel=1e-15)
    )


@pytest.mark.parametrize("extra_tables", ["", SHEAR])
def test_exact_rig_with_spread_equals_reduced_friction(extra_tables):
    """A rig with spread has the measures of a rig whose friction coefficient is reduced by the factor."""
    factor = carried_fraction(12.7e-3, 4e-3)
    text = SMALL_PATCH + extra_tables + NONLOCAL_2UM + SHORT
    with_spread, with_less_friction = (
        run(
            plan(loads(text, sets=[*sets, "accuracy.steps_per_cycle=400"])), estimate=False
        ).measures
        for sets in (SPREAD, [f"friction.static={0.3 * factor!r}"])
    )
    assert {k: m.value for k, m in with_spread.items()} == {
        k: m.value for k, m in with_less_friction.items()
    }
    assert plan(loads(text, sets=SPREAD)).groups["share_of_the_spread"] == factor
    assert "share_of_the_spread" not in plan(loads(text)).groups
    assert plan(loads(text, sets=SPREAD)).groups["D"] == pytest.approx(
        factor * plan(loads(text)).groups["D"]
    )


def test_refuses_spread_without_width_or_bonds():
    """Spread is refused if the width is missing or the law has no bonds."""
    with pytest.raises(SceneError, match=r"normal.width: missing.*friction.spread needs this key"):
        loads(POINT + NONLOCAL_2UM + TRIANGLE, sets=SPREAD)
    for law in ("coulomb", "tanh", "elastic-plastic"):
        with pytest.raises(
            SceneError, match=f"friction.spread: law '{law}' has no key spread"
        ) as caught:
            loads(
                SMALL_PATCH + NONLOCAL_2UM + TRIANGLE,
                sets=[*SPREAD, f"friction.law={law}", "friction.reference_speed=1 mm/s"],
            )
        assert len(caught.value.mistakes) == 1
