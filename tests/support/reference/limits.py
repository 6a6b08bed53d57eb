"""Page of limits: permitted combinations, sizes and numbers, and what the models neglect."""

from importlib import import_module

from patchfem.effects import join_words
from patchfem.runs.patch.result import MAX_SMALL_STRAIN, MIN_REPORTED_NORMAL_COUPLING_RATIO
from patchfem.scene.keys.types import DIVISOR_KINDS, MAX_MAGNITUDE
from patchfem.scene.rules import support

from .keys import FOLDER, format_table, iterate_bounds, iterate_tables
from .tried import (
    BENCHES,
    METHODS,
    MORE,
    POINT,
    RIG,
    RIGS,
    SceneColumn,
    find_refusal,
    list_laws,
)

FILE = FOLDER / "LIMITS.md"
HEAD = """\
# Limits

`python tests/support/reference` generates this page. A scene that cannot run is refused before the run, with a message
that names the line, the key and an alternative; `patchfem check SCENE` prints it. The last section says what the models
neglect.
"""
SIZES = {  # Constant -> description of the quantity that it bounds.
    "scene.toml_text.MAX_SCENE_FILE_BYTES": "bytes of a scene file",
    "scene.rules.contact.MAX_INTERFACE_ELEMENTS": "number of elements along an interface that has element_size",
    "effects.MAX_RIG_COORDINATES": "number of masses or modes that a scene lists",
    "scene.assignments.MAX_CASES": "number of cases of a sweep",
    "inputs.tables.MAX_TABLE_BYTES": "bytes of a text file with a table",
    "inputs.records.MAX_RECORD_FILE_BYTES": "bytes of a laboratory file or a .mat file",
    "inputs.packed.MAX_UNPACKED_BYTES": "bytes of the content of a .npz, .mat or zip file after decompression",
    "mesh.files.MAX_FILE_BYTES": "bytes of a mesh file",
    "surface.files.content.MAX_SURFACE_FILE_BYTES": "bytes of the file of a scan, also after decompression",
    "surface.files.table.MAX_COORDINATE": "length of a trace [m]",
    "model.slide.MAX_BENCH_STEPS_PER_CYCLE": "steps per cycle of a prescribed slide",
    "runs.rig.engines.MAX_MARCH_STEPS_PER_CYCLE": (
        "steps per cycle of a time integration, if the tolerance determines the steps"
    ),
    "event_driven.cases.MAX_STEPS": "steps of a motion from event to event, by method `exact` or engine `event_driven`, "
    "beside 100 in each cycle",
    "structure.drive_sizes.MAX_STORED_SAMPLES": "number of samples at equal spacing that are stored of a whole release, at "
    "least 20 per cycle; of a longer release turning points and the last cycles",
    "structure.drive_sizes.MAX_EARLY_SAMPLES": "number of samples stored before the last cycles; longer records are "
    "thinned out",
}
LEFT_OUT = f"""\
**Two dimensions.** The pieces are sections in plane strain, or in plane stress with `contact.plane`. A note of every
patch gives the difference between plane strain and plane stress. Effects at the two ends of the width are neglected: square
pieces are about 10 % too stiff under the load (`patchfem plan --probe` computes it).
With `[contact.area]` the pieces are blocks in three dimensions. Their friction acts along x alone: slip across x and the
coupling of pressure and shear stress of unequal pieces are neglected. If a mode yaws the face, each band of cells slides
with the displacement of its middle.

**Small strains, linear elasticity.** The pieces are isotropic; plasticity, creep and heat are neglected. The coating is
bonded, and the far faces are fixed to rigid holders. A note appears if strains exceed {MAX_SMALL_STRAIN:g}.
The line of action of the load is assumed not to shift along x when a tall piece bends.

**No friction in the static patch.** The pressure is computed without shear stress at the interface. If both pieces have
the same elastic constants, shear stress does not change the pressure. For pieces of different materials, the effect of
shear stress on the pressure is neglected in runs with motion; a note appears if this coupling exceeds
{100 * MIN_REPORTED_NORMAL_COUPLING_RATIO:g} % of the compliance.

**Quasi-static pieces.** The pieces have no mass, so waves in the pieces are neglected. Only the modes of the rig have
inertia.

**Pressure fixed to a piece.** The pressure distribution moves with the piece that has the tilt, crown, step or profile
(key `on`). If the other piece slides beyond the pressed length, the overhanging part of this piece is not modelled. If
the slide leaves the patch, the outcome is `leaves_contact`. The motion is computed as if the contact continued beyond
the end, so the measures of such a run are not those of a joint.

**Grooves.** The surfaces are assumed to stay in contact on the flanks. If the inertia force of the lifted mass cancels
the whole load, the run ends with the outcome `leaves_grooves`. The upper piece is assumed to ride up all ridges at the
same time.

**Friction is local.** The friction of a point depends on the pressure and the slip of that point. The only exception is
law `convolution`, which averages the pressure over neighbouring points (Oden-Pires). The bonds of a point depend on the
path of this point, that is, on the total length that it has slid. Bonds of reading "stretch" and order 1 break as the
load falls; those of other orders and of reading "report" keep the load under which they formed. Temperature acts only
through eq. 2.13, with a surface temperature given in the scene. Heat from friction does not change the surface
temperature.

**Partial slip.** At constant load and tilt, partial slip is computed with elements that stick or slip. These elements
are exact if both pieces have the same elastic constants. Under a changing load the shear compliance is represented by
modes, whose number follows from the tolerance. If the cross-sections of the pieces differ, the effect of shear on the
pressure is neglected. If an interface of `[[structure.interface]]` has its own patch, the load and pressure of this
patch are constant, and the patch does not wear. If the friction of a point falls while the point slides (bonds that
weaken, equation 2.17 as printed), several states can be in equilibrium. The run then considers only the equilibrium
states that lie in the direction of its last time steps, and continues from the state with the lower energy. The energy
difference between the states counts as dissipated.

**Rigid friction.** If the kinetic friction of law `coulomb` is below the static one, a stop or a release at one of several
interfaces may leave more than one motion possible. The interface slips whose limit is reached first while all forces
change in proportion. Where the friction of some interfaces falls much more slowly than that of others, a joint may take
another motion. Interfaces that the modes cannot move apart share their force at rest in proportion to their friction.

**Directions.** The surfaces of an interface slide along one direction.

**Modes.** The rig is linear except for its joints, `[structure.stiffening]` and an interlocking spring of
`[structure.bonded]`. Damping is viscous; hysteretic damping that a file contains is treated as viscous damping. A
complex mode shape is replaced by its real part.

**Wear.** Every point wears by Archard's law with its own pressure and slip. Debris and heat are neglected; where debris
carries the load, the true track is narrower and deeper. A [track in Ti-6Al-4V](../../studies/benchmarks/ti64_wear.py)
is 2.1 times as deep and 0.53 times as wide as computed for its volume; those of five other tests are 0.54 to 0.64 times
as wide. A layer of `[contact.asperities]` keeps its stiffness and decay length, and the worn depth is a mean over its
waves; only with `hardness` do its tops lose height. They are pressed flat by the mean pressure of the unworn contact, and
the material that this moves fills no valleys. Wear changes the friction only through the table `[wear.friction]`, by the
same factors at all points of the patch. Within each jump of wear, a rig is assumed to repeat its last computed cycle. If
a face yaws, its slide and its wear are computed along x only; a note gives the motion of the ends of the patch across x.

**Errors.** Stated errors are estimates from coarser runs. The true numerical error is smaller than the stated error in
about 19 of 20 scenes. Stated errors do not include what the model neglects. A step in the gap makes the pressure peak
infinite; any computed value of this peak would depend on the mesh.

**Steady motions.** Method `harmonic` and backbones find only periodic motions.
"""


