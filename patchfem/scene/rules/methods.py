"""Features that each solver (engine) supports, and why accuracy.method cannot run a scene."""

from typing import NamedTuple

from ...effects import (
    Waveform,
    describe_law,
    describe_unsupported,
    find_waveform,
    has_return_map,
    law_has_trait,
    law_supports,
    law_takes_stiffness_or_length,
    suggest_laws,
)
from ..keys.contact import Contact
from ..keys.tables import Drive, Friction, Interface, Tables
from .scene_draft import SceneDraft
from .view import TableView


class Joint(NamedTuple):
    """Friction interface, described by the properties that decide which solvers support it.

    - law: table of its friction law.
    - compliance: key of the compliance that allows partial slip; "" if the patch slips as a whole.
    - is_uneven: whether the friction limits of an averaged pressure may differ in both directions, or between bands.
    """

    law: Friction
    compliance: str
    is_uneven: bool = False


class MotionFeatures(NamedTuple):
    """Features of a scene that decide which solvers can compute its motion.

    A feature that is a text is "" if the scene does not have it.

    - joints: the interfaces with friction.
    - load_change: cause of a load that changes, such as "with normal.amplitude".
    - bands_yaw: whether bands of cells of the patch slide independently.
    - spring: key of the nonlinear spring of the rig.
    - grooves: table of the grooves that the upper piece climbs.
    - waveform: record of the waveform of the drive, in `effects`; NO_WAVEFORM for a release and for a response curve.
    - drive: the table [drive].
    - lower_shape: shape that moves the pressure with the lower piece, such as "contact.crown.on = 'lower'".
    """

    joints: list[Joint]
    load_change: str
    bands_yaw: bool
    spring: str
    grooves: str
    waveform: Waveform
    drive: Drive | None = None
    lower_shape: str = ""

    @property
    def compliance(self) -> str:
        """Key of the compliance that enables partial slip, for the first patch that has one."""
        return next((joint.compliance for joint in self.joints if joint.compliance), "")

    def describe_features(self) -> dict[str, str]:
        """Return features of the motion that an engine may lack, by name, as the end of a message.

        A feature that the motion does not have is "".
        """
        words = {
            "no-law": "" if self.joints else "for law 'none'",
            "load": self.load_change,
            "yaw": "with bands that yaw" if self.bands_yaw else "",
            "yaw-levels": "",
            "yaw-parts": "",
            "parts": f"with {self.compliance}" if self.compliance else "",
            "grooves": f"with {self.grooves}" if self.grooves else "",
            "spring": f"with {self.spring}" if self.spring else "",
            "faces": "with several interfaces" if len(self.joints) > 1 else "",
            "levels": "with waveform 'levels'" if self.waveform.has_levels else "",
            # the pressure changes with the motion
            "pressed": "" if "normal.amplitude" in self.load_change else self.load_change,
        }
        if words["yaw"] and words["levels"]:
            words["yaw-levels"] = f"{words['yaw']} and waveform 'levels'"
        if words["yaw"] and words["parts"]:
            words["yaw-parts"] = f"{words['yaw']} {words['parts']}"
        return words


class EngineSupport(NamedTuple):
    """Features that a solver supports.

    - law: word of `effects.LAWS[...].supports` that every friction law must carry; "" for any law.
    - features: names of `MotionFeatures.describe_features`, separated by blanks.
    """

    law: str
    features: str


# Features that each engine of a rig supports; `runs.rig.engines` refers to these names. The rows "exact" and "piecewise"
# are the maps of a period by which a steady motion is found.
ENGINE_SUPPORT = {
    "event_driven": EngineSupport("events", "no-law yaw faces levels parts spring load grooves"),
    "exact": EngineSupport("exact", "no-law yaw faces"),
    "piecewise": EngineSupport("pieces", "parts faces"),
    "march": EngineSupport(
        "march", "no-law load yaw yaw-levels yaw-parts parts grooves spring faces levels pressed"
    ),
    "harmonic": EngineSupport("", "no-law parts grooves spring faces"),
}
METHOD_KEY = "accuracy.method"


