"""Number files with wrong cells, headers and bytes: traces, signals, paths, rows and loops.

Damage that leaves no meaning (a word for a number, no unit, no rows, decreasing time) must be
refused.
"""

import numpy as np
import scipy.optimize  # noqa: F401  (imported before any fork, so that not every trial has to)

from .results import run_scene
from .scenes import damage_bytes
from .toml import to_toml
from .trial import Trial, TrialFailure, parse_strict_json

HEADS = {
    "trace": "x [um],z [um]",
    "signal": "time [s],acceleration [m/s^2]",
    "path": "time [s],displacement [m]",
    "rows": "frequency [Hz],input [g],acceleration [g],displacement [mil],flag",
    "loop": "time [s],displacement [m],force [N]",
}
RUBS = {
    "normal": {"load": "20 N"},
    "friction": {"law": "coulomb", "static": 0.3},
    "accuracy": {"tolerance": 1e-2},
}
RIG = RUBS | {
    "structure": {
        "moving_mass": "1 kg",
        "mode": [{"name": "m", "frequency": "100 Hz", "damping": 0.01, "slide": 1.0}],
    }
}
BASE = {"kind": "base", "frequency": "90 Hz", "acceleration": "5 m/s^2", "cycles": 3}
ODD = (
    "", " ", "9" * 400, '"', "\x00", "x" * 5000, *"0 -0 1e308 -1e308 1e-320 1e400 0x10 1,5 1.5.2 ½ 1_000 ٣ 1e5000".split(),
    *"=1+1 ' # inf nan - 1d5 true".split(),
)  # fmt: skip


def draw_rows(trial: Trial, kind: str) -> list:
    """Return the rows of a valid table of a kind as lists of texts."""
    count = int(trial.r.integers(12, 60))
    step = trial.r.uniform(0.5, 1.5, count) if trial.chance(0.5) else np.ones(count)
    walk = np.cumsum(trial.r.normal(size=count))
    if kind == "trace":
        columns = (np.cumsum(step), walk)
    elif kind == "rows":
        rows = [
            (
                f"{f:.1f}",
                f"{a:.2f}",
                f"{3 * a:.3f}",
                f"{5 * a:.3f}",
                trial.draw("", "", "U", "R", "*"),
            )
            for f, a in zip(trial.r.uniform(80, 160, count), trial.r.uniform(1, 9, count))
        ]
        return [list(row) for row in rows]
    else:
        columns = [np.cumsum(step) * 1e-3, walk * (1e-6 if kind == "path" else 1.0)]
        columns[1] = columns[1] - columns[1][0] * (kind == "path")
        columns[0] = columns[0] - columns[0][0]
        columns += [np.tanh(walk)] if kind == "loop" else []
    return [[repr(float(value)) for value in row] for row in zip(*columns)]


def make_damaged_csv(trial: Trial, kind: str) -> tuple:
    """Return the bytes of a damaged table, and whether it must be refused."""
    rows = draw_rows(trial, kind)
    head = HEADS[kind]
    is_invalid = False
    damage = trial.draw(
        *"whole cell cell word unit empty headless back short long order damage damage comma huge".split()
    )
    row = int(trial.r.integers(len(rows)))
    if damage == "cell":
        rows[row][int(trial.r.integers(2))] = trial.draw(*ODD)
    elif damage == "word":
        rows[row][int(trial.r.integers(2))] = trial.draw("abc", "1.5 apples", "--", "1..2", "1e")
        is_invalid = True
    elif damage == "unit":
        head = (
            head.replace("[um]", "[parsec]").replace("[s]", "[fortnight]").replace("[Hz]", "[rpm]")
        )
        is_invalid = True
    elif damage == "empty":
        rows = []
        is_invalid = kind != "rows"
    elif damage == "headless":
        head = ""
        is_invalid = True
    elif damage == "back" and kind in ("signal", "path", "loop"):
        rows[1:] = rows[:0:-1]
        is_invalid = True
    elif damage == "short":
        rows[row] = rows[row][:1]
        is_invalid = True
    elif damage == "long":
        rows[row] = [*rows[row], "1", "2"]
    elif damage == "order":
        trial.r.shuffle(rows)
    elif damage == "huge":
        rows[row][1] = trial.draw("1e300", "-1e300", "1e25")
    delimiter = ";" if damage == "comma" else trial.draw(",", ",", ",", "\t")
    text = trial.draw("\n", "\n", "\r\n").join(
        [head.replace(",", delimiter)] * bool(head) + [delimiter.join(r) for r in rows]
    )
    if damage == "comma":
        text = text.replace(".", ",")
    data = text.encode(trial.draw("utf-8", "utf-8", "utf-8-sig", "utf-16"), "replace")
    if damage == "damage":
        return damage_data(trial, data), False
    return data, is_invalid


