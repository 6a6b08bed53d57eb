"""`numerics` in summary.json: what a run chose, and what a scene pinned."""

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
def test_exact_names_the_engine_and_its_steps(law, method, engine):
    speed = 'reference_speed = "1 mm/s"\n' if law == "tanh" else ""
    text = RIG.format(law).replace("static = 0.3\n", f"static = 0.3\n{speed}")
    found = summarise_run(pf.run(text + f'[accuracy]\nmethod = "{method}"\n'))["numerics"]
    assert found["engine"] == engine and found["window_cycles"] == 2
    assert ("steps_per_cycle" in found) == (engine != "exact")


def test_exact_a_pinned_step_count_is_named():
    text = (
        HEAD.format("elastic-plastic")
        + 'bond_length = "1 um"\n[slide]\nkind = "sine"\namplitude = "5 um"\n'
        'frequency = "10 Hz"\ncycles = 1\n[accuracy]\nsteps_per_cycle = 300\n'
    )
    assert summarise_run(pf.run(text))["numerics"]["steps_per_cycle"] == 300
