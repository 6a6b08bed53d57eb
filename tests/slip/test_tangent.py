"""Tangential stiffness of unlike pieces that stick: the Schur complement of their compliance, and alike pieces."""

from __future__ import annotations

import numpy as np
import pytest
from pieces import COATED, COATING, HEIGHT, LENGTH, WIDTH, bare, coated_pair

from patchfem.contact import coupled_stiffness, tangential_stiffness
from patchfem.core import Compliance, Interface
from patchfem.elasticity import interface_compliance, make_piece
from patchfem.mesh import graded_grid


def unlike_pieces() -> tuple:
    """(compliance of a coated piece on a soft one, coupling (m, m) of normal and tangential forces [m/N])."""
    grids = (
        graded_grid(LENGTH, HEIGHT, LENGTH / 60, COATING),
        graded_grid(LENGTH, 4e-3, LENGTH / 60),
    )
    low, high = (
        interface_compliance(make_piece(grid.x, grid.depth, grid.coating_rows, layers))
        for grid, layers in zip(grids, (COATED, bare((70e9, 0.3))))
    )
    x = grids[0].x
    pieces = Compliance(
        Interface(x, np.ones(x.size), WIDTH), (low[0] + high[0]) / WIDTH, (low[1] + high[1]) / WIDTH
    )
    return pieces, (low[2] - high[2]) / WIDTH


def test_exact_stiffness_is_that_of_the_pieces_less_what_closing_gives_way():
    pieces, coupling = unlike_pieces()
    active = np.random.default_rng(4).random(len(coupling)) < 0.6
    here = np.ix_(active, active)
    cross = coupling[here]
    one = np.ones(active.sum())
    schur = pieces.tangential[here] - cross.T @ np.linalg.solve(pieces.normal[here], cross)
    found = coupled_stiffness(pieces, coupling, active)
    assert found == pytest.approx(np.linalg.solve(schur, one).sum(), rel=1e-11)
    assert found > (1 + 1e-6) * tangential_stiffness(pieces.tangential, active)


def test_exact_alike_pieces_and_no_contact():
    pair = coated_pair(60)
    none = 0 * pair.normal
    active = np.arange(pair.interface.x.size) < 40
    assert coupled_stiffness(pair, none, active) == pytest.approx(
        tangential_stiffness(pair.tangential, active), rel=1e-12
    )
    assert coupled_stiffness(pair, none, 0 > np.ones(active.size)) == 0.0