def damage_data(trial: Trial, data: bytes) -> bytes:
    """Return a copy of the data with some damaged bytes."""
    out = bytearray(data)
    for _ in range(trial.draw(1, 1, 2, 5)):
        damage_bytes(trial, out)
    return bytes(out)


def run_scene_with_file(
    trial: Trial, tables: dict, name: str, data: bytes, is_invalid: bool
) -> None:
    """Check, plan and run a scene that reads a file; TrialFailure if an invalid file is accepted."""
    (trial.folder / name).write_bytes(data)
    (trial.folder / "scene.toml").write_text(to_toml(tables), "utf-8")
    if run_scene(trial, "scene.toml") is not None and is_invalid:
        raise TrialFailure(f"{name} has no meaning and was taken")


def run_profiles_trial(trial: Trial) -> None:
    """Read traces alone, compare them, or press them."""
    data, is_invalid = make_damaged_csv(trial, "trace")
    (trial.folder / "trace.csv").write_bytes(data)
    run_json_command(
        trial,
        is_invalid,
        "profile",
        "trace.csv",
        "--json",
        *(("--cutoff", "5 um") if trial.chance(0.3) else ()),
    )
    if trial.chance(0.3):
        (trial.folder / "other.csv").write_bytes(make_damaged_csv(trial, "trace")[0])
        run_json_command(
            trial,
            is_invalid,
            "compare",
            "trace.csv",
            "other.csv",
            "--direction",
            "x",
            "-o",
            "out",
            "--json",
        )
    if trial.chance(0.3):
        contact = {
            "length": "10 mm",
            "width": "10 mm",
            "height": "5 mm",
            "load": "50 N",
            "substrate": "steel",
            "element_size": "0.5 mm",
            "profile": {"file": "trace.csv"},
        }
        run_scene_with_file(
            trial,
            {"contact": contact, "accuracy": {"tolerance": 1e-2}},
            "trace.csv",
            data,
            is_invalid,
        )


def run_json_command(trial: Trial, is_invalid: bool, *words) -> None:
    """Run a command whose output is JSON; TrialFailure if an invalid file is accepted."""
    result = trial.run(*words)
    if result.code == 0:
        if is_invalid:
            raise TrialFailure("a file without meaning was taken")
        parse_strict_json(result.out)


# Kind of table -> scene that reads it from the file table.csv.
SCENES = {
    "signal": RIG | {"drive": {"kind": "base", "waveform": "file", "file": "table.csv"}},
    "path": RUBS | {"slide": {"kind": "file", "file": "table.csv"}},
    "rows": RIG | {"drive": BASE, "measured": {"file": "table.csv"}},
}


def run_table_trial(trial: Trial) -> None:
    """Run a rig with a recorded base motion or measured rows, or a bench with a recorded slide; or read a loop."""
    kind = trial.draw(*SCENES, "loop")
    if kind == "loop":
        run_loop_trial(trial)
        return
    data, is_invalid = make_damaged_csv(trial, kind)
    run_scene_with_file(trial, SCENES[kind], "table.csv", data, is_invalid)


def run_loop_trial(trial: Trial) -> None:
    """Fit a bench to a friction loop, or import the loop."""
    data, is_invalid = make_damaged_csv(trial, "loop")
    (trial.folder / "loop.csv").write_bytes(data)
    if trial.chance(0.7):
        run_json_command(trial, is_invalid, "import", "loop.csv", "-o", "out.csv", "--json")
        return
    (trial.folder / "scene.toml").write_text(
        to_toml(RUBS | {"slide": {"kind": "sine", "amplitude": "10 um", "frequency": "10 Hz"}}),
        "utf-8",
    )
    run_json_command(
        trial,
        is_invalid,
        "fit",
        "scene.toml",
        "--to",
        "loop.csv",
        "--free",
        "friction.static=0.1..0.6",
        "-o",
        "out",
        "--json",
        "-q",
    )
