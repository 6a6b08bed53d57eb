"""BibTeX entries to cite: the report, the program, and the sources of a scene's effects.

The entries stand in sources.bib. The keywords of an entry are the effects, named as in `effects.EFFECTS`, that it describes;
"friction.law=iwan" also matches interfaces with this law. An entry without keywords is always cited.
"""

import re
from collections.abc import Iterable
from importlib.resources import files
from typing import NamedTuple

from .. import __version__


class Publication(NamedTuple):
    """Entry of the bibliography: its BibTeX text, its fields by name, and the effects that it describes."""

    text: str
    fields: dict[str, str]
    effects: tuple[str, ...]


def read_sources() -> list[Publication]:
    """Return all entries of the bibliography."""
    bibliography = (files(__package__) / "sources.bib").read_text("utf-8")
    sources = []
    for text in bibliography.replace("VERSION", __version__).split("\n\n"):
        fields = dict(re.findall(r"^  (\w+) = \{(.*)\},?$", text, re.MULTILINE))
        effects = fields.get("keywords", "")
        sources.append(
            Publication(text.strip(), fields, tuple(effects.split(", ") if effects else ()))
        )
    return sources


def bibtex(effect_names: Iterable[str] = ()) -> str:
    """Return BibTeX entries for the report, for this program and for the sources of the named effects."""
    names = {name.replace("structure.interface.", "friction.") for name in effect_names}
    cited = [one for one in read_sources() if not one.effects or names.intersection(one.effects)]
    return "\n\n".join(one.text for one in cited) + "\n"
