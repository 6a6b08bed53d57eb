"""Refused command lines: exit code, one line per mistake, and unchanged files."""

import pytest
from command_line import run_cli
from scene_texts import COULOMB, IWAN, POINT, SHORT, make_shaken_block

from patchfem.scene import read_template

RIG = POINT + COULOMB + SHORT
TRACE = "x [um],z [um]\n" + "".join(f"{k},{k % 7}\n" for k in range(2001))
FILES = {
    "rig.toml": RIG,
    "own.toml": RIG + '\n[sweep]\n"friction.static" = [0.1, 0.2]\n',
    "refused.toml": RIG + '[sweep]\n"normal.load" = "-1 N, -2 N"\n',
    "point.toml": POINT
    + COULOMB
    + '[slide]\nkind = "sine"\namplitude = "1 um"\nfrequency = "10 Hz"\n',
    "joint.toml": make_shaken_block(IWAN),
    "shipped.toml": read_template("rig"),
    "cases.csv": "normal.load [N],friction.static\n10,0.3\n",
    "pairs.csv": "before,after\na.csv,b.csv\n",
    "trace.csv": TRACE,
    "bare.csv": TRACE.partition("\n")[2],
}
STATIC = ("--over", "friction.static=0.1,0.2")
MODE = "--over=structure.mode.0.frequency=100 Hz,110 Hz"
MODE_NAMED = "--over=structure.mode.axial.frequency=100 Hz,110 Hz"
FREQUENCY = "structure.mode[1].frequency=90 Hz"
REFUSED = {  # command -> [(arguments, texts of the lines of the message)]; exit code 2
    "sweep rig.toml": [
        (
            ("--over", "normal.load=1 lb", "--over", "friction.statc=1"),
            ("'lbf'", "did you mean 'static'"),
        ),
        (("--over", "normal.load=-1 N,-2 N"), ("-1 N", "-2 N")),
        ((), ("no key to sweep is given",)),
        (
            ("--over", "friction.static=0.1..0.2:4000", "--over", "normal.load=1 N..2 N:4000"),
            ("16000000 cases, more than",),
        ),
        (("--over",), ("patchfem: --over needs a value; see `patchfem sweep --help`",)),
        (("--random", "4"), ("give each range by --over",)),
        (("--random", "4", "--sobol", "4", "--over", "friction.static=0.1..0.2"), ("one of them",)),
        ((*STATIC, "--shard", "5/4"), ("--shard 5/4",)),
        ((*STATIC, "--plot", "a.jpg"), ("a.jpg: a picture is written as .png, .svg, .pdf",)),
        ((*STATIC, "-o", "."), ("bare.csv",)),
        ((*STATIC, "--keep", "pages", "--no-page"), ("--no-page",)),
        (
            ("--cases", "cases.csv", *STATIC),
            ("cases.csv sets this key already; remove the key from the file",),
        ),
        (
            (MODE_NAMED, "--over=structure.mode.0.frequency=120 Hz"),
            ("this key is the same as structure.mode.axial",),
        ),
        (
            (MODE, "--set", FREQUENCY),
            (f"--set {FREQUENCY}: the sweep already sets structure.mode.0.frequency",),
        ),
        (
            ("--over", "contact.tilt=1 urad,2 urad"),
            ("choose a key of this table: contact.tilt.angle",),
        ),
    ],
    "sweep own.toml": [(("--set", "friction.static=0.3"), ("sets friction.static in every",))],
    **{
        f"{verb} refused.toml": [((), ("must be >= 0", "must be >= 0"))]
        for verb in ("check", "sweep")
    },
    "check rig.toml": [
        (("--set",), ("patchfem: --set needs a value; see `patchfem check --help`",)),
        (("--", "--set", "normal.load=1 N"), ("--set: no option is possible after --",)),
        (
            ("--set", "normal.load=1 N", "--set", "normal.load=2 N"),
            ("--set normal.load=2 N: normal.load is given twice; remove one of them",),
        ),
    ],
    "check": [((), ("SCENE is missing; see `patchfem check --help`",))],
    "check shipped.toml": [
        (
            ("--set", "acceleration=20 g"),
            ("acceleration: unknown key; did you mean 'drive.acceleration'?",),
        )
    ],
    "compare": [
        (
            ("trace.csv", "trace.csv", "--direction", "z"),
            ("direction 'z': the datum is straight, and the direction x or y",),
        ),
        (
            ("trace.csv", "trace.csv", "--datum", "bent"),
            ("datum 'bent', direction '': the datum is straight",),
        ),
        (("trace.csv", "trace.csv", "bare.csv"), ("give two files BEFORE and AFTER",)),
        (
            ("trace.csv", "trace.csv", "--scene", "point.toml", "-o", "result"),
            ("the scene has no [contact]",),
        ),
        (
            ("trace.csv", "trace.csv", "--scene", "none.toml", "-o", "result"),
            ("none.toml: cannot be read: No such file",),
        ),
        (
            ("trace.csv", "trace.csv", "--shift", "0"),
            ("--shift: '0' is a bare number without a unit",),
        ),
        (
            ("trace.csv", "bare.csv", "--pairs", "pairs.csv"),
            ("another file cannot be used with a table of pairs",),
        ),
        (("trace.csv",), ("give two files BEFORE and AFTER, or a table of pairs with --pairs",)),
        (
            ("--pairs", "pairs.csv", "--scene", "rig.toml"),
            ("--scene cannot be used with a table of pairs",),
        ),
        (
            ("trace.csv", "trace.csv", "--scene", "rig.toml", "--piece", "upper"),
            ("--piece cannot be used with --scene",),
        ),
        (
            ("trace.csv", "trace.csv", "--set", "contact.load=1 N"),
            ("--set cannot be used with surfaces alone, without --scene",),
        ),
    ],
    "profile": [
        (("trace.csv", "--cutoff", "0.25"), ("--cutoff: '0.25' is a bare number without a unit",)),
        (("trace.csv", "--cutoff", "-1 mm"), ("--cutoff -1 mm: a length above zero is needed",)),
        (("trace.csv", "--cutoff", "5 mm"), ("half a cut-off of 5 mm is trimmed at each end",)),
        (("trace.csv", "--window", "1 mm"), ("two positions are needed, such as '468 um,733 um'",)),
        (
            ("trace.csv", "--window", "1 mm,9 mm"),
            ("from 1 mm to 9 mm, but the surface along x from 0 um to 2 mm",),
        ),
        (("trace.csv", "--units", "mm"), ("the units ('mm',) are not those of x and of z",)),
        (("bare.csv",), ("units are never guessed",)),
        (("trace.csv", "--plot", "a"), ("a: a picture is written as .png, .svg, .pdf",)),
        (("trace.csv", "--split", "rig.toml", "--plot", "a.png"), ("--split: takes one FILE",)),
    ],
    "new": [
        (
            ("misalignment", "tilts.toml"),
            ("patchfem: unexpected 'tilts.toml'; see `patchfem new --help`",),
        ),
    ],
    "backbone joint.toml": [
        (("--amplitudes", "1..2"), ("bare number",)),
        (("--amplitudes", "1 um..x"), ("--amplitudes",)),
        (("--amplitudes", "0 um,1 um"), ("--amplitudes",)),
        (("--method", "static"), ("balance",)),
    ],
    "swep rig.toml": [((), ("unknown verb 'swep'; did you mean `sweep`? see `patchfem --help`",))],
    "scatter": [(("--help",), ("unknown verb 'scatter'; see `patchfem --help`",))],
    "help": [((), ("`patchfem run --help`",))],
    "report none": [
        (("-o", "a.pdf"), ("a.pdf: the ending of a page is .html; use -o report.html",))
    ],
    "--foo": [((), ("unknown option '--foo'; see `patchfem --help`",))],
}
NOT_THERE = [  # arguments, message on a missing file; exit code 4
    (("compare", "trace.csv", "none.csv"), "none.csv: there is no such file"),
    (("compare", "--pairs", "none.csv"), "none.csv: there is no such file"),
    (("profile", "none.csv"), "none.csv: there is no such file"),
    (("export", "none", "-o", "a.vtu"), "none: no such results folder"),
    (("view", "none"), "none: no such results folder"),
    (("report", "none"), "none: no such results folder"),
]
CASES = [
    ((*verb.split(), *words), says, 2) for verb, rows in REFUSED.items() for words, says in rows
]
CASES += [(words, (says,), 4) for words, says in NOT_THERE]


@pytest.mark.parametrize("words, says, code", CASES, ids=[" ".join(words) for words, _, _ in CASES])
def test_refuses_invalid_command_line(tmp_path, monkeypatch, words, says, code):
    """Each invalid command line ends with its exit code and one line per mistake, and changes no file."""
    monkeypatch.chdir(tmp_path)
    for name, text in FILES.items():
        (tmp_path / name).write_text(text, "utf-8")
    answer = run_cli(*words)
    lines = answer.err.splitlines()
    assert (answer.code, answer.out, len(lines)) == (code, "", len(says)), answer
    assert all(part in answer.err for part in says) and "internal fault" not in answer.err
    assert {path.name for path in tmp_path.iterdir()} == set(FILES)
    assert {name: (tmp_path / name).read_text("utf-8") for name in FILES} == FILES
