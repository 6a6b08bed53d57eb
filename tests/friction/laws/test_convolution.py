"""The averaged law: exact averages, the steady limit of 2.17 on a pressure that stays below, and scenes with it."""

from itertools import pairwise

import numpy as np
import pytest
from friction_paths import pulled, triangle, upper_pressure, walk
from hypothesis import given
from hypothesis import strategies as st
from scene_texts import COULOMB, POINT, SHEAR, SHORT, SLIDE, SMALL_PATCH
from scipy.integrate import quad
from scipy.special import gamma

from patchfem import SceneError, build, plan
from patchfem.core import PatchfemError
from patchfem.friction import Bonds, Coulomb, FirstOrderBonds, Quadrature
from patchfem.friction.laws.convolution import Convolution, average_pressure, sliding_limits
from patchfem.runs import solve_with_coarser
from patchfem.runs.bench import bench
from patchfem.runs.run import run
from patchfem.scene import loads

AVERAGED = '[friction]\nlaw = "convolution"\nstatic = 0.3\nbond_length = "1 mm"\n'
FLAT = SMALL_PATCH.split("[contact.tilt]")[0]
CROWN = '[contact.crown]\nradius = "20 m"\n'


def by_quadrature(y, nodes, sigma, way, length, order):
    """The defining integral at one place, between the kinks of the pressure."""
    ends = np.unique(np.clip(way * (y - nodes), 0, None))
    if ends.size < 2:
        return 0.0
    if order < 0:  # s = t^(1/(p + 1)) takes the infinite start away
        power = 1 / (order + 1)
        return sum(
            quad(
                lambda t: (
                    power
                    * length ** -(order + 1)
                    * np.exp(-(t**power) / length)
                    / gamma(order + 1)
                    * np.interp(y - way * t**power, nodes, sigma)
                ),
                a ** (order + 1),
                b ** (order + 1),
                epsabs=1e-15,
                epsrel=1e-13,
            )[0]
            for a, b in pairwise(ends)
        )
    return sum(
        quad(
            lambda s: (
                (s / length) ** order
                * np.exp(-s / length)
                / gamma(order + 1)
                / length
                * np.interp(y - way * s, nodes, sigma)
            ),
            a,
            b,
            epsabs=1e-15,
            epsrel=1e-13,
        )[0]
        for a, b in pairwise(ends)
    )


@pytest.mark.parametrize("order", [-0.5, 0.0, 0.4, 1.0, 2.0, 3.0])
@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize("length", [0.05, 0.7, 40.0])
def test_exact_average_is_the_integral(order, way, length):
    rng = np.random.default_rng(3)
    nodes = np.cumsum(rng.uniform(0.2, 1.5, 9))
    sigma = rng.uniform(0.1, 2, 9)
    places = np.append(rng.uniform(nodes[0], nodes[-1], 6), nodes[[0, 4, -1]])
    truth = [by_quadrature(y, nodes, sigma, way, length, order) for y in places]
    assert average_pressure(places, nodes, sigma, way, length, order) == pytest.approx(
        truth, rel=1e-9, abs=1e-12
    )


# ---- the steady limit of 2.17


def lower(nodes, sigma):
    return lambda q: np.interp(nodes + q, nodes, sigma, left=0.0, right=0.0)


@pytest.mark.share(0, 3, 5)
@pytest.mark.parametrize(
    "law, order", [(FirstOrderBonds, 1), (Quadrature, 1), (Quadrature, 0), (Quadrature, 2)]
)
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_exact_a_long_slide_over_a_pressure_below_settles_to_the_average(law, order, way):
    """2.17 by its own engines after 20 bond lengths, with the part that falls as the square of the step taken off; two
    stretches of pressure with a bare gap of several nodes between, over which no bond survives."""
    nodes = np.linspace(0, 60, 241)
    sigma = np.maximum(np.sin(nodes / 2) + 0.8, 0.0)
    bonds = Bonds(0.4, 1.0, float(order), "report" if order != 1 else "stretch", initial=0.0)
    engine = law(bonds, 0.0) if law is Quadrature else law(bonds)
    pressure = lower(nodes, sigma)
    coarse, fine = (
        pulled(engine, way * np.linspace(0, 20, steps + 1), pressure).traction[-1]
        for steps in (160, 320)
    )
    averaged = Convolution(0.4, 1.0, order, nodes, sigma)
    end = averaged.step(averaged.start(sigma), way * 20.0, sigma, pressure(way * 20.0), 1.0).state
    assert (np.diff((sigma > 0).astype(int)) != 0).sum() >= 2
    assert (4 * fine - coarse) / 3 == pytest.approx(averaged.traction(end), abs=2e-6)
    assert np.abs(averaged.traction(end)).max() > 0.4


