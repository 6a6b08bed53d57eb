"""Registry of the physical effects and methods that a scene can request.

An effect is a table of a scene, such as `contact.crown`, or the value of a key, such as `friction.law=iwan`. effects.toml
has a row with the module and the equation of each effect. Only the modules of the effects in a scene are imported.

Friction laws, gap shapes and waveforms have further columns. Those of a law are its keys in addition to `static`, its
supported features and its traits, as words separated by blanks. Those of a waveform are all its keys, and its traits,
which are fields of the class `Waveform`. Every law can be used in a bench, and in a rig with one interface under a constant
load. Optional features are:

- `shear`: elastic pieces ([contact.shear]);
- `exact`: steady motions of the whole interface as one rigid element;
- `pieces`: elements that stick or slip, for patches that slip part by part;
- `harmonic`: motions from event to event, and steady motions over one period, by a module of `event_driven.laws`;
- `march`: time steps (`time_steps.laws`).

Traits of laws:

- `set-valued`: the interface sticks rigidly below the friction limit;
- `bonds`: the law is the sum over bonds (2.17) with its readings and orders;
- `averaged`: the friction stress is an average over the pressure behind a point;
- `timeless`: the force does not depend on the sliding speed;
- `memoryless`: the force depends only on the current motion;
- `creeps`: the interface never sticks;
- `cells`: a continuous distribution of elements is discretised into cells.

`event_driven.laws` and `time_steps.laws` have their own lists of supported laws.

A gap shape has a table in `scene.keys.contact` and a function in `contact.gaps`. A waveform has a function in the table
`DRIVE_BUILDERS` of its module.
"""

import re
import tomllib
from importlib import import_module
from pathlib import Path
from typing import NamedTuple

from .exceptions import PatchfemError

# largest number of masses or modes of a rig, whose matrices are dense; defined here because parsing a scene must not
# import numpy
MAX_RIG_COORDINATES = 2000


class Effect(NamedTuple):
    """Physical effect or method that a scene can request.

    - module: module that computes the effect; "" if the effect requires no module.
    - equations: equations of the effect for the report page.
    - keys: required keys of a law or a waveform ("a|b" means one of two), and its optional keys.
    - supports: engines and features that support the law.
    - traits: traits of the law or the waveform.
    """

    module: str
    equations: str
    keys: tuple[str, str] = ("", "")
    supports: str = ""
    traits: str = ""


class Waveform(NamedTuple):
    """Waveform of the drive, whose traits are words of its row in effects.toml.

    Other modules use these traits and never compare the name.

    - name: value of `drive.waveform`; "" for a release, which has no waveform.
    - keys: required and optional keys of the table [drive], each separated by blanks.
    - is_sine: whether the drive is a single sine of constant amplitude and frequency.
    - has_levels: whether the drive is a sine whose amplitude takes the values of `drive.levels` in turn.
    - is_swept: whether the drive is a sine whose frequency varies from `drive.from` to `drive.to`.
    - is_step: whether the drive is a step at t = 0, after which the motion decays.
    - is_random: whether the drive is a random signal with a given spectral density.
    - is_for_base_only: whether the drive can only be a motion of the base, not a force.
    """

    name: str = ""
    keys: tuple[str, str] = ("", "")
    is_sine: bool = False
    has_levels: bool = False
    is_swept: bool = False
    is_step: bool = False
    is_random: bool = False
    is_for_base_only: bool = False

    def accepts_key(self, key: str) -> bool:
        """Return whether the waveform accepts a key of the table [drive]."""
        return key in re.findall(r"\w+", " ".join(self.keys))

    @property
    def has_steady_motion(self) -> bool:
        """Whether method `harmonic` can compute the steady-state motion, or a curve of such motions."""
        return self.is_sine or self.is_swept


def _read_effects() -> dict[str, Effect]:
    """Read the effects of effects.toml by name."""
    rows = tomllib.loads(Path(__file__).with_name("effects.toml").read_text("utf-8"))
    effects = {}
    for name, row in rows.items():
        keys = (row.pop("required", ""), row.pop("optional", ""))
        effects[name] = Effect(row.pop("module", ""), keys=keys, **row)
    return effects


EFFECTS = _read_effects()
# tables [[structure.interface]] have the same laws and readings as [friction]
EFFECTS |= {
    f"structure.interface.{name.removeprefix('friction.')}": effect
    for name, effect in EFFECTS.items()
    if name.startswith(("friction.law=", "friction.reading="))
}


def import_effect(name: str):
    """Import and return the module that computes the effect `name`, such as "contact.tilt"."""
    return import_module(EFFECTS[name].module)


