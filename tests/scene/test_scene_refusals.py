"""Mistakes of a scene, all reported at once with line, key and the expected value."""

from __future__ import annotations

import re

import pytest
from scene_texts import (
    BENCH,
    LINEAR,
    PATCH,
    PIECE,
    RIG,
    SLIDE,
    STRUCTURE,
    find_line,
    get_only_mistake,
    list_mistakes,
)

from patchfem.scene import load, loads
from patchfem.scene.scene import SceneError

# (text, sets, key whose line is named, what the message says)
BAD_VALUES = [
    ('load = "26 lb"', "contact.load", "did you mean 'lbf'"),
    (
        "load = 26",
        "contact.load",
        "a bare number without a unit; a force with its unit is needed, such as '26 lbf'",
    ),
    (
        'length = "-12.7 mm"',
        "contact.length",
        "must be > 0, not '-12.7 mm'",
    ),
    (
        'substrate = "Ti-8Al"',
        "contact.substrate",
        "did you mean 'Ti-8Al-1Mo-1V'? use one of Ti-8Al-1Mo-1V, WC-Co",
    ),
    (
        'material = "xyz"',
        "contact.coating.material",
        "unknown material 'xyz'; use one of Ti-8Al-1Mo-1V",
    ),
    ('thickness = "6.35 mm"', "contact.coating.thickness", "must be thinner than its piece"),
    ('law = "nonlocl"', "friction.law", "did you mean 'nonlocal'? use one of coulomb, tanh"),
    ('static = "0.3"', "friction.static", "a plain number is needed, not '0.3'"),
    ("static = nan", "friction.static", "a plain number is needed, not nan"),
    ('kind = "bass"', "drive.kind", "did you mean 'base'? use one of base, force, free"),
    ("title = 5", "title", "a text in quotes is needed, not 5"),
    (r'title = "a\nb"', "title", "has several lines; write one line of text"),
]


@pytest.mark.parametrize("line, key, says", BAD_VALUES)
def test_refuses_wrong_value_at_its_line(line, key, says):
    """A wrong value in a file is refused with line, key and the expected form."""
    start = line.split("=")[0]
    old = next(row for row in RIG.splitlines() if row.split("=")[0].strip() == start.strip())
    message = get_only_mistake(RIG.replace(old, line, 1))
    assert message.startswith(f"a.toml:{find_line(RIG, start.strip())}: {key}: ")
    assert says in message


BAD_SETS = [
    ("friction.kinetic=0.4", "friction.kinetic", "larger than static"),
    ("accuracy.tolerance=1", "accuracy.tolerance", "must be < 1, not 1"),
    ("friction.reading=reprot", "friction.reading", "did you mean 'report'? use one of stretch, report"),
    ("friction.temperature=5", "friction.temperature", "a table [friction.temperature] is needed, not 5"),
    ("contact.upper.coating=thick", "contact.upper.coating", "unknown value 'thick'; use one of none, or give a table "
     "[contact.upper.coating]"),
    ("contact.pairs=1.5", "contact.pairs", "a whole number is needed, not 1.5"),
    ("structure.mode=5", "structure.mode", "an array of tables [[structure.mode]] is needed, not 5"),
    ("contact.load.x=1", "contact.load.x", "contact.load is a value, not a table"),
    ("contact.element_size=13 mm", "contact.element_size", "longer than contact.length"),
    ("contact.lower.length=12.7000001 mm", "contact.lower.length", "write the same length for both"),
    ("contact.lower.chamfer=6.2 mm", "contact.lower.chamfer", "do not fit into the height"),
    ("contact.lower.end_radius=6.4 mm", "contact.lower.end_radius", "leaves no flat face"),
    ("contact.load_line.offset=1 mm", "contact.load_line", "unless [contact.holder]"),
    ("contact.load=1e40 N", "contact.load", "a mean pressure above Young's modulus"),
    ("contact.tilt.roll=1 mrad", "contact.tilt.roll", "add [contact.area]"),
    ("contact.crown.radius=-1 m", "contact.crown.radius", "for a hollow surface leave out [contact.crown]"),
    ("structure.mode.axal.frequency=1 Hz", "structure.mode.axal", "did you mean 'axial'?"),
    ("structure.mode.second.base=0.7", "structure.mode.axial.slide", "sum of `base`^2"),
    ("structure.mode.second.name=axial", "structure.mode[2].name", "two modes are named"),
    ("drive.displacement=1 mm", "drive.displacement", "`acceleration` and `displacement` exclude each other"),
    ("drive.wavform=sine", "drive.wavform", "unknown key; did you mean 'waveform'?"),
    ("drive.zzz=1", "drive.zzz", "unknown key; known here: kind, waveform, frequency, from, to"),
    ("strucure.moving_mass=1 kg", "strucure", "unknown table; did you mean 'structure'?"),
    ("contact.load", "contact.load", "table.key=value is needed"),
    ("contact.load=['1 N']", "contact.load", "not a quantity; a force with its unit is needed"),
    ("structure.mode[0].slide=1", "structure.mode[0].slide", "mode[0] names no item; items are numbered from 1"),
    ("structure.mode.second.name=", "structure.mode[2].name", "must not be an empty text"),
    ('contact.substrate={young = "1 GPa", poisson = 0.5, density = "1 kg/m^3"}', "contact.substrate.poisson",
     "must be < 0.5"),
]  # fmt: skip


