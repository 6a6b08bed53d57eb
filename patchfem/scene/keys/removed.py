"""Options, keys and values that patchfem no longer takes, and what to use instead."""

REMOVING_VERSION = "patchfem 1.0"
REMOVED_METHODS = {  # removed values of accuracy.method
    name: f"'{name}' was removed in {REMOVING_VERSION}; use 'march' (studies/integrators compares the methods)"
    for name in ("duhamel", "newmark", "euler")
}
# Removed values of accuracy.quadrature.
REMOVED_QUADRATURES = {
    "exponential": f"'exponential' was removed in {REMOVING_VERSION}; use 'merged'"
}
REMOVED_KEYS = {
    f"accuracy.{name}": f"this key of method '{method}' was removed in {REMOVING_VERSION}; use method 'march' without it"
    for name, method in (
        ("convergence", "duhamel"),
        ("convergence_tolerance", "duhamel"),
        ("stick_speed", "newmark"),
    )
}
REMOVED_KEYS["wear.scheme"] = (
    f"this key was removed in {REMOVING_VERSION}; leave it out: contact and wear are always solved together in each jump"
)
REMOVED_KEYS["structure.mode.lateral"] = (
    "this key was removed in patchfem 1.1, because no run could use it; leave it out: the patch slides along x alone"
)
REMOVED_NASTRAN = "reading files of Nastran was removed in patchfem 2.0; convert the matrix, with pyNastran for example"
REMOVED_OPTIONS = {  # advice for each removed (verb, option)
    (
        "profile",
        "--level",
    ): "read the material ratio of a level from the Abbott curve of the page (-o)",
    (
        "profile",
        "--ratios",
    ): "read the heights of two material ratios from the Abbott curve of the page (-o)",
    ("profile", "--tip"): "compare the tip radius with 1/rms_curvature, which profile prints",
    (
        "report",
        "--measured",
    ): "convert the file with `patchfem import FILE -o table.csv` and plot table.csv together "
    "with result.nc of the run in a plotting program",
    (
        "sweep",
        "--device",
    ): "batches of cases run on the processor; share them by -j N or --executor dask",
}

# advice for each (verb, option) that 2.0 removed
REMOVED_OPTIONS_2 = {
    (
        "fit",
        "--placebo",
    ): "set another value of the key with --set and compare the scores of the fits",
    (
        "fit",
        "--from-patch",
    ): "run the scene with its patch, or fit the law of a point to a loop that `run` and `export` wrote",
    ("fit", "--amplitudes"): "leave it out: it belonged to --from-patch",
    ("export", "--of"): "leave it out: choose the field in ParaView",
}


def describe_removed_option(verb: str, option: str, name: str) -> str:
    """State that an option was removed and what to do instead, or return "" if it was not removed.

    Parameters
    ----------
    verb, option : str
        Words of the command line, such as "profile" and "--tip".
    name : str
        Option as the sentence calls it, such as "profile --tip" or, in Python, "profile: tip".
    """
    if (verb, option) in REMOVED_OPTIONS_2:
        return f"{name} was removed in patchfem 2.0; {REMOVED_OPTIONS_2[verb, option]}"
    if (verb, option) not in REMOVED_OPTIONS:
        return ""
    return f"{name} was removed in {REMOVING_VERSION}; {REMOVED_OPTIONS[verb, option]}"
