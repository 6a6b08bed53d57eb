"""The operating tangent: differences of the full solve, symmetry, the entries of the contact set, skins in series."""

from __future__ import annotations

import numpy as np
import pytest
from partial_slip import Operators, Step, advance, operators_of, start
from pieces import COATED, COATING, HEIGHT, LENGTH, LOAD, TILTS, WIDTH, bare, coated_pair
from two_bodies import unlike_pair

from patchfem.contact.gaps import crown, tilt
from patchfem.contact.unilateral import press, press_by
from patchfem.core import PatchfemError
from patchfem.mesh.tensor import graded_grid
from patchfem.slip.shear_modes import normal_stiffness, tangential_stiffness
from patchfem.slip.tangent import operating_tangent

MU = 0.4


def pairs():
    low, high = graded_grid(LENGTH, HEIGHT, LENGTH / 60, COATING), graded_grid(LENGTH, 4e-3, LENGTH / 60)
    return {"alike": operators_of(coated_pair(60)),
            "unlike": unlike_pair(low, COATED, high, bare((70e9, 0.3)), WIDTH)[0]}


PAIRS = pairs()


def resultants(state, x):
    return np.array([state.shear, state.load, state.normal_force @ x])


@pytest.mark.parametrize("kind", PAIRS)
@pytest.mark.parametrize("angle", [2e-5, -1e-4])
def test_exact_tangent_is_the_slope_of_the_full_solve(kind, angle):
    """The increments go on as the last one did, so that slipping nodes slip on; approach and slide grow together."""
    ops = PAIRS[kind]
    x, gap = ops.x, tilt(ops.x, angle)
    state = advance(start(ops, gap), ops, Step(load=LOAD, shear=0.0), MU)
    here = advance(state, ops, Step(load=LOAD, shear=0.5 * MU * LOAD), MU)
    assert (here.slipping != 0).any() and (here.active & (here.slipping == 0)).any()
    found = operating_tangent(ops, here.active, here.slipping, MU).matrix
    steps = 1e-6 * np.array([here.slide, abs(here.slide), abs(here.slide) / LENGTH])
    base = np.array([here.slide, here.approach, 0.0])
    for motion in ((1, 0, 0), (1, 0.05, 0), (1, 0.02, 0.05), (1, -0.03, 0.04)):
        move = steps * motion
        ends = []
        for size in (1, 2):  # from the state before, so that the set of slip is that of the same stroke
            q, delta, turn = base + size * move
            ends.append(resultants(advance(state, ops, Step(approach=delta, slide=q, gap=gap + turn * x), MU), x))
        slope = ends[1] - ends[0]
        assert np.abs(slope - found @ move).max() <= 1e-6 * np.abs(np.abs(found) @ np.abs(move)).max()


@pytest.mark.parametrize("angle", TILTS)
def test_exact_entries_of_the_frictionless_patch_are_slopes_of_the_press(angle):
    pair = coated_pair(100)
    x, gap = pair.interface.x, tilt(pair.interface.x, angle)
    here = press(pair, gap, LOAD)
    found = operating_tangent(operators_of(pair), here.sigma_n > 0)
    assert found.normal == pytest.approx(normal_stiffness(pair.normal, here.sigma_n > 0), rel=1e-11)
    assert found.tangential == pytest.approx(tangential_stiffness(pair.tangential, here.sigma_n > 0), rel=1e-11)
    small = 1e-7 * np.abs(pair.normal @ (here.sigma_n * pair.interface.weight)).max()

    def resultants(delta, turn):
        state = press_by(pair, gap + turn * x, here.approach + delta)
        return np.array([state.load, state.moment])

    by_approach = (resultants(small, 0) - resultants(-small, 0)) / (2 * small)
    turn = small / LENGTH
    by_rotation = (resultants(0, turn) - resultants(0, -turn)) / (2 * turn)
    assert found.matrix[1:, 1] == pytest.approx(by_approach, rel=1e-5, abs=1e-6 * found.normal * LENGTH)
    assert found.matrix[1:, 2] == pytest.approx(by_rotation, rel=1e-5, abs=1e-6 * found.normal * LENGTH)
    assert found.rotational > 0 and found.matrix[2, 2] == -found.rotational
    assert not found.matrix[0, 1:].any() and not found.matrix[1:, 0].any()


@pytest.mark.parametrize("kind", PAIRS)
def test_exact_sticking_pieces_have_a_symmetric_tangent_and_slipping_ones_have_not(kind):
    ops = PAIRS[kind]
    here = advance(start(ops, tilt(ops.x, 3e-5)), ops, Step(load=LOAD, shear=0.3 * MU * LOAD), MU)
    work = np.diag([1.0, 1.0, -1.0])  # the moment works on the rotation that closes +x
    stuck = work @ operating_tangent(ops, here.active).matrix
    assert np.abs(stuck - stuck.T).max() <= 1e-12 * np.abs(stuck).max()
    scale = np.diag([1, 1, 1 / LENGTH])
    assert np.linalg.eigvalsh(scale @ stuck @ scale).min() > 0
    slipping = work @ operating_tangent(ops, here.active, here.slipping, MU).matrix
    assert abs(slipping[0, 1] - slipping[1, 0]) > 1e-3 * slipping[0, 0]


def test_exact_all_nodes_slipping_carry_friction_times_the_normal_rows():
    ops = PAIRS["alike"]
    active = np.ones(ops.x.size, bool)
    found = operating_tangent(ops, active, -np.ones(ops.x.size), MU).matrix
    assert found[0] == pytest.approx(-MU * found[1], rel=1e-12, abs=1e-14 * found[1, 1] * LENGTH)
    assert found[:, 0] == pytest.approx(np.zeros(3), abs=1e-12 * found[1, 1])


def test_exact_a_skin_in_series_is_a_softer_pair():
    """The same as a compliance with the skin inside; a very soft skin alone leaves sum k, sum k x^2."""
    ops, rng = PAIRS["unlike"], np.random.default_rng(4)
    k, kt = rng.uniform(1e7, 1e8, (2, ops.x.size))
    active = rng.random(ops.x.size) < 0.6
    inside = Operators(ops.x, ops.normal + np.diag(1 / k), ops.tangential + np.diag(1 / kt), ops.coupling)
    one = operating_tangent(ops, active, None, 0.0, k, kt).matrix
    assert one == pytest.approx(operating_tangent(inside, active).matrix, rel=1e-12)
    soft = operating_tangent(ops, active, None, 0.0, k * 1e-9, kt * 1e-9)
    assert soft.normal == pytest.approx(1e-9 * k[active].sum(), rel=1e-6)
    assert soft.tangential == pytest.approx(1e-9 * kt[active].sum(), rel=1e-6)
    assert soft.rotational == pytest.approx(1e-9 * k[active] @ ops.x[active] ** 2, rel=1e-6)


def test_exact_no_contact_has_no_stiffness():
    assert not operating_tangent(PAIRS["alike"], np.zeros(61, bool)).matrix.any()


def test_refuses_a_skin_without_stiffness():
    ops = PAIRS["alike"]
    with pytest.raises(PatchfemError, match=r"contact\.asperities: the normal stiffness"):
        operating_tangent(ops, crown(ops.x, 1.0) < 1e-5, None, 0.0, np.zeros(ops.x.size))
