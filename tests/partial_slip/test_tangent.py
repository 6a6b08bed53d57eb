"""Stick stiffness of two bodies of different materials, with normal-tangential coupling."""

from __future__ import annotations

import numpy as np
import pytest
from pieces import COATED, COATING, HEIGHT, LENGTH, WIDTH, make_bare_layers

from patchfem.contact import tangential_stiffness
from patchfem.contact.set_table import solve_set
from patchfem.core import Compliance, Interface
from patchfem.elasticity import Piece, compute_interface_compliance
from patchfem.mesh import make_graded_grid


def dissimilar_bodies() -> tuple:
    """Return the compliance of a coated body on a soft one, and the coupling of normal and
    tangential forces (m, m) [m/N]."""
    grids = (
        make_graded_grid(LENGTH, HEIGHT, LENGTH / 60, COATING),
        make_graded_grid(LENGTH, 4e-3, LENGTH / 60),
    )
    low, high = (
        compute_interface_compliance(Piece(grid, layers))
        for grid, layers in zip(grids, (COATED, make_bare_layers((70e9, 0.3))))
    )
    x = grids[0].x
    pieces = Compliance(
        Interface(x, np.ones(x.size), WIDTH), (low[0] + high[0]) / WIDTH, (low[1] + high[1]) / WIDTH
    )
    return pieces, (low[2] - high[2]) / WIDTH


def test_exact_coupled_stiffness_agrees_with_schur_complement():
    """The stick stiffness of dissimilar bodies agrees within 1e-11 with the Schur complement of
    their compliance, and exceeds the stiffness without coupling."""
    pieces, coupling = dissimilar_bodies()
    active = np.random.default_rng(4).random(len(coupling)) < 0.6
    contact = np.ix_(active, active)
    contact_coupling = coupling[contact]
    ones = np.ones(active.sum())
    schur = pieces.tangential[contact] - contact_coupling.T @ np.linalg.solve(
        pieces.normal[contact], contact_coupling
    )
    block = np.block([[pieces.normal, coupling], [coupling.T, pieces.tangential]])
    slide = np.repeat([[0.0, 1.0]], active.size, axis=1)
    force = solve_set(block, active, slide).force[0]
    stiffness = force @ slide[0]
    assert stiffness == pytest.approx(np.linalg.solve(schur, ones).sum(), rel=1e-11)
    assert not force[: active.size][~active].any()
    assert stiffness > (1 + 1e-6) * tangential_stiffness(pieces.tangential, active)
