"""Any tagged mesh of two pieces: triangles, quads or both, in four formats, and every unusable one refused by name."""

from __future__ import annotations

import time

import meshio
import numpy as np
import pytest
from any_mesh_cases import (
    FORMATS,
    GRID,
    find_cell_blocks,
    find_interface_node,
    make_pair,
    shift_points,
    write_and_read_pair,
    write_inp,
)
from hypothesis import given
from hypothesis import strategies as st

from patchfem.core import PatchfemError
from patchfem.mesh import graded_grid, read_pieces, write_mesh
from patchfem.mesh.files import CELL_TAGS, EDGE_TAGS
from patchfem.mesh.pairs import as_piece

KINDS = ("quads", "triangles", "mixed")


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("form", FORMATS)
def test_exact_every_format_gives_the_same_pair(form, kind, tmp_path):
    pair = write_and_read_pair(make_pair(kind), tmp_path, form)
    for piece in (pair.lower, pair.upper):
        assert np.abs(piece.x - GRID.x).max() <= 1e-12 * GRID.length
        assert (piece.length, piece.height, piece.coating_thickness) == pytest.approx(
            (GRID.length, GRID.height, GRID.coating_thickness)
        )
        assert piece.tributary_lengths() == pytest.approx(GRID.tributary_lengths(), rel=1e-9)
        assert np.all(piece.points[piece.interface, 1] == 0) and piece.points[:, 1].min() == 0
        assert np.abs(piece.points[piece.far, 1] - GRID.height).max() <= 1e-12
        assert piece.areas().min() > 0 and piece.areas().sum() == pytest.approx(
            GRID.length * GRID.height, rel=1e-12
        )
        assert (
            len(piece.points) == GRID.x.size * GRID.depth.size and not piece.points.flags.writeable
        )
        split = {"quads": 0, "triangles": 1, "mixed": 0.5}[kind]
        assert (len(piece.triangles), len(piece.quads)) == pytest.approx(
            np.array([2 * split, 1 - split]) * GRID.is_coating_cell().size, abs=1
        )


