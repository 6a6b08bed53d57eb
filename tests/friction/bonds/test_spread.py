"""The spread of bonds across the path (2.15): the factor of a pad, and scenes with it."""

import numpy as np
import pytest
from scene_texts import NONLOCAL, POINT, SHEAR, SHORT, SMALL_PATCH, TRIANGLE
from scipy.integrate import dblquad

from patchfem import SceneError, build, plan
from patchfem.friction import carried_fraction
from patchfem.runs.bench import bench
from patchfem.runs.run import run
from patchfem.scene import loads

LONGER = NONLOCAL.replace("1 um", "2 um")
SPREAD = ["friction.spread=4 mm"]


@pytest.mark.parametrize("width", [0.05, 0.7, 1.0, 4.0])
def test_exact_factor_is_the_double_integral_of_the_weight(width):
    """(1/b) of the weight between all pairs of points on the pad, by two-dimensional quadrature (kink-free halves)."""
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
def test_exact_every_force_of_a_bench_shrinks_by_the_factor(law):
    """12.7 mm of contact.width and the same normal.width give the same factor; kinetic keeps its ratio."""
    share = carried_fraction(12.7e-3, 4e-3)
    point = POINT.replace("[normal]\n", '[normal]\nwidth = "12.7 mm"\n')
    for text in (point, SMALL_PATCH):
        whole, less = (
            bench.run(build(loads(text + LONGER + law + TRIANGLE, sets=sets)), patch_of(text), 80)
            for sets in ([], SPREAD)
        )
        assert less.force == pytest.approx(
            share * whole.force, rel=1e-12, abs=1e-12 * np.abs(whole.force).max()
        )
        assert less.values["loop_area"] == pytest.approx(
            share * whole.values["loop_area"], rel=1e-12
        )
        assert less.slip == pytest.approx(whole.slip, rel=1e-9, abs=1e-18)


def patch_of(text):
    if text != SMALL_PATCH:
        return None
    from patchfem.runs import solve_with_coarser

    return solve_with_coarser(build(loads(SMALL_PATCH + LONGER + TRIANGLE)).patch, 1e-3, False)[0]


def test_exact_strips_share_the_whole_width():
    sets = ["contact.strips.count=4"]
    one, four = (
        build(loads(SMALL_PATCH + LONGER + TRIANGLE, sets=SPREAD + more)).friction
        for more in ([], sets)
    )
    assert (
        one.static == four.static == pytest.approx(0.3 * carried_fraction(12.7e-3, 4e-3), rel=1e-15)
    )


@pytest.mark.parametrize("more", ["", SHEAR])
def test_exact_a_rig_with_spread_is_a_rig_of_less_friction(more):
    share = carried_fraction(12.7e-3, 4e-3)
    text = SMALL_PATCH + more + LONGER + SHORT
    one, two = (
        run(
            plan(loads(text, sets=[*sets, "accuracy.steps_per_cycle=400"])), estimate=False
        ).measures
        for sets in (SPREAD, [f"friction.static={0.3 * share!r}"])
    )
    assert {k: m.value for k, m in one.items()} == {k: m.value for k, m in two.items()}
    assert plan(loads(text, sets=SPREAD)).groups["share_of_the_spread"] == share
    assert "share_of_the_spread" not in plan(loads(text)).groups
    assert plan(loads(text, sets=SPREAD)).groups["D"] == pytest.approx(
        share * plan(loads(text)).groups["D"]
    )


def test_refuses_spread_without_a_width_and_for_laws_without_bonds():
    with pytest.raises(SceneError, match=r"normal.width: missing.*friction.spread needs this key"):
        loads(POINT + LONGER + TRIANGLE, sets=SPREAD)
    for law in ("coulomb", "tanh", "elastic-plastic"):
        with pytest.raises(
            SceneError, match=f"friction.spread: law '{law}' has no spread"
        ) as caught:
            loads(
                SMALL_PATCH + LONGER + TRIANGLE,
                sets=[*SPREAD, f"friction.law={law}", "friction.reference_speed=1 mm/s"],
            )
        assert len(caught.value.mistakes) == 1


def test_exact_a_width_without_spread_is_remarked():
    scene = loads(POINT + LONGER + TRIANGLE, sets=["normal.width=1 mm"])
    assert scene.remarks == ["normal.width has no meaning without friction.spread and is not used"]
