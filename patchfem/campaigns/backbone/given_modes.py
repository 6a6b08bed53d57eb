"""Model of a backbone from a scene without modes, or from modes given beside the scene."""

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...core import PatchfemError
from ...formatting import format_quantity
from ...model.model import Model
from ...model.structure import compute_sticking_stiffness
from ...runs import joint
from ...scene.backbone_scene import ASSUMED_MASS, BackboneTables, GivenMode, parse_modes

# Fraction of the stiffness of a mode that a joint of unknown `slide` is assumed to contribute.
ASSUMED_JOINT_STIFFNESS_FRACTION = 0.1
# Note on a table of the scene that a backbone ignores
IGNORED_TABLE_NOTE = (
    "[{table}] is ignored: a backbone is the motion of a mode at every amplitude, without a drive"
)
# Note on modes whose `slide` is not given
ASSUMED_SIGNS_NOTE = (
    "every assumed `slide` is positive, so these modes are assumed to move the contact in the same direction when they "
    "move the output in the same direction; the curves of all methods depend on this assumption, so give the signs of "
    "`slide` if you know them, as 170 Hz:0.02:-0.02"
)


class PreparedModel(NamedTuple):
    """Model whose backbone is computed, and notes on what was ignored and assumed."""

    model: Model
    notes: tuple[str, ...]


def prepare_model(
    build: Callable[..., Model], modes: str | Iterable, sets: tuple[str, ...]
) -> PreparedModel:
    """Build the model of a backbone from a scene, with its own modes or modes given beside it.

    Modes without `slide` get one with which the sticking joint contributes ASSUMED_JOINT_STIFFNESS_FRACTION of
    their stiffness. The frequencies of modes given beside the scene are those of the bolted joint.

    Parameters
    ----------
    build : callable
        Function of `BackboneTables` and of a tuple of assignments that returns the model of the scene with these tables
        and changes; with None that of the scene as written.
    modes : str or iterable
        Text such as "120 Hz:0.01, 170 Hz:0.02", or tuples of frequency, damping ratio and slide; "" for the modes of
        the scene.
    sets : tuple of str
        Assignments "table.key=value" that change the scene.

    Returns
    -------
    PreparedModel
        Model, and notes on what was assumed and ignored.
    """
    tables = BackboneTables(parse_modes(modes) if modes else (), stuck=False)
    model = build(tables, sets)
    notes = tuple(IGNORED_TABLE_NOTE.format(table=name) for name in tables.ignored)
    if not tables.modes:
        return PreparedModel(model, notes)
    given_modes = tables.modes

    # The joint that was bolted in the modal test is that of the scene as written.
    stiffness, stiffer = _find_sticking_stiffness(
        build(BackboneTables(given_modes, stuck=False), None)
    )
    used_modes = given_modes
    if stiffness is not None:
        mass = model.rig.modes.mass
        used_modes = _assume_slides(given_modes, stiffness / mass)
        model = build(BackboneTables(used_modes), sets)
        # The error of the stiffness is an error of the assumed slides as well.
        if stiffer > stiffness:
            stiffer_modes = _assume_slides(given_modes, stiffer / mass)
            stiffer_rig = build(BackboneTables(stiffer_modes), sets).rig
            model = _attach_stiffer_rig(model, stiffer_rig)

    notes += _note_modes(used_modes, is_assumed=tables.is_assumed, is_stuck=stiffness is not None)
    if tables.assumes_mass and not tables.is_assumed:
        notes += (
            f"the modal mass is assumed to be {ASSUMED_MASS}, so the effect of a given `slide` on frequency and "
            "damping holds for this mass only; give yours as structure.moving_mass",
        )

    if any(mode.slide is None for mode in given_modes):
        notes += _note_slides(len(given_modes), stiffness)
        if sum(mode.slide is None for mode in given_modes) > 1:
            notes += (ASSUMED_SIGNS_NOTE,)
    return PreparedModel(model, notes)


def _attach_stiffer_rig(model: Model, stiffer_rig) -> Model:
    """Return a model of a bolted joint that takes its modes from another rig when its joint is stiffer by its error.

    The modes of `stiffer_rig` have the slides that were assumed for the stiffer joint.
    """
    structure = model.rig.structure
    build_rig = stiffer_rig.structure.bolted.build_rig
    bolted = structure.bolted._replace(build_stiffer_rig=build_rig)
    return replace(model, rig=replace(model.rig, structure=replace(structure, bolted=bolted)))


