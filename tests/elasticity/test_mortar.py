"""Unlike interface nodes: transfer by independent quadrature, patch tests, Hertz, ripple of a wrong side, balances."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from any_mesh_cases import of_grid
from hypothesis import given
from hypothesis import strategies as st
from pieces import HEIGHT, LENGTH, TITANIUM, bare, refined_middle

from patchfem.contact import press
from patchfem.contact.gaps import crown
from patchfem.core import Compliance, Interface, PatchfemError
from patchfem.elasticity import PieceInterface, elasticity, mortar, recovery, substructure
from patchfem.elasticity.mortar import clip_nodes, transfer_matrix
from patchfem.mesh import TensorGrid, tributary_lengths
from patchfem.mesh.tensor import graded_rows

A = 0.1e-3  # half width of the Hertz contact [m]
LOAD = 9107.0  # per metre of width [N/m]
PEAK = 2 * LOAD / (np.pi * A)
YOUNG = TITANIUM[0]
cells = st.lists(st.floats(0.1, 1.0), min_size=2, max_size=30)  # ratio up to 10 from cell to cell


def nodes(sizes, length=LENGTH):
    """Rising places of a mesh of these cell sizes over the length, 0 in the middle."""
    x = np.concatenate([[0.0], np.cumsum(sizes)])
    x = (x / x[-1] - 0.5) * length
    x[0] = -length / 2
    x[-1] = length / 2
    return x


def hat(own, j, place):
    """Value of the hat function of node j at places within the mesh."""
    return np.interp(place, own, np.eye(own.size)[j])


def dual(x, i, place):
    """Value of the biorthogonal function of node i of the grid at places that are no nodes."""
    cell = np.searchsorted(x, place) - 1
    mine = np.where(cell == i, 1, np.where(cell == i - 1, 0, -1))
    other = np.where(mine == 1, i + 1, i - 1).clip(0, x.size - 1)
    values = np.array([2 * hat(x, i, p) - hat(x, k, p) for p, k in zip(place, other)])
    return np.where(mine >= 0, values, 0.0)


def quadrature(x, own, points=3):
    """Places and weights exact for products of piecewise linears of both meshes, on the stretch of x."""
    cuts = np.unique(np.concatenate([x, own[(own > x[0]) & (own < x[-1])]]))
    gauss, weight = np.polynomial.legendre.leggauss(points)
    half = np.diff(cuts)[:, None] / 2
    return ((cuts[:-1] + cuts[1:])[:, None] / 2 + half * gauss).ravel(), (half * weight).ravel()


def column(x, height, young, poisson=TITANIUM[1], plane="strain", growth=1.4):
    """(nn, tt, nt) of a block of uniform material on these columns, its rows growing downwards."""
    depth = np.concatenate([[0.0], np.cumsum(graded_rows(np.diff(x).min(), height, growth))])
    return elasticity.interface_compliance(
        elasticity.make_piece(x, depth, 0, bare((young, poisson), plane))
    )


def forced(low, x_low, high, x_high, x):
    """nn of the pair on a given grid, without any judgement of it."""
    one = transfer_matrix(x, x_low).toarray()
    other = transfer_matrix(x, x_high).toarray()
    return one @ low[0] @ one.T + other @ high[0] @ other.T


def pressed(x, nn, gap, load=LOAD):
    return press(Compliance(Interface(x, tributary_lengths(x), 1.0), nn, nn), gap, load)


def crooked(sizes, seed):
    """A block as any mesh: these columns, half the quads cut in two, inner nodes moved at random."""
    x = nodes(sizes)
    depth = np.linspace(0, HEIGHT, 7)
    piece = of_grid(TensorGrid(x, depth, 0), 0.5)
    points = piece.points.copy()
    inner = (points > [x[0], 0]).all(axis=1) & (points < [x[-1], HEIGHT]).all(axis=1)
    moved = np.random.default_rng(seed).uniform(-0.2, 0.2, (inner.sum(), 2))
    points[inner] += moved * [np.diff(x).min(), depth[1]]
    return replace(piece, points=points)


def two_crooked(poisson=0.0, stiff=100.0):
    """Two crooked blocks of 12 and 9 columns, the upper one `stiff` times as stiff, assembled and condensed."""
    rng = np.random.default_rng(4)
    pair = [
        substructure.Substructure(
            crooked(rng.uniform(0.5, 1.0, count), count), bare((young, poisson))
        )
        for count, young in ((12, YOUNG), (9, stiff * YOUNG))
    ]
    return pair, [elasticity.interface_compliance(piece) for piece in pair]


@pytest.mark.parametrize("stiff", [0.01, 1.0, 100.0])
def test_exact_patch_test_reaches_the_inside_of_both_bodies(stiff):
    pair, (low, high) = two_crooked(0.0, stiff)
    joined = mortar.join_pieces(
        PieceInterface(pair[0].mesh.x, low), PieceInterface(pair[1].mesh.x, high)
    )
    state = pressed(joined.x, joined.compliance.nn, np.zeros(joined.x.size))
    for piece, force in zip(
        pair, joined.distribute_forces(state.sigma_n * joined.tributary_lengths)
    ):
        assert force == pytest.approx(piece.mesh.tributary_lengths() * LOAD / LENGTH, rel=1e-12)
        u = elasticity.compute_displacement(piece, 0 * force, force)
        stress = recovery.centre_stress(recovery.get_cells(piece), u)
        assert np.abs(stress - [0, -LOAD / LENGTH, 0, 0]).max() <= 1e-11 * LOAD / LENGTH


@pytest.mark.parametrize("side", ["both", "lower", "upper"])
def test_exact_compliance_is_the_weighted_motion_of_both_bodies(side):
    pair, (low, high) = two_crooked(0.3, 2.0)
    bodies = PieceInterface(pair[0].mesh.x, low), PieceInterface(pair[1].mesh.x, high)
    joined = mortar.join_on_grid(mortar.candidate_grids(*bodies), side, *bodies)
    x = joined.x
    rng = np.random.default_rng(8)
    normal, shear = rng.normal(size=(2, x.size))
    closing = np.zeros(x.size)
    slide = np.zeros(x.size)
    for piece, sign in zip(pair, (1, -1)):  # +x on the lower piece, -x on the upper one
        own = piece.mesh.x
        place, weight = quadrature(x, own)
        psi = (
            np.array([dual(x, i, place) * weight for i in range(x.size)])
            / tributary_lengths(x)[:, None]
        )
        load = psi @ np.array([hat(own, j, place) for j in range(own.size)]).T
        u = elasticity.compute_displacement(piece, sign * shear @ load, normal @ load)[
            0, piece.mesh.interface
        ]
        closing += load @ u[:, 1]
        slide += sign * load @ u[:, 0]
    assert (
        np.abs(joined.compliance.nn @ normal + joined.compliance.nt @ shear - closing).max()
        <= 1e-11 * np.abs(closing).max()
    )
    assert (
        np.abs(joined.compliance.tt @ shear + joined.compliance.nt.T @ normal - slide).max()
        <= 1e-11 * np.abs(slide).max()
    )


@given(one=cells, other=cells, stiff=st.floats(0.01, 100.0), seed=st.integers(0, 99))
def test_always_symmetric_positive_and_balanced_and_the_same_with_the_bodies_swapped(
    one, other, stiff, seed
):
    x_low = nodes(one)
    x_high = nodes(other)
    low = column(x_low, HEIGHT, YOUNG)
    high = column(x_high, 0.5 * HEIGHT, stiff * YOUNG, 0.2)
    try:
        joined = mortar.join_pieces(PieceInterface(x_low, low), PieceInterface(x_high, high))
    except PatchfemError as error:
        assert "pressure ripples of" in str(error)
        return
    assert np.array_equal(joined.compliance.nn, joined.compliance.nn.T) and np.array_equal(
        joined.compliance.tt, joined.compliance.tt.T
    )
    both = np.block(
        [
            [joined.compliance.nn, joined.compliance.nt],
            [joined.compliance.nt.T, joined.compliance.tt],
        ]
    )
    assert np.linalg.eigvalsh(both).min() > 0
    assert joined.tributary_lengths.sum() == pytest.approx(LENGTH, rel=1e-13)
    force = np.random.default_rng(seed).uniform(0, 1, (3, joined.x.size))
    for passed, own in zip(joined.distribute_forces(force), (x_low, x_high)):
        assert passed.sum(axis=1) == pytest.approx(force.sum(axis=1), rel=1e-13)
        assert np.abs(passed @ own - force @ joined.x).max() <= 1e-13 * force.sum() * LENGTH
    turned = mortar.join_pieces(PieceInterface(x_high, high), PieceInterface(x_low, low))
    alike = x_low.size == x_high.size and np.abs(x_low - x_high).max() <= 1e-12 * LENGTH
    assert alike or {joined.side, turned.side} in ({"both"}, {"lower", "upper"})
    assert turned.x == pytest.approx(joined.x, abs=1e-15)
    scale = 1e-12 * joined.compliance.nn.max()
    for mine, theirs in (
        (turned.compliance.nn, joined.compliance.nn),
        (turned.compliance.tt, joined.compliance.tt),
        (turned.compliance.nt, -joined.compliance.nt),
    ):
        assert np.abs(mine - theirs).max() <= scale
    tilted = [
        pressed(part.x, part.compliance.nn, 1e-6 * part.x).sigma_n for part in (joined, turned)
    ]
    assert np.abs(tilted[0] - tilted[1]).max() <= 1e-9 * tilted[0].max()


def test_exact_matching_nodes_give_the_joined_operator():
    x = nodes(np.random.default_rng(1).uniform(0.1, 1, 40))
    low = column(x, HEIGHT, YOUNG)
    high = column(x, 0.5 * HEIGHT, 0.01 * YOUNG)
    found = mortar.join_pieces(PieceInterface(x, low), PieceInterface(x, high))
    joined = low[0] + high[0], low[1] + high[1], low[2] - high[2]
    for mine, theirs in zip(
        (found.compliance.nn, found.compliance.tt, found.compliance.nt), joined
    ):
        assert np.abs(mine - theirs).max() <= 1e-14 * np.abs(theirs).max()
        assert not mine.flags.writeable
    assert np.array_equal(found.x, x) and found.ripple == 0 and found.side == "lower"
    # a text file rounds the nodes
    near = mortar.join_pieces(PieceInterface(x, low), PieceInterface(x * (1 + 1e-12), high))
    assert (
        np.abs(near.compliance.nn - found.compliance.nn).max() <= 1e-8 * found.compliance.nn.max()
    )


@cache
def _block(per_half_width):
    grid = refined_middle(1.5 * A, A / per_half_width, LENGTH, 6e-3, 1.1)
    return grid.x, elasticity.interface_compliance(
        elasticity.make_piece(grid.x, grid.depth, 0, bare(TITANIUM))
    )


def block(per_half_width, young=YOUNG):
    """(x, compliance) of the block of the Hertz pair, a / per_half_width at the contact."""
    x, parts = _block(per_half_width)
    return x, elasticity.InterfaceCompliance(*(part * (YOUNG / young) for part in parts))


def hertz(x, nn, young_low, young_high):
    """(largest error inside 0.8 a, of the peak, state) in shares of the peak."""
    modulus = 1 / ((1 - TITANIUM[1] ** 2) * (1 / young_low + 1 / young_high))
    state = pressed(x, nn, crown(x, np.pi * modulus * A**2 / (4 * LOAD)))
    inside = np.abs(x) < 0.8 * A
    error = state.sigma_n[inside] - PEAK * np.sqrt(1 - (x[inside] / A) ** 2)
    return np.abs(error).max() / PEAK, abs(state.sigma_n.max() / PEAK - 1), state


@pytest.mark.parametrize("young_low, young_high", [(1, 1), (1, 100), (100, 1), (1, 5)])
@pytest.mark.parametrize("fine", [17, 24, 40])
def test_exact_hertz_on_unlike_meshes_within_four_in_a_thousand(fine, young_low, young_high):
    (x_low, low), (x_high, high) = block(16, young_low * YOUNG), block(fine, young_high * YOUNG)
    joined = mortar.join_pieces(PieceInterface(x_low, low), PieceInterface(x_high, high))
    ripple, peak, _ = hertz(joined.x, joined.compliance.nn, young_low * YOUNG, young_high * YOUNG)
    assert ripple <= 4e-3 and peak <= 1e-3
    assert joined.ripple <= 5e-3


@pytest.mark.parametrize(
    "fine, stiff, low, high",
    [
        (32, 1, 0.01, 0.05),
        (64, 1, 0.02, 0.06),
        (32, 10, 0.1, 0.4),
        (64, 10, 0.2, 0.5),
        (64, 100, 0.9, 4.0),
    ],
)
def test_exact_a_wrong_side_ripples_as_expected_and_is_not_chosen(fine, stiff, low, high):
    (x_low, soft), (x_high, hard) = block(16), block(fine, stiff * YOUNG)
    measured = hertz(x_high, forced(soft, x_low, hard, x_high, x_high), YOUNG, stiff * YOUNG)[0]
    assert low <= measured <= high
    pair = PieceInterface(x_low, soft), PieceInterface(x_high, hard)
    refused = mortar.join_on_grid(mortar.candidate_grids(*pair), "upper", *pair)
    assert refused.reason.startswith("with the pressure defined on the nodes of the upper piece")
    assert 0.3 <= measured / refused.ripple <= 1.3
    joined = mortar.join_pieces(*pair)
    assert joined.side != "upper"
    assert hertz(joined.x, joined.compliance.nn, YOUNG, stiff * YOUNG)[0] <= 3e-3


@pytest.mark.share(1)
@pytest.mark.parametrize("stiff", [1.0, 0.1, 0.01])
def test_exact_where_the_coarser_side_changes_the_grid_changes_over(stiff):
    coarse, fine = (refined_middle(1.5 * A, A / count, LENGTH, 6e-3, 1.1).x for count in (16, 40))
    x_low = np.concatenate([fine[fine < 0], coarse[coarse >= 0]])
    x_high = -x_low[::-1]
    low = column(x_low, 6e-3, YOUNG, growth=1.1)
    high = column(x_high, 6e-3, stiff * YOUNG, growth=1.1)
    joined = mortar.join_pieces(PieceInterface(x_low, low), PieceInterface(x_high, high))
    assert joined.side == ("both" if stiff > 0.05 else "upper")
    assert hertz(joined.x, joined.compliance.nn, YOUNG, stiff * YOUNG)[0] <= 4e-3
    assert hertz(x_low, forced(low, x_low, high, x_high, x_low), YOUNG, stiff * YOUNG)[0] >= 2e-2


@given(one=cells, other=cells, left=st.floats(-0.3, 0.3), right=st.floats(-0.3, 0.3))
def test_always_pieces_that_overhang_touch_where_both_are(one, other, left, right):
    x_low = nodes(one)
    x_high = x_low[0] + left * LENGTH + (nodes(other) - nodes(other)[0]) * (1 + right - left)
    begin = max(x_low[0], x_high[0])
    end = min(x_low[-1], x_high[-1])
    for own in (x_low, x_high):
        x = clip_nodes(own, begin, end)
        assert (x[0], x[-1]) == pytest.approx((begin, end), abs=1e-9 * LENGTH) and np.all(
            np.diff(x) > 0
        )
        assert np.diff(x).min() >= 0.49 * np.diff(own).min() or x.size == 2
        for body in (x_low, x_high):
            share = transfer_matrix(x, body)
            assert np.abs(share.sum(axis=1) - 1).max() <= 1e-12
            assert np.abs(share @ body - x).max() <= 1e-12 * LENGTH
            # a uniform pressure on the common stretch loads every node with the integral of its hat over it
            place, weight = quadrature(x, body)
            wanted = np.array([weight @ hat(body, j, place) for j in range(body.size)])
            assert np.abs(tributary_lengths(x) @ share - wanted).max() <= 1e-12 * LENGTH


def test_exact_patch_test_of_a_short_block_on_a_long_one():
    x_low = nodes([1.0] * 23)
    x_high = nodes([1.0] * 10, 0.6 * LENGTH) + 0.1 * LENGTH
    joined = mortar.join_pieces(
        PieceInterface(x_low, column(x_low, HEIGHT, YOUNG)),
        PieceInterface(x_high, column(x_high, HEIGHT, YOUNG)),
    )
    assert (joined.x[0], joined.x[-1]) == pytest.approx((x_high[0], x_high[-1]))
    assert joined.tributary_lengths.sum() == pytest.approx(0.6 * LENGTH, rel=1e-13)
    low, high = joined.distribute_forces(joined.tributary_lengths)
    assert high == pytest.approx(tributary_lengths(x_high), rel=1e-12)
    assert np.all(low[x_low < x_high[0] - LENGTH / 23] == 0) and low.sum() == pytest.approx(
        0.6 * LENGTH
    )
    assert low @ x_low == pytest.approx(high @ x_high, rel=1e-12)
    assert np.linalg.eigvalsh(joined.compliance.nn).min() > 0


def test_refuses_by_name_what_cannot_be_joined():
    x = nodes([1.0] * 8)
    other = nodes([1.0] * 5)
    low = column(x, HEIGHT, YOUNG)
    high = column(other, HEIGHT, YOUNG)
    for bodies, message in (
        (
            (PieceInterface(x[::-1], low), PieceInterface(other, high)),
            "the lower interface needs at least three nodes",
        ),
        (
            (PieceInterface(x, low), PieceInterface(other, low)),
            "the upper interface needs .* compliance",
        ),
        (
            (PieceInterface(x, low), PieceInterface(other + LENGTH, high)),
            "do not face one another: the lower interface",
        ),
        (
            (PieceInterface(x, low), PieceInterface(other + 0.99 * LENGTH, high)),
            "share 0.000127 m of the interface",
        ),
    ):
        with pytest.raises(PatchfemError, match=r"contact\.mesh: .*" + message):
            mortar.join_pieces(*bodies)


def test_refuses_meshes_on_which_every_choice_ripples():
    rng = np.random.default_rng(2)
    x, other = (nodes(50.0 ** -rng.uniform(0, 1, count)) for count in (40, 30))
    with pytest.raises(
        PatchfemError, match=r"pressure ripples of \d+ % are .* cells of similar size that grow"
    ):
        mortar.join_pieces(
            PieceInterface(x, column(x, HEIGHT, YOUNG)),
            PieceInterface(other, column(other, HEIGHT, YOUNG)),
        )
