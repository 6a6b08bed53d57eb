"""Each feature that a release removed is refused with one sentence that names its replacement."""

import re
from functools import partial
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from command_line import run_cli
from lab_files import SI, make_record, write_universal
from scene_texts import COATED, COULOMB, DRIVE, MODE, POINT

import patchfem as pf
from patchfem.inputs import matrices, read_slide
from patchfem.scene.keys import removed
from patchfem.structure import universal
from patchfem.surface import read_surface

RIG = POINT + COULOMB + MODE + DRIVE
BENCH = f'{POINT}{COULOMB}[slide]\nkind = "sine"\namplitude = "9 um"\nfrequency = "1 Hz"\n'
MASSES = """[structure]
masses = ["1 kg", "1 kg"]
[[structure.spring]]
between = [1, 0]
stiffness = "1 kN/m"
[[structure.interface]]
between = [1, 2]
law = "coulomb"
static = 0.3
load = "10 N"
"""
JOINT = MASSES.replace('load = "10 N"\n', "") + DRIVE
JOINT += COATED.replace("[contact", "[structure.interface.contact")


def load(text: str, keys: dict, folder) -> None:
    """Load a scene with settings; `folder` is unused."""
    pf.load(text, **keys)


def run_failing_command(command: str, folder) -> None:
    """Run a command that fails with exit code 2, and raise its message."""
    answer = run_cli(*command.split())
    assert answer.code == 2
    raise pf.PatchfemError(answer.err)


def export_script(folder) -> None:
    """Export the results of a patch as a script for ParaView."""
    results = pf.run(COATED, **{"accuracy.tolerance": 0.05}).save(folder / "out")
    pf.export(results, folder / "play.py")


def write_responses(folder) -> Path:
    """Write a universal file with a frequency response, and return its path."""
    response = make_record([1.0, 2.0], [1j, 2j], 12, func_type=4, abscissa_spec_data_type=18)
    return write_universal(folder / "a.uff", [response])


def read_modes_as_arrays(folder) -> None:
    """Read a rig from a file of natural frequencies and slides."""
    np.savez(folder / "a.npz", frequency=[143.0], slide=[1.0])
    (folder / "a.toml").write_text(f'[structure]\nfile = "a.npz"\n{DRIVE}', "utf-8")
    pf.build(folder / "a.toml")


def read_two_directions(folder) -> None:
    """Read a prescribed slide with a column of a second direction."""
    path = folder / "path.csv"
    path.write_text("time [s],displacement [m],lateral [m]\n0,0,0\n1,1,1\n", "utf-8")
    read_slide(path)


def write_rig(folder):
    """Write the scene of a rig, and return its path."""
    path = folder / "rig.toml"
    path.write_text(RIG, "utf-8")
    return path


def import_shapes(folder: Path) -> None:
    """Import a universal file with a mode shape (data set 55) as modes."""
    pytest.importorskip("pyuff")
    shape = {"type": 55, "analysis_type": 2, "data_ch": 2, "spec_data_type": 8, "load_case": 1}
    shape |= {"mode_n": 1, "node_nums": [11, 12], "freq": 100.0, "modal_m": 1.0}
    shape |= {f"r{k}": np.zeros(2) for k in (1, 2, 3)}
    shape |= {"modal_damp_vis": 0.01, "modal_damp_his": 0.0}
    pf.import_(write_universal(folder / "shapes.uff", [SI, shape]), folder / "modes.toml")


