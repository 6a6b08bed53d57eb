"""Bond growth on a warm surface (2.13): the printed numbers, the reference that changes nothing, and scenes with it."""

from dataclasses import replace

import friction_forms
import numpy as np
import pytest
from command_line import FROM_PYTHON, loaded
from scene_texts import BENCH, GROWING, POINT, SHORT, SMALL_PATCH, TRIANGLE
from scipy.special import erfc

from patchfem import SceneError, build, plan
from patchfem.core import PatchfemError
from patchfem.friction import Bonds, FirstOrderBonds, surface_temperature_rise
from patchfem.friction.bonds.temperature import growth_at_temperature
from patchfem.runs.bench import bench
from patchfem.runs.run import run
from patchfem.scene import loads

WARM = """[friction.temperature]
surface = "393.15 K"
reference = "293.15 K"
rest_activation = "2500 K"
slip_activation = "1500 K"
"""
SLIDE = '[slide]\nkind = "constant"\nspeed = "5 mm/s"\ndistance = "60 um"\n'
SUBSTRATE = 'substrate = "Ti-8Al-1Mo-1V"'


@pytest.mark.parametrize(
    "surface, want",
    [
        (293.15, (1.97838937, 1.66806488e-7, 5.74463386e-4)),
        (393.15, (17.3127683, 4.53920808e-8, 8.86488902e-4)),
    ],
)
def test_exact_c13_rates_of_a_warm_surface(surface, want):
    """a_0 = 1e4, l_0 = 1e-9, T_a = 2500 K, T_l = 1500 K, as printed: the reference is infinite."""
    rest, slip = growth_at_temperature(1e4, 1e-9, surface, np.inf, 2500.0, 1500.0)
    assert (rest, slip, np.sqrt(rest * slip)) == pytest.approx(want, rel=1e-8)
    cold = growth_at_temperature(1e4, 1e-9, 293.15, np.inf, 2500.0, 1500.0)
    assert growth_at_temperature(*cold, surface, 293.15, 2500.0, 1500.0) == pytest.approx(
        want[:2], rel=1e-8
    )


@pytest.mark.parametrize(
    "surface, reference",
    [(0.0, 300.0), (-5.0, 300.0), (300.0, 0.0), (np.nan, 300.0), ([300.0, 0.0], 300.0)],
)
def test_refuses_temperatures_that_are_not_absolute(surface, reference):
    with pytest.raises(PatchfemError, match="above 0 K"):
        growth_at_temperature(1.0, 1e-6, surface, reference, 2500.0, 1500.0)


@pytest.mark.parametrize(
    "surface, key",
    [(0.5, "rest_growth would be about 1e-"), (2.0, "rest_growth would be about 1e-")],
)
def test_refuses_rates_beyond_floating_point(surface, key):
    with pytest.raises(PatchfemError, match=key):
        growth_at_temperature(10.0, 2e-7, surface, 293.15, 2500.0, 1500.0)
    with pytest.raises(PatchfemError, match="slip_growth would be about 1e3"):
        growth_at_temperature(10.0, 2e-7, 2.0, 293.15, None, 1500.0)


# ---- a temperature per point