def test_exact_gently_rounded_edges_are_read_with_their_rise(tmp_path):
    m = make_pair("mixed")
    lift = np.maximum(np.abs(m.points[:, 0]) - 0.5e-3, 0) ** 2 / 0.02
    m.points[:, 1] += np.where(np.arange(len(lift)) < len(lift) // 2, -1, 1) * lift
    pair = write_and_read_pair(m, tmp_path)
    for piece in (pair.lower, pair.upper):
        assert piece.interface_depths == pytest.approx(
            np.maximum(np.abs(GRID.x) - 0.5e-3, 0) ** 2 / 0.02, abs=1e-15
        )
        assert np.array_equal(piece.refine().interface_depths[::2], piece.interface_depths)
        assert piece.refine().interface_depths[1::2] == pytest.approx(
            (piece.interface_depths[1:] + piece.interface_depths[:-1]) / 2, abs=1e-18
        )
    assert np.all(write_and_read_pair(make_pair("mixed"), tmp_path).lower.interface_depths == 0)


@pytest.mark.parametrize("name", ["pair.msh", "pair.vtu"])
@pytest.mark.parametrize("kind", KINDS)
def test_exact_any_pair_is_written_and_read_back_bit_by_bit(kind, name, tmp_path):
    m = make_pair(kind)
    m.points[m.points[:, 1] > 0] *= [1.0, 1.7]  # unlike pieces
    pair = write_and_read_pair(m, tmp_path)
    write_mesh(pair.lower, tmp_path / name, pair.upper)
    back = read_pieces(tmp_path / name)
    for mine, theirs in ((back.lower, pair.lower), (back.upper, pair.upper)):
        for part in ("points", "triangles", "quads", "is_coating", "interface", "far"):
            assert np.array_equal(getattr(mine, part), getattr(theirs, part)), part


def test_exact_unlike_grids_are_written_as_the_pieces_they_are(tmp_path):
    other = graded_grid(2e-3, 3e-3, 2.5e-4)
    write_mesh(GRID, tmp_path / "pair.msh", other)
    back = read_pieces(tmp_path / "pair.msh")
    for piece, grid in ((back.lower, GRID), (back.upper, other)):
        assert np.array_equal(piece.x, grid.x) and piece.height == grid.height
        assert piece.coating_thickness == pytest.approx(grid.coating_thickness, rel=1e-12)
        assert np.array_equal(
            np.sort(piece.quads, axis=1)[np.argsort(piece.is_coating, kind="stable")],
            np.sort(as_piece(grid).quads, axis=1)[
                np.argsort(grid.is_coating_cell().ravel(), kind="stable")
            ],
        )


@given(
    order=st.randoms(use_true_random=False), shift=st.floats(-1.0, 1.0), kind=st.sampled_from(KINDS)
)
def test_always_numbering_sense_of_rotation_and_place_along_x_do_not_matter(
    order, shift, kind, tmp_path_factory
):
    m = make_pair(kind)
    new = list(range(len(m.points)))
    order.shuffle(new)
    new = np.array(new)
    points = np.empty_like(m.points)
    points[new] = m.points + np.array([shift, 0.0])
    m.points, m.triangles, m.quads, m.edges = (
        points,
        new[m.triangles],
        new[m.quads],
        new[m.edges][:, ::-1],
    )
    for cells in (m.triangles, m.quads):
        for k in range(len(cells)):
            cells[k] = np.roll(cells[k][:: order.choice((-1, 1))], order.randrange(4))
    pair = write_and_read_pair(m, tmp_path_factory.mktemp("any"))
    for piece in (pair.lower, pair.upper):
        assert np.abs(piece.x - GRID.x).max() <= 1e-14
        assert piece.areas().min() > 0 and piece.areas().sum() == pytest.approx(
            GRID.length * GRID.height, rel=1e-9
        )


@pytest.mark.parametrize("kind", KINDS)
def test_exact_halved_piece_fills_the_same_place_with_four_times_the_cells(kind, tmp_path):
    piece = write_and_read_pair(make_pair(kind), tmp_path).upper
    fine = piece.refine()
    assert fine.is_coating.size == 4 * piece.is_coating.size
    assert fine.areas().min() > 0
    assert fine.areas() == pytest.approx(np.repeat(piece.areas() / 4, 4), rel=1e-9)
    assert np.all(np.diff(fine.x) > 0) and np.array_equal(fine.x[::2], piece.x)
    assert fine.coating_thickness == pytest.approx(piece.coating_thickness)
    assert fine.far.size == 2 * piece.far.size - 1 and np.all(
        fine.points[fine.far, 1] == piece.height
    )
    assert np.unique(fine.points.round(12), axis=0).shape == fine.points.shape


def bend(m):
    """Both ends of the upper interface chamfered by a slope of 0.2."""
    upper = m.points[len(m.points) // 2 :]
    upper[:, 1] += 0.2 * np.maximum(np.abs(upper[:, 0]) - 0.75e-3, 0)


def double(m, node, cell):
    """A second node at the same place, used by one cell only."""
    m.points = np.append(m.points, m.points[node : node + 1], axis=0)
    m.quads[cell][m.quads[cell] == node] = len(m.points) - 1


def twin(m, node):
    """The interface edge on one side of a node ends in a second node at the same place, and so do its cells."""
    m.points = np.append(m.points, m.points[node : node + 1], axis=0)
    for cells in (m.quads, m.edges):
        beyond = m.points[cells][:, :, 0].mean(axis=1) > m.points[node, 0]
        cells[beyond[:, None] & (cells == node)] = len(m.points) - 1


def loosen(m):
    """The upper coating gets nodes of its own, as a drawing whose faces were not glued gives them."""
    mine = m.quad_tags == CELL_TAGS["upper_coating"]
    top = m.edge_tags == EDGE_TAGS["upper_interface"]
    own = np.unique(m.quads[mine])
    m.quads[mine] = np.searchsorted(own, m.quads[mine]) + len(m.points)
    m.edges[top] = np.searchsorted(own, m.edges[top]) + len(m.points)
    m.points = np.concatenate([m.points, m.points[own]])


def hang(m):
    """One quad cut in two by a node in the middle of an edge that its neighbour does not have."""
    k = int(np.flatnonzero(m.quad_tags == CELL_TAGS["upper_substrate"])[-2])
    a, b, c, d = m.quads[k]
    m.points = np.append(m.points, [(m.points[a] + m.points[b]) / 2], axis=0)
    new = len(m.points) - 1
    m.triangles = np.array([[a, new, d], [new, b, c], [new, c, d]])
    m.triangle_tags = np.full(3, m.quad_tags[k])
    m.quads, m.quad_tags = np.delete(m.quads, k, 0), np.delete(m.quad_tags, k)


def drop_edge(m, name, count=0):
    mine = np.flatnonzero(m.edge_tags == EDGE_TAGS[name])
    mine = mine[count : mine.size - count]
    m.edges, m.edge_tags = np.delete(m.edges, mine, 0), np.delete(m.edge_tags, mine)


def share(m):
    half = len(m.points) // 2
    for cells in (m.quads, m.edges):
        for k in np.flatnonzero(m.points[:half, 1] == 0):
            cells[cells == k + half] = k


SPOILT = {
    "off the line": (
        lambda m: shift_points(m, find_interface_node(m), (0, 2e-5)),
        "upper_interface is not the straight line y = 0",
    ),
    "shifted": (
        lambda m: shift_points(m, slice(len(m.points) // 2, None), (1e-5, 0)),
        "do not match .*; let both interfaces begin and end",
    ),
    "end node aside": (
        lambda m: shift_points(m, find_interface_node(m, k=-1), (1e-7, 0)),
        "do not match .* 1e-07 m apart",
    ),
    "double node": (lambda m: double(m, m.quads[20, 0], 20), "coincide, the first at .*merge"),
    "double interface node": (
        lambda m: twin(m, find_interface_node(m)),
        "upper_interface has two nodes at x = .*; merge",
    ),
    "loose coating": (loosen, "9 pairs of nodes of the upper piece coincide"),
    "hanging node": (hang, "do not meet edge to edge: a node lies"),
    "shared nodes": (share, "the two pieces share 9 nodes"),
    "steep edge": (bend, "rounded edges may reach a slope of 0.1\\): the node"),
    "across": (
        lambda m: np.negative(m.points[:, 1], out=m.points[:, 1]),
        "piece reaches 0.001 m across y = 0",
    ),
    "no far face": (
        lambda m: drop_edge(m, "upper_far"),
        r"no cells or nodes are tagged upper_far \(",
    ),
    "no interface": (
        lambda m: drop_edge(m, "lower_interface"),
        r"no cells or nodes are tagged lower_interface \(",
    ),
    "hole in the interface": (
        lambda m: drop_edge(m, "lower_interface", 2),
        "lower_interface has a hole .* make the interface",
    ),
    "far at the interface": (
        lambda m: m.edges.__setitem__(
            m.edge_tags == EDGE_TAGS["lower_far"], find_interface_node(m, "lower")
        ),
        "lower_far must contain two nodes or more",
    ),
    "foreign far": (
        lambda m: m.edge_tags.__setitem__(
            m.edge_tags == EDGE_TAGS["lower_far"], EDGE_TAGS["upper_far"]
        ),
        "no cells or nodes are tagged lower_far",
    ),
    "foreign node": (
        lambda m: m.edges.__setitem__(
            (np.flatnonzero(m.edge_tags == EDGE_TAGS["lower_far"])[0], 0), find_interface_node(m)
        ),
        "lower_far contains 1 nodes that belong to no cell",
    ),
    "far inside": (
        lambda m: m.edges.__isub__((m.edge_tags == EDGE_TAGS["lower_far"])[:, None].astype(int)),
        "lower_far contains .* nodes inside the lower piece",
    ),
    "doubled cell": (
        lambda m: m.quads.__setitem__(3, m.quads[4]),
        "overlap|has a hole|far contains",
    ),
    "twisted": (
        lambda m: m.quads.__setitem__((5, [1, 2]), m.quads[5, [2, 1]]),
        "1 cells are twisted",
    ),
    "no area": (
        lambda m: m.quads.__setitem__((5, 1), m.quads[5, 0]),
        "1 cells are twisted or have no area",
    ),
    "not finite": (lambda m: shift_points(m, 7, (np.nan, 0)), "not finite"),
    "missing piece": (
        lambda m: m.quad_tags.__setitem__(m.quad_tags <= 2, 3),
        "no cells or nodes are tagged upper_substrate",
    ),
    "no substrate": (
        lambda m: m.quad_tags.fill(CELL_TAGS["upper_coating"]),
        "no cells or nodes are tagged lower_substrate, upper_substrate",
    ),
}


@pytest.mark.parametrize("form", ["gmsh 2.2 binary", "vtu", "inp lines"])
@pytest.mark.parametrize("name", SPOILT)
def test_refuses_a_spoilt_mesh_by_name(name, form, tmp_path):
    spoil, message = SPOILT[name]
    m = make_pair("quads")
    spoil(m)
    begin = time.process_time()
    with pytest.raises(PatchfemError, match=message) as caught:
        write_and_read_pair(m, tmp_path, form)
    assert str(caught.value).startswith(str(tmp_path)) and "\n" not in str(caught.value)
    assert time.process_time() - begin < 2


def test_refuses_parts_joined_at_one_node_only(tmp_path):
    m = make_pair("quads")
    last = m.quads[np.flatnonzero(m.quad_tags == CELL_TAGS["upper_substrate"])[-1]]
    m.points = np.concatenate([m.points, m.points[last[2]] + [[1e-3, 0], [1e-3, 1e-3], [0, 1e-3]]])
    count = len(m.points)
    m.quads = np.append(m.quads, [[last[2], count - 3, count - 2, count - 1]], axis=0)
    m.quad_tags = np.append(m.quad_tags, CELL_TAGS["upper_substrate"])
    with pytest.raises(PatchfemError, match="the upper piece falls into 2 parts"):
        write_and_read_pair(m, tmp_path)


def test_refuses_curved_cells_bent_meshes_and_unknown_tags(tmp_path):
    m = make_pair("quads")
    path = tmp_path / "pair.vtu"
    mesh = meshio.Mesh(
        np.column_stack([m.points, m.points[:, 0]]),
        [(k, c) for k, c, _ in find_cell_blocks(m)],
        cell_data={"tag": [t for _, _, t in find_cell_blocks(m)]},
    )
    meshio.write(path, mesh)
    with pytest.raises(PatchfemError, match=r"not plane: its z values span 0\.002 m"):
        read_pieces(path)
    mesh.cell_data = {"tag": [t + 100 for _, _, t in find_cell_blocks(m)]}
    meshio.write(path, mesh)
    with pytest.raises(
        PatchfemError, match=r"no cells or nodes are tagged .*cell array `tag`: 1 upper_substrate"
    ):
        read_pieces(path)
    meshio.write(
        path, meshio.Mesh(m.points @ np.eye(2, 3), [("triangle6", m.quads[:, [0, 1, 2, 3, 0, 1]])])
    )
    with pytest.raises(PatchfemError, match="triangle6 cells; only linear"):
        read_pieces(path)
    path = tmp_path / "pair.inp"
    write_inp(m, path)
    path.write_text(path.read_text().replace("ELSET=UPPER_COATING", "ELSET=GLUE"))
    with pytest.raises(PatchfemError, match=r"some cells have an unknown tag \(no tag\);"):
        read_pieces(path)


@pytest.mark.parametrize(
    "text, message",
    [
        ("*NODE\n1,0,0\n1,1,0\n*NODE\n1,2,2\n", "given twice"),
        ("*NODE\n1,0,0\n*ELEMENT,TYPE=C3D8\n1,1,1,1,1,1,1,1,1\n", "C3D8 elements; only linear"),
        ("*NODE\n1,0,0\n*ELEMENT,TYPE=CPE3\n1,1,1\n", "do not all have 3 nodes"),
        ("*NODE\n1,0,0\n*NSET,NSET=upper_far,GENERATE\n1,2000000000,1\n", "longer than the deck"),
        ("*NODE\n1,0,0\n*NSET,NSET=upper_far\nnobody\n", "unknown set nobody"),
        (
            "*NODE\n1,0,0\n3,1,0\n*ELEMENT,TYPE=CPE3\n12,1,3,7\n",
            "element 12 names node 7, which the file does not define",
        ),
        (
            "*NODE\n1,0,0\n*NSET,NSET=upper_far\n1,9\n",
            "upper_far names node 9, which the file does not define",
        ),
        ("*INCLUDE, INPUT=other.inp\n", "INCLUDE is not supported yet"),
        ("*NODE\n1,zero,0\n", "not a readable .inp"),
        ("", "no cells or nodes are tagged .*ELSET"),
        ("\x00\ufffd*", "no cells or nodes are tagged"),
    ],
)
def test_refuses_decks_it_cannot_use(text, message, tmp_path):
    (tmp_path / "pair.inp").write_text(text, encoding="utf-8")
    with pytest.raises(PatchfemError, match=message):
        read_pieces(tmp_path / "pair.inp")


@pytest.mark.parametrize("form", FORMATS)
def test_refuses_truncations_in_bounded_time(form, tmp_path):
    ending, write = FORMATS[form]
    path = tmp_path / f"pair{ending}"
    write(make_pair("mixed"), path)
    whole = path.read_bytes()
    for cut in range(0, int(0.9 * len(whole)), max(1, len(whole) // 40)):
        path.write_bytes(whole[:cut])
        begin = time.process_time()
        with pytest.raises(PatchfemError, match="pair"):
            read_pieces(path)
        assert time.process_time() - begin < 2


CHANGES = st.lists(
    st.tuples(st.floats(0, 1, exclude_max=True), st.integers(0, 255)), min_size=1, max_size=4
)


@pytest.mark.share(0, 3, 4, 6)
@pytest.mark.parametrize("form", FORMATS)
@given(changes=CHANGES)
def test_always_a_spoilt_file_is_read_or_refused(form, changes, tmp_path):
    """Bytes of a file of this form changed at shares of its length: read to a mesh without faults, or refused."""
    ending, write = FORMATS[form]
    path = tmp_path / f"pair{ending}"
    write(make_pair("mixed"), path)
    raw = bytearray(path.read_bytes())
    for place, byte in changes:
        raw[int(place * len(raw))] = byte
    path.write_bytes(raw)
    begin = time.process_time()
    try:
        pair = read_pieces(path)
    except PatchfemError:
        pass
    else:
        for piece in (pair.lower, pair.upper):
            assert (
                piece.areas().min() > 0
                and np.isfinite(piece.points).all()
                and piece.points.min(axis=0)[1] >= 0
            )
    assert time.process_time() - begin < 2
