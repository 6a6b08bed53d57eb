"""Measures of whole scenes agree within their errors with closed forms, independent programs and far finer runs.

The scenes of the folder `found` had errors that were too small in earlier versions. Those of its files
`random_patches.json`, two of each kind, and `random_rigs.json`, some in time steps, were drawn by chance. Their references
with uncertainties are those of elements of order 4 with an interior-point method and of DOP853 between located events
(`patch_of_order_four.py` and `random_rigs.py` in `tests/support` of version 1.10). The rigs `bolted` were computed with
partial slip event by event and harmonic balance (`block_joint.py` and `bolted_rigs.py` of version 2.1.0). The references of
the entries `block`, benches with [contact.area], are 512 cells along the longer side and bricks of level 3.
"""

from pathlib import Path

import numpy as np
import pytest
from campaigns import measure_rows
from command_line import read_json
from scene_runs import assert_covers, find_sentences, run_scene
from scene_texts import COATING, PIECE

import patchfem as pf

FOUND = Path(__file__).parent / "found"
BLOCK = PIECE + 'load = "26 lbf"\nsubstrate = "Ti-8Al-1Mo-1V"\n' + COATING
STEP = BLOCK + '[contact.step]\nheight = "0.1 um"\nat = "2 mm"\n'
# External programs, DOP853 between reversals, a march of 4000 steps per cycle or `motion_reference` of version 1.10: scene,
# measure, reference, half a unit of its last digit or uncertainty, and largest error relative to the reference.
MOTIONS = [
    ("s77_21", "relative_displacement_amplitude", 3.5862e-5, 5e-10, 0.1),
    ("s77_41", "relative_displacement_amplitude", 6.458e-5, 5e-9, 0.1),
    ("s20261120_51", "friction_force_peak", 28.747, 5e-4, 0.1),
    ("s20261120_10", "drift_per_cycle", 1.891e-8, 5e-12, 0.1),
    ("tanh_levels_114", "absolute_acceleration_peak", 664.244, 9e-3, 1e-2),
    ("shear_bonds_14", "stick_fraction", 0.00377, 1.4e-3, 5.0),
    ("rig_5046", "relative_displacement_amplitude", 8.20190559e-6, 5e-15, 1e-6),
    ("rig_5046", "equivalent_stiffness", -74645.1102, 5e-5, 1e-6),
    ("rig_97000034", "stick_fraction", 0.1762914152, 0.0, 0.06),
    ("rig_97000034", "slip_start_phase", 2.2076168335, 0.0, 0.01),
    ("ep_stiff_1e6", "relative_displacement_amplitude", 0.7365597, 1e-7, 1e-2),
    ("peak_bouc_wen_53", "friction_force_peak", 20.594500409, 3e-8, 1e-2),
    ("peak_bouc_wen_53", "absolute_acceleration_peak", 217.5187442529, 1e-8, 1e-2),
    ("rig_7062", "stick_fraction", 0.048004613, 5e-10, 1e-5),
    ("rig_7062", "slip_start_phase", 2.089609, 5e-7, 1e-5),
    ("rig_9256", "relative_displacement_amplitude", 6.689247147339e-5, 5e-18, 1e-5),
    ("rig_9256", "equivalent_stiffness", 4188.7310127, 5e-8, 1e-5),
]


# The last scenes take long or would compile loops that no other test needs.
@pytest.mark.share(*range(10), 15, 16)
@pytest.mark.parametrize("scene, name, reference, doubt, largest", MOTIONS)
def test_exact_motion_agrees_with_independent_program(scene, name, reference, doubt, largest):
    """A measure of a motion agrees with an independent program within its error, which is small."""
    measure = pf.run(FOUND / f"{scene}.toml").measures[name]
    assert abs(measure.value - reference) <= measure.error + doubt
    assert measure.error <= largest * abs(reference) + 0.0101 * measure.floor