@pytest.mark.parametrize("breakaway", [0.0, 0.3])
def test_exact_points_of_their_own_temperature_are_separate_runs(breakaway):
    """Three points at 250, 293.15 and 450 K in one call = three recursions with rates by hand."""
    law = Bonds(0.6, 2e-6, 1.0, "stretch", 0.7, 10.0, 2e-7, 1e-5, breakaway=breakaway)
    hot = np.array([250.0, 293.15, 450.0])
    sigma = np.array([1.0, 2.0, 0.5])
    rest, slip = growth_at_temperature(
        law.rest_growth, law.slip_growth, hot, 293.15, 2500.0, 1500.0
    )
    engine = FirstOrderBonds(replace(law, rest_growth=rest, slip_growth=slip))
    alone = [
        FirstOrderBonds(
            Bonds(
                0.6,
                2e-6,
                1.0,
                "stretch",
                0.7,
                10 * np.exp(2500 * (1 / 293.15 - 1 / t)),
                2e-7 * np.exp(1500 * (1 / t - 1 / 293.15)),
                1e-5,
                breakaway=breakaway,
            )
        )
        for t in hot
    ]
    state = engine.start(sigma)
    states = [one.start(sigma[i : i + 1]) for i, one in enumerate(alone)]
    rng = np.random.default_rng(1)
    for dq in np.append(rng.normal(0, 1e-6, 60), [0.0, 2e-6]):
        new = sigma * rng.uniform(0.5, 1.5)
        step = engine.step(state, dq, sigma, new, 1e-3)
        ones = [
            one.step(s, dq, sigma[i : i + 1], new[i : i + 1], 1e-3)
            for i, (one, s) in enumerate(zip(alone, states))
        ]
        state = step.state
        states = [one.state for one in ones]
        assert step.mean == pytest.approx([one.mean[0] for one in ones], rel=1e-12, abs=1e-14)
        assert step.dissipated == pytest.approx(
            [one.dissipated[0] for one in ones], rel=1e-10, abs=1e-20
        )
        assert state.eps == pytest.approx([one.eps for one in states], rel=1e-13)
        assert (step.dissipated >= 0).all()
    assert np.ptp(state.eps) > 1e-8


# ---- scenes


def test_exact_a_surface_at_its_reference_is_the_scene_without_the_table():
    text = POINT + GROWING
    cold = ["friction.temperature.surface=293.15 K"]
    plain = loads(text + TRIANGLE)
    warm = loads(text + WARM + TRIANGLE, sets=cold)
    one, two = (bench.run(build(scene), None, 200) for scene in (plain, warm))
    assert (one.force == two.force).all() and one.values == two.values
    assert plan(plain).groups == plan(warm).groups


def test_exact_steady_friction_of_a_warm_bench():
    """mu(v) of 2.18 with the rates of 2.13; the warm surface is the stronger one at this speed."""
    rest = 10 * np.exp(2500 * (1 / 293.15 - 1 / 393.15))
    slip = 2e-7 * np.exp(1500 * (1 / 393.15 - 1 / 293.15))
    scene = loads(POINT + GROWING + WARM + SLIDE)
    found = bench.run(build(scene), None, 2000).values["friction_ratio_end"]
    truth = 0.6 * friction_forms.steady_bond_length(5e-3, 2e-6, 0.7, rest, slip) / 2e-6
    assert found == pytest.approx(truth, rel=1e-6)
    cold = 0.6 * friction_forms.steady_bond_length(5e-3, 2e-6, 0.7, 10.0, 2e-7) / 2e-6
    assert abs(truth - cold) > 1e-3


def test_exact_a_warm_rig_is_a_rig_with_the_rates_of_the_warm_surface():
    rest, slip = growth_at_temperature(10.0, 2e-7, 393.15, 293.15, 2500.0, 1500.0)
    warm = loads(POINT + GROWING + WARM + SHORT, sets=["friction.rest_speed=10 um/s"])
    same = loads(
        POINT + GROWING + SHORT,
        sets=[
            "friction.rest_speed=10 um/s",
            f"friction.rest_growth={rest!r} m/s^2",
            f"friction.slip_growth={slip!r} m",
        ],
    )
    assert build(warm).bonds == build(same).bonds != build(loads(POINT + GROWING + SHORT)).bonds
    one, two = (run(plan(scene), estimate=False).measures for scene in (warm, same))
    assert {k: m.value for k, m in one.items()} == {k: m.value for k, m in two.items()}
    assert one != run(plan(loads(POINT + GROWING + SHORT)), estimate=False).measures


@pytest.mark.parametrize(
    "sets, says",
    [
        (["friction.temperature.surface=0 K"], "must be > 0"),
        (["friction.temperature.surface=-3 K"], "below 0 K"),
        (["friction.temperature.reference=20 degC"], "temperatures must be absolute"),
        (["friction.temperature.rest_activation=-1 K"], "below 0 K"),
    ],
)
def test_refuses_wrong_temperatures_in_a_scene(sets, says):
    with pytest.raises(SceneError, match=says):
        loads(POINT + GROWING + WARM + SLIDE, sets=sets)