ADVICE = {  # Property of a joint in the advice of a row -> its meaning.
    "{other_pressure}": "the other pressure",
}
SHAPES = [
    f"`{header.replace('contact', 'patch')}`"
    for header, table in iterate_tables()
    if "on" in table.model_fields
]
MEANINGS = {  # Feature of a combination that is neither a key nor a law -> its keys.
    "rig": "`[drive]` with `[friction]` or `[[structure.interface]]`",
    "pressure in motion or of an interface": "a mode with heave or pitch, or `[[structure.interface]]`",
    "mode that turns or lifts a joint without places": "a mode with yaw and no `[contact.area]`, or a mode with heave or "
    "pitch and `[normal]`",
    "drive other than a sine": "`drive.kind` is `free`, or `drive.waveform` is not `sine`",
    "sensor apart from the output": "`accelerometer` or `gauge` of a `[[structure.mode]]` differs from its `output`",
    "output that bounds the motion": "`structure.travel`, `structure.stiffening`, `drive.kind` is `free`, or "
    "`drive.waveform` is `levels` or, unless `accuracy.method` is `harmonic`, `sweep`",
    "joint without a single stiffness": "`structure.masses`, `structure.reduced`, `structure.bonded.wavelength`, grooves, "
    "`normal.amplitude`, a mode with heave, pitch or yaw, or `[structure.interface.contact]`",
    "nonlinear asperities": "`patch.asperities.law` is `exponential` or `hertz`",
    "mode with heave or pitch": "`normal` or `pitch` of a `[[structure.mode]]` is not 0, or `structure.normal_at` or "
    "`structure.pitch_at` is given",
    "changing load or grooves": "a changing load, or grooves",
    "changing load": "in a rig: `normal.amplitude`, or a mode with heave or pitch",
    "kinetic below static": "law that sticks rigidly, with `kinetic` less than `static`",
    "bonds that no force can move": "law nonlocal with reading 'report', -1 < `order` < 0 and `initial_bonds` > 0",
    "partial slip": "`[patch.shear]`, `patch.asperities.tangential_ratio` or `patch.holder.tangential_stiffness`",
    "shape on the lower piece": "`on` is `lower` in " + join_words(SHAPES, "or"),
    "shapes on different pieces": "in a bench or a rig: `on` is `upper` in one and `lower` in another of "
    + join_words(SHAPES, "and"),
    "grooves": "`[contact.grooves]` or `[normal.grooves]`, with `amplitude` > 0",
    "interface": "`[[structure.interface]]`",
}  # fmt: skip
METHOD_COLUMNS = tuple(
    SceneColumn(f"`{method}`", POINT + RIG, (f"accuracy.method={method}",)) for method in METHODS
)
LAWS_TEXT = """\
Every friction law runs with every effect, in a rig and on a bench: partial slip of elastic pieces, pressure over a face,
bands that yaw, shapes on either piece, a load that oscillates, heave and pitch, grooves, nonlinear springs, several
interfaces with or without patches, and wear. The rows below are the exceptions, whatever the law unless they name one.
Method `auto` runs all of them. So does `march`, but for law 'coulomb' on grooves without partial slip, whose motion is
computed from event to event. Methods `exact` and `harmonic` need a state of a fixed size; they refuse law nonlocal with
another `order` than 1 or with reading 'report'. Both refuse heave and pitch, and `harmonic` also
loads that oscillate and bands that yaw; it needs a sine or a sweep of the frequency.
"""


