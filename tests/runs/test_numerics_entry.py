"""The entry `numerics` of summary.json: settings that the run chose or the scene prescribed."""

import pytest

import patchfem as pf
from patchfem.export import summarise_run

HEAD = '[normal]\nload = "100 N"\n[friction]\nlaw = "{}"\nstatic = 0.3\n'
RIG = (
    HEAD
    + '[structure]\nmoving_mass = "1 kg"\n[[structure.mode]]\nname = "axial"\nfrequency = "100 Hz"\n'
    'damping = 0.01\nslide = 1.0\n[drive]\nkind = "base"\nfrequency = "90 Hz"\nacceleration = "40 m/s^2"\ncycles = 20\n'
)


@pytest.mark.parametrize(
    "law, method, engine", [("coulomb", "auto", "exact"), ("tanh", "march", "march")]
)
def test_exact_summary_names_engine_and_steps(law, method, engine):
    """The summary names the engine and the window, and the steps per cycle of a march."""
    speed = 'reference_speed = "1 mm/s"\n' if law == "tanh" else ""
    text = RIG.format(law).replace("static = 0.3\n", f"static = 0.3\n{speed}")
    numerics = summarise_run(pf.run(text + f'[accuracy]\nmethod = "{method}"\n'))["numerics"]
    assert numerics["engine"] == engine and numerics["window_cycles"] == 2
    assert ("steps_per_cycle" in numerics) == (engine != "exact")


def test_exact_summary_names_prescribed_steps():
    """The summary names a prescribed number of steps per cycle."""
    text = (
        HEAD.format("elastic-plastic")
        + 'bond_length = "1 um"\n[slide]\nkind = "sine"\namplitude = "5 um"\n'
        'frequency = "10 Hz"\ncycles = 1\n[accuracy]\nsteps_per_cycle = 300\n'
    )
    assert summarise_run(pf.run(text))["numerics"]["steps_per_cycle"] == 300
