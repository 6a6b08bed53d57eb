"""A run whose energy balance does not close has not converged; runs with very large damping."""

from scene_texts import FORCED

import patchfem as pf
from patchfem.core import Outcome

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


def run_scene(folder, damping, cycles):
    """Return the result of the scene with a damping ratio and a number of cycles, from a file."""
    path = folder / "scene.toml"
    path.write_text(SCENE.format(damping=damping, cycles=cycles), "utf-8")
    return pf.run(path)


def test_exact_overdamped_mode_moves_with_base(tmp_path):
    """With a damping ratio of 1e6 the mass moves with the base, at 5 g. An earlier version gave
    9e-6 +- 8e-6 m/s^2, with an energy balance of 0.27."""
    result = run_scene(tmp_path, 1e6, 12)
    peak = result.measures["absolute_acceleration_peak"]
    assert abs(peak.value - 5 * 9.80665) <= max(peak.error, 1e-6)
    assert result.measures["energy_balance"].value < 1e-12 and result.outcome is Outcome.STEADY


def test_always_stuck_chain_has_zero_energy_balance():
    """A chain of two masses sticks at half of its friction limit; the energy of 1.7e-20 J is
    round-off, and the energy balance is zero."""
    drive = (
        FORCED.replace("mass = 2", "mass = 1")
        .replace("30 N", "4.14 N")
        .replace("90 Hz", "52.09 Hz")
    )
    result = pf.run(f"""[structure]
masses = ["0.5918 kg", "0.5335 kg"]
spring = [{{between = [1, 0], stiffness = "490700 N/m"}}, {{between = [2, 1], stiffness = "755300 N/m"}},
          {{between = [2, 0], stiffness = "1003000 N/m"}}]
damper = [{{between = [1, 0], coefficient = "1.449 N s/m"}}, {{between = [2, 1], coefficient = "6.438 N s/m"}}]
interface = [{{between = [1, 0], load = "10.38 N", law = "coulomb", static = 0.723}}]
{drive.replace("cycles = 25", "cycles = 12")}""")
    assert result.outcome is Outcome.STUCK and not result.warnings
    assert result.measures["energy_balance"].value == 0 < result.extra["book"]["power"] < 1e-18
