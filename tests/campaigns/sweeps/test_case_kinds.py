"""Every case of each kind of sweep agrees with its single run, and meets the tolerance or says why not."""

from pathlib import Path

import numpy as np
import pytest
from command_line import run_cli
from point_cases import DRIVES, LAWS, MANY, SCENE
from scene_texts import BLOCK, COATING, COULOMB, MODE, POINT
from sweep_tables import read_rows

import patchfem as pf
from patchfem.export import store

SHIPPED = Path(__file__).parents[3] / "studies/rig/rig.toml"
TILT = '[contact.tilt]\nangle = "0.05 mrad"\n'
CROWN = '[contact.crown]\nradius = "3 m"\n'
STEP = '[contact.step]\nheight = "0.1 um"\nat = "2 mm"\n'
PATCH = BLOCK + COATING + TILT
RIG = '[friction]\nlaw = "elastic-plastic"\nstatic = 0.3\nbond_length = "1 um"\n' + MODE
DRIVE = '[drive]\nkind = "base"\nfrequency = "120 Hz"\nacceleration = "6 g"\ncycles = 60\n'
# Scene and options of each kind of sweep, in which {n} is the number of cases
KINDS = {
    "load": (PATCH, ["--over", "contact.load=20 N..900 N:{n}"]),
    "tilt": (PATCH, ["--over", "contact.tilt.angle=-0.2 mrad..0.2 mrad:{n}"]),
    "crown": (PATCH + CROWN, ["--over", "contact.crown.radius=1 m..40 m:{n}"]),
    "step": (
        PATCH + STEP,
        ["--over", "contact.step.height=-0.3 um..0.4 um:{n}"],
    ),
    "unlike": (
        PATCH + '[contact.upper]\nsubstrate = "steel"\n',
        ["--over", "contact.load=20 N..900 N:{n}"],
    ),
    "rounded": (
        PATCH + '[contact.upper]\nend_radius = "1 mm"\n',
        ["--over", "contact.load=20 N..900 N:{n}"],
    ),
    "thickness": (PATCH, ["--over", "contact.coating.thickness=0.1 mm..0.4 mm:{n}"]),
    "profile": (
        PATCH + '[contact.profile]\nfile = "a.csv"\n',
        ["--over", "contact.profile.file=a.csv,b.csv", "--over", "contact.load=50 N..400 N:{half}"],
    ),
    "law keys": (
        POINT + RIG + DRIVE,
        [
            "--over",
            "friction.static=0.1..0.5:{half}",
            "--over",
            "friction.law=elastic-plastic,coulomb",
        ],
    ),
    "frequency": (POINT + RIG + DRIVE, ["--over", "drive.frequency=90 Hz..170 Hz:{n}"]),
    "two keys": (
        PATCH,
        [
            "--over",
            "contact.load=50 N..400 N:{half}",
            "--over",
            "contact.tilt.angle=0 rad,0.1 mrad",
        ],
    ),
    "three keys": (
        PATCH + CROWN,
        [
            "--over",
            "contact.load=50 N..400 N:{half}",
            "--over",
            "contact.tilt.angle=0.01 mrad,0.1 mrad",
            "--over",
            "contact.crown.radius=2 m,20 m",
        ],
    ),
    "Sobol": (
        POINT + COULOMB + MODE + DRIVE,
        [
            "--over",
            "friction.static=0.1..0.6",
            "--over",
            "normal.load=50 N..150 N",
            "--sobol",
            "{n}",
        ],
    ),
    "table": (PATCH + STEP, ["--cases", "cases.csv"]),
    **{
        law: (
            SCENE.format(law=text, drive=DRIVES["drive.acceleration"]),
            [
                "--over",
                "friction.static=0.25..0.5",
                "--over",
                "drive.frequency=90 Hz..250 Hz",
                "--sobol",
                "{n}",
            ],
        )
        for law, text in LAWS.items()
    },
    "without friction": (
        SCENE.format(law=LAWS["nonlocal"], drive=DRIVES["drive.acceleration"]),
        [
            "--over",
            "friction.static=0..0.6:{half}",
            "--over",
            "structure.mode.axial.frequency=143 Hz,4290 Hz",
        ],
    ),
    "shipped rig": (
        SHIPPED.read_text("utf-8").partition("[measured]")[0],
        ["--over", "contact.load=70 N..125 N:{n}"],
    ),
}
FAST = ("law keys", "table")
CASE_COLUMNS = "contact.load [N],contact.tilt.angle [mrad],contact.step.height [um]"