def test_refuses_a_scene_whose_rates_leave_the_range():
    scene = loads(POINT + GROWING + WARM + SLIDE, sets=["friction.temperature.surface=1 K"])
    with pytest.raises(
        PatchfemError,
        match=r"scene.toml:\d+: friction.temperature: at the surface temperature "
        r"rest_growth would be about 1e-",
    ):
        plan(scene)


@pytest.mark.parametrize(
    "text, says",
    [
        (GROWING, "activation temperatures"),
        (
            '[friction]\nlaw = "nonlocal"\nstatic = 0.6\nbond_length = "2 um"\n',
            "growth of the bonds",
        ),
    ],
)
def test_exact_a_table_without_effect_is_remarked(text, says):
    table = WARM if "growth" in says else WARM.split("rest_act")[0]
    scene = loads(POINT + text + table + SLIDE)
    assert [r for r in scene.remarks if "friction.temperature has no effect" in r and says in r]
    assert scene.friction.temperature is None and loads(scene.resolved()).remarks == []


# ---- the rise of the surface temperature


@pytest.mark.parametrize(
    "time, printed, within", [(1 / 143, 0.05, 0.1), (1.0, 0.6, 0.1), (10.0, 1.8, 0.1)]
)
def test_exact_rise_of_a_half_space_under_constant_heat(time, printed, within):
    """0.2 W on 1 cm2 of titanium: heat balance of the exact field 2 q sqrt(at) ierfc(z/2 sqrt(at))/k."""
    k = 7.0
    c = 2.3e6
    rise = surface_temperature_rise(2000.0, time, k, c)
    assert rise == pytest.approx(printed, rel=within)
    reach = np.sqrt(k / c * time)
    z = np.linspace(0, 14 * reach, 40_001)
    s = z / (2 * reach)
    field = 2 * 2000.0 * reach / k * (np.exp(-(s**2)) / np.sqrt(np.pi) - s * erfc(s))
    assert field[0] == pytest.approx(rise, rel=1e-14)
    assert np.trapezoid(c * field, z) == pytest.approx(2000.0 * time, rel=1e-6)


def test_exact_the_rise_is_reported_beside_the_table_only():
    text = SMALL_PATCH + GROWING + WARM + TRIANGLE
    lines = [
        w
        for w in run(plan(loads(text)), estimate=False).warnings
        if "the surface temperature would rise" in w
    ]
    assert len(lines) == 1 and "after one cycle" in lines[0] and "and keeps" in lines[0]
    found = run(plan(loads(SMALL_PATCH + GROWING + TRIANGLE)), estimate=False)
    assert not any("warm" in w for w in found.warnings)
    power = np.trapezoid(found.response.force, found.response.slide) / found.response.time[-1]
    assert f"friction dissipates {power:.1g}"[:22] in lines[0]
    rig = run(
        plan(loads(SMALL_PATCH + GROWING + WARM + SHORT, sets=["accuracy.steps_per_cycle=100"])),
        estimate=False,
    )
    power = rig.extra["book"]["friction"] / rig.response.time[-1]
    assert (
        any(
            f"friction dissipates {power:.2g} W" in w and "after one cycle" in w
            for w in rig.warnings
        )
        and power > 0
    )
    none = run(plan(loads(POINT + GROWING + WARM + TRIANGLE)), estimate=False).warnings
    assert any("has no area" in w for w in none)
    own = text.replace(
        SUBSTRATE, 'substrate = {young = "121 GPa", poisson = 0.32, density = "4370 kg/m^3"}'
    )
    assert any("conductivity" in w for w in run(plan(loads(own)), estimate=False).warnings)


def test_exact_a_scene_without_these_effects_imports_none_of_them(tmp_path):
    (tmp_path / "scene.toml").write_text(
        BENCH.replace("coulomb", "nonlocal").replace("static", 'bond_length = "2 um"\nstatic'),
        "utf-8",
    )
    others = {
        "friction.bonds.temperature",
        "friction.bonds.spread",
        "friction.laws.convolution",
        "friction.bonds.plane",
        "friction.bonds.plane_quadrature",
        "runs.bench.two_directions",
        "runs.results.heat",
        "runs.bench.averaged",
    }
    assert not {f"patchfem.{name}" for name in others} & loaded(
        FROM_PYTHON, tmp_path / "scene.toml"
    )
