"""Sweeps over cases of one mode and one point against exact motions and against the march of many points."""

from types import SimpleNamespace

import numpy as np
import pytest

from patchfem.core import ModalBasis, SineDrive
from patchfem.friction import make_law
from patchfem.points import cases, laws, rows

OMEGA = 2 * np.pi * 143.0
LIMIT = 40.0  # friction limit [N] of 1 kg
DRIVE = SineDrive(LIMIT / 0.8, OMEGA)
MODES = ModalBasis(
    ("a",), np.array([OMEGA]), np.array([0.003]), np.ones(1), np.ones(1), np.ones(1), 1.0
)
# Amplitude of the steady stick-slip motion at resonance, zeta = 0.003 and D = 0.8, by marching to 40 digits
EXACT_AMPLITUDE = 0.28704671337871602595
EXACT_STICK = 0.2127  # fraction of the time
KEYS = {
    "static": 0.5, "kinetic": 0.4, "bond_length": LIMIT / 2e7, "stiffness": 2e7, "exponent": 1.5, "shape": 0.6,
    "chi": -0.3, "beta": 0.5, "stribeck_speed": 0.01, "micro_damping": 200.0, "viscous": 1.0, "reference_speed": 2e-3,
}  # fmt: skip
SMOOTH = ("iwan", "bouc-wen", "lugre", "tanh", "nonlocal")


