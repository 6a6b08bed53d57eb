"""Meshes of the two pieces: structured grids and mesh files.

In: sizes and layers, or a file with tagged cells and edges. Out: a `TensorGrid` or `PieceMesh` for each piece, with its
interface nodes, materials and fixed nodes. Both have the same attributes, so that all later steps treat them alike.

- Read `grid` first: a grid of columns, which go on beyond the interface, and of rows that grow with depth. `grading`
  divides a length into cells of target lengths, which grow with the distance from bands of small cells; `ends` has the
  chamfered and rounded ends.
- `elements` has the shape functions of first and second order; `pieces` a mesh of any of these elements.
- `files` reads and writes tagged meshes with meshio, `decks` reads .inp; `checks` builds both pieces and checks them.
"""

# Names that other folders use, by module
PUBLIC = {
    "elements": ("ELEMENTS",),
    "ends": (
        "End",
        "SHARP_END",
    ),
    "files": (
        "read_pieces",
        "write_mesh",
    ),
    "grading": (
        "Layout",
        "RowHeights",
        "divide_into_columns",
        "divide_into_rows",
        "tributary_lengths",
    ),
    "grid": (
        "ROW_HEIGHT_GROWTH",
        "TensorGrid",
        "make_graded_grid",
        "compute_row_scale",
    ),
    "pieces": ("PieceMesh",),
}