TITANIUM = 'substrate = {young = "120 GPa", poisson = 0.32, density = "4370 kg/m^3"}\n'
NARROW = (
    '[contact]\nlength = "40 mm"\nwidth = "1 m"\nheight = "20 mm"\nload = "9100 N"\n'
    + TITANIUM
    + '[contact.crown]\nradius = "1 m"\n'
)
CROWNED = """[contact]
length = "22.837 mm"
width = "2.1229 mm"
height = "12.627 mm"
load = "744.99 N"
substrate = "WC-Co"
plane = "stress"
[contact.tilt]
angle = "6.352e-06 rad"
[contact.crown]
radius = "2628.5 mm"
[contact.step]
height = "0.1773 um"
at = "0.5519 mm"
"""
COATED = """[contact]
length = "14.584 mm"
width = "47.673 mm"
height = "26.232 mm"
load = "18.025 N"
substrate = "WC-Co"
[contact.coating]
material = "alumina"
thickness = "0.29487 mm"
[contact.upper]
substrate = {young = "102.25 GPa", poisson = 0.0927, density = "5000 kg/m^3"}
[contact.tilt]
angle = "-2.475e-06 rad"
[contact.step]
height = "0.03429 um"
at = "-0.03108 mm"
"""
# Rigid pieces on a skin touch on 8.35 of 12.7 mm with a uniform pressure; the deformation of the pieces changes it by 1e-5.
PAD = (
    PIECE
    + 'load = "2000 N"\nsubstrate = {young = "1e8 GPa", poisson = 0.3, density = "4400 kg/m^3"}\n'
    '[contact.asperities]\nlaw = "linear"\nnormal_stiffness = "1e12 Pa/m"\n'
    '[contact.step]\nheight = "20 um"\nat = "2 mm"\n'
)
PAD_PRESSURE = 2000 / (8.35e-3 * 12.7e-3)
# Elements of order 5, a spectral program, elements of order 4 and closed forms: scene, references, relative doubt, and
# tolerances from large to small, over which the errors must not grow.
PATCHES = {
    "tilt": (
        BLOCK + '[contact.tilt]\nangle = "0.1 mrad"\n',
        {
            "contact_fraction": 0.2193469,
            "pressure_peak": 8317717.0,
            "normal_stiffness": 5.349995e8,
            "tangential_stiffness": 2.289488e8,
        },
        2e-6,
        (1e-3,),
    ),
    "rigid pad": (
        PAD,
        {
            "pressure_peak": PAD_PRESSURE,
            "contact_fraction": 8.35 / 12.7,
            "contact_half_width": 4.175e-3,
            "moment": -2000 * 2.175e-3,
            "approach": PAD_PRESSURE / 1e12,
            "normal_stiffness": 1e12 * 8.35e-3 * 12.7e-3,
        },
        1e-5,
        (1e-3,),
    ),
    "narrow": (
        NARROW,
        {"contact_half_width": 4.162623e-4, "contact_fraction": 4.162623e-4 / 20e-3},
        0.0,
        (1e-3,),
    ),
    "coated": (
        COATED,
        {"moment": -8.2501e-3, "contact_half_width": 9.5556e-4},
        1e-5,
        (1e-2, 1e-3),
    ),
    "contact interval of one element": ("static_7005", {"moment": 0.17521083}, 6e-5, (1e-2, 1e-3)),
    "short interval": ("static_7047", {"contact_half_width": 8.724e-3}, 0.0, (1e-2, 1e-3)),
    "crown": (
        CROWNED,
        {"contact_half_width": 2.99765e-3, "contact_fraction": 0.258252},
        1e-5,
        (1e-2, 1e-3, 1e-4),
    ),
    "balanced": ("static_7017", {"moment": -6.73948e-5}, 2.1e-5, (1e-3, 1e-4)),
    "stiffness": (
        "static_7029",
        {"normal_stiffness": 220205694.0, "rotational_stiffness": 1541.8782},
        4e-5,
        (1e-2, 1e-3),
    ),
    "rotation": ("static_7059", {"rotational_stiffness": 201.2822}, 3.2e-4, (1e-2, 1e-3)),
    "steeper tilt": (
        BLOCK + '[contact.tilt]\nangle = "1 mrad"\n',
        {
            "contact_fraction": 0.02391931,
            "pressure_peak": 60.84458e6,
            "normal_stiffness": 1.698824e8,
            "tangential_stiffness": 1.196733e8,
        },
        2e-6,
        (1e-3,),
    ),
}


@pytest.mark.share(*range(6))
@pytest.mark.parametrize("name", PATCHES)
def test_always_errors_of_patch_cover_reference_and_decrease(name):
    """The errors of a patch cover a reference and do not grow as the tolerance decreases."""
    text, references, doubt, tolerances = PATCHES[name]
    text = (FOUND / f"{text}.toml").read_text("utf-8") if text.startswith("static_") else text
    previous = dict.fromkeys(references, np.inf)
    for tolerance in tolerances:
        measures = run_scene(text, f"accuracy.tolerance={tolerance}").measures
        assert_covers(measures, references, doubt)
        for key in references:
            assert measures[key].error <= previous[key] * (1 + 1e-6) + 1e-14, tolerance
            previous[key] = measures[key].error
            # A contact of a few elements has a larger error.
            assert measures[key].error <= 0.1 * abs(references[key]) or tolerance > 1e-3