def write_inputs(n: int) -> None:
    """Write two profiles and a table of n cases into the current folder."""
    t = np.linspace(-1, 1, 161)
    for name, shape in (("a.csv", 0.2 * np.cos(3 * t)), ("b.csv", 0.3 * t**2)):
        rows = [f"{7 * x:.6f},{z:.6f}" for x, z in zip(t, shape)]
        Path(name).write_text("\n".join(["x [mm],z [um]", *rows]) + "\n")
    rng = np.random.default_rng(n)
    loads, tilts, steps = rng.uniform((30, -0.1, -0.3), (900, 0.1, 0.4), (n, 3)).T
    rows = [
        f"{load:.4f},{tilt:.5f},{step:.4f},{plane}"
        for load, tilt, step, plane in zip(loads, tilts, steps, n * ["strain", "stress"])
    ]
    Path("cases.csv").write_text("\n".join([f"{CASE_COLUMNS},contact.plane", *rows]) + "\n")


def compare_kind(kind: str, n: int, n_compared: int | None = None) -> list[float]:
    """Run a sweep of a kind with about n cases, and compare cases, all by default, with their single runs.

    Returns the differences of their values, relative to the sum of both errors.
    """
    text, options = KINDS[kind]
    write_inputs(n)
    Path("scene.toml").write_text(text)
    words = [word.format(n=n, half=max(n // 2, 2)) for word in options]
    answer = run_cli(
        "sweep", "scene.toml", *words, "--keep", "none", "--no-page", "-q", "-o", "out"
    )
    assert answer.code in (0, 3) and "fault" not in answer.out + answer.err, answer.err
    data = store.read_answer(Path("out")).data
    rows = read_rows(Path("out"))
    keys = list(rows[0])[: list(rows[0]).index("outcome")]
    columns = {
        name: [data[name + end].values.ravel() for end in ("", "_error")]
        for name in data
        if f"{name}_error" in data
    }

    ratios = []
    for case, row in list(enumerate(rows))[:n_compared]:
        single = pf.run("scene.toml", **{key: row[key] for key in keys})
        assert row["outcome"] == single.outcome, (kind, case)
        tolerance = single.plan.model.accuracy.tolerance
        for name, (values, errors) in columns.items():
            # The case meets its tolerance, or says why not.
            if np.isfinite(errors[case]):
                floor = f"{name}_floor"
                allowed = tolerance * abs(values[case])
                allowed += data[floor].values.ravel()[case] if floor in data else 0
                assert errors[case] <= allowed or row["message"], (kind, case, name)

            # A value that both have differs by no more than both errors.
            measure = single.measures.get(name)
            if (
                measure is None
                or measure.value is None
                or measure.error is None
                or not np.isfinite(values[case])
            ):
                continue
            # Values that are 0 but for round-off have no error.
            allowed = errors[case] + measure.error + 1e-9 * (abs(measure.value) + measure.floor)
            ratios.append(abs(values[case] - measure.value) / allowed)

    assert len(ratios) >= 8 * len(rows[:n_compared])
    return ratios


@pytest.mark.parametrize(
    "kind", [pytest.param(kind, marks=pytest.mark.long if kind == "table" else ()) for kind in FAST]
)
def test_always_some_cases_agree_with_single_runs(kind, tmp_path, monkeypatch):
    """Values are within the sum of both errors, the outcome is the same, and a case that misses its tolerance says why."""
    monkeypatch.chdir(tmp_path)
    assert max(compare_kind(kind, 4)) <= 1


@pytest.mark.parametrize(
    "law",
    [
        pytest.param(law, marks=pytest.mark.long if place % 2 else ())
        for place, law in enumerate(LAWS)
    ],
)
def test_always_points_of_a_law_agree_with_single_runs(law, tmp_path, monkeypatch):
    """The values of the first of many points, which are marched together, lie within the sum of both errors."""
    monkeypatch.chdir(tmp_path)
    assert max(compare_kind(law, MANY, 4)) <= 1


def test_always_points_without_friction_agree_with_single_runs(tmp_path, monkeypatch):
    """The first two of many points, whose bonds carry no force, have the outcome and the values of single runs."""
    monkeypatch.chdir(tmp_path)
    assert max(compare_kind("without friction", MANY, 2)) <= 1


@pytest.mark.slow
@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind not in LAWS])
def test_always_cases_agree_with_single_runs(kind, tmp_path, monkeypatch):
    """Twenty cases of each kind of sweep agree with single runs in the same way."""
    monkeypatch.chdir(tmp_path)
    assert max(compare_kind(kind, 40 if kind == "Sobol" else 20)) <= 1
