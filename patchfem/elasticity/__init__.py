"""Elastic pieces that are condensed to their interface.

In: meshes and materials. Out: compliance matrices of the interface nodes (normal, tangential, coupled), and
displacements and stresses inside for given forces on the interface.

The equations are those of plane linear elasticity, in strain or stress: div sigma = 0 with
sigma = lam tr(eps) I + 2 mu eps, and u = 0 on the far face. With the stiffness split into inside i and interface s, the
compliance of the interface is the inverse of the Schur complement S = K_ss - K_si K_ii^-1 K_is.

- Read `elasticity` first: materials, stiffness of the cells of any mesh, pieces, compliance and displacement.
- `fronts` eliminates the inside of a piece.
- `mortar` joins pieces whose interface nodes do not match.
- `recovery` computes stresses and their errors, `coating_traction` the traction below a coating.
- `sides` computes what the free sides of a block change in the compliance of its face.
- `lapack` loads BLAS and LAPACK quickly; `sparse_factor` serves matrices that do not come from a mesh.
"""

# Names that other folders use, by module
PUBLIC = {
    "coating_traction": ("compute_coating_traction",),
    "elasticity": (
        "Layers",
        "Piece",
        "compute_displacement",
        "compute_interface_compliance",
        "von_mises",
    ),
    "mortar": ("PieceInterface",),
    "recovery": (
        "Cells",
        "compute_centre_stress",
        "estimate_error",
        "fit_recovery",
        "get_cells",
        "make_points",
    ),
    "sides": (
        "BlockShape",
        "LayerStack",
        "make_stack",
    ),
}
