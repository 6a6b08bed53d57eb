"""Periodic motions by shooting with a time-stepping march, against the map of the event engine."""

import numpy as np
import pytest
from event_run import solve_steady
from modal_bases import make_modal_basis

from patchfem.core import SineDrive
from patchfem.dynamics import start_run
from patchfem.dynamics.grooves.run import make_model
from patchfem.dynamics.harmonic import orbits
from patchfem.friction import Grooves

OMEGA, ZETA = 2 * np.pi * 143, 0.003
BASIS = make_modal_basis(OMEGA, ZETA, mass=1.194)


@pytest.mark.parametrize("level", [49.0, 60.0])
def test_exact_orbit_with_coulomb_friction_agrees_with_event_map(level):
    """On grooves of nearly zero height the orbit and its largest multiplier agree with those of the
    event engine, for a motion with stops and for one that slides all the time."""
    drive = SineDrive(level, OMEGA * 1.03)
    limit = 0.35 * 115.65
    expected = solve_steady(BASIS, drive, np.array([limit]), np.array([limit]))
    run = start_run(
        BASIS, drive, make_model(Grooves(80e-6, 1e-17), 115.65, 0.35, 0.35, None, BASIS), 64
    )
    assert orbits.march_to_periodic(run) < orbits.PERIODIC_TOL
    cycle, _ = orbits.march_cycle(run)
    amplitude = float(np.ptp(cycle.extremes)) / 2
    assert run.state[0, 0] == pytest.approx(expected.start.z[0], abs=1e-7 * amplitude)
    assert run.state[1, 0] == pytest.approx(expected.start.v[0], abs=1e-7 * amplitude * drive.omega)
    largest = np.abs(expected.multipliers).max(initial=0.0)
    assert np.abs(orbits.estimate_multipliers(run)).max() == pytest.approx(largest, abs=2e-3)
