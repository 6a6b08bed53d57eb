"""Measured surfaces: read, levelled and cleaned, their roughness, and their wear.

In: files of traces and areal scans (`files`). Out: levelled heights averaged over the cells of the
interface nodes (`nodes`), roughness with intervals (`roughness`), and what changed between two
traces (`compare`) or two scans (`scans`). Read `profile` first, then `nodes`.
"""

# Names that other folders use, by module.
PUBLIC = {
    "compare.compare": ("Comparison",),
    "files.read": (
        "read_profile",
        "read_surface",
    ),
    "fine": (
        "ELEMENTS_PER_WAVE",
        "describe_lost_waves",
        "fine_fraction",
    ),
    "nodes": (
        "average_at_nodes",
        "is_note",
        "place_over_patch",
    ),
    "profile": (
        "Profile",
        "clean",
        "level",
        "resample_evenly",
    ),
    "quantity": (
        "LEVEL",
        "Quantity",
    ),
    "roughness.filter": ("mean_line",),
    "roughness.form": ("parse_form_option",),
    "roughness.parameters": ("abbott_curve",),
    "roughness.peaks": (
        "Moments",
        "PERSSON",
        "Peaks",
        "TraceMoments",
        "gaussian_peaks",
        "persson_stiffness",
        "trace_moments",
    ),
    "roughness.report": (
        "RoughnessReport",
        "fitting_cutoff",
        "make_report",
    ),
    "roughness.spectrum": (
        "BAND",
        "Spectrum",
    ),
}