def find_unsupported_feature(support: EngineSupport, motion: MotionFeatures) -> str:
    """Return the first feature of a motion that a solver does not support, or "" if it supports all.

    Parameters
    ----------
    support : EngineSupport
        Features of the solver, such as ENGINE_SUPPORT["march"].
    motion : MotionFeatures
        Features of the scene.

    Returns
    -------
    str
        End of a message, such as "for law 'dahl'" or "with several interfaces".
    """
    joint = _find_unsupported_joint(support, motion)
    if joint is not None:
        compliance = f" with {joint.compliance}" if joint.compliance else ""
        return f"for law '{joint.law.law}'{compliance}"
    for name, words in motion.describe_features().items():
        if words and name not in support.features.split():
            return words
    return ""


def _find_unsupported_joint(support: EngineSupport, motion: MotionFeatures) -> Joint | None:
    """Return the first interface whose friction law is not supported, or None if all are supported.

    The map of events ("exact") needs patches that slip as a whole. A law that sticks without displacement becomes
    spring-slider elements ("pieces") only with a compliance in series. Motions from event to event ("events") exist for
    all laws with a finite number of states, and for the elements of a patch that slips part by part; time steps ("march")
    for all laws with a return map.
    """
    for joint in motion.joints:
        is_rigid = not joint.compliance
        is_supported = not support.law or law_supports(joint.law, support.law)
        if support.law == "events":
            is_supported = _has_finite_state(joint, motion)
        elif support.law == "march":
            is_supported = has_return_map(joint.law)
        elif support.law == "exact":
            is_supported &= is_rigid and not joint.is_uneven
        elif support.law == "pieces" and is_rigid:
            is_supported &= not law_has_trait(joint.law.law, "set-valued")
        elif support.law == "pieces":
            is_supported = has_shear_elements(joint)
        if not is_supported:
            return joint
    return None


def has_shear_elements(joint: Joint) -> bool:
    """Return whether an interface that slips part by part is a set of parallel elements."""
    return law_supports(joint.law, "pieces") and law_supports(joint.law, "shear")


def _has_finite_state(joint: Joint, motion: MotionFeatures) -> bool:
    """Return whether the engine `event_driven` has the law of an interface (`joint`).

    `motion` tells what the scene has beside: grooves, a varying load, a shaped lower piece. The engine needs a state
    of a fixed number of values.
    """
    law = joint.law.law
    if not (law_supports(joint.law, "harmonic") or law_supports(joint.law, "exact")):
        return False
    if motion.grooves:
        return law_has_trait(law, "memoryless") and not (joint.compliance or joint.is_uneven)
    if joint.compliance:
        return has_shear_elements(joint)
    if motion.load_change:
        # Regimes of the elastic-plastic law have springs that come and go with the load.
        is_fixed = joint.law.stiffness and law_takes_stiffness_or_length(law)
        # Laws of the engine `event_driven` under a load that varies in time.
        return law in ("coulomb", "tanh", "elastic-plastic") and not is_fixed
    return not (motion.lower_shape or joint.is_uneven)


def check_accuracy_method(draft: SceneDraft, kind: str) -> None:
    """Report an accuracy.method that cannot solve the scene of a draft.

    A method that is not used in this `kind` of scene gets a remark.
    """
    method = draft.values.accuracy.method
    if method in list_unused_methods(kind):
        draft.add_remark(
            METHOD_KEY, f"= '{method}' has no meaning in a {kind} scene and is not used"
        )
    if method and kind in ("rig", "linear"):
        reason = _find_obstacle(method, find_motion_features(draft.tables, kind))
        if reason:
            draft.add_mistake(METHOD_KEY, reason)


def list_unused_methods(kind: str) -> tuple[str, ...]:
    """Return the methods that have no meaning in a kind of scene without time integration."""
    return ("exact", "march") if kind in ("patch", "bench") else ()