def test_exact_short_bonds_and_even_pressure_are_coulomb():
    path = triangle(2.0, 2, 8)
    nodes = np.linspace(0, 100, 41)
    sigma = np.full(41, 2.0)
    inner = (nodes > 45) & (nodes < 55)
    plain = walk(Coulomb(0.3), path, upper_pressure(sigma))
    for law in (Convolution(0.3, 0.5, 1.0, nodes), Convolution(0.3, 0.5, 1.0)):
        found = walk(law, path, upper_pressure(sigma))
        assert found.mean[:, inner] == pytest.approx(plain.mean[:, inner], rel=1e-13)
        assert found.traction[:, inner] == pytest.approx(plain.traction[:, inner], rel=1e-13)
    wavy = 2 + np.sin(nodes)
    for eps in (1e-2, 1e-3, 1e-4):
        found = walk(Convolution(0.3, eps, 1.0, nodes), path, upper_pressure(wavy))
        near = walk(Coulomb(0.3), path, upper_pressure(wavy))
        assert np.abs(found.traction - near.traction)[:, 1:-1].max() < 0.3 * 2 * eps * 1.01


def test_exact_at_rest_the_last_traction_is_kept():
    law = Convolution(0.3, 1.0)
    one = np.ones(1)
    state = law.step(law.start(one), -0.1, one, one, 1.0).state
    still = law.step(state, 0.0, one, one, 5.0)
    assert (
        still.mean[0] == -0.3 and law.traction(still.state)[0] == -0.3 and still.dissipated[0] == 0
    )
    for pressure, kept in ((2.0, -0.3), (0.5, -0.15), (0.0, 0.0)):
        rested = law.press(state, one, pressure * one)
        assert rested.state.traction[0] == kept and rested.dissipated[0] == 0
        on = law.step(rested.state, -0.1, pressure * one, 1.0 * one, 1.0)
        assert (
            on.mean[0] == pytest.approx(-0.3 * (pressure + 1) / 2) and on.state.traction[0] == -0.3
        )


@given(st.lists(st.floats(-3, 3), min_size=1, max_size=12), st.booleans())
def test_always_the_averaged_law_only_takes_energy(steps, below):
    nodes = np.linspace(0, 9, 13)
    sigma = np.maximum(np.sin(nodes), 0.0)
    law = Convolution(0.5, 0.8, 1.0, nodes, sigma if below else None)
    pressure = lower(nodes, sigma) if below else upper_pressure(sigma)
    found = walk(law, np.cumsum([0.0, *steps]), pressure)
    assert (found.dissipated >= -1e-14).all()
    assert (np.abs(found.traction) <= 0.5 * sigma.max() + 1e-12).all()


def test_exact_the_limits_of_an_uneven_pressure_differ_by_what_the_trailing_edges_lose():
    """p = 0: the loss of a long pad is eps times the pressure at its trailing edge."""
    nodes = np.linspace(0, 40, 2001)
    weight = np.gradient(nodes)
    weight[[0, -1]] /= 2
    forward, back = sliding_limits(nodes, 1 + nodes / 40, weight, 1.0, 0.0)
    assert 60 - forward == pytest.approx(2 - 1 / 40, rel=1e-4) and 60 - back == pytest.approx(
        1 + 1 / 40, rel=1e-4
    )


# ---- scenes


def bench_of(text, *sets, steps=64):
    model = build(loads(text, sets=sets))
    patch = solve_with_coarser(model.patch, 1e-3, False)[0] if model.patch is not None else None
    return patch, bench.run(model, patch, steps, 4)


def test_exact_one_point_under_a_changing_load_is_coulomb():
    sets = ["normal.amplitude=60 N", "normal.frequency=300 Hz"]
    dwell = '[slide]\nkind = "dwell"\nspeed = "5 mm/s"\ndistance = "20 um"\nhold = "5 ms"\ndistance_after = "20 um"\n'
    _, one = bench_of(POINT + AVERAGED + dwell, *sets)
    _, two = bench_of(POINT + COULOMB + dwell, *sets)
    assert one.force == pytest.approx(two.force, rel=1e-13) and one.values == pytest.approx(
        two.values
    )
    assert np.ptp(one.load) > 100


@pytest.mark.parametrize("order", [0, 1])
def test_exact_force_of_a_patch_bench_is_the_resultant_of_the_average(order):
    """Forward and back by the definition, with the pressure on the mover: different, as the patch is tilted."""
    patch, found = bench_of(
        SMALL_PATCH + AVERAGED + SLIDE, "contact.tilt.angle=0.1 mrad", f"friction.order={order}"
    )
    x = patch.x
    sigma = patch.pressure.sigma_n
    weight = patch.pieces.interface.weight
    for way, force in ((1, found.force.max()), (-1, -found.force.min())):
        truth = sum(
            w * by_quadrature(y, x, sigma, way, 1e-3, order)
            for y, s, w in zip(x, sigma, weight)
            if s > 0
        )
        assert force == pytest.approx(0.3 * truth, rel=1e-9)
    assert found.force.max() < 0.97 * 0.3 * patch.pressure.load
    assert abs(found.force.max() + found.force.min()) > 1e-3 * found.force.max()
    assert found.values["energy_balance"] < 1e-12 and found.slip == pytest.approx(found.slide)


