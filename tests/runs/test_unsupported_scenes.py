"""Scenes that a run does not support are refused with the key, the reason and a remedy."""

import pytest
from scene_runs import assert_names_key_and_remedy, load_scene, run_scene
from scene_texts import (
    BENCH,
    BLOCK,
    COATED,
    COULOMB,
    DRIVE,
    FORCED,
    MODE,
    NONLOCAL,
    PAIR,
    PLASTIC,
    POINT,
    RIG,
    SHEAR,
    STRUCTURE,
    make_friction_table,
)

from patchfem.core import Missing, PatchfemError

TILTED = COATED + '[contact.tilt]\nangle = "0.1 mrad"\n'
COULOMB_RIG = POINT + COULOMB + STRUCTURE
BONDED_RIG = POINT + NONLOCAL + STRUCTURE
FACE_PATCH = COATED.replace('element_size = "0.5 mm"\n', "") + "[contact.area]\ncells = 64\n"
FACE_RIG = FACE_PATCH + COULOMB + STRUCTURE
RANDOM_RIG = (
    MODE + '[drive]\nkind = "base"\nwaveform = "random"\nspectrum = "0.01 g^2/Hz"\n'
    'from = "20 Hz"\nto = "300 Hz"\nduration = "3 s"\n'
)
TONES_RIG = (
    MODE + '[drive]\nkind = "base"\nwaveform = "tones"\nfrequencies = ["96 Hz", "102 Hz"]\n'
    'accelerations = ["1 g", "0.5 g"]\ncycles = 160\n'
)
GROOVES = "normal.grooves.wavelength=80 um; normal.grooves.amplitude=7.5 um; "
CONTACT_GROOVES = GROOVES.replace("normal", "contact")
BONDS = "friction.law=nonlocal; friction.bond_length=1 um; "
ELASTIC = "friction.law=elastic-plastic; friction.bond_length=1 um; "
TANH = "friction.law=tanh; friction.reference_speed=1 mm/s"
FREE = "drive.kind=free; drive.displacement=0.5 mm; "
WEAR = "wear.coefficient=1e-14 m^2/N; wear.cycles=1000"
CHAIN_PATCH = """[structure]
masses = ["1 kg", "1 kg"]
[[structure.spring]]
between = [1, 0]
stiffness = "1e6 N/m"
[[structure.interface]]
between = [1, 0]
law = "coulomb"
static = 0.3
[structure.interface.contact]
length = "10 mm"
width = "10 mm"
height = "8 mm"
load = "100 N"
substrate = "steel"
[structure.interface.contact.shear]
[[structure.interface]]
between = [2, 1]
law = "coulomb"
static = 0.3
load = "60 N"
"""
CHAIN = CHAIN_PATCH + DRIVE
FACE = "structure.interface.0.contact."
REFUSALS = [
    # ---- bonds and laws
    (
        BONDED_RIG,
        "friction.reading=report; structure.moving_mass=6.5 mg; accuracy.tolerance=1e-5",
        "the vibration of the block on its bonds, at .* Hz",
    ),
    (
        COULOMB_RIG,
        ELASTIC + "friction.stiffness=7e6 N/m",
        "friction.stiffness: .*exclude each other",
    ),
    (
        COULOMB_RIG,
        "friction.law=elastic-plastic; friction.stiffness=7e6 N/m; friction.static=0",
        r"friction\.static: must be > 0 with law 'elastic-plastic'",
    ),
    (BENCH, "slide.cycles=1e9", "lower slide.cycles"),
    # ---- engines
    (
        POINT + PLASTIC + STRUCTURE,
        "friction.bond_length=1e-13 um; accuracy.method=exact",
        r"use law 'coulomb' instead, or use accuracy\.method = \"march\"",
    ),
    (
        COULOMB_RIG,
        FREE + "structure.travel=0.4 mm; accuracy.method=exact",
        r"starts beyond this travel",
    ),
    (
        COULOMB_RIG,
        FREE + "structure.travel=0.4 mm; accuracy.method=march",
        r"starts beyond this travel",
    ),
    (
        STRUCTURE,
        "structure.mode.axial.damping=-0.02",
        r"damping: -0\.02 is negative damping, and without friction",
    ),
    (COULOMB_RIG, "structure.mode.axial.damping=-1.5", "damping: must be > -1"),
    # ---- modes measured with the joint bolted
    (
        POINT + make_friction_table("iwan") + STRUCTURE,
        "structure.measured=stuck; structure.mode.axial.frequency=14 Hz",
        "(?s)stiffness of the joint is .* % of the stiffness.*multiply `slide` of every mode by 0.0",
    ),
    (
        COATED + SHEAR + COULOMB + STRUCTURE,
        "structure.measured=stuck",
        "(?s)stiffness of the joint is .* % of the stiffness.*multiply `slide` of every mode by 0.0",
    ),
    (COULOMB_RIG, "structure.measured=stuck", "law 'coulomb' sticks rigidly"),
    (
        COULOMB_RIG,
        "structure.measured=stuck; structure.measured_joint=case; " + TANH,
        "law 'tanh' has no stiffness",
    ),
    (STRUCTURE, "structure.measured=stuck", r"add \[friction\]"),
    (
        PAIR + FORCED,
        "structure.measured=stuck",
        "'stuck' with structure.masses is not supported yet; give modes without the joint",
    ),
    (
        POINT + make_friction_table("iwan") + STRUCTURE,
        "structure.measured=stuck; normal.amplitude=10 N; normal.frequency=50 Hz",
        "normal.amplitude is not supported yet",
    ),
    # ---- grooves
    (BENCH, GROOVES + "friction.static=2", "normal.grooves.amplitude: .*lock with static = 2"),
    (
        BENCH,
        GROOVES + "normal.grooves.amplitude=-1 um",
        r"normal\.grooves\.amplitude: must be >= 0, not '-1 um'",
    ),
    (
        BONDED_RIG,
        GROOVES + "accuracy.method=harmonic",
        r"accuracy\.method: 'harmonic' with \[normal\.grooves\] for law 'nonlocal' is not supported yet; use 'march'",
    ),
    (BENCH, GROOVES + WEAR, r"normal.grooves: a \[normal\] contact has no area.*: use \[contact\]"),
    (
        BLOCK + COULOMB + STRUCTURE,
        CONTACT_GROOVES + "structure.mode.axial.normal=0.1",
        r"structure\.mode\.\S+: not supported yet with \[contact\.grooves\]",
    ),
    (BLOCK, CONTACT_GROOVES, r"contact\.grooves: .*needs a sliding motion"),
    # ---- holders, faces and normal motion
    (
        RIG,
        "contact.holder.tangential_stiffness=5e6 N/m; friction.reading=report; friction.order=-0.5",
        "initial_bonds: 1 with order = -0.5",
    ),
    (
        POINT + COULOMB + STRUCTURE,
        "structure.mode.axial.normal=0.1",
        r"a joint without places is not supported yet; use \[contact\]",
    ),
    (
        COATED + COULOMB + STRUCTURE,
        "structure.mode.axial.yaw=30 rad/m",
        "axial.yaw: .*contact.area",
    ),
    (
        FACE_RIG,
        BONDS + "contact.shear={}; structure.mode.axial.yaw=30 rad/m; accuracy.method=exact",
        r"use 'march' or leave",
    ),
    (
        FACE_RIG,
        "contact.shear={}; friction.kinetic=0.2",
        r"friction\.kinetic: 0\.2 below static = 0\.3 with \[contact\.shear\]",
    ),
    # ---- instruments and drives
    (
        COULOMB_RIG,
        "structure.mode.axial.gauge=0.2; structure.travel=5 mm",
        r"axial\.gauge: not supported yet with structure\.travel",
    ),
    (
        COULOMB_RIG,
        "structure.mode.axial.gauge=0.2; structure.stiffening.cubic=1e12 N/m^3",
        r"axial\.gauge: not supported yet with structure\.stiffening",
    ),
    (
        COULOMB_RIG,
        'structure.mode.axial.gauge=0.2; drive.waveform=levels; drive.levels=["3 g"]',
        r"axial\.gauge: not supported yet with drive\.waveform = 'levels'",
    ),
    (RANDOM_RIG, "drive.kind=force", r"drive\.kind: waveform .random. can only shake the base"),
    (RANDOM_RIG, "drive.to=20 Hz", r"drive\.to: 20 Hz is not above drive\.from"),
    (RANDOM_RIG, "drive.file=x.csv", r"drive\.file: `spectrum` and `file` exclude each other"),
    (
        RANDOM_RIG.replace('spectrum = "0.01 g^2/Hz"\n', ""),
        "",
        r"drive\.spectrum: missing; .* needs this key or file",
    ),
    (RANDOM_RIG.replace('from = "20 Hz"\n', ""), "", r"drive\.from.*needs a lowest frequency"),
    (
        RANDOM_RIG,
        "drive.spectrum=0.01 g",
        r"drive\.spectrum: 'g' is .* but an acceleration spectrum is needed",
    ),
    (RANDOM_RIG, "drive.spectrum=0 g^2/Hz", r"drive\.spectrum: must be > 0, not '0 g"),
    (RANDOM_RIG, "drive.duration=0.01 s", r"drive\.duration: 0\.01 s are too short for a band"),
    (TONES_RIG, "drive.kind=force", r"drive\.kind: waveform 'tones' can only shake the base"),
    (
        TONES_RIG,
        'drive.phases=["0 deg", "0 deg", "0 deg"]',
        "3 values for 2 values of `frequencies`",
    ),
    (
        TONES_RIG.replace('frequencies = ["96 Hz", "102 Hz"]\n', ""),
        "",
        "waveform 'tones' needs this key",
    ),
    (
        TONES_RIG,
        'drive.accelerations=["0 g", "0 g"]',
        r"drive\.accelerations: all accelerations are 0",
    ),
    (
        TONES_RIG,
        'drive.frequencies=["96 Hz", "1 um"]',
        r"drive\.frequencies\[2\]: 'um' is a unit of length",
    ),
    (
        TONES_RIG,
        "accuracy.method=harmonic",
        r"accuracy\.method: 'harmonic' finds only steady motion: under a sine",
    ),
    # ---- patches at interfaces
    (
        CHAIN,
        f"{FACE}grooves.wavelength=80 um; {FACE}grooves.amplitude=2 um",
        r"contact.grooves: not supported yet with \[\[structure.interface\]\]; leave out this entry",
    ),
    (CHAIN, "structure.interface.0.load=5 N", "`load` and `contact` exclude each other"),
    (
        CHAIN,
        "structure.interface.0.kinetic=0.2",
        r"interface\[1\].kinetic: 0.2 below static = 0.3 with .*shear\] is not supported yet; leave out kinetic",
    ),
    (CHAIN, WEAR, "wear: not supported yet"),
    (CHAIN, FACE + "profile.file=none.csv", "profile.file: none.csv: there is no such file"),
    # ---- wear
    (
        TILTED,
        WEAR,
        r"missing \[friction\]: a run with a load, a slide or wear also needs this table",
    ),
    (COULOMB_RIG, FREE + WEAR, r"wear: .* last cycle of a steady motion"),
    (
        BENCH,
        WEAR + '; wear.friction.depth=["0 um", "8 um"]; wear.friction.coefficient_factor=[1, 0.2]',
        r"wear.friction: a \[normal\] contact has no area.*: use \[contact\]",
    ),
]


@pytest.mark.parametrize("text, changes, pattern", REFUSALS)
def test_refuses_unsupported_scene(text, changes, pattern):
    """A scene that is not supported is refused, at the latest when it is run, and the unchanged scene is not; every message
    names a key and a remedy."""
    if changes:
        load_scene(text)
    with pytest.raises((PatchfemError, Missing), match=pattern) as caught:
        run_scene(text, changes)
    for message in getattr(caught.value, "mistakes", [str(caught.value)]):
        assert_names_key_and_remedy(message)