def find_motion_features(tables: Tables, kind: str) -> MotionFeatures:
    """Return the features of a scene, as far as its tables could be read.

    `kind` is the kind of scene. Only a "rig" has interfaces.
    """
    scene = TableView(tables)
    if kind != "rig":
        spring = find_nonlinear_spring(tables)
        return MotionFeatures([], "", False, spring, "", find_waveform(tables.drive), tables.drive)

    # A table whose law could not be read has its own mistake
    tables_of_laws = [tables.friction, *(view.table for view in scene.structure.interface)]
    laws = [law for law in tables_of_laws if law is not None and law.law is not None]
    joints = []
    for law in laws:
        joints.append(Joint(law, find_compliance_key(law, tables), _is_uneven(law, tables)))

    # The scene has one patch, or one for each interface, and any of them may have shapes on its lower piece.
    lower = list_lower_shapes(tables.contact)
    for number, interface in enumerate(scene.structure.interface):
        patch_key = f"structure.interface.{number}.contact"
        lower += list_lower_shapes(interface.table.contact, patch_key)
    load_change = find_load_change_key(tables) if laws else ""
    return MotionFeatures(
        joints=joints,
        load_change=load_change and f"with {describe_load_change(load_change)}",
        bands_yaw=bool(scene.contact.area and find_yaw_key(tables)),
        spring=find_nonlinear_spring(tables),
        grooves=find_climbed_grooves(tables),
        waveform=find_waveform(tables.drive),
        drive=tables.drive,
        lower_shape=f"{lower[0]} = 'lower'" if lower else "",
    )


def find_compliance_key(law: Friction, tables: Tables) -> str:
    """Return the key in the tables that allows partial slip under a law, or "" if there is none or nothing rubs."""
    owner = law if isinstance(law, Interface) else tables.contact
    # The numbers of a law without a patch may be arrays of many cases.
    if owner is None or (law is not None and law.static == 0):
        return ""
    return owner.compliance_key


def _is_uneven(law: Friction, tables: Tables) -> bool:
    """Return whether a law in the tables averages a pressure that may not be even along x, or not alike on all bands."""
    contact = law.contact if isinstance(law, Interface) else tables.contact
    if contact is None or not law_has_trait(law.law, "averaged"):
        return False
    is_shaped = bool(set(contact.shapes) - {"crown"} or contact.load_line or contact.mesh)
    return is_shaped or isinstance(law, Interface) or bool(find_yaw_key(tables))


def list_lower_shapes(contact: Contact | None, table_key: str = "contact") -> list[str]:
    """List the keys that place a gap shape of a patch on the lower piece, such as `contact.crown.on`.

    `table_key` is the dotted key of the patch.
    """
    shapes = contact.shapes if contact is not None else {}
    return [f"{table_key}.{name}.on" for name, shape in shapes.items() if shape.on == "lower"]


def find_nonlinear_spring(tables: Tables) -> str:
    """Return the key in the tables of the nonlinear spring of the rig, or "" if it has none."""
    structure = TableView(tables).structure
    if structure.stiffening:
        return "[structure.stiffening]"
    return "structure.bonded.wavelength" if structure.bonded.wavelength else ""


def find_climbed_grooves(tables: Tables) -> str:
    """Return the key in the tables of the grooves that the upper piece climbs.

    It is "" if there are none or they are flat.
    """
    for name in ("contact", "normal"):
        if TableView(tables)[name].grooves.amplitude:
            return f"[{name}.grooves]"
    return ""


def find_yaw_key(tables: Tables) -> str:
    """Return the key in the tables by which a mode yaws the patch, or "" if no mode does."""
    return _find_mode_key(tables, "yaw")


def find_heave_key(tables: Tables) -> str:
    """Return the key in the tables by which a mode heaves or pitches the patch, "" if none does."""
    structure = TableView(tables).structure
    keys = ("normal_at", "pitch_at") if structure.file else ()
    places = (f"structure.{key}" for key in keys if structure[key])
    return next(places, "") or _find_mode_key(tables, "normal", "pitch")


