"""Cells of high order condensed to their interface: against a dense matrix made by quadrature, bars, polynomials."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial import legendre
from pieces import CARBIDE, TITANIUM, bare

from patchfem.core import NotConverged
from patchfem.elasticity.elasticity import Layers, lame
from patchfem.elasticity.grid_fronts import Shape, counts, eliminate_parts, plan
from patchfem.elasticity.high_order import condense, lobatto, nodes, peak

X = np.array([-1.0, -0.6, -0.5, 0.1, 0.35, 1.0])
DEPTH = np.array([0.0, 0.07, 0.3, 0.8])


def dense(x, depth, coating_rows, layers, order):
    """Stiffness of all nodes by Gauss quadrature of B^T D B, unknowns 2 (column * rows + row); places of the nodes."""
    points, weights = legendre.leggauss(order + 2)
    base = [np.poly1d(np.poly(np.delete(lobatto(order)[0], k)) / np.prod(at - np.delete(lobatto(order)[0], k)))
            for k, at in enumerate(lobatto(order)[0])]
    value, slope = (np.array([[one(at) for one in these] for at in points])
                    for these in (base, [one.deriv() for one in base]))
    nx, ny = (len(x) - 1) * order + 1, (len(depth) - 1) * order + 1
    out = np.zeros((2 * nx * ny, 2 * nx * ny))
    for i, hx in enumerate(np.diff(x)):
        for j, hy in enumerate(np.diff(depth)):
            lam, mu = lame(*(layers.coating if j < coating_rows else layers.substrate), layers.plane)
            hooke = np.array([[lam + 2 * mu, lam, 0], [lam, lam + 2 * mu, 0], [0, 0, mu]])
            node = ((i * order + np.arange(order + 1))[:, None] * ny + j * order + np.arange(order + 1)).ravel()
            unknown = np.stack([2 * node, 2 * node + 1], axis=1).ravel()
            for a, wa in enumerate(weights):
                for b, wb in enumerate(weights):
                    by_x, by_y = np.kron(slope[a], value[b]) * 2 / hx, np.kron(value[a], slope[b]) * 2 / hy
                    strain = np.zeros((3, unknown.size))
                    strain[0, ::2], strain[1, 1::2], strain[2, ::2], strain[2, 1::2] = by_x, by_y, by_y, by_x
                    out[np.ix_(unknown, unknown)] += strain.T @ hooke @ strain * (wa * wb * hx * hy / 4)
    place = np.stack(np.meshgrid(nodes(x, order)[0], nodes(depth, order)[0], indexing="ij"), axis=-1)
    return out, place


@pytest.mark.parametrize("order, plane", [(2, "strain"), (3, "stress"), (4, "strain")])
def test_exact_compliance_is_that_of_the_dense_inverse(order, plane):
    layers = Layers(CARBIDE, TITANIUM, plane)
    whole, place = dense(X, DEPTH, 1, layers, order)
    nx, ny = place.shape[:2]
    free = np.arange(2 * nx * ny).reshape(nx, ny, 2)[:, :-1].ravel()
    top = np.searchsorted(free, np.arange(2 * nx * ny).reshape(nx, ny, 2)[:, 0].ravel())
    wanted = np.linalg.inv(whole[np.ix_(free, free)])[np.ix_(top, top)]
    found = condense(X, DEPTH, 1, layers, order)
    for part, block in ((found.nn, wanted[1::2, 1::2]), (found.tt, wanted[::2, ::2]), (found.nt, wanted[1::2, ::2])):
        assert np.abs(part - block).max() <= 1e-11 * np.abs(wanted).max()


def test_exact_a_field_of_degree_four_in_equilibrium_leaves_no_force_inside():
    """u = grad Re (x + i y)^5 has no divergence and is harmonic."""
    whole, place = dense(X, DEPTH, 3, bare(TITANIUM), 4)
    z = place[..., 0] + 1j * place[..., 1]
    u = np.stack([(z**4).real, -(z**4).imag], axis=-1)
    force = (whole @ u.ravel()).reshape(u.shape)
    assert np.abs(force[1:-1, 1:-1]).max() <= 1e-11 * np.abs(force).max()


def test_exact_even_pressure_closes_a_coated_column_as_bars_in_series():
    """Without Poisson's ratio the layers are bars: 1/E per thickness, the same at every node."""
    layers = Layers((250e9, 0.0), (121e9, 0.0), "strain")
    found = condense(X, DEPTH, 2, layers)
    closing = 0.3 / 250e9 + 0.5 / 121e9
    assert np.abs(found.nn @ found.weight - closing).max() <= 1e-12 * closing
    assert np.abs(found.nt.T @ found.weight).max() <= 1e-12 * closing


@pytest.mark.parametrize("order", [2, 4, 6])
def test_exact_weights_integrate_what_gauss_lobatto_integrates(order):
    x, weight = nodes(X, order)
    assert weight.min() > 0 and x.size == (X.size - 1) * order + 1
    for power in range(2 * order):
        whole = (1 - (-1)**(power + 1)) / (power + 1)
        assert abs(weight @ x**power - whole) <= 1e-13


def test_exact_counts_are_those_of_the_factors():
    columns, rows, order = 5, 7, 3
    corner = []

    def leaves(shape, place):
        corner.append(place)
        size, own = 2 * (shape.columns + 1) * shape.lines, 2 * len(plan(shape).own)
        unit = np.broadcast_to(np.eye(size), (len(place), size, size)).copy()
        return unit[:, :own, :own], unit[:, :own, own:], unit[:, own:, own:]

    found = eliminate_parts(Shape(columns * order, rows * order, False, False, False, order), leaves)
    places = np.concatenate(corner)
    assert len(places) == columns * rows == len(np.unique(places, axis=0)) and (places % order == 0).all()
    _, _, entries, _, _ = counts(columns * order + 1, rows * order + 1, False, order)
    assert entries == found.entries


def test_exact_peak_is_the_vertex_of_a_parabola_between_nodes():
    x, weight = nodes(np.linspace(-1, 1, 4), 4)
    pressure = 2.0 - (x - 0.041)**2
    assert abs(peak(pressure * weight, weight, 4, pressure > 0) - 2.0) <= 1e-4  # read at eighty places of a cell
    open_ = pressure * (np.abs(x) > 0.4)
    assert peak(open_ * weight, weight, 4, open_ > 0) == open_.max()  # no polynomial across an edge


@pytest.mark.parametrize("height", [2.0, 60.0])
def test_always_round_off_stays_within_its_bound(height):
    """A grid and its mirror image are eliminated in another order; what they differ by is round-off."""
    x = np.concatenate([[-1.0], 0.3 - np.geomspace(1.2, 1e-5, 14), [0.3], 0.3 + np.geomspace(1e-5, 0.7, 14)])
    depth = np.concatenate([[0.0], np.geomspace(1e-5, height, 18)])
    one, other = condense(x, depth, 0, bare(TITANIUM)), condense(-x[::-1], depth, 0, bare(TITANIUM))
    differ = np.abs(one.tt - other.tt[::-1, ::-1]).max() / np.abs(one.tt).max()
    assert differ <= one.rounding <= 1e4 * differ


def test_refuses_a_stiffness_that_is_not_positive_definite():
    with pytest.raises(NotConverged, match="not positive definite"):
        condense(X, DEPTH, 1, bare((-1.0, 0.3)))
