"""Modes under a contact with varying load: bodies, laws and the energy of the motion."""

from functools import cache
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
import pytest
from march_contacts import make_pressed_contact
from pressed import solve_forces
from scipy.optimize import brentq

from patchfem.contact import ContactSets
from patchfem.core import InitialState, ModalBasis, SineDrive
from patchfem.friction import BondGrowth, Bonds
from patchfem.motion_measures import energy_balance
from patchfem.time_steps.contacts import Press
from patchfem.time_steps.time_march import march

MASS, LOAD, STILL = 0.884, 116.0, SineDrive(0.0, 2 * np.pi * 143)
LAWS = {
    "coulomb": SimpleNamespace(law="coulomb", static=0.3, kinetic=None),
    "weaker": SimpleNamespace(law="coulomb", static=0.3, kinetic=0.2),
    "tanh": SimpleNamespace(law="tanh", static=0.3, kinetic=None, reference_speed=1e-3),
    "plastic": SimpleNamespace(law="elastic-plastic", static=0.3, bond_length=1e-6),
    "bonds": Bonds(0.3, 1e-6),
    "growing": Bonds(0.3, 1e-6, 1.0, "stretch", 0.7, BondGrowth(10.0, 2e-7, 1e-5), 0.5),
}


def make_modes(frequencies, slide, normal, pitch, zeta=0.0, base=None) -> ModalBasis:
    """Return a modal basis with displacement, heave and pitch at the interface."""
    size = len(frequencies)
    numbers = (np.array(v, float) for v in (slide, slide if base is None else base, slide))
    return ModalBasis(
        tuple("abcd"[:size]),
        2 * np.pi * np.array(frequencies, float),
        np.full(size, zeta),
        *numbers,
        MASS,
        normal=np.array(normal, float),
        pitch=np.array(pitch, float),
    )


# Displacement, heave and pitch in every mode.
MIXED = make_modes([143.0, 700.0], [1.0, 0.3], [0.05, 1.0], [30.0, -80.0], 0.02)


def make_contact(m: int = 21, crown: float = 0.0) -> ContactSets:
    """Return springs of 5e7 N/m coupled as in a half space and pressed by LOAD, flat or crowned."""
    x = np.linspace(-5e-3, 5e-3, m)
    c = 2e-8 * (np.exp(-np.abs(x[:, None] - x) / 2e-3) * 0.3 + np.eye(m))
    gap = crown * (x / x[-1]) ** 2
    delta = brentq(
        lambda d: solve_forces(c, x, gap - d, np.zeros(0))[0].sum() - LOAD, 1e-9, 1e-5, xtol=1e-18
    )
    force = solve_forces(c, x, gap - delta, np.zeros(0))[0]
    return ContactSets(c, x, gap - delta, force > 0)


def march_pressed(basis, drive, sets, name: str, cycles, steps, start=None, shear=None, **options):
    """March a basis under the load of contact sets with a law of LAWS."""
    contact = make_pressed_contact(
        LAWS[name],
        sets.force,
        basis.slide,
        shear,
        press=Press(sets, basis.normal, basis.pitch),
    )
    return march(basis, drive, contact, cycles, steps, window=cycles, start=start, **options)


@cache
def crowned_contact() -> ContactSets:
    """Return the crowned contact."""
    return make_contact(21, 4e-7)


def total_energy(response, basis) -> np.ndarray:
    """Return kinetic and elastic energy of the motion, the contact and the friction (t,) [J]."""
    motion = (
        0.5
        * basis.mass
        * (response.modal_rate**2 + (basis.omega * response.modal) ** 2).sum(axis=1)
    )
    return motion + response.extra["normal_energy"] + response.extra["ledger"][1]


def check_balance(result, basis) -> float:
    """Check the stored energy of a march and return its energy balance."""
    energies = result.ledger
    assert energies["stored"] == pytest.approx(
        total_energy(result.response, basis)[-1], rel=1e-9, abs=1e-18
    )
    return energy_balance(energies)


