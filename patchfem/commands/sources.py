"""BibTeX entries to cite: the report, the program, and the sources of a scene's effects."""

from collections.abc import Iterable

from .. import __version__

# kind, key and fields of an entry of a bibliography
Entry = tuple[str, str, dict[str, str]]
REPORT = (
    "techreport",
    "srinivasan1985",
    {
        "author": "Srinivasan, A. V. and Cassenti, B. N. and Cutts, D. G.",
        "title": "Study of Characteristics of Dry Friction Damping",
        "institution": "United Technologies Research Center",
        "year": "1985",
    },
)
PROGRAM = (
    "software",
    "patchfem",
    {
        "author": "{The patchfem founders}",
        "title": "{patchfem}: finite-element contact patches, nonlocal friction and the dynamics of the joint that rubs",
        "version": __version__,
        "year": "2026",
    },
)


def _article(
    key: str, author: str, title: str, journal: str, where: str, year: int, doi: str = ""
) -> Entry:
    """Return the bibliography entry of a journal article; `where` has the form "volume:pages"."""
    volume, pages = where.split(":")
    fields = {
        "author": author,
        "title": title,
        "journal": journal,
        "volume": volume,
        "pages": pages,
        "year": str(year),
    }
    return "article", key, fields | ({"doi": doi} if doi else {})


APPLIED_MECHANICS = "Journal of Applied Mechanics"
# Effects, named as in `effects.EFFECTS`, and their source; "friction.law=iwan" also
# matches interfaces with this law.
SOURCES = (
    (
        ("contact",),
        _article(
            "gustafsson2020",
            "Gustafsson, T. and McBain, G. D.",
            "scikit-fem: A {Python} package for finite element assembly",
            "Journal of Open Source Software",
            "5(52):2369",
            2020,
            "10.21105/joss.02369",
        ),
    ),
    (
        ("contact",),
        _article(
            "hueber2005",
            'H{\\"u}eber, S. and Wohlmuth, B. I.',
            "A primal--dual active set strategy for non-linear multibody contact problems",
            "Computer Methods in Applied Mechanics and Engineering",
            "194:3147--3166",
            2005,
            "10.1016/j.cma.2004.08.006",
        ),
    ),
    (
        ("contact.asperities.law=hertz",),
        _article(
            "greenwood1966",
            "Greenwood, J. A. and Williamson, J. B. P.",
            "Contact of nominally flat surfaces",
            "Proceedings of the Royal Society A",
            "295:300--319",
            1966,
            "10.1098/rspa.1966.0242",
        ),
    ),
    (
        ("contact.asperities.law=exponential",),
        _article(
            "persson2007",
            "Persson, B. N. J.",
            "Relation between interfacial separation and load: a general theory of "
            "contact mechanics",
            "Physical Review Letters",
            "99:125502",
            2007,
            "10.1103/PhysRevLett.99.125502",
        ),
    ),
    (
        ("contact.shear",),
        _article(
            "mindlin1949",
            "Mindlin, R. D.",
            "Compliance of elastic bodies in contact",
            APPLIED_MECHANICS,
            "16:259--268",
            1949,
        ),
    ),
    (
        ("friction.law=nonlocal", "friction.law=convolution"),
        _article(
            "oden1983",
            "Oden, J. T. and Pires, E. B.",
            "Nonlocal and nonlinear friction laws and variational principles "
            "for contact problems in elasticity",
            APPLIED_MECHANICS,
            "50:67--76",
            1983,
            "10.1115/1.3167019",
        ),
    ),
    (
        ("friction.law=iwan",),
        _article(
            "segalman2005",
            "Segalman, D. J.",
            "A four-parameter {Iwan} model for lap-type joints",
            APPLIED_MECHANICS,
            "72:752--760",
            2005,
            "10.1115/1.1989354",
        ),
    ),
    (
        ("friction.law=bouc-wen",),
        _article(
            "wen1976",
            "Wen, Y.-K.",
            "Method for random vibration of hysteretic systems",
            "Journal of the Engineering Mechanics Division",
            "102:249--263",
            1976,
        ),
    ),
    (
        ("friction.law=lugre",),
        _article(
            "canudas1995",
            'Canudas de Wit, C. and Olsson, H. and {\\AA}str{\\"o}m, K. J. and Lischinsky, P.',
            "A new model for control of systems with friction",
            "IEEE Transactions on Automatic Control",
            "40:419--425",
            1995,
            "10.1109/9.376053",
        ),
    ),
    (
        ("accuracy.method=harmonic",),
        _article(
            "cameron1989",
            "Cameron, T. M. and Griffin, J. H.",
            "An alternating frequency/time domain method for "
            "calculating the steady-state response of nonlinear dynamic systems",
            APPLIED_MECHANICS,
            "56:149--154",
            1989,
            "10.1115/1.3176036",
        ),
    ),
    (
        ("wear",),
        _article(
            "archard1953",
            "Archard, J. F.",
            "Contact and rubbing of flat surfaces",
            "Journal of Applied Physics",
            "24:981--988",
            1953,
            "10.1063/1.1721448",
        ),
    ),
)


def bibtex(effect_names: Iterable[str] = ()) -> str:
    """Return BibTeX entries for the report, for this program and for the sources of the named effects."""
    names = {name.replace("structure.interface.", "friction.") for name in effect_names}
    entries = [
        REPORT,
        PROGRAM,
        *(entry for effects, entry in SOURCES if names.intersection(effects)),
    ]
    return "\n".join(_entry(*one) for one in entries)


def _entry(kind: str, key: str, fields: dict[str, str]) -> str:
    """Return a bibliography entry in BibTeX format."""
    lines = ",\n".join(f"  {name} = {{{text}}}" for name, text in fields.items())
    return f"@{kind}{{{key},\n{lines}\n}}\n"
