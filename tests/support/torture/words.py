"""Random command lines: every command with valid options and values, and with some invalid ones."""

from . import grammar
from .scenes import NUMBERS, TEXTS
from .tables import RIG, RUBS, make_damaged_csv
from .toml import list_schema_keys, to_toml
from .trial import Trial

PATCH = {
    "contact": {
        "length": "10 mm",
        "width": "10 mm",
        "height": "5 mm",
        "load": "50 N",
        "substrate": "steel",
        "element_size": "0.2 mm",
        "tilt": {"angle": "1 urad"},
    }
}
BENCH = RUBS | {"slide": {"kind": "sine", "amplitude": "10 um", "frequency": "5 Hz"}}
SCENES = {
    "patch.toml": PATCH,
    "bench.toml": BENCH,
    "rig.toml": RIG
    | {"drive": {"kind": "base", "frequency": "90 Hz", "acceleration": "5 m/s^2", "cycles": 3}},
}
RANGES = (
    "1 N,2 N",
    "1 N..2 N:3",
    "1 N..2 N:0",
    "1 N..2 N:-1",
    "1 N..2 N:1e9",
    "2 N..1 N:2",
    "1 N..1 N:3",
    "nan..1 N:2",
    "1..2:2",
    "",
    ",",
    "..",
    "1 N..",
    ":3",
    "1 N..2 N:3log",
    "0 N..2 N:3log",
    "-1 N..2 N:3log",
    "1 N..2 N:3x",
    "1 N,1 N",
    "0.1..0.6",
    "1 N..2 m:2",
    "1 N..2 N:2.5",
    "a,b",
    "1 N..1e300 N:3",
    "1 N;2 N",
)
KEYS = (
    "normal.load",
    "contact.load",
    "friction.static",
    "drive.frequency",
    "structure.mode.m.frequency",
    "",
    "accuracy.tolerance",
    "structure.mode.0.damping",
    "friction.law",
    "nothing",
    "a.b",
    "contact",
    "title",
    ".",
    "contact.tilt.angle",
    "structure.mode",
    "normal..load",
    "sweep",
    "normal.load.x",
    "structure.mode.x.frequency",
)
LENGTHS = ("0.25 mm", "0 mm", "-1 mm", "1e9 m", "1e-30 m", "mm", "nan mm", "5", "")


def run_words_trial(trial: Trial) -> None:
    """Run one random command line, with its files in the folder."""
    for name, tables in SCENES.items():
        (trial.folder / name).write_text(to_toml(tables), "utf-8")
    for name, kind in (
        ("a.csv", "trace"),
        ("b.csv", "trace"),
        ("loop.csv", "loop"),
        ("rows.csv", "rows"),
    ):
        (trial.folder / name).write_bytes(make_damaged_csv(trial, kind)[0])
    verb = trial.draw("sweep", "fit", "demo", "doctor", "torture", "nothing", "", *FORMS)
    words = [verb, *FORMS.get(verb, lambda trial: [])(trial)]
    for _ in range(trial.draw(0, 0, 0, 1, 2)):
        position = 1 + int(trial.r.integers(len(words)))
        words[position:position] = [trial.draw(*ODD)()] if trial.chance(0.5) else [draw_word(trial)]
    # These commands are slow by design, so they get an invalid option.
    if "demo" in words or "torture" in words:
        words = words[:1] + [word for word in words[1:] if word.startswith("--")] + ["--nothing"]
    trial.run(*words, seconds=30.0)


def draw_word(trial: Trial) -> str:
    """Return a word without meaning."""
    return str(
        trial.draw(
            *TEXTS,
            *NUMBERS,
            "-",
            "--",
            "-o",
            "--set",
            "--json",
            "-q",
            "-v",
            "--resume",
            "--frame",
            "-j",
            "--over",
            "rig.toml",
            "a.csv",
            "/",
            "..",
            "--no-page",
            "--help",
        )
    ).replace("\x00", "")


ODD = (
    lambda: "--nothing",
    lambda: "-z",
    lambda: "--json=maybe",
    lambda: "--out=",
    lambda: "--set=",
    lambda: "-jx",
)


def draw_file(trial: Trial) -> str:
    """Return the name of a file, in most cases of a scene."""
    return trial.draw(
        "patch.toml",
        "bench.toml",
        "bench.toml",
        "rig.toml",
        "rig.toml",
        "nowhere.toml",
        "a.csv",
        ".",
    )


def draw_key(trial: Trial) -> str:
    """Return a key of a scene, or nearly one."""
    return (
        trial.draw(*KEYS)
        if trial.chance(0.8)
        else ".".join(map(str, trial.draw(*list_schema_keys())[0]))
    )


def draw_sets(trial: Trial) -> list:
    """Return none to two options --set."""
    out = []
    for _ in range(trial.draw(0, 0, 1, 2)):
        value = trial.draw(
            "1 N",
            "0.2",
            "5",
            "",
            "nan",
            "x",
            "1 N,2 N",
            "[1, 2]",
            "{}",
            "1e400",
            '"1 N"',
            "true",
            "é",
            "=",
            trial.draw(*grammar.LAWS),
            "1 kHz",
            "0 m/s^2",
            "\x1b[1m",
        )
        out += ["--set", f"{draw_key(trial)}{trial.draw('=', '=', '=', '', '==', ' = ')}{value}"]
    return out


