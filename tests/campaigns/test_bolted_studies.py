"""Sweeps, backbones and fits of a rig whose modes were measured with the joint bolted.

The joint that is subtracted from the modes is that of the scene as written, so that all cases have the
same structure.
"""

import shlex
from pathlib import Path

import numpy as np
import pytest
from command_line import read_json, run_successfully

import patchfem as pf
from patchfem.core import PatchfemError
from patchfem.scene import loads

MASS = 1.3  # modal mass [kg]
SLIDE = 0.0169  # motion of the contact per motion of the output
POINT = """\
[normal]
load = "4 kN"
[friction]
law = "elastic-plastic"
static = 0.3
bond_length = "1.5 um"
"""
ROUGH = """\
[contact]
length = "40 mm"
width = "30 mm"
height = "10 mm"
load = "4 kN"
substrate = "steel"
[contact.asperities]
law = "exponential"
decay_length = "2 um"
tangential_ratio = 0.8
[contact.shear]
[friction]
law = "coulomb"
static = 0.3
"""
LAP_JOINT = """\
[contact]
length = "40 mm"
width = "30 mm"
height = "10 mm"
element_size = "{size}"
load = "10.7 kN"
substrate = "steel"
[contact.crown]
radius = "31 m"
[contact.shear]
[friction]
law = "coulomb"
static = 0.34
[accuracy]
tolerance = 1e-2
"""
MODE = f"""\
[structure]
moving_mass = "{MASS} kg"
measured = "stuck"
[[structure.mode]]
name = "first"
frequency = "212 Hz"
damping = 0.002
slide = {SLIDE}
output = 1.0
"""
DRIVE = """\
[drive]
kind = "force"
frequency = "212 Hz"
force = "0.2 N"
cycles = 60
"""
LOADS = ("3.2 kN", "4 kN", "4.8 kN")


def stuck_frequency(joint_stiffness: float, bolted_stiffness: float) -> float:
    """Return the frequency [Hz] of the mode with a sticking joint, after another joint was subtracted."""
    square = (2 * np.pi * 212.0) ** 2 + (joint_stiffness - bolted_stiffness) * SLIDE**2 / MASS
    return float(np.sqrt(square) / (2 * np.pi))


@pytest.mark.parametrize("contact, key", [(POINT, "normal.load"), (ROUGH, "contact.load")])
def test_exact_backbone_over_load_has_stuck_frequency_of_each_load(contact, key):
    """The stuck frequency rises with the load as the stiffness of the joint does, and the free one stays."""
    stiffnesses = []
    for load in LOADS:
        if contact is POINT:
            stiffnesses.append(0.3 * float(load.split()[0]) * 1e3 / 1.5e-6)
        else:
            # The joint of each load sticks, as the joint of the backbone does
            own = {"structure.measured_joint": "case"}
            run = pf.run(contact + MODE + DRIVE, **{key: load}, **own)
            stiffnesses.append(run.measures["tangential_stiffness"].value)
    for load, stiffness in zip(LOADS, stiffnesses):
        curves = pf.backbone(
            contact + MODE + DRIVE, amplitudes="0.1 um", method="balance", **{key: load}
        )
        expected = stuck_frequency(stiffness, stiffnesses[1])
        assert curves.attrs["stuck_frequency"] == pytest.approx(expected, rel=1e-9)
        free = stuck_frequency(0.0, stiffnesses[1])
        assert curves.attrs["free_frequency"] == pytest.approx(free, rel=1e-9)
        assert "the joint of the scene as written, " in str(curves.attrs["notes"])


def test_exact_modes_given_beside_the_scene_keep_their_slide():
    """Modes given beside the scene have the slide and the free frequency of the scene as written."""
    text = ROUGH + f'[structure]\nmoving_mass = "{MASS} kg"\n'
    free = [
        pf.backbone(text, modes="212 Hz:0.002", amplitudes="0.1 um", **changes).attrs[
            "free_frequency"
        ]
        for changes in ({}, {"contact.load": "4.8 kN"})
    ]
    assert free[1] == pytest.approx(free[0], rel=1e-12)


