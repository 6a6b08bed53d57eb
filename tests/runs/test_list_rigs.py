"""Rigs with a list of bonds (orders other than 1 and the law of the report) on random scenes:
energy balances close."""

import numpy as np

from patchfem import load
from patchfem.runs.run import run

RIG = """[normal]
load = "{load:.6g} N"
[friction]
law = "nonlocal"
static = 0.3
bond_length = "{length:.6g} um"
{law}[structure]
moving_mass = "0.9 kg"
[[structure.mode]]
name = "one"
frequency = "{first:.6g} Hz"
damping = {damping:.4g}
slide = 1.0
base = 0.9
output = 1.0
[[structure.mode]]
name = "two"
frequency = "{second:.6g} Hz"
damping = 0.02
slide = 0.4
base = 0.2
[drive]
kind = "base"
frequency = "{drive:.6g} Hz"
acceleration = "{level:.6g} g"
cycles = 3
[accuracy]
steps_per_cycle = {steps}
"""


def draw_rig(rng) -> str:
    """Return a random scene."""
    reading = str(rng.choice(["stretch", "report"]))
    order = float(rng.choice([0, 0.5, 2, 3.3] if reading == "stretch" else [-0.5, 0, 0.5, 1, 2]))
    law = f'reading = "{reading}"\norder = {order}\n'
    law += "initial_bonds = 0\n" if order < 0 or rng.random() < 0.5 else ""
    if rng.random() < 0.5:
        law += (
            f'kinetic = {rng.uniform(0.18, 0.3):.3f}\nrest_growth = "{10 ** rng.uniform(-1, 1.5):.4g} m/s^2"\n'
            f'slip_growth = "{10 ** rng.uniform(-1, 1):.4g} um"\n'
        )
    first = rng.uniform(80, 200)
    return RIG.format(
        load=rng.uniform(20, 120),
        length=10 ** rng.uniform(0, 1.5),
        law=law,
        first=first,
        damping=rng.uniform(0.003, 0.05),
        second=first * rng.uniform(1.5, 4),
        steps=300,
        drive=first * rng.uniform(0.6, 1.4),
        level=rng.uniform(1, 6),
    )


def test_always_energy_balance_of_random_rigs_closes():
    """The energy balance and the friction work of six random rigs close; with the reading "stretch"
    no energy is created."""
    rng = np.random.default_rng(1)
    for _ in range(6):
        text = draw_rig(rng)
        result = run(load(text), estimate=False)
        values = {name: measure.value for name, measure in result.measures.items()}
        assert values["energy_balance"] <= 1e-8 and values["work_check"] <= 5e-3, text
        is_created = values["energy_created"] > 1e-9 * values["energy_dissipated"]
        assert any("in the report created" in line for line in result.warnings) == is_created, text
        if '"stretch"' in text:
            exchanged = values["energy_dissipated"] + result.motion.energies["power"]
            assert values["energy_created"] <= 1e-12 * exchanged, text
