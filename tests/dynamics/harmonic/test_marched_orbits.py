"""Marches that are brought to repeat: a linear mode by its closed form, Coulomb's law by the map of its events."""

import numpy as np
import pytest
from event_run import steady
from modal_bases import basis_of

from patchfem.core import SineDrive
from patchfem.dynamics import element_model, start_run
from patchfem.dynamics.grooves.run import make_model
from patchfem.dynamics.harmonic import orbits
from patchfem.friction import Grooves, parallel_element
from patchfem.response import energy_balance

OMEGA, ZETA = 2 * np.pi * 143, 0.003
BASIS = basis_of(OMEGA, ZETA, mass=1.194)


def test_exact_a_spring_beside_a_mode():
    """An element that never slips: amplitude, multipliers and books of a linear oscillator."""
    spring = 2e5
    drive = SineDrive(10.0, 2 * np.pi * 120)
    run = start_run(BASIS, drive, element_model(parallel_element([spring], [1.0])), 400)
    left = orbits.march_to_periodic(run)
    assert left < orbits.PERIODIC_TOL and run.outcome is None
    own = OMEGA**2 + spring / BASIS.mass
    true = 10.0 / abs(own - drive.omega**2 + 2j * ZETA * OMEGA * drive.omega)
    mark, _ = orbits.march_cycle(run)
    # the march is of order two
    assert float(np.ptp(mark.amplitudes)) / 2 == pytest.approx(true, rel=1e-4)
    assert energy_balance(mark.ledger) < 1e-11
    found = orbits.estimate_multipliers(run)
    beat = np.sqrt(own - (ZETA * OMEGA) ** 2)
    kept = np.exp((-ZETA * OMEGA + 1j * beat) * drive.period)
    np.testing.assert_allclose(np.abs(found), abs(kept), rtol=1e-5)
    np.testing.assert_allclose(
        found[found.imag > 0], [complex(kept.real, abs(kept.imag))], rtol=1e-3
    )


@pytest.mark.parametrize("level", [49.0, 60.0])
def test_exact_coulombs_law_on_flanks_of_no_height_is_the_map_of_events(level):
    """States and multipliers of a motion with stops, and of one that slides all the time."""
    drive = SineDrive(level, OMEGA * 1.03)
    limit = 0.35 * 115.65
    true = steady(BASIS, drive, np.array([limit]), np.array([limit]))
    run = start_run(
        BASIS, drive, make_model(Grooves(80e-6, 1e-17), 115.65, 0.35, 0.35, None, BASIS), 64
    )
    assert orbits.march_to_periodic(run) < orbits.PERIODIC_TOL
    mark, _ = orbits.march_cycle(run)
    swing = float(np.ptp(mark.amplitudes)) / 2
    assert run.state[0, 0] == pytest.approx(true.start.z[0], abs=1e-7 * swing)
    assert run.state[1, 0] == pytest.approx(true.start.v[0], abs=1e-7 * swing * drive.omega)
    largest = np.abs(true.multipliers).max(initial=0.0)
    assert np.abs(orbits.estimate_multipliers(run)).max() == pytest.approx(largest, abs=2e-3)