# Known exceptions; of the errors of 60 scenes (seeds 8300000 to 8300059) 99.4 % hold at 1e-2 and 98.3 % at 1e-3:
# successive changes of the stiffness of patch 601 have the ratios 2.8, 5.8 and 4.3; the first suggests a wrong order.
MISSES = {(name, "rotational_stiffness", 1e-3) for name in ("601", "609")}
KNOWN = (
    3.0  # Ratio of the uncertainty of the reference to an error above which a row does not count.
)
MAX_MISS = 1.5  # Largest ratio of true to stated error of an exception.
LONG = {"block 941002"}  # rigs that .ci/run runs
RANDOM_PATCHES, RANDOM_RIGS = (
    read_json(FOUND / f"random_{kind}.json") for kind in ("patches", "rigs")
)


def compare_with_stored(scene: dict, changes: str = "") -> list:
    """Return the rows of a stored scene: each stored measure has a value, and an error inside the tolerance or a warning."""
    result = run_scene(scene["scene"], changes)
    rows = measure_rows(result.measures, scene["true"], scene["doubt"])
    reasons = {name for name in scene["true"] if result.measures[name].reason}
    assert {row.name for row in rows} | reasons == set(scene["true"]) and len(rows) > 3
    tolerance = result.plan.model.accuracy.tolerance
    if not find_sentences(result.warnings, "the tolerance is"):
        assert all(result.measures[row.name].error_ratio(tolerance) <= 1 for row in rows)
    return rows


@pytest.mark.share(1, 3, 5)
@pytest.mark.parametrize("name", RANDOM_PATCHES)
def test_always_errors_of_random_patch_cover_independent_program(name):
    """For two random scenes of each kind, the errors cover an independent program, apart from MISSES; NaN is a miss."""
    for tolerance in (1e-2, 1e-3):
        rows = compare_with_stored(RANDOM_PATCHES[name], f"accuracy.tolerance={tolerance}")
        # An error below the uncertainty of the reference is not decided.
        misses = [
            row
            for row in rows
            if not row.holds
            and not (row.error < KNOWN * row.doubt and row.true_error <= KNOWN * row.doubt)
        ]
        assert {(name, row.name, tolerance) for row in misses} <= MISSES
        assert all(row.true_error <= MAX_MISS * row.error + row.doubt for row in misses)


@pytest.mark.share(0, 1, 2, 3, 16, 17, 18, 20)
@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=pytest.mark.long if name in LONG else ()) for name in RANDOM_RIGS],
)
def test_always_errors_of_random_rig_cover_independent_program(name):
    """All errors of a random rig cover the independent program or finer cells, but for the work of one rig (1.03 times its
    error); NaN is a miss."""
    misses = [row for row in compare_with_stored(RANDOM_RIGS[name]) if not row.holds]
    assert [row.name for row in misses] == ["friction_work"] * (name == "march 304")
    assert all(row.true_error < 1.1 * row.error for row in misses)


def test_always_peak_at_loaded_step_has_no_value():
    """The pressure under a sharp corner is unbounded, so that the peak has no value but a reason; behind a compliant
    skin it has a value."""
    peak = run_scene(STEP).measures["pressure_peak"]
    assert peak.value is None and "edge of the step" in peak.reason
    skin = "contact.asperities.law=linear; contact.asperities.normal_stiffness=1e13 Pa/m"
    peak = run_scene(STEP, skin).measures["pressure_peak"]
    assert peak.value > 0 and peak.error is not None


def test_always_unlike_pieces_have_note_on_coupling():
    """A note on a rigid piece on a soft one states that shear moves the surfaces apart; pieces alike have none."""
    soft = 'contact.upper.substrate={young = "1 GPa", poisson = 0, density = "1 kg/m^3"}'
    hard = 'contact.substrate={young = "1e6 GPa", poisson = 0.3, density = "1 kg/m^3"}; contact.load=100 N; '
    block = PAD.partition("[contact.asp")[0]
    result = run_scene(block, hard + soft + "; contact.element_size=0.5 mm")
    (note,) = find_sentences(result.notes, "different elasticity")
    assert 0.02 < float(note.split("displacement is ")[1].split(" times")[0]) < 1
    assert not find_sentences(run_scene(NARROW).notes, "different elasticity")


WORN = (
    PIECE
    + 'load = "2000 N"\n'
    + TITANIUM.replace("120", "121")
    + """[contact.crown]
radius = "1 m"
[friction]
law = "coulomb"
static = 0.3
[slide]
kind = "sine"
amplitude = "20 um"
frequency = "10 Hz"
[wear]
coefficient = "1e-14 m^2/N"
cycles = 100000
jumps = 1
"""
)


def test_always_error_of_single_wear_step_covers_peak():
    """A Hertz contact worn in a single step has a peak of 39.4 MPa instead of 30.56 MPa (19 steps)."""
    peak = run_scene(WORN).measures["pressure_peak"]
    assert abs(peak.value - 30.56e6) <= peak.error <= 0.5 * peak.value