COMMANDS = {  # removed option -> (command that uses it, replacement that the message names)
    "run --fresh": ("run a.toml --fresh", "leave it out: every run computes"),
    "fit --placebo": (
        "fit a.toml --placebo friction.static=0.3",
        "set another value of the key with --set",
    ),
    "fit --from-patch": ("fit a.toml --from-patch", "run the scene with its patch"),
    "fit --amplitudes": ("fit a.toml --amplitudes 1um,2um", "leave it out"),
    "fit --offset": ("fit a.toml --offset force", "subtract the offset"),
    "fit --warm-up": ("fit a.toml --warm-up", "hold them out"),
    "fit --resume": ("fit a.toml --resume", "fewer --starts"),
    "fit --seed": ("fit a.toml --seed 1", "give more --starts"),
    "fit --unstable": ("fit a.toml --unstable out", "--hold flag=U"),
    "sweep --of": ("sweep a.toml --of loop_area", "choose the measure on the page"),
    "plan --over": (
        "plan a.toml --over friction.static=0.2,0.3",
        "give the values of one case with --set",
    ),
    "plan --of": ("plan a.toml --of loop_area", "leave it out"),
    "import --segment": ("import a.uff -o b.toml --segment 2s", "fitted to the time record"),
    "import --window": ("import a.uff -o b.toml --window hann", "fitted to the time record"),
    "import -o .uff": ("import a.uff -o b.uff", "scipy.signal.csd"),
    "export --of": ("export out -o a.vtu --of sigma_yy", "choose the field in ParaView"),
    "compare of four files": (
        "compare a.csv b.csv c.csv d.csv",
        "compare each direction by itself",
    ),
}
COMMANDS |= {
    f"plan --{option}": (f"plan a.toml --{option} 8", "give the values of one case with --set")
    for option in ("cases", "random", "sobol", "seed")
}
PLAN_ATTRIBUTES = {
    "steps": "Result.settings of a run",
    **dict.fromkeys(("seconds", "compile_seconds", "cost"), "`patchfem plan --probe`"),
    "bytes": "ends with a sentence before it starts",
    "tolerance": "Result.findings of a run",
}
MEASURES = {
    "ring_frequency": "stuck frequency",
    "ring_damping": "decay of a release",
    **dict.fromkeys(("jump_level", "level_hysteresis"), "levels in Result.motion"),
}
TRIED = {  # removed feature -> (function that uses it, replacement that the message names)
    "structure.mode.lateral": (
        partial(load, RIG, {"structure.mode.axial.lateral": 0.2}),
        "the patch slides along x alone",
    ),
    "contact.strips": (
        partial(load, COATED, {"contact.strips.count": 4}),
        "use [contact.area]",
    ),
    "structure.interface.contact.strips": (
        partial(load, JOINT, {"structure.interface.0.contact.strips.count": 4}),
        "use [structure.interface.contact.area]",
    ),
    "accuracy.harmonics": (
        partial(load, RIG, {"accuracy.harmonics": 9}),
        "leave it out: method 'harmonic' computes the motion over one period to the tolerance",
    ),
    "friction.breakaway": (
        partial(load, RIG, {"friction.breakaway": 0.2}),
        "law 'iwan' or 'elastic-plastic' does not creep",
    ),
    "value with a tolerance": (
        lambda folder: pf.sweep(RIG, {"friction.static": "0.3 +- 5 %"}),
        "write the range as low..high",
    ),
    "export of a structure as .npz": (
        lambda folder: pf.export(write_rig(folder), folder / "rig.npz"),
        "exported as .mat",
    ),
    "export of a script for ParaView": (export_script, "write .pvd for older versions"),
    "backbone --method decay": (
        lambda folder: pf.backbone(write_rig(folder), method="decay"),
        'drive.kind = "free"',
    ),
    "the fit of modes to frequency responses": (
        lambda folder: universal.read_universal(write_responses(folder)),
        "write the modes of your modal analysis as dataset 55",
    ),
    "import of responses": (
        lambda folder: pf.import_(write_responses(folder), folder / "modes.toml"),
        "write the modes of your modal analysis as dataset 55",
    ),
    "a file of modes as arrays": (read_modes_as_arrays, "write M = m I, K = m diag(omega^2)"),
    "backbone --method all": (
        lambda folder: pf.backbone(write_rig(folder), method="all"),
        "leave it out: both methods are the default",
    ),
    "the import of mode shapes": (import_shapes, "give the file as structure.file"),
    "reading files of Nastran": (
        lambda folder: matrices.read_matrix(folder / "k.op4", "stiffness"),
        "convert the matrix to .mtx, .mat or .npz",
    ),
    "structure.interface.lateral": (
        lambda folder: pf.load(f"{MASSES}lateral = [2, 1]\n{DRIVE}"),
        "an interface slides along x alone",
    ),
    "structure.interface.breakaway": (
        lambda folder: pf.load(f"{MASSES}breakaway = 0.2\n{DRIVE}"),
        "law 'iwan' or 'elastic-plastic' does not creep",
    ),
    "an approach of a piece that can rotate": (
        lambda folder: pf.load(
            COATED.replace('load = "26 lbf"', 'approach.distance = "1 um"'),
            **{"contact.load_line.offset": "1 mm"},
        ),
        "give contact.load, or leave out [contact.load_line]",
    ),
    "slide in two directions": (read_two_directions, "leave out the column"),
    "pf.sweep(of=...)": (
        lambda folder: pf.sweep(RIG, {"friction.static": [0.2, 0.3]}, of="loop_area"),
        "choose the measure on the page",
    ),
    "pf.compare of four files": (
        lambda folder: pf.compare("a.csv", "b.csv", "c.csv", "d.csv"),
        "compare each direction by itself",
    ),
    "pf.FitOptions(warm_up=...)": (lambda folder: pf.FitOptions(warm_up=True), "hold them out"),
    "pf.import_(segment=...)": (
        lambda folder: pf.import_("a.csv", "b.toml", segment="2 s"),
        "fitted to the time record",
    ),
    "Result.extra": (lambda folder: pf.run(BENCH).extra, "use Result.notes, Result.settings"),
}
TRIED |= {
    f"Plan.{name}": (lambda folder, name=name: getattr(pf.plan(BENCH), name), instead)
    for name, instead in PLAN_ATTRIBUTES.items()
}
TRIED |= {
    f"measure {name}": (lambda folder, name=name: pf.run(BENCH).measures[name], instead)
    for name, instead in MEASURES.items()
}
TRIED |= {
    name: (partial(run_failing_command, command), instead)
    for name, (command, instead) in COMMANDS.items()
}


