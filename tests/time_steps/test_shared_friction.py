"""Rigid friction at more interfaces than the modes can move apart: such interfaces share their forces, and stop together."""

import numpy as np
import pytest
from march_contacts import make_contact, make_coulomb

from patchfem.core import ModalBasis
from patchfem.motion_measures import energy_balance
from patchfem.structure.drives import RecordedDrive
from patchfem.time_steps import laws, march

N_FACES = 8
FIRST_SEED = 20330001
N_BLOCKS = 160


def make_block(seed, n_rows):
    """Return a block that slides and turns on a row of faces, its random drive of `n_rows` rows, and the friction limits."""
    rng = np.random.default_rng(seed)
    arms = np.linspace(-1, 1, N_FACES) * rng.uniform(0.1, 1)
    modes = ModalBasis(
        ("slide", "turn"),
        np.array([1.0, rng.uniform(0.5, 1.5)]),
        np.full(2, 0.003),
        np.array([1.0, 0.0]),
        np.array([1.0, rng.uniform(0.05, 0.5)]),
        np.array([0.0, 1.0]),
        1.0,
        None,
        np.stack([np.ones(N_FACES), arms], axis=1),
    )
    frequency = np.fft.rfftfreq(n_rows, 0.3)
    lines = rng.standard_normal(frequency.size) + 1j * rng.standard_normal(frequency.size)
    base = np.fft.irfft(lines * ((frequency > 0.02) & (frequency < 0.5)), n_rows)
    base /= base.std()
    base[0] = 0.0
    drive = RecordedDrive(np.arange(n_rows) * 0.3, base, 6.0)
    limits = rng.uniform(0.8, 1.2, N_FACES) / N_FACES * rng.uniform(0.3, 1)
    return modes, drive, limits


def check_block(seed, kinetic):
    """March a block whose kinetic friction is a fraction of the static one; assert energy balance and friction limits."""
    modes, drive, limits = make_block(seed, 2000)
    point_laws = [make_coulomb(limit, kinetic * limit) for limit in limits]
    result = march(modes, drive, make_contact(point_laws, modes.interfaces), 99, 20)
    assert result.outcome is None, result.message
    assert energy_balance(result.ledger) <= 1e-9
    forces = np.abs(result.response.extra["forces"]).max(axis=0)
    assert (forces <= limits * (1 + 1e-9)).all()


@pytest.mark.parametrize("seed, kinetic", [(5, 1.0), (7, 1.0), (9, 1.0), (11, 1.0), (11, 0.7)])
def test_always_shared_friction_balances_energy(seed, kinetic):
    """Faces that nearly rest stop, turn back and slip again; the motion goes on to the end of the drive."""
    check_block(seed, kinetic)


@pytest.mark.slow
@pytest.mark.parametrize("kinetic", [1.0, 0.7])
def test_always_random_blocks_march_to_the_end(kinetic):
    """Random blocks, with as much kinetic friction as static and with less."""
    for seed in range(FIRST_SEED, FIRST_SEED + N_BLOCKS):
        check_block(seed, kinetic)


def test_shared_friction_is_the_limit_of_stiff_springs():
    """The motion on rigid faces is that on stiff elastic-plastic ones, whose elastic length is below 1e-6 of the motion."""
    modes, drive, limits = make_block(2, 400)
    rigid = make_contact([make_coulomb(limit, limit) for limit in limits], modes.interfaces)
    stiff = make_contact([laws.make_cells(limit, 1e-6, 1.0) for limit in limits], modes.interfaces)
    motions = [march(modes, drive, contact, 19, 640).response.output for contact in (rigid, stiff)]
    assert np.abs(motions[0] - motions[1]).max() < 5e-4 * np.abs(motions[0]).max()
