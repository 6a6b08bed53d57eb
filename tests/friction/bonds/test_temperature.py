"""Growth of bonds on a warm surface (equation 2.13): printed values, the reference temperature, and scenes."""

import friction_forms
import numpy as np
import pytest
from scene_texts import GROWING, NONLOCAL, POINT, TRIANGLE

from patchfem import SceneError, build, plan
from patchfem.core import PatchfemError
from patchfem.friction.bonds.temperature import growth_at_temperature
from patchfem.runs.bench import bench
from patchfem.scene import loads

WARM = """[friction.temperature]
surface = "393.15 K"
reference = "293.15 K"
rest_activation = "2500 K"
slip_activation = "1500 K"
"""
CONSTANT_SPEED = '[slide]\nkind = "constant"\nspeed = "5 mm/s"\ndistance = "60 um"\n'


@pytest.mark.parametrize(
    "surface, expected",
    [
        (293.15, (1.97838937, 1.66806488e-7, 5.74463386e-4)),
        (393.15, (17.3127683, 4.53920808e-8, 8.86488902e-4)),
    ],
)
def test_exact_growth_rates_of_warm_surface(surface, expected):
    """Growth rates of a warm surface agree with the printed values, for an infinite or a finite reference (C13)."""
    rest, slip = growth_at_temperature(1e4, 1e-9, surface, np.inf, 2500.0, 1500.0)
    assert (rest, slip, np.sqrt(rest * slip)) == pytest.approx(expected, rel=1e-8)
    cold = growth_at_temperature(1e4, 1e-9, 293.15, np.inf, 2500.0, 1500.0)
    assert growth_at_temperature(*cold, surface, 293.15, 2500.0, 1500.0) == pytest.approx(
        expected[:2], rel=1e-8
    )


def test_exact_surface_at_reference_temperature_has_no_effect():
    """A surface at its reference temperature gives the results of a scene without the temperature table."""
    text = POINT + GROWING
    sets = ["friction.temperature.surface=293.15 K"]
    without_table = loads(text + TRIANGLE)
    with_table = loads(text + WARM + TRIANGLE, sets=sets)
    run_without, run_with = (
        bench.run_bench(build(scene), None, 200) for scene in (without_table, with_table)
    )
    assert (run_without.force == run_with.force).all() and run_without.values == run_with.values
    assert plan(without_table).groups == plan(with_table).groups


def test_exact_steady_friction_on_warm_bench():
    """The friction ratio at constant speed on a warm surface agrees with equations 2.13 and 2.18."""
    rest = 10 * np.exp(2500 * (1 / 293.15 - 1 / 393.15))
    slip = 2e-7 * np.exp(1500 * (1 / 393.15 - 1 / 293.15))
    scene = loads(POINT + GROWING + WARM + CONSTANT_SPEED)
    ratio = bench.run_bench(build(scene), None, 2000).values["friction_ratio_end"]
    expected = 0.6 * friction_forms.steady_bond_length(5e-3, 2e-6, 0.7, rest, slip) / 2e-6
    assert ratio == pytest.approx(expected, rel=1e-6)
    cold_ratio = 0.6 * friction_forms.steady_bond_length(5e-3, 2e-6, 0.7, 10.0, 2e-7) / 2e-6
    assert abs(expected - cold_ratio) > 1e-3


@pytest.mark.parametrize(
    "sets, message",
    [
        (["friction.temperature.surface=0 K"], "must be > 0"),
        (["friction.temperature.surface=-3 K"], "below 0 K"),
        (["friction.temperature.reference=20 degC"], "temperatures must be absolute"),
        (["friction.temperature.rest_activation=-1 K"], "below 0 K"),
    ],
)
def test_refuses_invalid_scene_temperatures(sets, message):
    """A temperature that is not absolute or not positive is refused in a scene."""
    with pytest.raises(SceneError, match=message):
        loads(POINT + GROWING + WARM + CONSTANT_SPEED, sets=sets)


def test_refuses_scene_with_growth_rates_out_of_range():
    """A scene whose growth rates leave the floating-point range is refused with the line of the table."""
    scene = loads(
        POINT + GROWING + WARM + CONSTANT_SPEED, sets=["friction.temperature.surface=1 K"]
    )
    with pytest.raises(
        PatchfemError,
        match=r"scene.toml:\d+: friction.temperature: at the surface temperature "
        r"rest_growth would be about 1e-",
    ):
        plan(scene)


@pytest.mark.parametrize("has_growth", [True, False])
def test_exact_temperature_table_without_effect_is_reported(has_growth):
    """A temperature table without activation temperatures, or beside bonds that do not grow, gives a remark and is
    dropped."""
    law = GROWING if has_growth else NONLOCAL
    table = WARM.split("rest_act")[0] if has_growth else WARM
    scene = loads(POINT + law + table + CONSTANT_SPEED)
    reason = "activation temperatures" if has_growth else "growth of the bonds"
    [remark] = [remark for remark in scene.remarks if remark.startswith("friction.temperature")]
    assert "has no effect without" in remark and reason in remark
    assert scene.friction.temperature is None
