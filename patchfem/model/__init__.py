"""Models: the problems that scenes describe, in SI units, before anything is solved.

In: a `Scene`. Out: a `Model` of frozen records for pieces, gap, load, friction laws, prescribed slide, rig and
wear. No later folder knows a scene. Read `model` first, then `patch` for pressed pieces and `rig` for modes
and drives; `files` checks the files that a scene names.
"""

# Names that other folders use, by module.
PUBLIC = {
    "earlier_wear": (
        "GAP_DIFFERENCE_FRACTION",
        "LOADING_KEYS",
        "interpolate_nodes",
    ),
    "files": ("find_file_faults",),
    "law": ("make_bond_parameters",),
    "model": (
        "Model",
        "build",
        "build_without_sweep",
        "write_resolved",
    ),
    "peaks": ("read_spectral_moments",),
    "pieces": (
        "extend_grid",
        "find_rounded_edges",
        "make_elastic_layers",
        "make_piece_meshes",
    ),
    "profile": ("find_sample_spacing",),
    "rig": ("MAX_COMPUTED_DISPLACEMENT",),
    "similar_models": (
        "SimilarModels",
        "collect_columns",
        "select_models",
    ),
    "slide": ("SlidePath",),
    "source": ("locate_errors",),
    "structure": (
        "compute_named_motions",
        "compute_sticking_stiffness",
    ),
}
