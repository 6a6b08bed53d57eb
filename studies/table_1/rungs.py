"""Which models of the rig are held against Table 1, and how: the recipe of the ladder, fixed before any score of it.

A rung is a scene with its free keys, each between ends that a rig may have (a spring, a damper and an offset may be 0);
a reading is what the accelerometer is taken to have shown of the computed acceleration. Every rung is fitted to 143 Hz
alone, then predicts 135, 150 and 155 Hz; those of `each` are also fitted to all rows and to all but one frequency at a
time. A start is the best of SCREEN random points, by training readings alone. Further starts are the best fits to the
same rows of what a rung CONTAINS, and the best end with each number that may be 0 at 0: both were added when the first
scores showed that eight random starts can find a valley twice and miss a better one, which a smaller rung had found. No
start saw anything but training readings: where 143 Hz is a part of these, the fit to 143 Hz is a start and half as many
random ones do. The number of random starts doubles, from `starts` up to `most`, until two
starts end in the best valley; a record says where that failed. Rows flagged U count as lower bounds in a fit and as
they stand in a score. What climbs grooves is marched from rest, with fewer starts.

"peak x stuck" takes its factor from the training rows of its own fit: the mean of acceleration over input at the lowest
level of the frequency where that is least, for a block that does not slide shows the input itself.

26 lbf over 1.194 kg is an assumption; the rows determine load over mass alone. The rungs up to grooves are the best of
sixty that another program tried on these same rows. "path of Fig. 27" and "damper" were tried by another program too,
from eight starts; rods, weight, wear and pads were tried by nobody. The numbers are blind to what is held out, the
choice of models is not.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import pi
from pathlib import Path

from derived import Derived, FitRequest, Number, rods

from patchfem.scene import BOUNDS_FORM, Scene, load, loads, read_assignments

FOLDER = Path(__file__).parent
TABLE = FOLDER.parent / "rig" / "table1.csv"
PREDICTED_ROWS = "frequency=135 Hz,150 Hz,155 Hz"
STARTS = 8  # random starts of a fit
MAX_STARTS = 16  # largest number of random starts
SCREEN = 8  # random points per start; the descent begins at the best of them
SEED = 0  # seed of the random starts
POINT = (
    '[normal]\nload = "26 lbf"\n\n[friction]\nlaw = "elastic-plastic"\nbond_length = "0.243 um"\n'
)
GAIN = "measured.acceleration_gain=0.5..3"
STUCK_READING = "peak x stuck"
READINGS = {  # {name: (values for --set, free keys of the kind of reading)}
    "peak": ((), ()),
    "peak x gain": ((), (GAIN,)),
    STUCK_READING: (
        ("measured.acceleration_gain=1.2375",),
        (),
    ),  # gain at 143 Hz; each fit replaces it by that of its training readings
    "fundamental x gain": (("measured.reading=fundamental",), (GAIN,)),
    "fundamental x sqrt2": (
        ("measured.reading=fundamental", "measured.acceleration_gain=1.4142135623730951"),
        (),
    ),
}
ROOT2 = "fundamental x sqrt2"
# kinds of readings in the order of the campaign
READING = (
    "peak",
    STUCK_READING,
    ROOT2,
    "peak x gain",
    "fundamental x gain",
)
FRICTION = "friction.static=0.1..1.5"
YAW = "structure.mode.yaw.slide=0..0.5"
SPRING = "structure.bonded.stiffness=0 N/m..2e7 N/m"
DAMPER = "structure.bonded.damping=0 N s/m..10000 N s/m"
YAW_SEEN = "structure.mode.yaw.accelerometer=-1..1"
LOAD = "normal.load=15 lbf..50 lbf"
AMPLITUDE = ("normal.grooves.amplitude", "2 um..14 um")
NO_SPRING = "structure.bonded.stiffness=0 N/m"
NO_DAMPER = "structure.bonded.damping=0 N s/m"
MASS = 1.19396625  # [kg] mass of the block
OMEGA = 2 * pi * 143  # [rad/s] angular frequency of the axial mode
AXIAL_DAMPING = 0.003  # damping ratio of the axial mode
# spring and damper of a critically damped mode at 148 Hz
FIG_27 = (
    f"structure.bonded.stiffness={MASS * OMEGA**2 * ((148 / 143) ** 2 - 1)!r} N/m",
    f"structure.bonded.damping={2 * MASS * (2 * pi * 148 - AXIAL_DAMPING * OMEGA)!r} N s/m",
)
# load / length of a cable of 20 mm or more
PENDULUM = f"structure.bonded.stiffness=0 N/m..{26 * 4.4482216152605 / 0.02!r} N/m"
PROTOCOLS = ("all", "without 135", "without 143", "without 150", "without 155")
FOUR = ("peak", "peak x gain", "fundamental x gain", ROOT2)
FIVE = ("peak", "peak x gain", STUCK_READING, "fundamental x gain", ROOT2)


@dataclass(frozen=True, slots=True)
class Rung:
    """A model: scene file; free keys; --set strings; point: one elastic-plastic point in the place of the patch;
    readings of the fits to 143 Hz; each: those that are also fitted to all and to all but one frequency; starts, most:
    first and last number of starts; numbers: free numbers that are no keys, from which `derive` makes --set strings;
    worn: whether friction follows the wear of the columns before, by its last number."""

    scene: str
    free: tuple
    sets: tuple = ()
    point: bool = False
    readings: tuple = FOUR
    each: tuple = ()
    starts: int = STARTS
    most: int = MAX_STARTS
    numbers: tuple = ()
    derive: Callable | None = None
    worn: bool = False

    def text(self, reading: str, *more: str) -> Scene:
        """Return the scene with an interpretation and further --set strings."""
        path = FOLDER / self.scene
        text = path.read_text("utf-8")
        if self.point:
            text = POINT + text[text.index("static =") :]
        base = ("measured.acceleration_gain=1",) if "acceleration_gain" in text else ()
        sets = [*base, *self.sets, *READINGS[reading][0], *more]
        sets = list({one.partition("=")[0]: one for one in sets}.values())
        return loads(text, path, sets) if self.point else load(path, sets)

    def question(self, reading: str, *more: str) -> FitRequest:
        """Build the request to `campaigns.rows`: the scene, and the ranges of its free keys and of its reading.

        Grooves of another wavelength are searched between the amplitudes that bend alike, as far as they do not lock.
        """
        scene = self.text(reading, *more)
        wanted = list(read_assignments((*self.free, *READINGS[reading][1]), BOUNDS_FORM)[0])
        grooves = scene.normal.grooves if scene.normal is not None else None
        if grooves is not None:
            bends = (grooves.wavelength / 80e-6) ** 2
            most = 0.9 * grooves.wavelength / (2 * pi * scene.friction.static)
            for place, one in enumerate(wanted):
                if one.key == AMPLITUDE[0]:
                    high = min(bends * one.high, most)
                    wanted[place] = replace(one, low=bends * one.low, high=high)
        if self.numbers:
            return Derived(scene, [*wanted, *self.numbers], TABLE, self.derive)
        return FitRequest(scene, wanted, TABLE)


SECOND = (FRICTION, SPRING, DAMPER, YAW)
RUNGS = {
    "rigid Coulomb": Rung("rigid.toml", (FRICTION,), starts=2, most=8, each=("peak",)),
    "patch": Rung("second_path.toml", (FRICTION, YAW), (NO_SPRING, NO_DAMPER), starts=4, most=16),
    "weight on its cable": Rung(
        "second_path.toml",
        (FRICTION, PENDULUM, YAW),
        (NO_DAMPER,),
        True,
        readings=(STUCK_READING, ROOT2),
        each=(ROOT2,),
    ),
    "spring and yaw": Rung(
        "second_path.toml",
        (FRICTION, SPRING, YAW),
        (NO_DAMPER,),
        True,
        readings=FIVE,
        each=(ROOT2, STUCK_READING),
    ),
    "rods, spring and yaw": Rung(
        "rods.toml",
        (FRICTION, SPRING, YAW),
        readings=(ROOT2,),
        each=(ROOT2,),
        numbers=(Number("rods.share", 0.05, 0.9), Number("rods.mass", 0.01, 0.3)),
        derive=rods,
    ),
    "spring and yaw, worn": Rung(
        "second_path.toml",
        (FRICTION, SPRING, YAW),
        (NO_DAMPER,),
        True,
        readings=(ROOT2,),
        each=(ROOT2,),
        starts=4,
        most=8,
        numbers=(Number("worn.factor", 0.3, 3.0),),
        worn=True,
    ),
    "second path": Rung(
        "second_path.toml", SECOND, point=True, readings=FIVE, each=(STUCK_READING, ROOT2)
    ),
    "second path, patch": Rung(
        "second_path.toml", SECOND, readings=(STUCK_READING, ROOT2), starts=4, most=16
    ),
    "yaw in the accelerometer": Rung(
        "second_path.toml",
        (*SECOND, YAW_SEEN),
        point=True,
        readings=FIVE,
        each=(STUCK_READING, "peak x gain"),
    ),
    "damper, yaw seen": Rung(
        "second_path.toml",
        (FRICTION, DAMPER, YAW, YAW_SEEN),
        (NO_SPRING,),
        True,
        readings=(STUCK_READING, "peak x gain", ROOT2),
        each=(STUCK_READING,),
    ),
    "path of Fig. 27, yaw not seen": Rung(
        "second_path.toml",
        (FRICTION, YAW),
        FIG_27,
        True,
        readings=(STUCK_READING, ROOT2),
        each=(ROOT2,),
    ),
    "path of Fig. 27": Rung(
        "second_path.toml",
        (FRICTION, YAW, YAW_SEEN),
        FIG_27,
        True,
        readings=(STUCK_READING, "peak x gain", ROOT2),
        each=(STUCK_READING, "peak x gain", ROOT2),
    ),
    "grooves": Rung("grooves.toml", (LOAD, "=".join(AMPLITUDE)), starts=4, most=8, each=(ROOT2,)),
    "grooves, lift and yaw": Rung(
        "climbing.toml",
        (LOAD, "=".join(AMPLITUDE), YAW),
        starts=4,
        most=8,
        each=("fundamental x gain",),
    ),
}
CONTAINS = {  # {model: smaller models that it equals if some of its parameters are fixed}
    "second path": ("spring and yaw", "path of Fig. 27, yaw not seen"),
    "second path, patch": ("second path",),
    "spring and yaw": ("patch", "weight on its cable"),
    "spring and yaw, worn": ("spring and yaw",),
    "rods, spring and yaw": ("spring and yaw",),
    "path of Fig. 27": ("path of Fig. 27, yaw not seen",),
    "damper, yaw seen": ("path of Fig. 27",),
    "yaw in the accelerometer": (
        "second path",
        "spring and yaw",
        "path of Fig. 27",
        "damper, yaw seen",
    ),
}
# {kind of reading: kinds that it equals at a fixed gain}
CONTAINED_READINGS = {
    "peak x gain": ("peak", STUCK_READING),
    "fundamental x gain": (ROOT2,),
}
PLACEBOS = {  # {(model, kind of reading, protocol): values that replace those of the report}
    ("yaw in the accelerometer", STUCK_READING, "all"): tuple(
        f"structure.mode.yaw.frequency={one} Hz" for one in (73, 110, 122, 138)
    ),
    ("spring and yaw", ROOT2, "143"): tuple(
        f"structure.mode.yaw.frequency={one} Hz" for one in (73, 110, 122, 138)
    ),
    ("grooves", ROOT2, "143"): tuple(
        f"normal.grooves.wavelength={one} um" for one in (40, 60, 120, 200)
    ),
}


def variants() -> list:
    """List every (model, interpretation, protocol, placebo) of the recipe.

    The protocol is "143" or one of PROTOCOLS; the placebo is a --set string or "".
    """
    found = [(rung, reading, "143", "") for rung, one in RUNGS.items() for reading in one.readings]
    found += [(*key, placebo) for key, texts in PLACEBOS.items() for placebo in texts]
    found += [
        (rung, reading, protocol, "")
        for rung, one in RUNGS.items()
        for reading in one.each
        for protocol in PROTOCOLS
    ]
    return sorted(found, key=_rank)


# fits that are repeated with each frequency left out, in this order
FOLDS = (
    ("spring and yaw", ROOT2),
    ("path of Fig. 27", STUCK_READING),
    ("spring and yaw", STUCK_READING),
    ("path of Fig. 27, yaw not seen", ROOT2),
    ("path of Fig. 27", ROOT2),
    ("path of Fig. 27", "peak x gain"),
    ("damper, yaw seen", STUCK_READING),
    ("second path", STUCK_READING),
    ("second path", ROOT2),
    ("yaw in the accelerometer", STUCK_READING),
    ("yaw in the accelerometer", "peak x gain"),
)
# models that others contain are fitted first
FIRST_RUNGS = (
    "patch",
    "weight on its cable",
    "spring and yaw",
    "path of Fig. 27, yaw not seen",
    "path of Fig. 27",
    "damper, yaw seen",
    "second path",
    "yaw in the accelerometer",
)
SLOW = (
    "spring and yaw, worn",
    "second path, patch",
    "rods, spring and yaw",
    "rigid Coulomb",
    "grooves, lift and yaw",
    "grooves",
)


def _rank(variant: tuple) -> tuple:
    """Return the position of a variant in a campaign that may be stopped.

    First come quick fits to 143 Hz and the first two of FOLDS, then slow fits to 143 Hz, other FOLDS, free gains, other
    folds, all rows and placebos.
    """
    rung, reading, protocol, placebo = variant
    slow = SLOW.index(rung) + 1 if rung in SLOW else 0
    first = FOLDS.index((rung, reading)) if (rung, reading) in FOLDS else len(FOLDS)
    size = FIRST_RUNGS.index(rung) if rung in FIRST_RUNGS else 0, READING.index(reading)
    if protocol == "143" and not placebo:
        return 1.5 if slow else 2.5 if reading.endswith("gain") else 0, slow, *size
    if slow and not placebo:
        return 6 + (protocol == "all"), slow, *size
    if protocol == "all" or placebo:
        return 4 + bool(placebo), slow, *size
    return 1 if first < 2 else 2 if first < len(FOLDS) else 3, first, 0, 0
