"""Measured surfaces: read, levelled and cleaned, their roughness, and their wear.

In: files of traces and areal scans (`files`). Out: levelled heights averaged over the cells of the
interface nodes (`nodes`), roughness (`roughness`), and what changed between two traces or two scans
(`compare`). Read `profile` first, then `compare.records` and `compare.compare`.
"""

# Names that other folders use, by module.
PUBLIC = {
    "compare.compare": ("Options",),
    "files.read": (
        "read_profile",
        "read_surface",
    ),
    "areal": ("level",),
    "nodes": (
        "average_at_nodes",
        "place_over_patch",
    ),
    "profile": (
        "Profile",
        "clean",
        "resample_evenly",
    ),
    "roughness.filter": ("mean_line",),
    "roughness.peaks": (
        "Moments",
        "gaussian_peaks",
        "trace_moments",
    ),
    "roughness.report": (
        "fitting_cutoff",
        "make_report",
    ),
    "spectrum": ("describe_lost_waves",),
}