def draw_over(trial: Trial) -> list:
    """Return one or two options --over."""
    out = []
    for _ in range(trial.draw(1, 1, 2)):
        out += ["--over", f"{draw_key(trial)}={trial.draw(*RANGES)}"]
    return out


def draw_profile_words(t: Trial) -> list:
    """Return the words of the command profile."""
    options = (
        ["b.csv"],
        ["--cutoff", t.draw(*LENGTHS)],
        ["--json"],
        ["-v"],
        ["--window", t.draw("1 um,5 um", "5 um,1 um", "x", "1 um", ",")],
        ["--units", t.draw("um,um", "um", "x,y", ",")],
    )
    return [
        t.draw("a.csv", "rows.csv", "nowhere", "."),
        *(word for option in options if t.chance(0.3) for word in option),
    ]


def draw_fit_words(t: Trial) -> list:
    """Return the words of the command fit."""
    span = t.draw("0.1..0.6", "0.6..0.1", "1 N..2 N", "x", "", "..", "0..0", "nan..1")
    return [
        t.draw("bench.toml", "patch.toml", "nowhere.toml", "rig.toml"),
        "--to",
        t.draw("loop.csv", "a.csv", "nowhere", "", "worn_depth_max=1 um..2 um"),
        "--free",
        f"{draw_key(t)}={span}",
        "-o",
        "out",
        *t.draw(
            [],
            ["--hold", "frequency=1 Hz"],
            ["--starts", "0"],
            ["--starts", "-1"],
            ["--offset", "x"],
        ),
    ]


def draw_import_words(t: Trial) -> list:
    """Return the words of the command import."""
    option = t.draw(
        [],
        ["--map", t.draw("force=force", "x", "=", "force=1:+x [N]", "time=t [s]")],
        ["--zero"],
        ["--segment", t.draw("1 s", "0 s", "x")],
        ["--band", t.draw("1 Hz..9 Hz", "x..", "..")],
        ["--decay"],
    )
    return [
        t.draw("loop.csv", "a.csv", "nowhere.mat", "rows.csv"),
        "-o",
        t.draw("o.csv", "o.toml", "o.uff", "o.x"),
        *option,
    ]


FORMS = {
    "run": lambda t: [
        draw_file(t),
        *draw_sets(t),
        "-o",
        t.draw("out", "out", "a.csv", ".", ""),
        *t.draw([], ["--json"], ["-q"], ["-v", "--no-page"]),
    ],
    "plan": lambda t: [
        draw_file(t),
        *draw_sets(t),
        *(draw_over(t) if t.chance(0.5) else []),
        *t.draw([], ["--json"], ["--probe"]),
    ],
    "check": lambda t: [draw_file(t), *draw_sets(t), *t.draw([], ["--json"])],
    "sweep": lambda t: [
        draw_file(t),
        *draw_over(t),
        *draw_sets(t),
        "-o",
        "out",
        *t.draw(
            ["-j", "1"],
            ["-j", "1"],
            ["-j", "0"],
            ["-j", "-3"],
            ["--executor", "x"],
            ["--keep", "x"],
        ),
    ],
    "cost": lambda t: [
        t.draw("nowhere.toml", "bench.toml"),
        "-o",
        "out",
        *t.draw([], ["--over", t.draw("steps_per_cycle", "element_size", "nothing", "")]),
    ],
    "fit": draw_fit_words,
    "profile": draw_profile_words,
    "import": draw_import_words,
    "mesh": lambda t: [
        draw_file(t),
        *draw_sets(t),
        "-o",
        t.draw("m.msh", "m.vtu", "m.xyz", "m", "", "no/m.msh", "."),
    ],
    "compare": lambda t: [
        "a.csv",
        t.draw("b.csv", "a.csv", "nowhere"),
        "--direction",
        t.draw("x", "y", "z", ""),
        "-o",
        "out",
        *t.draw([], ["--scene", draw_file(t), *draw_sets(t)], ["--units", "um,um"]),
    ],
    "export": lambda t: [
        t.draw("out", "nowhere", ".", "a.csv"),
        "-o",
        t.draw("x.vtu", "x.csv", "x.uff", "x.py", "x"),
        *t.draw([], ["--frame", t.draw("0", "-1", "x", "9" * 20)], ["--histories"]),
    ],
    "report": lambda t: [*t.draw([], ["nowhere"], [".", "."]), "-o", t.draw("r.html", "", ".")],
    "view": lambda t: [
        t.draw("nowhere", ".", "a.csv"),
        "-o",
        t.draw("p.png", "p.x", ""),
        *t.draw([], ["--magnify", t.draw("nan", "0", "-1", "1e400", "x")]),
    ],
    "new": lambda t: [
        *t.draw([], ["joint"], ["nothing"], ["joint", "-o", "rig.toml"], ["joint", "-o", "."])
    ],
    "schema": lambda t: ["-o", t.draw("s.json", ".", "no/s.json", "")],
    "cite": lambda t: [*t.draw([], [draw_file(t)])],
}