def test_exact_a_symmetric_block_on_a_rig_is_coulomb_with_the_limit_of_the_average():
    text = FLAT + CROWN + AVERAGED.replace("1 mm", "300 um") + SHORT
    scene = loads(text)
    found = run(plan(scene), estimate=False)
    patch = found.patch
    forward, back = sliding_limits(
        patch.x, patch.pressure.sigma_n, patch.pieces.interface.weight, 3e-4, 1.0
    )
    assert forward == pytest.approx(back, rel=1e-9) and 0.5 < forward / patch.pressure.load < 0.9
    plain = run(
        plan(
            loads(
                FLAT + CROWN + COULOMB + SHORT,
                sets=[f"friction.static={0.3 * forward / patch.pressure.load!r}"],
            )
        ),
        estimate=False,
    )
    for name, m in plain.measures.items():
        assert m.reason or found.measures[name].value == pytest.approx(
            m.value, rel=1e-6, abs=1e-12
        ), name
    march = run(
        plan(loads(text, sets=["accuracy.method=march", "accuracy.steps_per_cycle=1600"])),
        estimate=False,
    )
    name = "relative_displacement_amplitude"
    assert march.measures[name].value == pytest.approx(found.measures[name].value, rel=1e-3)
    weight = patch.pieces.interface.weight
    assert found.fields["shear_stress"][1:] @ weight == pytest.approx(
        found.window.force[np.searchsorted(found.window.time, found.fields["time"][1:])], rel=1e-9
    )
    assert not any("moves exactly as one point" in line for line in found.warnings)


def test_exact_the_mesh_of_the_limit_stands_in_the_errors_of_the_motion():
    """A mesh four times as fine moves the block otherwise, by no more than the error that is given."""
    text = FLAT + CROWN + AVERAGED.replace("1 mm", "300 um") + SHORT
    found = run(plan(loads(text))).measures
    fine = run(plan(loads(text, sets=["contact.element_size=0.125 mm"])), estimate=False).measures
    for name in ("relative_displacement_amplitude", "friction_force_peak", "loop_area"):
        miss = abs(found[name].value - fine[name].value)
        assert 1e-6 * abs(fine[name].value) < miss < found[name].error, name


def test_exact_a_block_of_one_point_on_a_rig_is_coulomb():
    one, two = (
        run(plan(loads(POINT + text + SHORT)), estimate=False).measures
        for text in (AVERAGED, COULOMB)
    )
    assert {k: m.value for k, m in one.items()} == {k: m.value for k, m in two.items()}
    assert "bonds" in plan(loads(POINT + AVERAGED + SHORT)).chain


def test_refuses_an_uneven_pressure_on_a_rig():
    scene = loads(SMALL_PATCH + AVERAGED + SHORT, sets=["contact.tilt.angle=0.1 mrad"])
    with pytest.raises(
        PatchfemError,
        match=r"friction.law: law 'convolution' with a pressure that is not symmetric "
        r"\(slip force .* N forward, .* N back\) is not supported yet",
    ):
        run(plan(scene), estimate=False)


@pytest.mark.parametrize(
    "text, sets, says",
    [
        (
            SLIDE,
            [SHEAR],
            "friction.law: 'convolution' with \\[contact.shear\\] is not supported yet; leave",
        ),
        (
            SHORT,
            [SHEAR],
            "friction.law: 'convolution' with \\[contact.shear\\] is not supported yet; leave",
        ),
        (SHORT, ["contact.tilt.on=lower"], "'lower' in a rig with law 'convolution'"),
        (
            SLIDE,
            ["contact.strips.count=4"],
            "contact.strips: not supported yet with law 'convolution'",
        ),
        (SLIDE, ["friction.order=-1"], "friction.order: must be > -1, not -1"),
        (
            SLIDE,
            ["friction.kinetic=0.2"],
            "laws with a kinetic coefficient are coulomb, nonlocal and lugre",
        ),
    ],
)
def test_refuses_what_the_averaged_law_cannot_do(text, sets, says):
    more = [one.replace(SHEAR, "contact.shear={}") for one in sets]
    with pytest.raises(SceneError, match=says):
        loads(SMALL_PATCH + AVERAGED + text, sets=more)


def test_exact_any_order_above_minus_one_is_let_through():
    assert (
        loads(SMALL_PATCH + AVERAGED + SLIDE, sets=["friction.order=-0.5"]).friction.order == -0.5
    )
    assert loads(SMALL_PATCH + AVERAGED + SLIDE, sets=["friction.initial_bonds=0"]).remarks == [
        "friction.initial_bonds has no meaning for law 'convolution' and is not used"
    ]