def find_load_change_key(tables: Tables) -> str:
    """Return the key in the tables that makes the load of a rig vary, or "" if it is constant."""
    is_varied = TableView(tables).normal.amplitude
    return "normal.amplitude" if is_varied else find_heave_key(tables)


def _find_mode_key(tables: Tables, *names: str) -> str:
    """Return the dotted key of the first value of a mode that is not 0, such as "structure.mode.0.yaw", or "".

    `names` are the keys of a mode that are looked at.
    """
    for index, mode in enumerate(TableView(tables).structure.mode):
        for name in names:
            if mode[name]:
                return f"structure.mode.{index}.{name}"
    return ""


def describe_load_change(key: str) -> str:
    """Return the cause of a changing load by its key: normal.amplitude, or "a mode's pitch"."""
    motion = key.rpartition(".")[2].removesuffix("_at")
    return key if key == "normal.amplitude" else f"a mode's {motion}"


def _find_obstacle(method: str, motion: MotionFeatures) -> str:
    """Return why a value of accuracy.method cannot compute a motion, or "" if it can.

    Parameters
    ----------
    method : str
        Value of accuracy.method.
    motion : MotionFeatures
        What the scene contains that engines may not support.

    Returns
    -------
    str
        Reason and remedy, for a message.
    """
    limits = {name: find_unsupported_feature(row, motion) for name, row in ENGINE_SUPPORT.items()}
    if method == "harmonic":
        return _find_harmonic_obstacle(motion, limits)

    # What each engine lacks.
    by_events = limits["event_driven"]
    in_steps = limits["march"]
    without_events = f"the motion cannot be computed from event to event {by_events}"
    law = motion.joints[0].law.law if motion.joints else None
    is_climbing = motion.grooves and not motion.compliance and law_has_trait(law, "set-valued")
    obstacles = {
        "auto": in_steps
        and by_events
        and f"{without_events}, nor in time steps {in_steps}; use another law",
        "exact": by_events and f"{without_events}; use 'march' or leave `method` out",
        "march": in_steps and f"'march' {in_steps} is not supported yet; leave `method` out",
    }

    # Steps over a stop or a release of rigid friction on a flank are inaccurate.
    if method == "march" and is_climbing and not in_steps:
        return (
            f"the motion over grooves under law '{law}' is computed from event to event; use 'exact' or leave "
            "`method` out"
        )
    return obstacles[method]


def _find_harmonic_obstacle(motion: MotionFeatures, limits: dict[str, str]) -> str:
    """Return the reason why the steady motion of a scene cannot be found by shooting over a period; "" if it can.

    `motion` has the features of the scene. `limits` has the feature that each engine does not support, or "", by engine.
    """
    wave = motion.waveform
    drive = TableView(motion.drive)
    if drive.kind == "free" or (wave.name and not wave.has_steady_motion):
        return (
            "'harmonic' finds only steady motion: under a sine, or over the frequencies of a sweep; use 'march' or leave "
            "`method` out"
        )
    if wave.is_swept and drive.kind == "base" and drive.table.displacement is not None:
        return (
            "'harmonic' needs a constant acceleration over a sweep; give drive.acceleration in place of "
            "drive.displacement"
        )

    # Method harmonic computes a period with the engine event_driven, so that it has the limits of this engine too.
    feature = limits["harmonic"]
    if not feature and limits["event_driven"]:
        feature = limits["event_driven"]
        if motion.grooves:
            feature = f"with {motion.grooves} {feature}"
        joint = _find_unsupported_joint(ENGINE_SUPPORT["event_driven"], motion)
        if joint is not None and not (motion.grooves or law_supports(joint.law, "harmonic")):
            remedy = f"use 'march', or {suggest_laws('harmonic', friction=joint.law)}"
            return describe_unsupported(f"'harmonic' with {describe_law(joint.law)}", remedy)
    return feature and describe_unsupported(f"'harmonic' {feature}", "use 'march'")