@pytest.mark.parametrize("one, key, says", BAD_SETS)
def test_refuses_wrong_setting(one, key, says):
    """A wrong value in --set is refused with its key and the expected form."""
    message = get_only_mistake(RIG, one)
    where = f"a.toml:{find_line(RIG, 'slide')}" if key == "structure.mode.axial.slide" else "--set"
    assert message.startswith(f"{where}: {key}: ")
    assert says in message


MISSING = [
    (RIG, r"^length.*\n", "[contact]", "contact.length", "missing; a length with its unit is needed, such as"),
    (RIG, r"^thickness.*\n", "[contact.coating]", "contact.coating.thickness", "missing; a length"),
    (RIG, r"^static.*\n", "[friction]", "friction.static", "missing; a plain number is needed"),
    (RIG, r"^bond_length.*\n", "[friction]", "friction.bond_length", "law 'nonlocal' needs this key"),
    (RIG, r"^slide = 0.1\n", "[[structure.mode]]", "structure.mode.second.slide", "missing; a plain number"),
    (RIG, r"^cycles.*\n", "[drive]", "drive.cycles", "waveform 'sine' needs this key or duration"),
    (LINEAR, r"^\[\[(.|\n)*(?=\[drive)", "[structure]", "structure.mode", "this key or masses or file or reduced is needed"),
    (BENCH, r"^kind.*\n", "[slide]", "slide.kind", "missing; one of constant, sine, triangle, dwell, file"),
    (BENCH, r"^amplitude.*\n", "[slide]", "slide.amplitude", "kind 'triangle' needs this key"),
]  # fmt: skip


@pytest.mark.parametrize("text, pattern, header, key, says", MISSING)
def test_refuses_missing_key_at_its_table(text, pattern, header, key, says):
    """A missing key is reported at the line of its table with an example."""
    cut, count = re.subn(pattern, "", text, count=1, flags=re.MULTILINE)
    assert count == 1
    message = get_only_mistake(cut)
    lines = [n for n, line in enumerate(cut.splitlines(), 1) if line == header]
    assert message.startswith(f"a.toml:{lines[-1]}: {key}: missing")
    assert says in message


