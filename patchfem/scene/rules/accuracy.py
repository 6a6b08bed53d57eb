"""Rules of [accuracy]: numerical settings that a scene fixes must have an effect on its run."""

from typing import NamedTuple

from ...effects import LAWS, law_has_trait, needs_bond_list
from ..keys.accuracy import Accuracy
from ..keys.tables import Tables
from .contact import iterate_patches
from .methods import (
    MotionFeatures,
    find_climbed_grooves,
    find_load_change_key,
    find_motion_features,
    has_shear_elements,
)
from .scene_draft import SceneDraft
from .view import UNKNOWN_VALUE


class SettingScope(NamedTuple):
    """Kinds of scenes, solvers and friction laws for which a key of [accuracy] has an effect.

    - kinds: names of kinds of scenes, separated by blanks.
    - methods: names of methods and engines, separated by blanks. "auto" stands for the engines that the
      program may choose, "bench" for that of a bench.
    - trait: trait of `effects.LAWS[...].traits` that a friction law of the scene must have; "" for any law.
    """

    kinds: str
    methods: str
    trait: str = ""


# Scope in which each numerical setting (a key of [accuracy]) has an effect.
SETTING_SCOPES: dict[str, SettingScope] = {
    "steps_per_cycle": SettingScope("bench rig linear", "auto bench march harmonic"),
    "tail": SettingScope("bench rig", "auto bench march", "bonds"),
    "merge": SettingScope("bench rig", "auto bench march", "bonds"),
    "shear_modes": SettingScope("bench rig", "auto bench march"),
}


def has_effect(setting: str, kind: str, method: str) -> bool:
    """Return whether a key of SETTING_SCOPES has an effect in a kind of scene.

    Parameters
    ----------
    setting : str
        Key of [accuracy].
    kind : str
        Kind of the scene.
    method : str
        Value of accuracy.method, or the engine that was chosen.
    """
    scope = SETTING_SCOPES[setting]
    return kind in scope.kinds.split() and method in scope.methods.split()


def list_fixed_settings(accuracy: Accuracy) -> list[str]:
    """Return the numerical settings that a table [accuracy] fixes."""
    return [setting for setting in SETTING_SCOPES if getattr(accuracy, setting) is not None]


def check_quadrature(draft: SceneDraft, kind: str) -> None:
    """Add a remark if the scene sets a method of `accuracy.quadrature` by which its bonds are not summed.

    Parameters
    ----------
    draft : SceneDraft
        Scene that is checked; it receives the remark.
    kind : str
        Kind of the scene. Bonds are summed only in a "bench" or a "rig".
    """
    scene = draft.values
    method = scene.accuracy.quadrature
    if method in ("auto", UNKNOWN_VALUE):
        return
    laws = [scene.friction, *scene.structure.interface]
    laws = [law for law in laws if law_has_trait(law.law, "bonds")]
    reason = ""
    if kind not in ("bench", "rig") or not laws:
        reason = "has no meaning without law 'nonlocal' and is not used"
    elif any(map(needs_bond_list, laws)):
        if method == "recursion":
            reason = "is not used, because a recursion needs reading 'stretch' and order 1"
    elif find_load_change_key(draft.tables) or find_climbed_grooves(draft.tables):
        if method != "recursion":
            reason = "is not used, because the load changes: bonds are then summed by recursion"
    if reason:
        draft.add_remark("accuracy.quadrature", reason)


def check_settings(draft: SceneDraft, kind: str) -> None:
    """Add a remark to the draft on each numerical setting that is fixed but has no effect.

    `kind` is the kind of scene, such as "rig".
    """
    if kind and draft.tables.accuracy is not None:
        for setting, where in find_unused_settings(draft.tables, kind).items():
            draft.add_remark(
                f"accuracy.{setting}", f"is not used, because it has no effect {where}"
            )
        if draft.tables.accuracy.max_seconds is not None and not _is_repeated(draft, kind):
            draft.add_remark(
                "accuracy.max_seconds",
                "is not used, because this run is never repeated with a finer mesh or smaller steps",
            )


