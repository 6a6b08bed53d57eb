"""A run whose energy balance does not close has not converged, whatever its amplitudes look like; stiff damping."""

import pytest
from scene_texts import FORCED

import patchfem as pf
from patchfem.core import Measure, Outcome
from patchfem.runs import ENGINES
from patchfem.runs.rig.engines import describe_balance_error

SCENE = """
[normal]
load = "26 lbf"
[friction]
law = "tanh"
static = 0.3
reference_speed = "1 mm/s"
[structure]
moving_mass = "884.0 kg"
[[structure.mode]]
name = "axial"
frequency = "143 Hz"
damping = {damping}
slide = 1.0
[drive]
kind = "base"
frequency = "143 Hz"
acceleration = "5 g"
cycles = {cycles}
[accuracy]
tolerance = 1e-2
method = "march"
"""


def run(folder, damping, cycles):
    path = folder / "scene.toml"
    path.write_text(SCENE.format(damping=damping, cycles=cycles), "utf-8")
    return pf.run(path)


def test_exact_acceleration_of_a_mode_that_its_damping_locks(tmp_path):
    """Damping 1e6: the mass moves with the base, 5 g; a march said 9e-6 ± 8e-6 m s-2 and an energy balance of .27."""
    found = run(tmp_path, 1e6, 12)
    peak = found.measures["absolute_acceleration_peak"]
    assert abs(peak.value - 5 * 9.80665) <= max(peak.error, 1e-6)
    assert found.measures["energy_balance"].value < 1e-12 and found.outcome is Outcome.STEADY


@pytest.mark.parametrize(
    "engine, value, error, closes",
    [
        ("march", 2e-8, 1e-6, False),
        ("march", 9e-9, 0.0, True),
        ("exact", 2e-8, None, False),
        ("harmonic", 6e-8, 1e-7, True),
        ("harmonic", 6e-8, 1e-9, False),
        ("march", float("nan"), None, True),
        ("march", None, None, True),
    ],
)
def test_always_an_energy_balance_above_its_limit_is_reported(engine, value, error, closes):
    said = describe_balance_error(
        ENGINES[engine], {"energy_balance": Measure(value, "1", error, 1e-8)}
    )
    assert (said == "") is closes


def test_always_the_round_off_of_what_holds_still_is_no_missing_energy():
    """Two masses, of which the driven one is held at half its limit: all that passes is 1.7e-20 J of round-off."""
    held = (
        FORCED.replace("mass = 2", "mass = 1")
        .replace("30 N", "4.14 N")
        .replace("90 Hz", "52.09 Hz")
    )
    found = pf.run(f"""[structure]
masses = ["0.5918 kg", "0.5335 kg"]
spring = [{{between = [1, 0], stiffness = "490700 N/m"}}, {{between = [2, 1], stiffness = "755300 N/m"}},
          {{between = [2, 0], stiffness = "1003000 N/m"}}]
damper = [{{between = [1, 0], coefficient = "1.449 N s/m"}}, {{between = [2, 1], coefficient = "6.438 N s/m"}}]
interface = [{{between = [1, 0], load = "10.38 N", law = "coulomb", static = 0.723}}]
{held.replace("cycles = 25", "cycles = 12")}""")
    assert found.outcome is Outcome.STUCK and not found.warnings
    assert found.measures["energy_balance"].value == 0 < found.extra["book"]["power"] < 1e-18
