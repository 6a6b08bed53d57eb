"""Pieces that reach beyond the interface, chamfered and rounded ends: their outline, their cells, finer and coarser."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from patchfem.mesh import SHARP_END, End, graded_grid, shaped_grid
from patchfem.mesh.ends import MAX_INTERFACE_SLOPE
from patchfem.mesh.pairs import as_piece

LENGTH, HEIGHT, COATING = 10e-3, 4e-3, 0.2e-3
ENDS = {"sharp": SHARP_END, "chamfer": End("chamfer", 0.7e-3), "radius": End("radius", 1.1e-3)}


def made(end, shorter=0.0, cell=0.31e-3, coating=COATING):
    """A piece LENGTH long on an interface as long as its face, less `shorter` at either end."""
    return shaped_grid(
        graded_grid(2 * (end.half_contact_length(LENGTH) - shorter), HEIGHT, cell, coating),
        LENGTH,
        end,
    )


def test_exact_a_rounded_end_is_a_circle_to_sixty_degrees_then_its_tangent():
    end = ENDS["radius"]
    start = LENGTH / 2 - ENDS["radius"].size
    s = np.linspace(0, 1, 200) * end.size
    drop = end.face_depth(start + s, LENGTH)
    last = np.sqrt(3) / 2 * end.size
    on = s <= last
    assert np.allclose(s[on] ** 2 + (end.size - drop[on]) ** 2, end.size**2, rtol=1e-12)
    assert np.allclose(drop[~on], end.size / 2 + np.sqrt(3) * (s[~on] - last), rtol=1e-12)
    assert (
        np.array_equal(drop, end.face_depth(-start - s, LENGTH))
        and end.face_depth(start, LENGTH) == 0.0
    )


@pytest.mark.parametrize("kind", ENDS)
def test_exact_the_face_that_can_touch_ends_at_the_corner_or_where_it_is_steep(kind):
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
@pytest.mark.parametrize("shorter", [0.0, 1.9e-3])
def test_exact_cells_fill_the_outline_and_a_sprayed_coating_is_as_thick_everywhere(kind, shorter):
    body = made(ENDS[kind], shorter)
    x = np.unique(body.points[:, 0])
    drop = ENDS[kind].face_depth(x, LENGTH)
    lost = ((drop[1:] + drop[:-1]) / 2 * np.diff(x)).sum()
    assert body.areas().min() > 0
    assert body.areas().sum() == pytest.approx(LENGTH * HEIGHT - lost, rel=1e-12)
    assert body.areas()[body.is_coating].sum() == pytest.approx(LENGTH * COATING, rel=1e-12)
    assert body.coating_thickness == pytest.approx(COATING, rel=1e-12) and body.height == HEIGHT
    if kind == "chamfer":
        assert lost == pytest.approx(ENDS[kind].size ** 2, rel=1e-12)


def test_exact_a_piece_without_ends_or_overhang_is_its_tensor_grid():
    grid = graded_grid(LENGTH, HEIGHT, 0.31e-3, COATING)
    body = shaped_grid(grid, LENGTH, SHARP_END)
    wanted = as_piece(grid)
    for name in ("points", "quads", "is_coating", "interface", "far"):
        assert np.array_equal(getattr(body, name), getattr(wanted, name)), name
    assert body.base_grid is grid and wanted.base_grid is None


@pytest.mark.parametrize("kind", ENDS)
def test_exact_finer_and_coarser_keep_the_outline_and_the_interface_of_the_plan(kind):
    body = made(ENDS[kind], 1.9e-3, 0.3e-3)
    for other, inner in (
        (body.refine(), body.inner.refine()),
        (body.coarsen(), body.inner.coarsen()),
    ):
        assert np.array_equal(other.x, inner.x) and np.array_equal(other.inner.depth, inner.depth)
        assert np.abs(other.points).max() == np.abs(body.points).max()
        assert other.areas().min() > 0
    again = body.refine().coarsen()
    assert np.array_equal(again.points, body.points) and np.array_equal(again.quads, body.quads)


@given(
    size=st.floats(1e-6, 0.999),
    shorter=st.floats(0, 0.9),
    cell=st.floats(1e-6, 1),
    kind=st.sampled_from(["chamfer", "radius"]),
)
def test_always_cells_are_convex_and_columns_grow_gently(size, shorter, cell, kind):
    end = End(kind, size * min(LENGTH / 2, HEIGHT - COATING))
    half = end.half_contact_length(LENGTH) * (1 - shorter)
    body = shaped_grid(
        graded_grid(2 * half, HEIGHT, max(2 * half * cell, LENGTH / 60), COATING)
        if half > LENGTH / 120
        else graded_grid(2 * half, HEIGHT, half, COATING),
        LENGTH,
        end,
    )
    corner = body.points[body.quads]
    side = np.roll(corner, -1, axis=1) - corner
    turn = (
        side[..., 0] * np.roll(side, -1, axis=1)[..., 1]
        - side[..., 1] * np.roll(side, -1, axis=1)[..., 0]
    )
    assert turn.min() > 0
    cells = np.diff(np.concatenate([body.inner.x[-2:], body.inner.x[-1] + body.outer[1:]]))
    assert (cells[1:] <= 1.11 * np.maximum.accumulate(cells[:-1])).all()
    assert np.abs(body.points[:, 0]).max() == LENGTH / 2
