"""BibTeX entries to cite: the report, the program, and the sources of a scene's effects."""

from collections.abc import Iterable

from .. import __version__

REPORT = r"""
@techreport{srinivasan1985,
  author = {Srinivasan, A. V. and Cassenti, B. N. and Cutts, D. G.},
  title = {Study of Characteristics of Dry Friction Damping},
  institution = {United Technologies Research Center},
  year = {1985}
}
"""
# the version is inserted
PROGRAM = r"""
@software{patchfem,
  author = {{The patchfem founders}},
  title = {{patchfem}: finite-element contact patches, nonlocal friction and the dynamics of the joint that rubs},
  version = {VERSION},
  year = {2026}
}
"""
# Effects, named as in `effects.EFFECTS` and separated by blanks, and their source; "friction.law=iwan" also
# matches interfaces with this law.
SOURCES = (
    (
        "contact",
        r"""
@article{gustafsson2020,
  author = {Gustafsson, T. and McBain, G. D.},
  title = {scikit-fem: A {Python} package for finite element assembly},
  journal = {Journal of Open Source Software},
  volume = {5(52)},
  pages = {2369},
  year = {2020},
  doi = {10.21105/joss.02369}
}
""",
    ),
    (
        "contact",
        r"""
@article{hueber2005,
  author = {H{\"u}eber, S. and Wohlmuth, B. I.},
  title = {A primal--dual active set strategy for non-linear multibody contact problems},
  journal = {Computer Methods in Applied Mechanics and Engineering},
  volume = {194},
  pages = {3147--3166},
  year = {2005},
  doi = {10.1016/j.cma.2004.08.006}
}
""",
    ),
    (
        "contact.asperities.law=hertz",
        r"""
@article{greenwood1966,
  author = {Greenwood, J. A. and Williamson, J. B. P.},
  title = {Contact of nominally flat surfaces},
  journal = {Proceedings of the Royal Society A},
  volume = {295},
  pages = {300--319},
  year = {1966},
  doi = {10.1098/rspa.1966.0242}
}
""",
    ),
    (
        "contact.asperities.law=exponential",
        r"""
@article{persson2007,
  author = {Persson, B. N. J.},
  title = {Relation between interfacial separation and load: a general theory of contact mechanics},
  journal = {Physical Review Letters},
  volume = {99},
  pages = {125502},
  year = {2007},
  doi = {10.1103/PhysRevLett.99.125502}
}
""",
    ),
    (
        "contact.shear",
        r"""
@article{mindlin1949,
  author = {Mindlin, R. D.},
  title = {Compliance of elastic bodies in contact},
  journal = {Journal of Applied Mechanics},
  volume = {16},
  pages = {259--268},
  year = {1949}
}
""",
    ),
    (
        "friction.law=nonlocal friction.law=convolution",
        r"""
@article{oden1983,
  author = {Oden, J. T. and Pires, E. B.},
  title = {Nonlocal and nonlinear friction laws and variational principles for contact problems in elasticity},
  journal = {Journal of Applied Mechanics},
  volume = {50},
  pages = {67--76},
  year = {1983},
  doi = {10.1115/1.3167019}
}
""",
    ),
    (
        "friction.law=iwan",
        r"""
@article{segalman2005,
  author = {Segalman, D. J.},
  title = {A four-parameter {Iwan} model for lap-type joints},
  journal = {Journal of Applied Mechanics},
  volume = {72},
  pages = {752--760},
  year = {2005},
  doi = {10.1115/1.1989354}
}
""",
    ),
    (
        "friction.law=bouc-wen",
        r"""
@article{wen1976,
  author = {Wen, Y.-K.},
  title = {Method for random vibration of hysteretic systems},
  journal = {Journal of the Engineering Mechanics Division},
  volume = {102},
  pages = {249--263},
  year = {1976}
}
""",
    ),
    (
        "friction.law=lugre",
        r"""
@article{canudas1995,
  author = {Canudas de Wit, C. and Olsson, H. and {\AA}str{\"o}m, K. J. and Lischinsky, P.},
  title = {A new model for control of systems with friction},
  journal = {IEEE Transactions on Automatic Control},
  volume = {40},
  pages = {419--425},
  year = {1995},
  doi = {10.1109/9.376053}
}
""",
    ),
    (
        "accuracy.method=harmonic",
        r"""
@article{cameron1989,
  author = {Cameron, T. M. and Griffin, J. H.},
  title = {An alternating frequency/time domain method for calculating the steady-state response of nonlinear dynamic systems},
  journal = {Journal of Applied Mechanics},
  volume = {56},
  pages = {149--154},
  year = {1989},
  doi = {10.1115/1.3176036}
}
""",  # noqa: E501
    ),
    (
        "wear",
        r"""
@article{archard1953,
  author = {Archard, J. F.},
  title = {Contact and rubbing of flat surfaces},
  journal = {Journal of Applied Physics},
  volume = {24},
  pages = {981--988},
  year = {1953},
  doi = {10.1063/1.1721448}
}
""",
    ),
)


def bibtex(effect_names: Iterable[str] = ()) -> str:
    """Return BibTeX entries for the report, for this program and for the sources of the named effects."""
    names = {name.replace("structure.interface.", "friction.") for name in effect_names}
    entries = [REPORT, PROGRAM.replace("VERSION", __version__)]
    entries += [entry for effects, entry in SOURCES if names.intersection(effects.split())]
    return "".join(entries).removeprefix("\n")
