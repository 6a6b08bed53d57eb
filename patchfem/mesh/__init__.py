"""Meshes of the two pieces: tensor grids, pieces with shaped ends, and mesh files.

In: sizes and layers, or a file with tagged cells and edges. Out: a `TensorGrid`, `ShapedGrid` or
`PieceMesh` for each piece, with its interface nodes, materials and fixed nodes. All three have `x`,
`height`, `first_row_height`, `coating_thickness`, `tributary_lengths()`, `refine()` and `base_grid`.

- Read `tensor` first: a grid of columns and rows that grow with depth. `grading` divides a length
  into cells of target lengths, which grow with the distance from bands of small cells.
- `ends` and `shaped`: pieces that are longer than the interface, chamfered or rounded.
- `files` reads and writes tagged meshes with meshio; `decks` reads .inp; `anymesh` checks them and
  builds both pieces; `recognise` detects tensor grids; `pairs` joins two pieces into one mesh.
- `nodal_averages` adds up values over the cells around a node.
"""

# Names that other folders use, by module
PUBLIC = {
    "anymesh": (
        "PieceMesh",
        "cell_edges",
    ),
    "ends": (
        "End",
        "SHARP_END",
    ),
    "files": (
        "read_bodies",
        "read_pieces",
        "write_mesh",
    ),
    "grading": (
        "LENGTH_TOL",
        "Layout",
        "divide_into_columns",
        "divide_into_rows",
        "tributary_lengths",
    ),
    "nodal_averages": (
        "Patches",
        "collect_patches",
    ),
    "recognise": (
        "find_holes",
        "measure_clamped_length",
    ),
    "shaped": ("shaped_grid",),
    "tensor": (
        "ROW_SLOPE",
        "TensorGrid",
        "graded_grid",
        "row_scale",
    ),
}