OFFSET = "contact.load_line.offset"
MOMENT = "contact.load_line.moment"
ORDER = "friction.reading=report; friction.order"
LOAD_LINE = PATCH.replace('[contact.tilt]\nangle = "0.1 mrad"\n', "[contact.load_line]\n")
FREE_ROLL = PATCH + '[contact.area]\n[contact.load_line]\nacross = "1 mm"\n'
APPROACH = FREE_ROLL.replace('load = "26 lbf"', "") + '[contact.approach]\ndistance = "1 um"\n'
LIMITS = [  # text, settings, and what the message says; no message if the scene is valid
    (RIG, f"contact.shear={{}}; {ORDER}=-0.5", "whose bonds at rest no force can move"),
    (RIG, f"contact.shear={{}}; {ORDER}=-0.5; friction.initial_bonds=0", ""),
    (BENCH, f"friction.law=nonlocal; friction.bond_length=1 um; {ORDER}=-0.5", ""),
    (RIG, f"{ORDER}=-1", "must be > -1"),
    (LOAD_LINE, "", f"{OFFSET}: missing; a length"),
    (LOAD_LINE, f"{OFFSET}=1 mm; {MOMENT}=0.05 N m", "exclude each other"),
    (LOAD_LINE, f"{OFFSET}=-6.35 mm", "|offset| < length/2 = 0.00635 m"),
    (LOAD_LINE, f"{MOMENT}=1 N m", "|moment|/load < length/2"),
    (LOAD_LINE, f"{MOMENT}=-1e-3 N m; contact.load=0 N", "|moment|/load < length/2"),
    (LOAD_LINE, f"{OFFSET}=6.34 mm", ""),
    (LOAD_LINE, f"{OFFSET}=1 mm; contact.load=0 N", ""),
    (FREE_ROLL, "", ""),
    (FREE_ROLL, "contact.tilt.roll=1 mrad", "keep only one of these two keys"),
    (FREE_ROLL, "contact.load_line.across=-6.35 mm", "|across| < width/2 = 0.00635 m"),
    (FREE_ROLL, "contact.area.hardness=0.5 MPa", "not above the mean pressure"),
    (FREE_ROLL, "contact.shear={}; contact.upper.height=5 mm", "pieces of different elasticity"),
    (APPROACH, "", "an approach of a piece that can rotate was removed"),
    (RIG, "structure.mode.axial.base=1e40", "sum of `base`^2"),
    (RIG, "structure.mode.axial.base=1e200", "outside the computable range"),
    (RIG, "structure.mode.axial.frequency=1e300 Hz", "outside the computable range"),
    (RIG, "structure.moving_mass=1e-300 kg", "range; a magnitude from 1e-50 to 1e+50 kg is needed"),
    (RIG, "structure.stiffening.cubic=1e-300 N/m^3", "; 0 or a magnitude from 1e-50 to 1e+50 N/m^3 is needed"),
    (RIG, "contact.element_size=12.7 mm", ""),
    (RIG, "contact.element_size=0.126 um", "elements of 1.26e-07 m on a length of 0.0127 m are more than 100000"),
    (RIG, "contact.element_size=0.127 um", ""),
    # A load has only an upper limit of its magnitude.
    (RIG, "contact.load=1e60 N", "1e+60 N is outside the computable range; a magnitude of at most 1e+50 N is needed"),
    (RIG.replace("[structure]\n", '[structure]\n"mode.².x" = 1\n'), "", "unknown key"),
    (RIG.replace("[structure]\n", '[structure]\n"a\\n\\u001bb" = 1\n'), "", "unknown key"),
    ("deep = " + "[" * 250 + "]" * 250 + "\n" + RIG, "", "unknown key"),
    (RIG, "friction.static=" + "9" * 400, "a plain number is needed"),
]  # fmt: skip


@pytest.mark.parametrize("number", range(len(LIMITS)))
def test_refuses_keys_beyond_their_limits(number):
    """Keys beyond a limit that other keys determine, odd keys and huge numbers are refused in one line, others accepted."""
    text, changes, says = LIMITS[number]
    sets = changes.split("; ") if changes else []
    if says:
        assert says in get_only_mistake(text, *sets)
    else:
        loads(text, sets=sets)


COMBINATIONS = [
    ("", "a.toml: missing [contact]: "),
    (RIG[: RIG.index("[drive]")], "a.toml: missing [drive]: [structure] needs this table"),
    (LINEAR[LINEAR.index("[drive]") :], "a.toml: missing [structure]: [drive] needs this table"),
    (PATCH + LINEAR, "a.toml: missing [friction]: "),
    (
        BENCH[: BENCH.index("[slide]")],
        "a.toml: missing [slide]: friction needs a motion, [slide] or [structure] with [drive]; only `patchfem backbone`",
    ),
    (BENCH[BENCH.index("[friction]") :], "a.toml: missing [contact]: friction needs a normal load"),
    (RIG + BENCH[BENCH.index("[slide]") :], "a.toml:35: slide: "),
    (
        RIG + '[normal]\nload = "1 N"\n',
        "a.toml:35: normal: [contact] and [normal] exclude each other",
    ),
    (LINEAR + '[wear]\ncoefficient = "1e-14 m^2/N"\ncycles = 5\n', "a.toml: missing [friction]: "),
]


