"""Elastic pieces that are condensed to their interface.

In: tagged meshes and materials. Out: compliance matrices of the interface nodes (normal,
tangential, coupled), and displacements and stresses inside for given forces on the interface.

The equations are those of plane linear elasticity, in strain or stress: div sigma = 0 with
sigma = lam tr(eps) I + 2 mu eps, and u = 0 on the far face. `plane_form` contains their weak form.
scikit-fem evaluates it, and the shape functions of the stresses, for every mesh. With the stiffness
split into inside i and interface s, the compliance of the interface is the inverse of the Schur
complement S = K_ss - K_si K_ii^-1 K_is.

- Read `elasticity` first: materials, pieces, compliance and displacement.
- `reference_cells` returns the values of scikit-fem's elements on reference cells, from the disk
  cache if they are there.
- A piece on a tensor grid is assembled in `tensor_stiffness` from the matrices of three reference
  cells. `condense` computes S, and `grid_fronts` eliminates the inside and predicts the cost.
- A piece on an unstructured mesh (from a file, or with round ends) is assembled cell by cell in
  `substructure` and factorised by `fronts`, in the order of `dissect`.
- `mortar` joins pieces whose interface nodes do not match.
- `recovery` computes stresses and their errors, `coating_traction` the traction below a coating.
- `cache` stores compliances on disk; `lapack` loads BLAS and LAPACK quickly.
"""

# Names that other folders use, by module
PUBLIC = {
    "cache": (
        "grid_key",
        "load_arrays",
        "mesh_key",
        "store_arrays",
    ),
    "coating_traction": (
        "compute_coating_traction",
        "interpolate_coating_traction",
    ),
    "elasticity": (
        "InterfaceCompliance",
        "Layers",
        "Piece",
        "compute_displacement",
        "interface_compliance",
        "lame",
        "von_mises",
    ),
    "fronts": (
        "SparseFactor",
        "ZeroEnergyMotion",
    ),
    "grid_fronts": (
        "predict_bytes",
        "predict_seconds",
    ),
    "lapack": (
        "cho_factor",
        "cho_solve",
        "dpotrf",
        "dpotrs",
        "dtrsm",
        "dtrtri",
        "use_one_blas_thread",
    ),
    "mortar": (
        "PieceInterface",
        "join_pieces",
    ),
    "recovery": (
        "Cells",
        "StressError",
        "centre_stress",
        "estimate_error",
        "fit_recovery",
        "get_cells",
        "make_points",
    ),
    "substructure": ("Substructure",),
}
