"""Cases of sweeps that stick but still vibrate freely, and cases with large errors."""

import numpy as np
from scene_texts import ELASTIC_JOINT

import patchfem as pf

DRIVE = '[drive]\nkind = "force"\nforce = "1 N"\nfrequency = "220 Hz"\ncycles = 100\n'
JOINT = ELASTIC_JOINT + DRIVE


def find_steady_amplitude(force: float, frequency: float) -> float:
    """Return the steady amplitude [m] of the joint while it sticks, a mode of two springs with one damper."""
    omega = 2 * np.pi * frequency
    stiffness = 1.3 * (2 * np.pi * 195) ** 2 + 2e5
    damping = 2 * 0.002 * 2 * np.pi * 195 * 1.3
    return force / abs(stiffness - 1.3 * omega**2 + 1j * omega * damping)


def test_sticking_cases_that_still_vibrate_are_transient():
    """A sticking joint after 100 cycles is transient in a run and in sweeps of both kinds; its steady amplitude is right.

    After 2000 cycles it is stuck.
    """
    one = pf.run(JOINT)
    assert one.outcome == "transient"
    few = pf.sweep(pf.load(JOINT), {"drive.force": ["1 N", "2 N"]})
    many = pf.sweep(pf.load(JOINT), {"drive.force": [f"{1 + k / 100} N" for k in range(80)]})
    for sweep in (few, many):
        assert set(sweep["outcome"].values) == {"transient"}
        values = sweep["relative_displacement_amplitude_steady"].values
        errors = sweep["relative_displacement_amplitude_steady_error"].values
        forces = sweep["drive_force"].values
        true = np.array([find_steady_amplitude(force, 220.0) for force in forces])
        assert (np.abs(values - true) <= errors + 1e-6 * true).all()
    assert pf.run(JOINT, **{"drive.cycles": 2000}).outcome == "stuck"