@pytest.mark.parametrize("text, start", COMBINATIONS)
def test_refuses_incompatible_tables(text, start):
    """Tables that exclude each other, or of which one is missing, are refused."""
    assert list_mistakes(text)[0].startswith(start)


def test_refuses_scene_with_mistakes_in_file_order():
    """All mistakes of a scene are reported at once in the order of the file."""
    text = (
        RIG.replace('load = "26 lbf"', 'load = "26 lb"')
        .replace("static = 0.3", "static = 0.3\nkinetic = 0.4\norder = -3")
        .replace('bond_length = "1 um"\n', "")
        .replace("damping = 0.003", "dampin = 0.003")
        .replace("[drive]", "[drve]")
    )
    found = list_mistakes(text, "accuracy.tolerance=0")
    keys = [message.split(": ")[1] for message in found]
    assert keys == [
        "missing [drive]", "contact.load", "friction.bond_length", "friction.kinetic", "friction.order",
        "structure.mode.axial.damping", "structure.mode.axial.dampin", "drve", "accuracy.tolerance",
    ]  # fmt: skip


@pytest.mark.parametrize(
    "text, start",
    [
        ("a = 1\nb = = 2\n", "a.toml:2: not valid TOML: "),
        ("a = 1\na = 2\n", "a.toml:2: not valid TOML: "),
        ('a = 1\nb = """x\n', "a.toml:2: not valid TOML: "),
        ("a = " + "[" * 5000, "a.toml:1: not valid TOML: nested too deeply"),
        ("a = " + "1" * 5000, "a.toml:1: not valid TOML: "),
    ],
)
def test_refuses_invalid_toml(text, start):
    """A text that is not valid TOML is refused with the line."""
    assert get_only_mistake(text).startswith(start)


@pytest.mark.parametrize(
    "text, end",
    [
        ("a = 1\nload = 26 lbf\n", 'put a quantity or a word in quotes: load = "26 lbf"'),
        ("law = coulomb\n", 'put a quantity or a word in quotes: law = "coulomb"'),
        ("static = -.5e3\n", "put a digit on both sides of the point: static = -0.5e3"),
        ("static = 5.\n", "put a digit on both sides of the point: static = 5.0"),
        ("static = 0,3\n", "write the decimal comma as a point: static = 0.3"),
        (
            "damping = 0.3 %  # of the mode\n",
            'put a quantity or a word in quotes: damping = "0.3 %"',
        ),
        ("a = 1e", "statement (column 6)"),
    ],
)
def test_refuses_unquoted_value_with_correction(text, end):
    """A value without quotes or digits is refused with its correct form."""
    assert get_only_mistake(text).endswith(end) and "not valid TOML" in get_only_mistake(text)


def test_refuses_unreadable_file(tmp_path):
    """A folder, an absent file and a file that is not UTF-8 are refused."""
    for path, says in [(tmp_path, "cannot be read: Is a directory"), (tmp_path / "no.toml", "cannot be read: No such"),
                       ("a\0b", "cannot be read")]:  # fmt: skip
        with pytest.raises(SceneError) as caught:
            load(path)
        assert caught.value.mistakes[0].startswith(f"{path}: {says}")
    path = tmp_path / "latin.toml"
    path.write_bytes(b'title = "x"\n# 5 \xb5m\n')
    with pytest.raises(SceneError, match=r"latin\.toml:2: not UTF-8: byte 0xb5"):
        load(path)


@pytest.mark.parametrize(
    "text, says",
    [
        ("contact = 5\n", "contact: a table [contact] is needed, not 5"),
        (
            "[structure]\nmode = 5\n",
            "structure.mode: an array of tables [[structure.mode]] is needed, not 5",
        ),
        (
            "[structure.mode]\n",
            "structure.mode: an array of tables [[structure.mode]] is needed, not a table",
        ),
        (
            "[[structure.spring]]\nbetween = [1]\n",
            "structure.spring[1].between: two whole numbers are needed, such as [1, 2], not 1 value",
        ),
        (
            "[structure.reduced]\ndamping = true\n",
            "structure.reduced.damping: a plain number, or the name of a file, is needed, not true",
        ),
        (
            "[structure.reduced]\nboundary = [1, true]\n",
            "structure.reduced.boundary[2]: whole numbers or texts are needed, such as [1, '12:x'] or "
            "['1..39:20'], not true",
        ),
        ("[wear.friction]\ndepth = [0]\n", "wear.friction.depth[1]: a bare number without a unit"),
        (
            '[structure]\nfile = "a.uff"\n',
            "(node and direction, as named in the file (such as 12:+x), whose motion",
        ),
        (
            '[drive]\nkind = "force"\nlevels = ["1e60 N"]\n',
            "drive.levels: 1e+60 N is outside the computable range; 0 or a magnitude from 1e-50 to 1e+50 N",
        ),
        ("[sweep]\ncontact.load = []\n", "sweep.contact.load: at least one value is needed"),
        ('"contact.load" = "1 N"\n', "contact.load: unknown key; leave out its quotes"),
    ],
)
def test_refuses_wrong_structure_of_table(text, says):
    """A table where a value is expected, or the reverse, is refused."""
    assert any(says in message for message in list_mistakes(text))