@pytest.mark.long
@pytest.mark.parametrize("method", ["quasi_static", "balance"])
def test_always_errors_of_assumed_slides_include_the_stiffness_of_the_joint(method):
    """Coarse and fine meshes agree within their errors, and on each the joint has a tenth of the stiffness of the mode."""
    coarse, fine = (
        pf.backbone(
            LAP_JOINT.format(size=size),
            modes="74 Hz:0.002",
            amplitudes="0.1 mm, 0.5 mm, 2 mm, 6 mm",
            method=method.replace("_", "-"),
        )
        for size in ("0.5 mm", "0.125 mm")
    )
    for curves in (coarse, fine):
        assert curves.attrs["free_frequency"] == pytest.approx(74 * np.sqrt(0.9), rel=1e-9)
    for name in (f"{method}_frequency", f"{method}_damping"):
        error = coarse[f"{name}_error"] + fine[f"{name}_error"]
        assert (np.abs(coarse[name] - fine[name]) <= error).all(), name
    # In gross slip the frequency is nearly the free one, whatever the stiffness of the joint.
    assert coarse[f"{method}_frequency_error"][-1] < 2e-3


@pytest.mark.parametrize("modes", ["", "212 Hz:0.002:0.0169"])
def test_scene_written_by_a_backbone_over_load_has_the_load_of_the_modal_test(
    tmp_path: Path, monkeypatch, modes: str
):
    """The resolved scene of a backbone over loads is that as written, and has the curve of its own load."""
    monkeypatch.chdir(tmp_path)
    structure = MODE if not modes else f'[structure]\nmoving_mass = "{MASS} kg"\n'
    Path("joint.toml").write_text(POINT + structure + (DRIVE if not modes else ""))
    options = ["--amplitudes", "300 um", "--method", "balance", "--no-page"]
    options += ["--modes", modes] if modes else []
    over = ("--over", "normal.load=3.2 kN,4 kN")
    run_successfully("backbone", "joint.toml", *over, *options, "-o", "out")
    details = read_json("out/backbone.json")
    written = loads(Path("out/scene.resolved.toml").read_text())
    assert written.normal.load == 4e3

    # The scene without --modes is the complete rig, with the same joint subtracted.
    again = pf.backbone(Path("out/scene.resolved.toml"), amplitudes="300 um", method="balance")
    frequency = details["cases"][1]["curves"]["balance"]["frequency"]
    assert again["balance_frequency"].values == pytest.approx(frequency, rel=1e-9)


@pytest.mark.parametrize(
    "joint, key, values, end",
    [
        (
            "written",
            "contact.load",
            ["3.2 kN", "4 kN"],
            "scene; set it there to that of the modal test.",
        ),
        (
            "written",
            "normal.load",
            ["3.2 kN", "4 kN"],
            "scene; set it there to that of the modal test.",
        ),
        (
            "written",
            "normal.load",
            ["3.2 kN", "4.8 kN"],
            ", which no curve has; set it there to that of the modal test.",
        ),
        ("case", "normal.load", ["3.2 kN", "4 kN"], None),
        ("written", "structure.moving_mass", ["1.3 kg", "1.5 kg"], None),
    ],
)
def test_backbone_over_load_states_the_load_of_the_modal_test(joint, key, values, end):
    """A note names the load of the scene, and says if no curve has it; none does where no other joint is subtracted."""
    text = (ROUGH if key == "contact.load" else POINT) + MODE + DRIVE
    text = text.replace('"stuck"', f'"stuck"\nmeasured_joint = "{joint}"')
    curves = pf.backbone(text, amplitudes="10 um", method="balance", over={key: values})
    notes = [note for note in curves.attrs["notes"] if "count as measured" in note]
    assert len(notes) == (end is not None)
    for note in notes:
        assert f"{key} = 4 kN, the value in the scene" in note and note.endswith(end)


def test_backbone_over_a_key_that_its_scene_lacks_has_the_scene_of_the_first_value():
    """Free modes do not need the scene as written, so a scene may have its load by the values of `over` only."""
    text = (POINT + MODE + DRIVE).replace('load = "4 kN"\n', "").replace('"stuck"', '"free"')
    curves = pf.backbone(
        text, amplitudes="10 um", method="balance", over={"normal.load": ["3.2 kN", "4 kN"]}
    )
    assert curves["balance_frequency"].shape == (2, 1)


