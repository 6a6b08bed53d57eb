"""Pieces that extend beyond the interface, with chamfered or rounded ends: outline, elements, refinement."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from patchfem.elasticity.elasticity import evaluate_cells
from patchfem.mesh import ELEMENTS, SHARP_END, End, graded_grid
from patchfem.mesh.ends import MAX_INTERFACE_SLOPE

LENGTH, HEIGHT, COATING = 10e-3, 4e-3, 0.2e-3
ENDS = {"sharp": SHARP_END, "chamfer": End("chamfer", 0.7e-3), "radius": End("radius", 1.1e-3)}


def make_shaped_piece(end, overhang=0.0, element_size=0.31e-3):
    """Return a piece of the given length whose grid is `overhang` than its contact face at either end."""
    half_length = end.half_contact_length(LENGTH) - overhang
    return graded_grid(2 * half_length, HEIGHT, element_size, COATING).extend(LENGTH, end)


def compute_areas(body):
    """Return the areas of the elements by Gauss integration; all integration points have a positive area."""
    quad = ELEMENTS["quad"]
    weights = evaluate_cells(
        body.points, body.blocks["quad"], quad, quad.gauss, quad.weights
    ).weights
    assert weights.min() > 0
    return weights.sum(axis=1)


def test_exact_rounded_end_is_circle_then_tangent():
    """A rounded end is a circle up to 60 degrees and then its tangent."""
    end = ENDS["radius"]
    start = LENGTH / 2 - ENDS["radius"].size
    s = np.linspace(0, 1, 200) * end.size
    depth = end.face_depth(start + s, LENGTH)
    tangent_point = np.sqrt(3) / 2 * end.size
    on_circle = s <= tangent_point
    assert np.allclose(
        s[on_circle] ** 2 + (end.size - depth[on_circle]) ** 2, end.size**2, rtol=1e-12
    )
    assert np.allclose(
        depth[~on_circle], end.size / 2 + np.sqrt(3) * (s[~on_circle] - tangent_point), rtol=1e-12
    )
    assert (
        np.array_equal(depth, end.face_depth(-start - s, LENGTH))
        and end.face_depth(start, LENGTH) == 0.0
    )


@pytest.mark.parametrize("kind", ENDS)
def test_exact_contact_face_ends_at_corner_or_max_slope(kind):
    """The contact face ends at the corner of a sharp or chamfered end, or where a rounded end has the largest slope."""
    end = ENDS[kind]
    half = end.half_contact_length(LENGTH)
    step = 1e-9
    slope = (end.face_depth(half + step, LENGTH) - end.face_depth(half - step, LENGTH)) / (2 * step)
    flat = {"sharp": LENGTH / 2, "chamfer": LENGTH / 2 - end.size}
    assert (
        half == flat[kind]
        if kind in flat
        else slope == pytest.approx(MAX_INTERFACE_SLOPE, rel=1e-5)
    )


@pytest.mark.parametrize("kind", ENDS)
@pytest.mark.parametrize("overhang", [0.0, 1.9e-3])
def test_exact_elements_fill_outline_with_uniform_coating(kind, overhang):
    """The elements fill the outline exactly, and the coating has the same thickness everywhere."""
    body = make_shaped_piece(ENDS[kind], overhang)
    x = np.unique(body.points[:, 0])
    depth = ENDS[kind].face_depth(x, LENGTH)
    removed_area = ((depth[1:] + depth[:-1]) / 2 * np.diff(x)).sum()
    assert compute_areas(body).sum() == pytest.approx(LENGTH * HEIGHT - removed_area, rel=1e-12)
    assert compute_areas(body)[body.is_coating].sum() == pytest.approx(LENGTH * COATING, rel=1e-12)
    assert body.coating_thickness == pytest.approx(COATING, rel=1e-12) and body.height == HEIGHT
    if kind == "chamfer":
        assert removed_area == pytest.approx(ENDS[kind].size ** 2, rel=1e-12)


@pytest.mark.parametrize("kind", ENDS)
def test_exact_refinement_and_coarsening_preserve_outline(kind):
    """Refinement and coarsening preserve the outline and the interface nodes of the inner grid."""
    body = make_shaped_piece(ENDS[kind], 1.9e-3, 0.3e-3)
    for changed in (body.refine(), body.coarsen()):
        assert changed.points[changed.interface] == pytest.approx(
            np.stack([changed.x, ENDS[kind].face_depth(changed.x, LENGTH)], axis=1), abs=1e-15
        )
        assert np.abs(changed.points).max() == pytest.approx(np.abs(body.points).max(), rel=1e-14)
        assert compute_areas(changed).min() > 0
    restored = body.refine().coarsen()
    assert restored.points == pytest.approx(body.points, abs=1e-15)
    assert np.array_equal(restored.blocks["quad"], body.blocks["quad"])


@given(
    size=st.floats(1e-6, 0.999),
    shorter=st.floats(0, 0.9),
    cell=st.floats(1e-6, 1),
    kind=st.sampled_from(["chamfer", "radius"]),
)
def test_always_elements_are_convex_and_columns_grow_slowly(size, shorter, cell, kind):
    """All elements are convex, and columns outside the interface grow by at most 11 %."""
    end = End(kind, size * min(LENGTH / 2, HEIGHT - COATING))
    half = end.half_contact_length(LENGTH) * (1 - shorter)
    size = max(2 * half * cell, LENGTH / 60) if half > LENGTH / 120 else half
    body = graded_grid(2 * half, HEIGHT, size, COATING).extend(LENGTH, end)
    corner = body.points[body.blocks["quad"]]
    side = np.roll(corner, -1, axis=1) - corner
    cross_products = (
        side[..., 0] * np.roll(side, -1, axis=1)[..., 1]
        - side[..., 1] * np.roll(side, -1, axis=1)[..., 0]
    )
    assert cross_products.min() > 0
    widths = np.diff(np.concatenate([body.x[-2:], body.x[-1] + body.outer[1:]]))
    assert (widths[1:] <= 1.11 * np.maximum.accumulate(widths[:-1])).all()
    assert np.abs(body.points[:, 0]).max() == pytest.approx(LENGTH / 2, rel=1e-14)