def test_always_masses_and_interfaces_are_read():
    """Masses, springs and interfaces of a structure are read, and a kinetic coefficient above the static one is refused."""
    text = """
[structure]
masses = ["1 kg", "2 kg"]
[[structure.spring]]
between = [1, 2]
stiffness = "1e6 N/m"
[[structure.interface]]
between = [2, 0]
law = "coulomb"
static = 0.3
kinetic = 0.4
load = "1 N"
[drive]
kind = "base"
frequency = "1 Hz"
acceleration = "1 g"
cycles = 2
"""
    assert "structure.interface[1].kinetic: 0.4 is larger" in get_only_mistake(text)
    scene = loads(text.replace("0.4", "0.2"))
    assert scene.kind == "rig"
    assert scene.structure.masses == (1.0, 2.0)
    assert scene.structure.output_mass == 1
    assert (scene.structure.interface[0].between, scene.structure.interface[0].kinetic) == (
        (2, 0),
        0.2,
    )


OUTLINES = [
    (
        '[contact.upper]\nchamfer = "1 mm"\nend_radius = "1 mm"\n',
        (),
        "contact.upper.end_radius",
        "exclude each other",
    ),
    (
        '[contact.upper]\nlength = "8 mm"\n',
        ("contact.element_size=9 mm",),
        "contact.element_size",
        "the interface length of",
    ),
    (
        '[contact.upper]\nlength = "8 mm"\n',
        ("contact.load_line.offset=4 mm",),
        "contact.load_line.offset",
        "outside",
    ),
    (
        '[contact.lower]\nchamfer = "3 mm"\n',
        ('contact.step={height="1 um",at="4 mm"}',),
        "contact.step.at",
        "outside",
    ),
    *(
        (
            f'mesh = "a.msh"\n[contact.lower]\n{key} = "1 mm"\n',
            (),
            f"contact.lower.{key}",
            "cannot be used with contact.mesh",
        )
        for key in ("length", "chamfer", "end_radius")
    ),
]


@pytest.mark.parametrize("tables, sets, key, words", OUTLINES)
def test_refuses_invalid_outlines(tables, sets, key, words):
    """Outlines of the pieces that do not fit are refused with their keys."""
    text = PIECE + 'load = "26 lbf"\nsubstrate = "steel"\n' + tables
    assert any(f"{key}: " in line and words in line for line in list_mistakes(text, *sets)), (
        list_mistakes(text, *sets)
    )


def test_refuses_factor_on_missing_bond_length_with_one_sentence():
    """A law that has a stiffness but no bond length is not told to give a bond length in its place."""
    text = PATCH + SLIDE + '[friction]\nlaw = "iwan"\nstatic = 0.3\nchi = -0.5\nbeta = 0.5\n'
    text += 'stiffness = "1e7 N/m"\n[wear]\ncoefficient = "1e-14 m^2/N"\ncycles = 100\n'
    text += '[wear.friction]\ndepth = ["0 um", "1 um"]\nbond_length_factor = [1, 2]\n'
    assert "law 'iwan' has no bond_length" in get_only_mistake(text)


def test_refuses_missing_law_of_measured_joint_with_one_sentence():
    """A scene with [friction] but without its law has a joint, with which its modes may have been measured."""
    text = "[friction]\nstatic = 0.3\n[normal]\nload = '1 N'\n" + STRUCTURE
    assert "friction.law: missing" in get_only_mistake(text, "structure.measured=stuck")
