"""Scenes whose contact pushes and turns the modes as well as it rubs, and rigs under a load that swings."""

import numpy as np
import pytest
from scene_texts import BENCH, RIG, STRUCTURE, only

from patchfem.contact.unilateral import solve_forces
from patchfem.dynamics import make_contact_sets
from patchfem.export.histories import collect_histories
from patchfem.runs.run import run
from patchfem.scene import loads

PITCH = RIG.replace("slide = 0.1", 'slide = 0.1\npitch = "40 rad/m"').replace(
    "cycles = 200", "cycles = 12"
)
FEW = ["contact.element_size=400 um", "accuracy.steps_per_cycle=200"]
POINT = STRUCTURE + BENCH.split("[slide]")[0]
SWING = ["normal.amplitude=60 N", "normal.frequency=50 Hz"]


def result_of(text, *sets, estimate=False):
    return run(loads(text, "a.toml", sets), estimate=estimate)


@pytest.mark.share(0, 2)  # Coulomb and tanh: each a loop to compile
@pytest.mark.parametrize(
    "law",
    [
        '"nonlocal"\nbond_length = "1 um"',
        '"coulomb"',
        '"elastic-plastic"\nbond_length = "1 um"',
        '"tanh"\nreference_speed = "1 mm/s"',
    ],
)
def test_exact_a_pitching_mode_closes_its_energy_and_balances_its_fields(law):
    """Balance <= 1e-10; every frame is the unilateral solution at its gap: forces and gaps exclude each other."""
    text = PITCH.replace('"nonlocal"', law).replace(
        'static = 0.3\nbond_length = "1 um"', "static = 0.3"
    )
    found = result_of(text, *FEW)
    assert found.measures["energy_balance"].value <= 1e-10
    assert found.measures["energy_created"].value == 0
    fields = found.fields
    patch = found.patch
    load = found.response.extra["normal_load"]
    sums = fields["normal_stress"] @ patch.pieces.interface.weight
    assert sums[0] == pytest.approx(patch.pressure.load) and np.ptp(sums) > 0
    assert load.min() - 1e-9 <= sums.min() and sums.max() <= load.max() + 1e-9
    assert (fields["gap"] >= 0).all() and not (fields["gap"] * fields["normal_stress"]).any()
    assert (np.abs(fields["shear_stress"]) <= 0.3 * fields["normal_stress"] + 1e-6).all()
    kept, _ = collect_histories(found)
    assert kept["normal_load"] is load and np.ptp(load) > 1e-3 * load[0]


def test_exact_the_spring_of_the_holder_is_in_series_with_the_pitch():
    """Forces at a turn of the holder: the piece turns by the moment over the spring less than the holder."""
    words = ["contact.tilt.angle=0.01 mrad", "contact.holder.rotational_stiffness=2e4 N m/rad"]
    patch = result_of(PITCH, *FEW, *words, "drive.cycles=1").patch
    found = make_contact_sets(patch, 2e4)
    x = patch.x
    turn = 2e-6
    spring = 2e4
    force = solve_forces(found.c, found.x, found.opening + turn * found.x, np.zeros(0))[0]
    own = turn + (force @ x - patch.pressure.moment) / spring
    before = patch.pressure.sigma_n * patch.pieces.interface.weight
    gap = patch.pressure.gap - patch.pieces.normal @ before + own * x
    want = solve_forces(patch.pieces.normal, x, gap, np.zeros(0))[0]
    assert np.abs(force - want).max() <= 1e-11 * patch.pressure.load and own < 0.9 * turn


@pytest.mark.share(1)
@pytest.mark.parametrize(
    "law",
    [(), ("friction.law=elastic-plastic", "friction.bond_length=1 um")],
    ids=["coulomb", "elastic-plastic"],
)
def test_exact_a_rig_under_a_swinging_load(law):
    """normal_load follows its formula, the balance closes, and friction keeps below mu N."""
    found = result_of(POINT, *SWING, *law, estimate=True)
    time = found.response.time
    load = found.response.extra["normal_load"]
    assert load == pytest.approx(
        26 * 4.4482216152605 + 60 * np.cos(2 * np.pi * 50 * time), abs=1e-9
    )
    assert found.measures["energy_balance"].value <= 1e-12
    assert (np.abs(found.response.force) <= 0.3 * load + 1e-9).all()
    assert all(
        (m.error is None) == bool(m.reason)
        for name, m in found.measures.items()
        if not name.endswith("steady")
    )


def test_refuses_heave_and_pitch_beside_a_point():
    message = only(POINT, "structure.mode.axial.normal=0.1")
    assert message.startswith("--set: structure.mode.axial.normal: ")
    assert "use [contact] in place of" in message
    assert "no exact solution exists with normal.amplitude" in only(
        POINT, *SWING, "accuracy.method=exact"
    )