@pytest.mark.slow
def test_exact_fit_of_the_bolted_joint_finds_its_stiffness(tmp_path: Path):
    """A fit of a joint that was bolted in the modal test finds the bond length of synthetic data with
    measured_joint = "case"; with the joint of the scene as written it warns."""
    case = (POINT + MODE + DRIVE).replace('"stuck"', '"stuck"\nmeasured_joint = "case"')
    truth = pf.backbone(case, amplitudes="20 um..400 um:4", method="balance")
    rows = zip(
        truth["balance_amplitude"].values,
        truth["balance_frequency"].values,
        truth["balance_damping"].values,
    )
    table = tmp_path / "curve.csv"
    table.write_text(
        "amplitude [m],frequency [Hz],damping\n"
        + "\n".join(f"{a:.17g},{f:.17g},{z:.17g}" for a, f, z in rows)
    )
    free = {"friction.bond_length": ("1 um", "3 um")}
    guess = case.replace("1.5 um", "2.2 um")
    fitted = pf.fit(guess, table, free=free)
    assert fitted["values"]["friction.bond_length"]["value"] == pytest.approx(1.5e-6, rel=1e-4)
    assert not any("measured_joint" in text for text in fitted["warnings"])
    written = pf.fit(guess.replace('measured_joint = "case"\n', ""), table, free=free)
    assert any('measured_joint = "case"' in text for text in written["warnings"])


def test_refuses_study_whose_scene_as_written_is_not_valid():
    """A scene that has a load only by the values of a study has no joint that could have been bolted."""
    text = (POINT + MODE + DRIVE).replace('load = "4 kN"\n', "")
    with pytest.raises(
        PatchfemError, match=r"the scene as written.*normal.load.*measured_stiffness"
    ):
        pf.backbone(text, **{"normal.load": "4 kN"})
    stated = text.replace('"stuck"', '"stuck"\nmeasured_stiffness = "8e8 N/m"')
    scene = loads(stated, "a.toml", ["normal.load=4 kN"])
    assert scene.written is None and pf.build(scene).rig.structure.bolted.origin == "given"


BONDED = (
    POINT
    + MODE
    + DRIVE
    + """\
[structure.bonded]
stiffness = "1e7 N/m"
damping = "2 N s/m"
"""
)
PRESSED = ROUGH + MODE + DRIVE
# Options of a sweep, by the kind of its cases; the first value of the key is not that of the scene.
SWEEPS = {
    "over": ["--over", "{key}=3.2 kN,4 kN"],
    "cases": ["--cases", "cases.csv"],
    "random": ["--over", "{key}=3.2 kN..4.8 kN", "--random", "2"],
    "sobol": ["--over", "{key}=3.2 kN..4.8 kN", "--sobol", "2"],
    "table": [],
    "pairs": ["--over", "{key}=3.2 kN,4 kN", "--over", "drive.force=0.1 N,0.2 N"],
    "set": ["--over", "drive.force=0.1 N,0.2 N", "--set", "{key}=3.2 kN"],
}


@pytest.mark.parametrize(
    "kind",
    [
        "cases",
        "set",
        *(pytest.param(kind, marks=pytest.mark.long) for kind in ("sobol", "table", "pairs")),
        *(pytest.param(kind, marks=pytest.mark.slow) for kind in ("over", "random")),
    ],
)
@pytest.mark.parametrize(
    "text, key",
    [(BONDED, "normal.load"), pytest.param(PRESSED, "contact.load", marks=pytest.mark.slow)],
)
def test_exact_each_case_is_repeated_by_its_scene_and_its_command(
    tmp_path: Path, monkeypatch, text: str, key: str, kind: str
):
    """The resolved scene of a case, and its command, subtract the joint of the sweep: same values, errors and outcome."""
    monkeypatch.chdir(tmp_path)
    table = f'[sweep]\n"{key}" = "3.2 kN,4.8 kN"\n' if kind == "table" else ""
    Path("joint.toml").write_text(text + table)
    Path("cases.csv").write_text(f"{key} [kN]\n3.2\n4.4\n")
    options = [option.format(key=key) for option in SWEEPS[kind]]
    run_successfully("sweep", "joint.toml", *options, "--keep", "results", "--no-page", "-o", "out")

    for case in Path("out/cases").iterdir():
        row = read_json(case / "summary.json")
        run_successfully("run", case / "scene.resolved.toml", "--no-page", "-o", "again")
        # The words after "patchfem run joint.toml"
        words = shlex.split(row["origin"]["command"])[3:]
        run_successfully("run", "joint.toml", *words, "--no-page", "-o", "command")
        for folder in ("again", "command"):
            repeated = read_json(f"{folder}/summary.json")
            assert repeated["outcome"] == row["outcome"]
            assert repeated["measures"] == row["measures"]


