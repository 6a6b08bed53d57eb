"""Models: the problems that scenes describe, in SI units, before anything is solved.

In: a `Scene`. Out: a `Model` of frozen records for pieces, gap, load, friction laws, prescribed slide, rig and
wear. No later folder knows a scene. Read `model` first, then `patch` for pressed pieces and `rig` for modes
and drives; `files` checks the files that a scene names.
"""

# Names that other folders use, by module.
PUBLIC = {
    "law": ("make_bond_parameters",),
    "model": (
        "Model",
        "build",
        "build_without_sweep",
        "write_resolved",
    ),
    "pieces": (
        "extend_grid",
        "make_piece_meshes",
    ),
    "similar_models": ("SimilarModels",),
    "slide": ("SlidePath",),
    "structure": ("compute_named_motions",),
}
