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
    "loops": ("read_loop",),
    "matlab": (
        "read_real_arrays",
        "read_variables",
    ),
    "matrices": ("read_matrix",),
    "measured": ("read_table",),
    "records": ("parse_requests",),
    "signals": ("read_signal",),
    "slides": ("read_slide",),
    "tables": (
        "TableFormat",
        "read_columns",
    ),
}
