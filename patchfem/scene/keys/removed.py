"""Keys, values, files and options that patchfem no longer takes: one table, with what to use instead."""

_OTHER_METHOD = "use 'march' (studies/integrators compares the methods)"
_WITHOUT_KEY = "use method 'march' without it"
# Version that removed a key, a value (key=value), files or an option of a verb, and what to use instead.
REMOVED_NAMES = {
    "accuracy.method=duhamel": ("1.0", _OTHER_METHOD),
    "accuracy.method=newmark": ("1.0", _OTHER_METHOD),
    "accuracy.method=euler": ("1.0", _OTHER_METHOD),
    "accuracy.quadrature=exponential": ("1.0", "use 'merged'"),
    "accuracy.convergence": ("1.0", _WITHOUT_KEY),
    "accuracy.convergence_tolerance": ("1.0", _WITHOUT_KEY),
    "accuracy.stick_speed": ("1.0", _WITHOUT_KEY),
    "wear.scheme": (
        "1.0",
        "leave it out: contact and wear are always solved together in each jump",
    ),
    "structure.interface.lateral": (
        "2.0",
        "leave it out: an interface slides along x alone",
    ),
    "structure.mode.lateral": (
        "1.1",
        "no run could use it; leave it out: the patch slides along x alone",
    ),
    "friction.breakaway": (
        "2.0",
        "leave it out; law 'iwan' or 'elastic-plastic' does not creep under an oscillating force",
    ),
    "structure.interface.breakaway": (
        "2.0",
        "leave it out; law 'iwan' or 'elastic-plastic' does not creep",
    ),
    "approach of a piece that can rotate": (
        "2.0",
        "give contact.load, or leave out [contact.load_line] and contact.holder.rotational_stiffness",
    ),
    "files of Nastran": ("2.0", "convert the matrix, with pyNastran for example"),
    "profile --level": (
        "1.0",
        "read the material ratio of a level from the Abbott curve of the page (-o)",
    ),
    "profile --ratios": (
        "1.0",
        "read the heights of two material ratios from the Abbott curve of the page (-o)",
    ),
    "profile --tip": ("1.0", "compare the tip radius with 1/rms_curvature, which profile prints"),
    "report --measured": (
        "1.0",
        "convert the file with `patchfem import FILE -o table.csv` "
        "and plot table.csv together with result.nc of the run in a plotting program",
    ),
    "sweep --device": (
        "1.0",
        "batches of cases run on the processor; share them by -j N or --executor dask",
    ),
    "fit --placebo": (
        "2.0",
        "set another value of the key with --set and compare the scores of the fits",
    ),
    "fit --from-patch": (
        "2.0",
        "run the scene with its patch, or fit the law of a point to a loop that `run` and `export` wrote",
    ),
    "fit --amplitudes": ("2.0", "leave it out: it belonged to --from-patch"),
    "export --of": ("2.0", "leave it out: choose the field in ParaView"),
}


def describe_removed(name: str, shown: str = "this key") -> str:
    """State that something was removed and what to do instead, or return "" if it was not removed.

    Parameters
    ----------
    name : str
        Key of REMOVED_NAMES, such as "accuracy.method=euler" or "profile --tip".
    shown : str
        What the sentence calls it, such as "profile --tip" or, in Python, "profile: tip".
    """
    if name not in REMOVED_NAMES:
        return ""
    version, instead = REMOVED_NAMES[name]
    return f"{shown} was removed in patchfem {version}; {instead}"
