"""Modes under a contact whose load varies: pieces, laws and the energy of the motion."""

from functools import cache

import numpy as np
import pytest
from scipy.optimize import brentq

from patchfem.contact import ContactSets
from patchfem.contact.unilateral import solve_forces
from patchfem.core import ModalBasis, SineDrive
from patchfem.dynamics.march import varying_load
from patchfem.friction import Bonds
from patchfem.response import energy_balance

MASS, LOAD, STILL = 0.884, 116.0, SineDrive(0.0, 2 * np.pi * 143)
LAWS = {
    "coulomb": varying_load.make_coulomb_law(0.3),
    "weaker": varying_load.make_coulomb_law(0.3, 0.2),
    "tanh": varying_load.make_tanh_law(0.3, 1e-3),
    "plastic": varying_load.make_elastic_plastic_law(0.3, 1e-6),
    "bonds": varying_load.make_bonds_law(Bonds(0.3, 1e-6)),
    "growing": varying_load.make_bonds_law(
        Bonds(0.3, 1e-6, 1.0, "stretch", 0.7, 10.0, 2e-7, 1e-5, 0.5)
    ),
}


def modes(frequencies, slide, normal, pitch, zeta=0.0, base=None) -> ModalBasis:
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


def elastic(m: int = 21, crown: float = 0.0) -> ContactSets:
    """Springs of 5e7 N/m coupled like those of a half space, pressed by LOAD, flat or crowned."""
    x = np.linspace(-5e-3, 5e-3, m)
    c = 2e-8 * (np.exp(-np.abs(x[:, None] - x) / 2e-3) * 0.3 + np.eye(m))
    gap = crown * (x / x[-1]) ** 2
    delta = brentq(
        lambda d: solve_forces(c, x, gap - d, np.zeros(0))[0].sum() - LOAD, 1e-9, 1e-5, xtol=1e-18
    )
    force = solve_forces(c, x, gap - delta, np.zeros(0))[0]
    return ContactSets(c, x, gap - delta, force > 0)


@cache
def crowned() -> ContactSets:
    return elastic(21, 4e-7)


def mechanical(response, basis) -> np.ndarray:
    motion = (
        0.5
        * basis.mass
        * (response.modal_rate**2 + (basis.omega * response.modal) ** 2).sum(axis=1)
    )
    return motion + response.extra["normal_energy"] + response.extra["ledger"][1]


def balance(done, basis) -> float:
    book = done.ledger
    assert book["stored"] == pytest.approx(
        mechanical(done.response, basis)[-1], rel=1e-9, abs=1e-18
    )
    return energy_balance(book)
