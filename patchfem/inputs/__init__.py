"""Readers of measurements and matrices that a scene, a fit or `patchfem import` names.

In: paths of files. Out: arrays in SI units. An error names the file, the line where there is one, and
what is needed instead.

Tables (.csv, .txt): `tables` reads them all, and four modules ask for the columns of one purpose: `slides`
(a prescribed slide), `signals` (a drive or its spectrum), `loops` (force against displacement) and `measured`
(responses of a rig). `units` lists all units.
Files of laboratories: `records` selects and converts channels that share one time, from any file that
`laboratory` opens: tables, universal files (`universal`) or MATLAB files (`matlab`).
Matrices of finite-element programs: `matrices`. `packed` refuses files that are too large after they are unpacked.
Read `tables` first.
"""

# Names that other folders use, by module.
PUBLIC = {
    "laboratory": ("read_records",),
    "loops": (
        "Loop",
        "read_loop",
    ),
    "matlab": (
        "read_real_arrays",
        "read_variables",
    ),
    "matrices": (
        "Matrix",
        "align_rows",
        "read_matrix",
    ),
    "measured": (
        "is_readable",
        "read_table",
    ),
    "packed": (
        "count_zip_bytes",
        "open_arrays",
        "refuse_large_content",
    ),
    "records": (
        "parse_requests",
        "shift_to_zero",
    ),
    "signals": (
        "read_signal",
        "read_spectrum",
    ),
    "slides": ("read_slide",),
    "tables": (
        "NUMBER_PATTERN",
        "TableFormat",
        "find_factors",
        "read_columns",
        "read_text",
    ),
    "units": ("SI_UNITS",),
    "universal": (
        "Dataset",
        "find_unit_factors",
        "read_datasets",
    ),
}
