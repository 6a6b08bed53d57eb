"""Normal contact of two pieces through their condensed compliance.

In: the compliance C (m, m) of m interface nodes, the gap g (m,), and a load or an approach. Out: nodal
forces f or pressures, the gap under load, the approach delta and the rotation theta that satisfy

    w = g + theta x - delta + C f >= 0,    f >= 0,    f . w = 0.

`gaps` has the shapes of the surfaces. `press.press` presses the cases of a pair of pieces, bare or with asperities
(`asperity_laws`, `asperity_layer`): `press_cases` finds their contact sets on a table (`set_table`), from which `edges`
derives where the contacts end. `unilateral` solves a case alone whose sets cycle, if need be from the set that the
gradients of `bounded` show, and checks the solution. Read `gaps`, `set_table`, `press_cases` and `press` first.

`contact_sets` and the kernels solve again and again while the holder moves (`press_kernels`, `press_path_kernels`).

Faces that vary along both axes, and rows of thousands of points, are divided into equal cells: `waves` has the closed
forms of layers, `cells` the compliance of the cells of two blocks, `bounded` the solver, `press_cells` the contact and
`cell_edges` the edges of contact between cells. Read `cells` first.
"""

# Names that other folders use, by module
PUBLIC = {
    "asperity_laws": (
        "ExponentialAsperities",
        "HertzAsperities",
    ),
    "cells": ("make_block",),
    "contact_sets": ("ContactSets",),
    "press": ("press_patch",),
    "press_cases": ("Holders",),
    "press_cells": (
        "FaceLoading",
        "solve_on_set",
    ),
    "stiffness": ("tangential_stiffness",),
}