def list_repeated_axes(
    kind: str, *, has_wear: bool, has_automatic_mesh: bool, has_fixed_steps: bool
) -> tuple[str, ...]:
    """Return the axes along which a run that misses its tolerance is repeated with twice the resolution.

    A static patch is refined when it is pressed, wear has its own passes, and the steps of a rig are refined within a
    pass.

    Parameters
    ----------
    kind : str
        Kind of the run.
    has_wear : bool
        Whether the scene has [wear].
    has_automatic_mesh : bool
        Whether the mesh of a patch follows from the tolerance.
    has_fixed_steps : bool
        Whether the scene fixes the steps per cycle.
    """
    if kind == "patch" or has_wear:
        return ()
    has_free_steps = kind == "bench" and not has_fixed_steps
    return ("mesh",) * has_automatic_mesh + ("steps",) * has_free_steps


def _is_repeated(draft: SceneDraft, kind: str) -> bool:
    """Return whether a run of the draft, of this kind of scene, that misses its tolerance may be repeated."""
    tables = draft.tables
    # The steps of a rig are refined unless they are fixed. Other engines than the march solve a linear rig exactly.
    methods = {"rig": ("auto", "march"), "linear": ("march",)}.get(kind, ())
    if (tables.accuracy.method or "auto") in methods and not tables.accuracy.steps_per_cycle:
        return True
    patches = [patch for _, patch in iterate_patches(draft)]
    axes = list_repeated_axes(
        kind,
        has_wear=bool(tables.wear),
        has_automatic_mesh=any(one.element_size is None and one.mesh is None for one in patches),
        has_fixed_steps=bool(tables.accuracy.steps_per_cycle),
    )
    return bool(axes)


def find_unused_settings(tables: Tables, kind: str) -> dict[str, str]:
    """Return the numerical settings of the tables of a scene that have no effect, with the reason for each.

    Only settings that the scene fixes count. `kind` is the kind of scene, such as "rig".
    """
    accuracy = tables.accuracy
    method = "bench" if kind == "bench" else accuracy.method or "auto"
    unused = {}
    for setting in list_fixed_settings(accuracy):
        if kind not in SETTING_SCOPES[setting].kinds.split():
            where = f"in a {kind} scene"
        elif not has_effect(setting, kind, method):
            where = f"for method '{method}'" if kind != "bench" else "in a bench scene"
        else:
            motion = find_motion_features(tables, "rig" if kind == "bench" else kind)
            where = _find_reason_without_effect(setting, accuracy, motion)
        if where:
            unused[setting] = where
    return unused


def _find_reason_without_effect(setting: str, accuracy: Accuracy, motion: MotionFeatures) -> str:
    """Return why a setting has no effect on the laws and patches of a motion, or "" if it has an effect.

    `setting` is a key of the table `accuracy`.
    """
    trait = SETTING_SCOPES[setting].trait
    laws = [joint.law for joint in motion.joints]
    if trait and not any(law_has_trait(law.law, trait) for law in laws):
        return f"without law '{next(name for name in LAWS if law_has_trait(name, trait))}'"

    # Sums by recursion have neither a tail nor merged bonds.
    if trait == "bonds":
        engine = accuracy.quadrature
        if engine in ("direct", "recursion") or (engine, setting) == ("truncated", "merge"):
            return f"for quadrature '{engine}'"
        is_summed = engine != "auto" or any(map(needs_bond_list, laws))
        return "" if is_summed else "for a law that is summed by recursion"
    if setting != "shear_modes":
        return ""

    # Elements in closed form need no shear modes.
    if not motion.compliance:
        return "for pieces that are rigid in shear"
    changes = motion.load_change or motion.grooves or motion.bands_yaw or motion.lower_shape
    soft = [joint for joint in motion.joints if joint.compliance]
    if changes or not all(map(has_shear_elements, soft)):
        return ""
    return f"for law '{laws[0].law}' under a constant load (this case is solved exactly without the key)"