@pytest.mark.parametrize(
    "text, key", [(BONDED, "normal.load"), (ROUGH + MODE + DRIVE, "contact.load")]
)
def test_exact_set_subtracts_the_joint_of_the_file(text: str, key: str):
    """A changed load of a single run or of a plan leaves the structure alone, as in a sweep and a backbone."""
    written = pf.plan(text)
    changed = pf.plan(text, **{key: "3.2 kN"})
    assert changed.model.rig.modes.omega == pytest.approx(written.model.rig.modes.omega, rel=1e-12)
    assert changed.modes(changed.chain)[0]["stuck_frequency"] < 211
    own = pf.plan(text, **{key: "3.2 kN", "structure.measured_joint": "case"})
    assert own.modes(own.chain)[0]["stuck_frequency"] == pytest.approx(212, rel=1e-9)
    assert "measured_stiffness" not in own.model.source.resolved


def test_exact_each_of_several_interfaces_states_its_stiffness(tmp_path: Path):
    """The resolved scene of a rig with several interfaces has the stiffness that was subtracted at each of them."""
    mass = np.diag([1.0, 2.0])
    stiffness = np.array([[4e6, -1e6], [-1e6, 6e6]])
    rows = {"output": np.array([1.0, 0.0]), "base": np.ones(2)}
    np.savez(tmp_path / "rig.npz", M=mass, K=stiffness, C=1e-5 * stiffness, **rows)
    law = POINT.partition("[friction]\n")[2]
    text = '[structure]\nfile = "rig.npz"\nmeasured = "stuck"\n'
    for number in (1, 2):
        text += f'[[structure.interface]]\nbetween = [{number}, 0]\nload = "{number} N"\n{law}'
    (tmp_path / "rig.toml").write_text(text + DRIVE)

    changed = pf.build(tmp_path / "rig.toml", **{"structure.interface.0.load": "1.5 N"})
    (tmp_path / "again.toml").write_text(changed.source.resolved)
    repeated = pf.build(tmp_path / "again.toml")
    assert repeated.rig.structure.bolted.subtracted.stiffness == pytest.approx(
        (2e5, 4e5), rel=1e-12
    )
    assert (repeated.rig.modes.omega == changed.rig.modes.omega).all()


@pytest.mark.parametrize(
    "old, new, message",
    [
        ('measured = "stuck"', 'measured_stiffness = "1e7 N/m"', "add structure.measured"),
        (
            'measured = "stuck"',
            'measured = "stuck"\nmeasured_joint = "case"\nmeasured_stiffness = "1e7 N/m"',
            "keep only one",
        ),
        ('measured = "stuck"', 'measured = "stuck"\nmeasured_stiffness_error = "1 N/m"', "missing"),
    ],
)
def test_refuses_a_measured_stiffness_without_meaning(old: str, new: str, message: str):
    """The keys of the subtracted joint need modes that were measured with it, and contradict `measured_joint = "case"`."""
    with pytest.raises(PatchfemError, match=message):
        pf.load((ROUGH + MODE + DRIVE).replace(old, new))


@pytest.mark.slow
def test_fitted_scene_subtracts_the_joint_of_the_fit(tmp_path: Path, monkeypatch):
    """The scene that a fit writes has the curve of the fit, though its load is not that of the modal test."""
    monkeypatch.chdir(tmp_path)
    Path("joint.toml").write_text(POINT + MODE + DRIVE)
    key = "normal.load"
    truth = pf.backbone(
        Path("joint.toml"), amplitudes="20 um..400 um:4", method="balance", **{key: "3.6 kN"}
    )
    columns = [truth[f"balance_{name}"].values for name in ("amplitude", "frequency", "damping")]
    header = "amplitude [m],frequency [Hz],damping"
    np.savetxt("curve.csv", np.transpose(columns), "%.17g", ",", header=header, comments="")
    run_successfully(
        "fit",
        "joint.toml",
        "--to",
        "curve.csv",
        "--free",
        f"{key}=3 kN..5 kN",
        "-o",
        "fit",
        "--no-page",
    )
    fitted = pf.backbone(
        Path("fit/scene.fitted.toml"), amplitudes="20 um..400 um:4", method="balance"
    )
    assert fitted["balance_frequency"].values == pytest.approx(columns[1], rel=1e-6)


@pytest.mark.long
@pytest.mark.parametrize("joint", ["1.5 um", "0.01 um"])
def test_always_default_amplitudes_resolve_the_onset_of_slip(joint: str):
    """Frequency and damping ratio change by at most 8 % of their range between neighbouring default amplitudes."""
    text = (POINT + MODE + DRIVE).replace("1.5 um", joint).replace('"stuck"', '"free"')
    curves = pf.backbone(text, method="balance")
    for name in ("frequency", "damping"):
        values = curves[f"balance_{name}"].values
        assert np.abs(np.diff(values)).max() <= 0.081 * np.ptp(values), name
