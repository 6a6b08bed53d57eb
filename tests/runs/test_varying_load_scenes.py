"""Rigs with modes that change the normal load (pitch, heave), and rigs with a prescribed varying
load."""

import numpy as np
import pytest
from pressed import solve_forces
from scene_texts import BENCH, RIG, STRUCTURE, get_only_mistake

from patchfem.export.run_data import collect_data
from patchfem.runs.rig.interface import make_contact_sets
from patchfem.runs.run import run
from patchfem.scene import loads

PITCH = RIG.replace("slide = 0.1", 'slide = 0.1\npitch = "40 rad/m"').replace(
    "cycles = 200", "cycles = 12"
)
COARSE_SETTINGS = ["contact.element_size=400 um", "accuracy.steps_per_cycle=200"]
POINT = STRUCTURE + BENCH.split("[slide]")[0]
VARYING_LOAD = ["normal.amplitude=60 N", "normal.frequency=50 Hz"]


def run_text(text, *sets, estimate=False):
    """Return the result of a scene with --set options."""
    return run(loads(text, "a.toml", sets), estimate=estimate)


# The Coulomb and tanh cases would each compile a time loop that no other test needs.
@pytest.mark.share(2)
@pytest.mark.parametrize(
    "law",
    [
        '"nonlocal"\nbond_length = "1 um"',
        '"coulomb"',
        '"elastic-plastic"\nbond_length = "1 um"',
        '"tanh"\nreference_speed = "1 mm/s"',
    ],
)
def test_exact_pitching_mode_balances_energy_and_fields(law):
    """The energy balance closes within 1e-10, and in every frame pressure and gap exclude each
    other."""
    text = PITCH.replace('"nonlocal"', law).replace(
        'static = 0.3\nbond_length = "1 um"', "static = 0.3"
    )
    result = run_text(text, *COARSE_SETTINGS)
    assert result.measures["energy_balance"].value <= 1e-10
    assert result.measures["energy_created"].value == 0
    fields = result.fields
    patch = result.patch
    load = result.response.extra["normal_load"]
    sums = fields["normal_stress"] @ patch.pieces.interface.weight
    assert sums[0] == pytest.approx(patch.pressure.load) and np.ptp(sums) > 0
    assert load.min() - 1e-9 <= sums.min() and sums.max() <= load.max() + 1e-9
    assert (fields["gap"] >= 0).all() and not (fields["gap"] * fields["normal_stress"]).any()
    assert (np.abs(fields["shear_stress"]) <= 0.3 * fields["normal_stress"] + 1e-6).all()
    assert collect_data(result)["normal_load"].values is load and np.ptp(load) > 1e-3 * load[0]


def test_exact_holder_spring_acts_in_series_with_pitch():
    """At a given rotation of the holder, the piece rotates by this angle minus the moment over the
    spring stiffness."""
    settings = ["contact.tilt.angle=0.01 mrad", "contact.holder.rotational_stiffness=2e4 N m/rad"]
    patch = run_text(PITCH, *COARSE_SETTINGS, *settings, "drive.cycles=1").patch
    contact_set = make_contact_sets(patch, 2e4)
    x = patch.x
    holder_rotation = 2e-6
    spring = 2e4
    force = solve_forces(
        contact_set.c,
        contact_set.x,
        contact_set.opening + holder_rotation * contact_set.x,
        np.zeros(0),
    )[0]
    piece_rotation = holder_rotation + (force @ x - patch.pressure.moment) / spring
    initial_force = patch.pressure.sigma_n * patch.pieces.interface.weight
    gap = patch.pressure.gap - patch.pieces.normal @ initial_force + piece_rotation * x
    expected = solve_forces(patch.pieces.normal, x, gap, np.zeros(0))[0]
    assert (
        np.abs(force - expected).max() <= 1e-11 * patch.pressure.load
        and piece_rotation < 0.9 * holder_rotation
    )


def test_refuses_normal_motion_of_point_contact():
    """Modes with normal motion are refused with a point contact."""
    message = get_only_mistake(POINT, "structure.mode.axial.normal=0.1")
    assert message.startswith("--set: structure.mode.axial.normal: ")
    assert "use [contact] in place of" in message


# Rigs whose friction force and secant stiffness had the same samples in all coarser runs.
OSCILLATING_LOADS = {
    "sliding": (
        'load = "3.72097 N"\namplitude = "1.5994 N"\nfrequency = "140.86 Hz"\nphase = "0.1318 rad"\n'
        '[friction]\nlaw = "coulomb"\nstatic = 0.3\n[structure]\nmoving_mass = "0.6612 kg"\n',
        'frequency = "140.86 Hz"\ndamping = 0.003\nslide = 1.0\nbase = 0.69956\noutput = 1.0\n',
        'frequency = "140.86 Hz"\nacceleration = "5.04404 m/s^2"\n',
    ),
    "sticking": (
        'load = "157.8086 N"\namplitude = "32.241 N"\nfrequency = "115.1918 Hz"\nphase = "2.95912 rad"\n'
        '[friction]\nlaw = "elastic-plastic"\nbond_length = "4.8684 um"\nstatic = 0.3\n'
        '[structure]\nmoving_mass = "1.08517 kg"\n',
        'frequency = "115.1918 Hz"\ndamping = 0.05\nslide = 1.0\nbase = 0.7538\noutput = 1.0\n',
        'frequency = "115.1918 Hz"\nacceleration = "16.82 m/s^2"\n',
    ),
}


@pytest.mark.parametrize("kind, steps", [("sliding", 400), ("sticking", 128)])
def test_always_errors_under_oscillating_load_cover_many_steps(kind, steps):
    """The errors cover the differences from 16 times the steps, also of values between two samples."""
    head, mode, drive = OSCILLATING_LOADS[kind]
    text = (
        f'[normal]\n{head}[[structure.mode]]\nname = "axial"\n{mode}'
        f'[drive]\nkind = "base"\n{drive}cycles = 40\n[accuracy]\nmethod = "march"\n'
    )
    coarse, fine = (
        run_text(text + f"steps_per_cycle = {count}\n", estimate=True).measures
        for count in (steps, 16 * steps)
    )
    for name in ("friction_force_peak", "slip_amplitude", "secant_stiffness", "loop_area"):
        measure, truth = coarse[name], fine[name]
        if measure.value is not None:
            gap = abs(measure.value - truth.value)
            # A patch that sticks slips by round-off, in metres.
            assert gap <= measure.error + truth.error + 1e-18, name
    assert coarse["friction_force_peak"].error < 0.01 * coarse["friction_force_peak"].value
