"""Keys, files and options that patchfem no longer takes: one table, with what to use instead."""

# Version that removed a key, files or an option of a verb, and what to use instead. Most names that 1.0.0 removed have no
# row: they are as unknown as any other.
REMOVED_NAMES = {
    "accuracy.convergence": ("1.0", "use accuracy.method = 'march' without it"),
    "structure.interface.lateral": ("1.3", "leave it out: an interface slides along x alone"),
    "structure.mode.lateral": ("1.1", "leave it out: the patch slides along x alone"),
    "friction.breakaway": (
        "1.4",
        "leave it out; law 'iwan' or 'elastic-plastic' does not creep under an oscillating force",
    ),
    "structure.interface.breakaway": (
        "1.4",
        "leave it out; law 'iwan' or 'elastic-plastic' does not creep",
    ),
    "approach of a piece that can rotate": (
        "1.4",
        "give contact.load, or leave out [contact.load_line] and contact.holder.rotational_stiffness",
    ),
    "files of Nastran": ("1.3", "convert the matrix, with pyNastran for example"),
    "fit --placebo": (
        "1.2",
        "set another value of the key with --set and compare the scores of the fits",
    ),
    "fit --from-patch": (
        "1.2",
        "run the scene with its patch, or fit the law of a point to a loop that `run` and `export` wrote",
    ),
    "fit --amplitudes": ("1.2", "leave it out: it belonged to --from-patch"),
    "export --of": ("1.2", "leave it out: choose the field in ParaView"),
}


def describe_removed(name: str, shown: str = "this key") -> str:
    """State that something was removed and what to do instead, or return "" if it was not removed.

    Parameters
    ----------
    name : str
        Key of REMOVED_NAMES, such as "friction.breakaway" or "fit --placebo".
    shown : str
        What the sentence calls it, such as "fit --placebo" or, in Python, "fit: placebo".
    """
    if name not in REMOVED_NAMES:
        return ""
    version, instead = REMOVED_NAMES[name]
    return f"{shown} was removed in patchfem {version}; {instead}"