def list_absent_effects(names) -> list[str]:
    """Return all effects except those in `names`, in the order of EFFECTS.

    Raises
    ------
    PatchfemError
        If a name has no entry in EFFECTS.
    """
    present = set(names)
    if unknown := sorted(present - set(EFFECTS)):
        raise PatchfemError(
            f"{unknown[0]}: a scene can ask for this effect, but it has no row in "
            "patchfem/effects.toml; add a row with its module and equation"
        )
    return [name for name in EFFECTS if name not in present]


def list_displayed_absent_effects(names, engine: str | None) -> list[str]:
    """Return the names of absent effects without the method that the program selected itself.

    `engine` is that method.
    """
    return [name for name in names if name != f"accuracy.method={engine}"]


def _select_values(key: str) -> dict[str, Effect]:
    """Return the effects that are the values of a key, such as "friction.law", by value."""
    values = {}
    for name, effect in EFFECTS.items():
        effect_key, _, value = name.partition("=")
        if effect_key == key:
            values[value] = effect
    return values


LAWS = _select_values("friction.law")
GAP_SHAPES = {
    name.removeprefix("contact."): effect
    for name, effect in EFFECTS.items()
    if effect.module == "patchfem.contact.gaps"
}
WAVEFORMS = {
    name: Waveform(name, effect.keys, **dict.fromkeys(effect.traits.split(), True))
    for name, effect in _select_values("drive.waveform").items()
}
NO_WAVEFORM = Waveform()  # waveform of a release and of an unknown name


def find_waveform(drive) -> Waveform:
    """Return the waveform of a [drive] table.

    Returns NO_WAVEFORM without a drive, for free motion, and for an unknown name.
    """
    if drive is None or drive.kind == "free":
        return NO_WAVEFORM
    return WAVEFORMS.get(drive.waveform, NO_WAVEFORM)


def law_has_trait(law: str | None, trait: str) -> bool:
    """Return whether a friction law has a trait, such as "bonds", or False for an unknown law."""
    return law in LAWS and trait in LAWS[law].traits.split()


def law_takes_key(law: str | None, key: str) -> bool:
    """Return whether a friction law accepts a key; True for an unknown law."""
    return law not in LAWS or key in " ".join(LAWS[law].keys).replace("|", " ").split()


def law_takes_stiffness_or_length(law: str | None) -> bool:
    """Return whether a law accepts either a stiffness or a bond length, which determines it."""
    return law in LAWS and "bond_length|stiffness" in LAWS[law].keys[0].split()


def needs_bond_list(friction) -> bool:
    """Return whether a [friction] table requires the sum over all bonds instead of a recursion."""
    return law_has_trait(friction.law, "bonds") and (
        friction.reading == "report" or friction.order not in (1, None)
    )


def has_return_map(friction) -> bool:
    """Return whether time steps can integrate the law of a [friction] table."""
    return "march" in LAWS[friction.law].supports.split()


def law_supports(friction, feature: str) -> bool:
    """Return whether the law of a [friction] table supports an engine or a feature; a sum over all bonds supports none."""
    return not needs_bond_list(friction) and feature in LAWS[friction.law].supports.split()


def describe_law(friction) -> str:
    """Return the name of the law of a [friction] table for use in a message.

    The name includes the reading or the order if it requires the sum over all bonds.
    """
    if not needs_bond_list(friction):
        return f"law '{friction.law}'"
    if friction.reading == "report":
        return f"law '{friction.law}' of reading 'report'"
    return f"law '{friction.law}' of order {friction.order:g}"


def name_laws_with_key(key: str) -> str:
    """Return the names of the laws that accept a key, such as "coulomb and nonlocal"."""
    return join_words((name for name in LAWS if law_takes_key(name, key)), "and")


def suggest_laws(feature: str, other_features: str = "", friction=None) -> str:
    """Return advice to use a law that supports a feature, such as "use law 'coulomb' or 'tanh'".

    Parameters
    ----------
    feature : str
        Feature that the current law does not support.
    other_features : str
        Further features that the suggested laws must support, separated by blanks.
    friction : table or None
        Current [friction] table. If only its reading or its order is unsupported, a change of these is suggested first.

    Returns
    -------
    str
    """
    required = {feature, *other_features.split()}
    laws = [name for name, law in LAWS.items() if required <= set(law.supports.split())]
    instead = ""
    if friction is not None and needs_bond_list(friction) and friction.law in laws:
        instead = 'reading = "stretch" with order = 1, or '
        laws.remove(friction.law)
    quoted = [f"'{name}'" for name in laws]
    return f"use {instead}law {join_words(quoted, 'or')}"


def describe_unsupported(combination: str, remedy: str) -> str:
    """Return the message for a combination of effects that is not supported, with its remedy."""
    if combination.startswith("with "):
        return f"not supported yet {combination}; {remedy}"
    return f"{combination} is not supported yet; {remedy}"


def join_words(words, conjunction: str) -> str:
    """Join words with commas, and the last one with a conjunction."""
    *first, last = words
    return f"{', '.join(first)} {conjunction} {last}" if first else last
