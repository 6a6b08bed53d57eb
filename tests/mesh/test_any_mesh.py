"""Tagged meshes of two pieces, of triangles, quads or both, in four formats, and refusals of unusable meshes."""

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
from patchfem.mesh import read_pieces, write_mesh
from patchfem.mesh.files import CELL_TAGS, EDGE_TAGS

ELEMENT_KINDS = ("quads", "triangles", "mixed")


@pytest.mark.parametrize("kind", ELEMENT_KINDS)
@pytest.mark.parametrize("form", FORMATS)
def test_exact_all_formats_give_same_pair(form, kind, tmp_path):
    """Every format gives the same pair of pieces, with nodes, lengths, heights and coatings."""
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
        counts = [len(piece.blocks.get(kind, ())) for kind in ("triangle", "quad")]
        assert counts == pytest.approx(
            np.array([2 * split, 1 - split]) * GRID.is_coating.size, abs=1
        )


def test_exact_rounded_ends_are_read_with_depths(tmp_path):
    """The depths of gently rounded interface ends are read, and refinement interpolates them."""
    mesh = make_pair("mixed")
    heights = np.maximum(np.abs(mesh.points[:, 0]) - 0.5e-3, 0) ** 2 / 0.02
    mesh.points[:, 1] += np.where(np.arange(len(heights)) < len(heights) // 2, -1, 1) * heights
    pair = write_and_read_pair(mesh, tmp_path)
    for piece in (pair.lower, pair.upper):
        assert piece.interface_depths == pytest.approx(
            np.maximum(np.abs(GRID.x) - 0.5e-3, 0) ** 2 / 0.02, abs=1e-15
        )
        assert np.array_equal(piece.refine().interface_depths[::2], piece.interface_depths)
        assert piece.refine().interface_depths[1::2] == pytest.approx(
            (piece.interface_depths[1:] + piece.interface_depths[:-1]) / 2, abs=1e-18
        )
    assert np.all(write_and_read_pair(make_pair("mixed"), tmp_path).lower.interface_depths == 0)


def test_always_middle_of_interface_is_origin(tmp_path):
    """A pair that is drawn elsewhere along x is the same pair."""
    pairs = []
    for shift in (0.0, 3e-3):
        mesh = make_pair("mixed")
        mesh.points[:, 0] += shift
        pairs.append(write_and_read_pair(mesh, tmp_path))
    for side in ("lower", "upper"):
        first, second = (getattr(pair, side).points for pair in pairs)
        assert second == pytest.approx(first, abs=1e-15)


@pytest.mark.parametrize("name", ["pair.msh", "pair.vtu"])
@pytest.mark.parametrize("kind", ELEMENT_KINDS)
def test_exact_mesh_pair_round_trip(kind, name, tmp_path):
    """A pair of different pieces is written and read back bit for bit."""
    mesh = make_pair(kind)
    mesh.points[mesh.points[:, 1] > 0] *= [1.0, 1.7]  # makes the two pieces different
    pair = write_and_read_pair(mesh, tmp_path)
    write_mesh(pair.lower, tmp_path / name, pair.upper)
    read_pair = read_pieces(tmp_path / name)
    for piece, expected in ((read_pair.lower, pair.lower), (read_pair.upper, pair.upper)):
        for part in ("points", "is_coating", "interface", "far"):
            assert np.array_equal(getattr(piece, part), getattr(expected, part)), part
        assert piece.blocks.keys() == expected.blocks.keys()
        for kind, cells in expected.blocks.items():
            assert np.array_equal(piece.blocks[kind], cells)


@pytest.mark.parametrize("kind", ELEMENT_KINDS)
def test_exact_refined_piece_has_same_outline(kind, tmp_path):
    """A refined piece has the same outline and coating and four times the elements."""
    piece = write_and_read_pair(make_pair(kind), tmp_path).upper
    refined = piece.refine()
    assert refined.is_coating.size == 4 * piece.is_coating.size
    assert refined.areas().min() > 0
    assert refined.areas() == pytest.approx(np.repeat(piece.areas() / 4, 4), rel=1e-9)
    assert np.all(np.diff(refined.x) > 0) and np.array_equal(refined.x[::2], piece.x)
    assert refined.coating_thickness == pytest.approx(piece.coating_thickness)
    assert refined.far.size == 2 * piece.far.size - 1 and np.all(
        refined.points[refined.far, 1] == piece.height
    )
    assert np.unique(refined.points.round(12), axis=0).shape == refined.points.shape


def chamfer_upper_ends(mesh):
    """Move both ends of the upper interface away by a slope of 0.2."""
    upper_points = mesh.points[len(mesh.points) // 2 :]
    upper_points[:, 1] += 0.2 * np.maximum(np.abs(upper_points[:, 0]) - 0.75e-3, 0)


def duplicate_node(mesh, node, cell):
    """Add a node at the position of another node and use it in one element."""
    mesh.points = np.append(mesh.points, mesh.points[node : node + 1], axis=0)
    mesh.quads[cell][mesh.quads[cell] == node] = len(mesh.points) - 1


def split_interface_node(mesh, node):
    """Add a node at the position of an interface node and use it on one side."""
    mesh.points = np.append(mesh.points, mesh.points[node : node + 1], axis=0)
    for cells in (mesh.quads, mesh.edges):
        is_beyond = mesh.points[cells][:, :, 0].mean(axis=1) > mesh.points[node, 0]
        cells[is_beyond[:, None] & (cells == node)] = len(mesh.points) - 1


def separate_coating(mesh):
    """Give the upper coating nodes of its own, as in a drawing whose faces were not joined."""
    is_coating = mesh.quad_tags == CELL_TAGS["upper_coating"]
    is_interface = mesh.edge_tags == EDGE_TAGS["upper_interface"]
    nodes = np.unique(mesh.quads[is_coating])
    mesh.quads[is_coating] = np.searchsorted(nodes, mesh.quads[is_coating]) + len(mesh.points)
    mesh.edges[is_interface] = np.searchsorted(nodes, mesh.edges[is_interface]) + len(mesh.points)
    mesh.points = np.concatenate([mesh.points, mesh.points[nodes]])


def add_hanging_node(mesh):
    """Split a quad by a node in the middle of an edge that its neighbour does not have."""
    k = int(np.flatnonzero(mesh.quad_tags == CELL_TAGS["upper_substrate"])[-2])
    a, b, c, d = mesh.quads[k]
    mesh.points = np.append(mesh.points, [(mesh.points[a] + mesh.points[b]) / 2], axis=0)
    new_node = len(mesh.points) - 1
    mesh.triangles = np.array([[a, new_node, d], [new_node, b, c], [new_node, c, d]])
    mesh.triangle_tags = np.full(3, mesh.quad_tags[k])
    mesh.quads, mesh.quad_tags = np.delete(mesh.quads, k, 0), np.delete(mesh.quad_tags, k)


def remove_edges(mesh, name, count=0):
    """Remove the tagged edges of a name, except `count` at either end."""
    edge_numbers = np.flatnonzero(mesh.edge_tags == EDGE_TAGS[name])
    edge_numbers = edge_numbers[count : edge_numbers.size - count]
    mesh.edges, mesh.edge_tags = (
        np.delete(mesh.edges, edge_numbers, 0),
        np.delete(mesh.edge_tags, edge_numbers),
    )


def share_interface_nodes(mesh):
    """Let both pieces use the same nodes on the interface."""
    half = len(mesh.points) // 2
    for cells in (mesh.quads, mesh.edges):
        for k in np.flatnonzero(mesh.points[:half, 1] == 0):
            cells[cells == k + half] = k


INVALID_CHANGES = {
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
    "double node": (
        lambda m: duplicate_node(m, m.quads[20, 0], 20),
        "on another node; merge nodes that coincide",
    ),
    "double interface node": (
        lambda m: split_interface_node(m, find_interface_node(m)),
        "upper_interface has two nodes at x = .*; merge",
    ),
    "loose coating": (separate_coating, "on another node; merge nodes that coincide"),
    "hanging node": (
        add_hanging_node,
        "do not meet edge to edge: a node at x = .* lies inside an edge",
    ),
    "shared nodes": (share_interface_nodes, "the two pieces share 9 nodes"),
    "steep edge": (chamfer_upper_ends, "rounded edges may reach a slope of 0.1\\): the node"),
    "across": (
        lambda m: np.negative(m.points[:, 1], out=m.points[:, 1]),
        "piece reaches 0.001 m across y = 0",
    ),
    "no far face": (
        lambda m: remove_edges(m, "upper_far"),
        r"no cells or nodes are tagged upper_far \(.*; tags in the file: lower_coating, lower_far, ",
    ),
    "no interface": (
        lambda m: remove_edges(m, "lower_interface"),
        r"no cells or nodes are tagged lower_interface \(",
    ),
    "hole in the interface": (
        lambda m: remove_edges(m, "lower_interface", 2),
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


@pytest.mark.parametrize("form", ["gmsh 2.2 binary", "inp lines"])
@pytest.mark.parametrize("name", INVALID_CHANGES)
def test_refuses_invalid_mesh_with_reason(name, form, tmp_path):
    """An invalid mesh is refused within 2 s, with the file and the reason."""
    change, message = INVALID_CHANGES[name]
    mesh = make_pair("quads")
    change(mesh)
    start_time = time.process_time()
    with pytest.raises(PatchfemError, match=message) as caught:
        write_and_read_pair(mesh, tmp_path, form)
    assert str(caught.value).startswith(str(tmp_path)) and "\n" not in str(caught.value)
    assert time.process_time() - start_time < 2


def test_refuses_curved_elements_nonplanar_meshes_and_unknown_tags(tmp_path):
    """Elements of other orders, meshes that are not plane and unknown tags are refused."""
    pair = make_pair("quads")
    path = tmp_path / "pair.vtu"
    for slope, span in ((1e-4, "2e-07"), (1.0, r"0\.002")):
        mesh = meshio.Mesh(
            np.column_stack([pair.points, slope * pair.points[:, 0]]),
            [(k, c) for k, c, _ in find_cell_blocks(pair)],
            cell_data={"tag": [t for _, _, t in find_cell_blocks(pair)]},
        )
        meshio.write(path, mesh)
        with pytest.raises(PatchfemError, match=f"not plane: its z values span {span} m"):
            read_pieces(path)
    mesh.cell_data = {"tag": [t + 100 for _, _, t in find_cell_blocks(pair)]}
    meshio.write(path, mesh)
    with pytest.raises(
        PatchfemError, match=r"no cells or nodes are tagged .*cell array `tag`: 1 upper_substrate"
    ):
        read_pieces(path)
    meshio.write(
        path,
        meshio.Mesh(
            pair.points @ np.eye(2, 3),
            [("tetra", pair.quads)],
        ),
    )
    with pytest.raises(PatchfemError, match="tetra cells; only plane"):
        read_pieces(path)
    path = tmp_path / "pair.inp"
    write_inp(pair, path)
    path.write_text(path.read_text().replace("ELSET=UPPER_COATING", "ELSET=GLUE"))
    with pytest.raises(PatchfemError, match=r"some cells have an unknown tag \(no tag\);"):
        read_pieces(path)


@pytest.mark.parametrize(
    "old, new, message",
    [
        ("CPE4R", "S4R", r"S4R elements cannot be used; .*\(CPE\*\)"),
        ("CPE4R", "CAX4R", "CAX4R elements cannot be used"),
        ("CPE4R", "M3D4", "M3D4 elements cannot be used"),
        ("T2D2", "SAX1", "SAX1 elements cannot be used"),
        ("*NODE", "*Part, name=A\n*NODE", r"\*PART: parts .*noPartsInputFile=ON\) writes a flat"),
        ("*NODE", "*Instance, name=A-1, part=A\n*NODE", r"\*INSTANCE: parts and instances"),
        ("\n8, ", "\n5, ", "node 5 is given twice"),
        *(
            ("*NODE", f"*{word}\n1\n*NODE", rf"\*{word} is not supported yet; write a flat deck")
            for word in "INCLUDE SYSTEM NGEN NFILL ELGEN NCOPY ELCOPY".split()
        ),
    ],
)
def test_refuses_decks_of_other_elements_and_of_parts(old, new, message, tmp_path):
    """A deck of shells, membranes or axisymmetric elements, of parts or with a number given twice is refused."""
    path = tmp_path / "pair.inp"
    write_inp(make_pair("quads"), path)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    with pytest.raises(PatchfemError, match=message):
        read_pieces(path)


@pytest.mark.parametrize("kind", ["CPE4H", "CPS4", "CPEG4R"])
def test_always_reads_decks_of_plane_elements(kind, tmp_path):
    """Elements of plane strain, plane stress and generalized plane strain are read."""
    path = tmp_path / "pair.inp"
    write_inp(make_pair("quads"), path)
    path.write_text(path.read_text().replace("CPE4R", kind))
    assert len(read_pieces(path).lower.blocks["quad"]) > 0


BYTE_CHANGES = st.lists(
    st.tuples(st.floats(0, 1, exclude_max=True), st.integers(0, 255)), min_size=1, max_size=4
)


@pytest.mark.share(0, 3, 6)
@pytest.mark.parametrize("form", FORMATS)
@given(changes=BYTE_CHANGES)
def test_always_changed_mesh_file_is_read_or_refused(form, changes, tmp_path):
    """A mesh file with changed bytes is read to a valid mesh or refused, within 2 s."""
    ending, write = FORMATS[form]
    path = tmp_path / f"pair{ending}"
    write(make_pair("mixed"), path)
    content = bytearray(path.read_bytes())
    for fraction, byte in changes:
        content[int(fraction * len(content))] = byte
    path.write_bytes(content)
    start_time = time.process_time()
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
    assert time.process_time() - start_time < 2