def make(name, accelerations=(DRIVE.acceleration,), ratio=1.0, cycles=200, **changes):
    """Return a batch of cases with accelerations (c,) [m s-2] at a ratio of the resonance, under a law with changed keys."""
    keys = KEYS | {"limit": LIMIT} | changes
    load = keys["limit"] / keys["static"]
    law = SimpleNamespace(static=keys["static"], length=keys["bond_length"])
    if name != "nonlocal":
        law = make_law(SimpleNamespace(law=name, **keys), load)
    drive = SineDrive(np.array(accelerations), ratio * OMEGA)
    columns = [
        *cases.list_parameters(MODES, drive, load, cycles, min(10, cycles // 10)),
        *laws.list_point_law(name, law, load),
        OMEGA**2,
    ]
    table = np.column_stack(np.broadcast_arrays(*columns))
    n = len(rows.Number)
    *arrays, reference = np.split(table, [n, -1], axis=1)
    return rows.Cases(*map(np.ascontiguousarray, arrays), reference[:, 0])


def test_coulomb_block_at_resonance():
    """Amplitude, stick fraction and energies of the two-stop motion with 64 steps per cycle."""
    values = cases.march_cases(make("coulomb", static=1.0, kinetic=1.0), 64).values
    amplitude = values["relative_displacement_amplitude"][0] * OMEGA**2 / DRIVE.acceleration
    assert amplitude == pytest.approx(EXACT_AMPLITUDE, rel=3e-5)
    assert values["stick_fraction"][0] == pytest.approx(EXACT_STICK, abs=2e-3)
    assert values["energy_balance"][0] <= 1e-6
    assert values["loop_area"][0] == pytest.approx(
        4 * LIMIT * values["slip_amplitude"][0], rel=1e-4
    )


def test_exact_stick_under_static_friction():
    """Below static friction a block at rest does not move at all, and friction carries the drive, also between steps."""
    law = {"static": 1.3, "kinetic": 1.0, "limit": 1.3 * LIMIT}
    values = cases.march_cases(make("coulomb", **law), 30).values
    assert values["friction_force_peak"][0] == pytest.approx(DRIVE.acceleration, rel=1e-9)
    assert values["relative_displacement_amplitude"][0] == 0
    assert values["stick_fraction"][0] == 1


def test_always_released_block_is_located_within_its_shortest_step():
    """With 34 steps per cycle the amplitude of stick-slip motions agrees with that of 2048 steps."""
    law = {"static": 1.8, "kinetic": 1.0, "limit": 1.8 * LIMIT}
    batch = make("coulomb", LIMIT * np.linspace(1.9, 3.0, 6), 0.6, 60, **law)
    coarse, fine = [cases.march_cases(batch, steps).values for steps in (34, 2048)]
    assert (fine["stick_fraction"] > 0.01).all()
    amplitude = "relative_displacement_amplitude"
    assert coarse[amplitude] == pytest.approx(fine[amplitude], rel=3e-6)


@pytest.mark.parametrize("speed", [1e-3, 1e-4])
@pytest.mark.parametrize("ratio", [0.6, 0.9, 1.3])
def test_always_acceleration_peak_of_steep_tanh_is_that_of_coulomb(ratio, speed):
    """With a small reference speed, relative to that of the drive, the peak is that of rigid friction."""
    accelerations = LIMIT * np.array([1.5, 2.0, 3.0, 5.0])
    peak = "absolute_acceleration_peak"
    drives = accelerations, ratio, 60
    rigid = make("coulomb", *drives, static=1.0, kinetic=1.0)
    tanh = make("tanh", *drives, reference_speed=speed * DRIVE.acceleration / OMEGA)
    truth = cases.march_cases(rigid, 1024).values[peak]
    for steps in (34, 54):
        values = cases.march_cases(tanh, steps).values
        assert values[peak] == pytest.approx(truth, rel=3e-3)


@pytest.mark.parametrize("name", ["elastic-plastic", *SMOOTH])
def test_always_steps_converge(name):
    """Amplitude and loop area of six drives approach those of 1024 steps per cycle."""
    batch = make(name, LIMIT * np.linspace(0.9, 3.0, 6), 0.9, 60)
    truth, rough, fine = [cases.march_cases(batch, steps).values for steps in (1024, 32, 128)]
    for measure in ("relative_displacement_amplitude", "loop_area"):
        size = np.abs(truth[measure])
        assert np.median(np.abs(rough[measure] - truth[measure]) / size) <= 5e-3
        assert np.median(np.abs(fine[measure] - truth[measure]) / size) <= 1e-3


@pytest.mark.parametrize("name", SMOOTH)
def test_exact_errors_decrease_down_to_round_off(name):
    """The amplitudes of six drives with 300 and with 1000 steps per cycle agree within 2e-7, which the residuals of the
    steps must not disturb."""
    batch = make(name, LIMIT * np.linspace(0.9, 3.0, 6), 0.9, 60)
    few, many = [
        cases.march_cases(batch, steps).values["relative_displacement_amplitude"]
        for steps in (300, 1000)
    ]
    np.testing.assert_allclose(few, many, rtol=2e-7)


@pytest.mark.parametrize(
    "name, static", [("coulomb", 1.0), ("coulomb", 1.3), ("elastic-plastic", 1.0)]
)
def test_exact_steps_between_events_have_no_error(name, static):
    """Amplitude, work and stick of motions that stick, just slip and slip are the same with 16 and with 256 steps."""
    batch = make(
        name,
        LIMIT * np.linspace(0.9, 3.0, 24),
        0.9,
        60,
        static=static,
        kinetic=1.0,
        limit=static * LIMIT,
    )
    few, many = [cases.march_cases(batch, steps).values for steps in (16, 256)]
    for measure in ("relative_displacement_amplitude", "friction_work", "stick_fraction"):
        np.testing.assert_allclose(few[measure], many[measure], rtol=1e-9, atol=1e-15)
    assert (many["stick_fraction"] < 1).sum() > 12


def test_exact_short_stop_between_two_steps_is_found():
    """A slip whose velocity falls to 0 and rises again between two nodes stops there, as with many more steps.

    Far below its resonance a mode vibrates while it slips; at one in ten of these levels it just comes to rest.
    """
    levels = LIMIT * np.linspace(1.2, 4, 500)
    batch = make("coulomb", levels, 0.15, 60, static=1.0, kinetic=0.8)
    few, many = [cases.march_cases(batch, steps).values for steps in (8, 256)]
    for measure in ("friction_work", "stick_fraction"):
        np.testing.assert_allclose(few[measure], many[measure], rtol=1e-10, atol=1e-15)


def test_always_law_much_faster_than_drive_ends():
    """A case whose law needs more steps than a run may take ends, and its work check fails, unlike that of the next one."""
    speeds = np.array([1e-12, 1e-3]) * LIMIT / OMEGA
    values = cases.march_cases(make("tanh", [2 * LIMIT] * 2, reference_speed=speeds), 20).values
    assert values["work_check"][0] == np.inf > 1e-2 > values["work_check"][1]
