"""Unlike pieces that stick: the slope of the full solve, the Schur complement, alike pieces."""

from __future__ import annotations

import numpy as np
import pytest
from partial_slip import Step, advance, operators_of, start
from pieces import COATED, COATING, HEIGHT, LENGTH, LOAD, WIDTH, bare, coated_pair
from two_bodies import unlike_pair

from patchfem.contact.stiffness import coupled_stiffness, tangential_stiffness
from patchfem.core import Compliance, Interface
from patchfem.mesh.tensor import graded_grid

MU = 0.4


def unlike():
    low, high = graded_grid(LENGTH, HEIGHT, LENGTH / 60, COATING), graded_grid(LENGTH, 4e-3, LENGTH / 60)
    ops = unlike_pair(low, COATED, high, bare((70e9, 0.3)), WIDTH)[0]
    return ops, Compliance(Interface(ops.x, np.ones(ops.x.size), WIDTH), ops.normal, ops.tangential)


def test_exact_stiffness_in_stick_is_the_slope_of_the_full_solve():
    """Flat pieces bear everywhere, and a small slide at held approach lets no node slip."""
    ops, pieces = unlike()
    here = advance(start(ops, 0 * ops.x), ops, Step(load=LOAD, shear=0.0), MU)
    want = coupled_stiffness(pieces, ops.coupling, here.active)
    ends = []
    for share in (1, 2):
        slide = here.slide + share * 1e-3 * MU * LOAD / want
        there = advance(here, ops, Step(approach=here.approach, slide=slide, gap=0 * ops.x), MU)
        assert here.active.all() and np.array_equal(there.slipping, here.slipping)
        ends.append((slide, there.shear))
    (a, low), (b, high) = ends
    assert not here.slipping.any() and (high - low) / (b - a) == pytest.approx(want, rel=1e-8)


def test_exact_stiffness_is_that_of_the_pieces_less_what_closing_gives_way():
    ops, pieces = unlike()
    active = np.random.default_rng(4).random(ops.x.size) < 0.6
    here = np.ix_(active, active)
    cross, one = ops.coupling[here], np.ones(active.sum())
    schur = pieces.tangential[here] - cross.T @ np.linalg.solve(pieces.normal[here], cross)
    found = coupled_stiffness(pieces, ops.coupling, active)
    assert found == pytest.approx(np.linalg.solve(schur, one).sum(), rel=1e-11)
    assert found > (1 + 1e-6) * tangential_stiffness(pieces.tangential, active)


def test_exact_alike_pieces_and_no_contact():
    pair = coated_pair(60)
    none, active = 0 * pair.normal, np.arange(pair.interface.x.size) < 40
    assert coupled_stiffness(pair, none, active) == pytest.approx(tangential_stiffness(pair.tangential, active),
                                                                  rel=1e-12)
    assert coupled_stiffness(pair, none, 0 > np.ones(active.size)) == 0.0
    assert operators_of(pair, none).coupling is None