def find_faults_of_random_march(name: str, seed: int, steps: int, shear=None) -> dict[str, float]:
    """Return faults of a random march in their tolerances: its balance, energy that it creates, and force beyond mu N.

    Parameters
    ----------
    name : str
        Name of a law in LAWS.
    seed : int
        Seed of modes, drive and start.
    steps : int
        Steps per cycle.
    shear : ShearModes, optional
        Shear of the pieces.
    """
    rng = np.random.default_rng(seed)
    n = rng.integers(1, 5)
    basis = make_modes(
        rng.uniform(50, 900, n),
        rng.normal(size=n),
        rng.normal(size=n) * rng.choice([0, 0.3, 1.0]),
        rng.normal(size=n) * rng.choice([0, 50.0, 300.0]),
        0.01,
    )
    drive = SineDrive(float(rng.choice([0, 30.0, 150.0])), 2 * np.pi * 143)
    start = InitialState(1e-6 * rng.normal(size=n), 3e-4 * rng.normal(size=n))
    result = march_pressed(basis, drive, crowned_contact(), name, 3, steps, start, shear)
    response = result.response
    peak = result.ledger["peak_stored"]
    assert result.outcome is None, result.message

    # A step is solved up to 1e-12 of the largest force (march_rows.RESIDUAL), which does work along the path.
    force = max(0.3 * LOAD, response.extra["normal_load"].max())
    paths = np.abs(np.diff([response.slide, response.modal @ basis.normal])).sum()
    energy = peak + result.ledger["power"]
    work, stored, lost, created = (column[-1] for column in response.extra["ledger"])
    gain = -np.diff(response.extra["ledger"][2]).min()
    balance = check_balance(result, basis)
    imbalance = abs(work - (stored + lost - created))
    difference = abs(result.ledger["friction"] - lost)
    excess = (np.abs(response.force) - 0.3 * response.extra["normal_load"]).max()
    return {
        "balance": balance / (1e-11 + 1e-12 * force * paths / energy),
        "created": created / (1e-12 * peak),
        "gain": gain / (1e-12 * peak),
        "work": imbalance / max(1e-9 * abs(stored + lost - created), 1e-12 * peak),
        "friction": difference / (1e-9 * (lost + stored) + 1e-18),
        "force": excess / (1e-9 * LOAD),
    }


def march_with_lift_off(name: str, shear=None) -> tuple:
    """Return a march that lifts off and lands again, without force while apart, and its energy balance."""
    basis = make_modes([100.0, 150.0], [1.0, 0.0], [0.0, 1.0], [0.0, 0.0], 0.0, [1.0, 0.0])
    drive = SineDrive(30.0, 2 * np.pi * 143)
    start = InitialState([0, 5e-7], [0, 0.0])
    result = march_pressed(basis, drive, crowned_contact(), name, 6, 400, start, shear)
    force = result.response.force
    is_apart = result.response.extra["normal_load"] == 0
    assert 0.02 < is_apart.mean() < 0.95 and not force[is_apart].any()
    assert np.abs(force).max() > 0.1 * 0.3 * LOAD
    assert np.count_nonzero(np.diff(is_apart.astype(int)) == -1) >= 3
    return result, check_balance(result, basis)


class Convergence(NamedTuple):
    """Observed order of a march, and its last change relative to the state."""

    order: float
    change: float


def find_convergence(name: str, steps: int, shear=None) -> Convergence:
    """Return the order of the end of a cycle of `MIXED` from four numbers of steps, each twice the one before.

    Parameters
    ----------
    name : str
        Name of a law in LAWS.
    steps : int
        Smallest number of steps per cycle.
    shear : ShearModes, optional
        Shear of the pieces.
    """
    drive = SineDrive(40.0, 2 * np.pi * 143)
    final_states = []
    for factor in (1, 2, 4, 8):
        result = march_pressed(
            MIXED, drive, crowned_contact(), name, 1, factor * steps, shear=shear
        )
        response = result.response
        final_states.append(
            np.concatenate([response.modal[-1], response.modal_rate[-1] / MIXED.omega])
        )
        assert result.outcome is None
    change = np.abs(np.diff(final_states, axis=0)).max(axis=1)
    order = float(np.log2(change[0] / change[2]) / 2)
    return Convergence(order, float(change[-1] / np.abs(final_states[-1]).max()))
