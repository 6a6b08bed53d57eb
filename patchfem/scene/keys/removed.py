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
    "fit of responses": (
        "1.10",
        "write the modes of your modal analysis as dataset 55, list them in [[structure.mode]], or fit modes to the "
        "records over time with `patchfem import`",
    ),
    "modes as arrays": (
        "1.10",
        "write M = m I, K = m diag(omega^2) and C = 2 m diag(zeta omega) with the modal mass m, or list the modes in "
        "[[structure.mode]]",
    ),
    "value with a tolerance": ("1.10", "write the range as low..high"),
    "fit --placebo": (
        "1.2",
        "set another value of the key with --set and compare the scores of the fits",
    ),
    "fit --from-patch": (
        "1.2",
        "run the scene with its patch, or fit the law of a point to a loop that `run` and `export` wrote",
    ),
    "fit --amplitudes": ("1.2", "leave it out: it belonged to --from-patch"),
    "backbone --method decay": (
        "1.3",
        'run a release with drive.kind = "free", whose result has frequency and damping over the amplitude',
    ),
    "backbone --method all": ("1.3", "leave it out: both methods are the default"),
    "fit --offset": ("1.10", "subtract the offset from the record"),
    "fit --warm-up": (
        "1.10",
        "repeat the rows of the first cycle before the record, label them in a further column, and hold them out, as --hold "
        "cycle=1",
    ),
    "fit --resume": ("1.10", "repeat the fit with fewer --starts"),
    "fit --seed": ("1.10", "give more --starts"),
    "fit --unstable": (
        "1.10",
        "rows flagged U are lower bounds; hold them out with --hold flag=U, or delete the flag",
    ),
    "sweep --of": ("1.10", "choose the measure on the page, or its column of sweep.csv"),
    "plan --over": ("1.10", "give the values of one case with --set"),
    "import of mode shapes": ("1.10", "give the file as structure.file of the scene"),
    "import -o .uff": ("1.10", "estimate it with scipy.signal.csd from a table of the records"),
    "import --segment": ("1.10", "leave it out: modes are fitted to the time record"),
    "import --window": ("1.10", "leave it out: modes are fitted to the time record"),
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
