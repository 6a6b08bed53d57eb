"""March of contact points: closed forms and order."""

import numpy as np
import pytest
from march_contacts import make_coulomb

from patchfem import kernel_cache
from patchfem.core import ModalBasis, SineDrive
from patchfem.time_steps import March, march
from patchfem.time_steps.contacts import Contact, PointSet

OMEGA = 2 * np.pi * 143.0
LIMIT = 40.0
DRIVE = SineDrive(LIMIT / 0.8, OMEGA)
EXACT_AMPLITUDE = 0.28704671337871602595  # two-stop motion in closed form, in static displacements


def make_modes(zeta=0.003) -> ModalBasis:
    """Return one mode of 1 kg."""
    one = np.ones(1)
    return ModalBasis(("a",), np.array([OMEGA]), np.array([zeta]), one, one, one, 1.0)


def run(law, steps, drive=DRIVE, cycles=60, zeta=0.003, **options):
    """Return the motion of a block on points of a given law."""
    contact = Contact([PointSet(law, np.ones(1))], LIMIT)
    return march(make_modes(zeta), drive, contact, cycles, steps, **options)


def amplitude(motion) -> float:
    """Return the amplitude of the last cycle in static displacements of the drive."""
    low, high = motion.extremes[-1]
    return (high - low) / 2 * OMEGA**2 / DRIVE.acceleration


def test_coulomb_block_at_resonance():
    """The amplitude of the two-stop motion, and its energy balance."""
    motion = run(make_coulomb(1.0, 1.0, LIMIT), 200)
    assert amplitude(motion) == pytest.approx(EXACT_AMPLITUDE, rel=1e-6)
    ledger = motion.ledger
    gap = ledger["work_in"] - ledger["viscous"] - ledger["booked"] - ledger["stored"]
    assert abs(gap) <= 1e-6 * ledger["power"]


def test_exact_rig_without_friction_shares_compiled_code():
    """The arrays of a march without points have the types of those with points: other types are compiled anew."""
    point = PointSet(make_coulomb(1.0, 1.0, LIMIT), np.ones(1))
    contacts = Contact([]), Contact([point], LIMIT)
    systems = [March(make_modes(), DRIVE, contact, 10).system for contact in contacts]
    assert len({kernel_cache.machine.convert_argument(system)[0] for system in systems}) == 1