def text() -> str:
    """Return the page patchfem/scene/LIMITS.md; scenes are assembled and checked, but not run."""
    if refused := find_refusals((*RIGS, *MORE, *BENCHES)):
        raise ValueError(f"a law is refused with an effect: {list(refused)}")
    body = [
        "## Laws",
        LAWS_TEXT.strip(),
        "## Combinations",
        "`patchfem check` refuses a scene in which all features of a row stand together. A feature in code style is a key, "
        "a table or a value of a key; `patch` stands for `contact` or `structure.interface.contact`.",
        _format_combinations(),
        "The features that are not keys are:",
        _format_features(),
        "## Numbers",
        f"The magnitude of a quantity must be at most {MAX_MAGNITUDE:g} in SI units. If the quantity is of a kind by "
        "which the program divides ("
        + ", ".join(sorted(DIVISOR_KINDS))
        + "), its magnitude must also be at least "
        f"{1 / MAX_MAGNITUDE:g}, or exactly 0 if the key accepts 0. The following keys have narrower bounds:",
        _format_bounds(),
        "## Sizes",
        _format_sizes(),
        "A run is refused if the memory that its unknowns and histories need exceeds the memory limit of "
        "the process. The message names the key whose value requires so much memory.",
        "## What the models leave out",
        LEFT_OUT.strip(),
    ]
    return "\n\n".join([HEAD.strip(), *body]) + "\n"


def format_messages() -> str:
    """Return the page of the messages with which methods refuse laws."""
    rows = [
        (law, words, "; ".join(sentences))
        for (law, words), sentences in find_refusals(METHOD_COLUMNS).items()
    ]
    parts = [
        "# Messages of unsupported combinations",
        "[Limits](../../../patchfem/scene/LIMITS.md) lists what is refused. The table below gives the message for each "
        "law that a method refuses.",
        "## Methods",
        format_table(("law", "with", "message"), rows),
    ]
    return "\n\n".join(parts) + "\n"


def find_refusals(columns: tuple) -> dict:
    """Return {(law, heading of a column): sentences} of the combinations that are refused."""
    rows = {}
    for law, keys in list_laws().items():
        for column in columns:
            if sentences := find_refusal(keys, column):
                rows[law, column.words] = sentences
    return rows


def _format_combinations() -> str:
    """Return the table of the features that no run supports together."""
    rows = []
    for names, advice in support.UNSUPPORTED_COMBINATIONS:
        features = [
            name if name in support.JOINT_FEATURES else f"`{name.replace('=', ' = ')}`"
            for name in names.split(", ")
        ]
        for word, meaning in ADVICE.items():
            advice = advice.replace(word, meaning)
        rows.append((features[0], "; ".join(features[1:]), advice))
    return format_table(("feature", "together with", "instead"), rows)


def _format_features() -> str:
    """Return the table that defines the features of combinations that are not keys."""
    names = {name: None for row, _ in support.UNSUPPORTED_COMBINATIONS for name in row.split(", ")}
    rows = [(name, MEANINGS[name]) for name in sorted(names) if name in support.JOINT_FEATURES]
    return format_table(("feature", "keys"), rows)


def _format_bounds() -> str:
    """Return the table of permitted values."""
    return format_table(
        ("key", "permitted values"), [(f"`{key}`", kind) for key, kind in iterate_bounds()]
    )


def _format_sizes() -> str:
    """Return the table of the largest sizes."""
    rows = []
    for name, words in SIZES.items():
        module, _, constant = name.rpartition(".")
        value = getattr(import_module(f"patchfem.{module}"), constant)
        value_text = (
            f"{value / 2**20:.4g} MiB"
            if words.startswith("bytes")
            else f"{value:,.0f}".replace(",", " ")
        )
        rows.append((words.removeprefix("bytes of "), value_text))
    return format_table(("quantity", "largest value"), rows)