@pytest.mark.parametrize("name", TRIED)
def test_refuses_removed_feature(tmp_path, name):
    """A removed feature is refused with one sentence that names version and replacement."""
    attempt, instead = TRIED[name]
    with pytest.raises((pf.PatchfemError, AttributeError, KeyError)) as refused:
        attempt(tmp_path)
    sentence = str(refused.value)
    assert re.search(r"removed in patchfem \d\.\d+\b", sentence) and instead in sentence
    assert len(sentence.strip().splitlines()) == 1


def test_always_all_removed_features_are_tested():
    """Every removed option and key is among the tested features."""
    assert removed.read_removed_names().keys() <= set(TRIED)


def test_always_removing_versions_are_releases():
    """Each version that removed a key, files or an option is a release or pre-release in the list of changes."""
    changes = (Path(pf.__file__).parent / "CHANGES.md").read_text("utf-8")
    releases = set(re.findall(r"^## (\d+\.\d+)\.0(?:a\d+)? \(", changes, re.MULTILINE))
    assert {version for version, _ in removed.read_removed_names().values()} <= releases


@pytest.mark.skipif(
    find_spec("SurfaceTopography") is not None, reason="the extra `profiles` is installed"
)
def test_refuses_sdf_file_without_extra(tmp_path):
    """An SDF file is refused with the name of the extra to install."""
    path = tmp_path / "scan.sdf"
    path.write_bytes(b"bISO-1.0" + bytes(200))
    with pytest.raises(
        pf.Missing, match=r"pip install 'patchfem\[profiles\]', or export the surface as text"
    ):
        read_surface(path)