def _find_sticking_stiffness(model: Model) -> tuple[float, float] | tuple[None, None]:
    """Return the stiffness [N/m] of the sticking contact of a model, and its upper bound.

    The upper bound is the stiffness plus its error, which only a patch has. Both are None if the contact is rigid, if
    its stiffness cannot be computed, or if there is not exactly one interface.
    """
    interfaces = model.rig.friction.interfaces
    if len(interfaces) != 1 or model.friction is None:
        return None, None
    if model.patch is not None:
        stiffness, stiffer = joint.find_bolted_stiffness(model, joint.solve_patch(model))
        return (stiffness, stiffer) if 0 < stiffness < np.inf else (None, None)
    try:
        stiffness = compute_sticking_stiffness(interfaces[0], model.nominal_load)
        return stiffness, stiffness
    except PatchfemError:
        return None, None


def _assume_slides(
    modes: tuple[GivenMode, ...], stiffness_per_mass: float
) -> tuple[GivenMode, ...]:
    """Return the modes, with a `slide` for those that were given without it.

    It follows from the assumed contribution of the joint to the stiffness of the mode. `stiffness_per_mass` [1/s2] is
    the stiffness of the sticking contact divided by the modal mass.
    """
    fraction = _assumed_fraction(len(modes))
    completed = []
    for mode in modes:
        slide = mode.slide
        if slide is None:
            omega = 2 * np.pi * mode.frequency
            slide = omega * np.sqrt(fraction / stiffness_per_mass)
        completed.append(mode._replace(slide=slide))
    return tuple(completed)


def _assumed_fraction(n_modes: int) -> float:
    """Return the fraction of the stiffness of each mode that is assumed to be due to the joint."""
    # Largest sum, over all modes, of the fractions of stiffness that a joint is assumed to
    # contribute
    return min(ASSUMED_JOINT_STIFFNESS_FRACTION, 0.5 / n_modes)


def _note_modes(
    modes: tuple[GivenMode, ...], *, is_assumed: bool, is_stuck: bool
) -> tuple[str, ...]:
    """Return notes on modes that are not given in the scene.

    The modes stand for a scene without mode if `is_assumed`, else they were given beside it. `is_stuck` tells whether
    their frequencies are those with a stuck contact.
    """
    names = ", ".join(_describe_mode(mode) for mode in modes)
    place = "with the contact stuck" if is_stuck else "without the contact"
    if not is_assumed:
        return (f"the modes are those given beside the scene ({place}): {names}",)
    return (
        f"the scene has no mode, so this is an example, a mode {place} of {names}: the relative "
        "change of its frequency and the damping by friction hold for any frequency and mass at the "
        "same motion of the contact; for your own modes, give their frequencies and damping ratios, "
        'as --modes "120 Hz:0.01, 170 Hz:0.02"',
    )


def _describe_mode(mode: GivenMode) -> str:
    """Describe a mode by its frequency, its damping ratio and its slide."""
    text = f"{format_quantity(mode.frequency, 'Hz', 4)}, damping ratio {mode.damping:.3g}"
    return text if mode.slide is None else f"{text}, slide {mode.slide:.3g}"


def _note_slides(n_modes: int, stiffness: float | None) -> tuple[str, ...]:
    """Return a note on the assumed `slide` of modes.

    `stiffness` [N/m] is that of the sticking contact, or None if the contact is rigid.
    """
    if stiffness is None:
        return (
            "`slide` is assumed to be 1 for each mode given without it: the contact moves as far as the output",
        )
    fraction = 100 * _assumed_fraction(n_modes)
    return (
        f"for each mode given without it, `slide` is assumed such that the sticking joint, of "
        f"{format_quantity(stiffness, 'N/m', 3)}, contributes {fraction:.3g} % of the stiffness of the mode. This part "
        "grows with the square of `slide`, as do about the fall of the frequency and the damping by friction; the "
        f"amplitude of slip is inversely proportional: half the `slide` gives {fraction / 4:.3g} % and twice the "
        "amplitude. Give the motion of the contact per motion of the output as a third number, as 120 Hz:0.01:0.02",
    )
