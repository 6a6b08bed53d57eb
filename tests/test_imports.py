"""What a scene does not name is not imported, and the command line answers at once."""

import os
import subprocess
import sys
from functools import cache
from pathlib import Path
from resource import RUSAGE_CHILDREN, getrusage
from tempfile import TemporaryDirectory

import pytest
from command_line import FROM_PYTHON, FROM_SHELL, MODULES, absent, has_code_of, loaded, loaded_again
from scene_texts import BENCH, COATED, COULOMB, PLASTIC, POINT, SHEAR, STRUCTURE, TRIANGLE

RIG = Path(__file__).parents[1] / "studies" / "rig" / "rig.toml"
PATCH = COATED + '[contact.tilt]\nangle = "0.1 mrad"\n'


@pytest.fixture
def scene(tmp_path):
    def write(text):
        path = tmp_path / "scene.toml"
        path.write_text(text, "utf-8")
        return path
    return write


@cache
def run_of(text: str) -> set:
    """Names in sys.modules after a run of a scene from Python, each scene once."""
    with TemporaryDirectory() as folder:
        path = Path(folder, "scene.toml")
        path.write_text(text, "utf-8")
        return loaded(FROM_PYTHON, path)


PHYSICS = {"closed_forms", "contact", "dynamics", "elasticity", "friction", "identify", "inputs", "mesh", "response",
           "slip", "structure", "surface", "wear", "runs.bench", "runs.many", "runs.patch", "runs.rig", "runs.wear"}
PIECES = "contact elasticity mesh runs.patch "  # folders that press a patch
MOTION = "dynamics response runs.rig structure "  # folders that move a rig
PAGE = "response structure "  # folders that a page takes words from
WEAR = '[wear]\ncoefficient = "1e-15 1/Pa"\ncycles = 100\n'
FOLDERS = {  # kind of scene -> its text, folders that `patchfem run` loads for it with its page
    "static patch": (PATCH, PIECES + PAGE),
    "bench of a point": (BENCH, "friction runs.bench " + PAGE),
    "bench of a patch": (COATED + COULOMB + TRIANGLE, PIECES + "friction runs.bench " + PAGE),
    "linear rig": (STRUCTURE, MOTION),
    "rig of a point": (POINT + COULOMB + STRUCTURE, MOTION + "friction"),
    "rig of elements": (POINT + PLASTIC + STRUCTURE, MOTION + "friction"),
    "rig of a patch": (COATED + PLASTIC + STRUCTURE, PIECES + MOTION + "friction"),
    "rig of a patch with slip": (COATED + SHEAR + PLASTIC + STRUCTURE, PIECES + MOTION + "friction slip"),
    "wear": (COATED + COULOMB + TRIANGLE + WEAR, PIECES + "friction runs.bench runs.wear wear " + PAGE),
}


@pytest.mark.parametrize("kind", FOLDERS)
def test_exact_a_run_loads_the_folders_of_its_scene(scene, tmp_path, kind):
    """A run in a fresh process loads code of these folders of the physics and of no other."""
    text, folders = FOLDERS[kind]
    modules = loaded(FROM_SHELL, "run", scene(text), "-o", tmp_path / "out", "-q")
    assert {name for name in PHYSICS if has_code_of(modules, name)} == set(folders.split())


def test_exact_a_patch_loads_the_modules_of_its_keys():
    modules = run_of(PATCH)
    absent(modules, "compiled", "contact.skin_laws", "contact.strips", "contact.gradients", "elasticity.mortar",
           "elasticity.substructure", "elasticity.fronts", "elasticity.recovery", "export", "mesh.anymesh", "response",
           "scipy", "skfem")
    assert {"patchfem.contact.unilateral", "patchfem.mesh.tensor"} <= modules


def test_exact_little_is_loaded_before_the_command_line_answers_an_interrupt():
    """`patchfem.__main__` answers signals; before it runs the package itself is loaded, where a signal ends in a
    traceback."""
    code = "import sys; had = {*sys.modules}; sys.path[0] = sys.argv[1]; import patchfem; print(*{*sys.modules} - had)"
    words = [sys.executable, "-S", "-c", code, str(RIG.parents[2])]
    run = subprocess.run(words, capture_output=True, text=True, check=True)
    assert {one.partition(".")[0] for one in run.stdout.split()} <= {"patchfem", "importlib", "types", "warnings"}


@pytest.mark.parametrize("table, module", [
    ('[contact.asperities]\nlaw = "exponential"\ndecay_length = "1 um"\n', "contact.skin_laws"),
    ("[contact.strips]\ncount = 2\n", "contact.strips"),
], ids=["skin", "strips"])
def test_exact_an_effect_brings_its_own_module(table, module):
    modules = run_of(PATCH + table)
    assert f"patchfem.{module}" in modules
    absent(modules, *{"elasticity.mortar", "surface"})


def test_exact_a_rubbing_point_needs_no_other_rig():
    """One mode, one sine, one point: no masses, files, springs, heave, other drives, other engines."""
    modules = run_of(POINT + COULOMB + STRUCTURE)
    assert {"patchfem.dynamics.events.histories", "patchfem.structure.modes"} <= modules
    absent(modules, "structure.matrices", "structure.masses", "structure.arrays", "structure.universal",
           "structure.bonded", "structure.identify", "structure.drives", "dynamics.harmonic.harmonic",
           "dynamics.events.stick_steady",
           "dynamics.harmonic.continuation", "dynamics.propagator", "dynamics.march.joints",
           "dynamics.march.varying_load",
           "runs.rig.steady", "dynamics.harmonic.balance", "dynamics.march")
    assert "pyuff" not in modules


@pytest.mark.share(1, 3)
@pytest.mark.parametrize("lines, module", [
    ('[structure.stiffening]\ncubic = "1e12 N/m^3"\n', "dynamics.march.joints"),
    ('[structure.bonded]\nstiffness = "1e6 N/m"\n', "structure.bonded"),
    ('[accuracy]\nmethod = "harmonic"\n', "dynamics.events.stick_steady"),
], ids=["stiffening", "bonded", "harmonic"])
def test_exact_a_rig_brings_what_it_names(lines, module):
    modules = run_of(POINT + COULOMB + STRUCTURE + lines)
    assert f"patchfem.{module}" in modules
    others = {"dynamics.march.joints", "structure.bonded",
              "dynamics.events.stick_steady"} - {module}
    assert not {f"patchfem.{name}" for name in others} & modules


@pytest.mark.parametrize("text", [STRUCTURE, POINT + COULOMB + STRUCTURE, POINT + PLASTIC + STRUCTURE],
                         ids=["linear", "coulomb", "plastic"])
def test_exact_a_short_history_compiles_nothing(scene, tmp_path, monkeypatch, text):
    """On a machine where nothing is compiled yet: neither numba nor what loads machine code is imported."""
    monkeypatch.delenv("PATCHFEM_CACHE", raising=False)  # it would win over XDG_CACHE_HOME
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    modules = loaded(FROM_PYTHON, scene(text))
    absent(modules, "compiled.inner", "compiled.kept", "dynamics.events.march_kernels")
    assert "llvmlite" not in modules and not [*tmp_path.rglob("*.code"), *tmp_path.rglob("*.nbi")]


@pytest.mark.share(1)
@pytest.mark.parametrize("text", [POINT + COULOMB + STRUCTURE, STRUCTURE, BENCH], ids=["rig", "linear", "bench"])
def test_exact_results_without_a_patch_need_no_mesh(scene, tmp_path, text):
    modules = loaded(FROM_SHELL, "run", scene(text), "-o", tmp_path / "out", "-q", "--no-page")
    absent(modules, "contact", "mesh", "skfem", "export.report", "export.drawing")
    assert not {"matplotlib", "pandas", "xarray", "scipy"} & modules
    assert not list((tmp_path / "out").glob("fields*"))


def test_exact_a_patch_is_written_without_pyvista(scene, tmp_path):
    modules = loaded(FROM_SHELL, "run", scene(PATCH), "-o", tmp_path / "out", "-q", "--no-page")
    assert not {"pyvista", "vtkmodules", "numba", "meshio", "skfem", "scipy", "matplotlib", "pandas",
                "xarray"} & modules


def without_files(scene) -> Path:
    """The shipped rig without its table of measured rows: a scene that names no file."""
    return scene(RIG.read_text("utf-8").partition("[measured]")[0])


@pytest.mark.parametrize("words", [("check",), ("check", RIG), ("--help",), ("check", "--help"), ("--version",)],
                         ids=["check", "check of measured rows", "help", "verb help", "version"])
def test_exact_light_verbs_import_nothing_heavy(scene, words):
    modules = loaded(FROM_SHELL, *words, *([without_files(scene)] if words == ("check",) else []))
    assert not {"numpy", "scipy", "skfem", "numba", "matplotlib", "xarray", "h5py", "pyvista", "meshio"} & modules


def least_seconds(pairs: int, *commands) -> list:
    """Least CPU time [s] of an interpreter with each of these words, taken in turns: other work then counts alike."""
    best = [float("inf")] * len(commands)
    keeping = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    for _ in range(pairs):
        for k, words in enumerate(commands):
            begin = getrusage(RUSAGE_CHILDREN)
            subprocess.run([sys.executable, *words], capture_output=True, check=True, env=keeping)
            end = getrusage(RUSAGE_CHILDREN)
            best[k] = min(best[k], end.ru_utime + end.ru_stime - begin.ru_utime - begin.ru_stime)
    return best


@pytest.mark.share(1)
@pytest.mark.parametrize("words", [("--help",), ("check",)], ids=["help", "check"])
def test_always_an_answer_before_pyplot_is_imported(scene, words):
    """0.3 s are promised where an import of pyplot takes 0.55 s, share 0.55; on a slower or a busy machine both take
    longer. Compiled Python is kept, as it is for people: reading all of patchfem anew takes 0.05 s more."""
    words = (*words, str(without_files(scene))) if words == ("check",) else words
    seconds, pyplot = least_seconds(2, ("-m", "patchfem", *words), ("-c", "import matplotlib.pyplot"))
    assert seconds < 0.55 * pyplot


def test_exact_a_scene_without_a_sweep_imports_none_of_it(scene):
    absent(run_of(BENCH), "campaigns", "export.sweeps", "scene.axes", "runs.many")
    absent(loaded(FROM_SHELL, "check", scene(BENCH)), "campaigns", "export.sweeps", "scene.axes", "runs.many")


def test_exact_a_sweep_over_a_point_needs_no_mesh_and_no_pictures(scene, tmp_path):
    modules = loaded(FROM_SHELL, "sweep", scene(BENCH), "--over", "friction.static=0.1,0.2", "-o", tmp_path / "a", "-q")
    absent(modules, "contact", "mesh", "export.report", "export.drawing", "export.fields")
    assert not {"matplotlib", "pandas", "xarray", "dask", "distributed"} & modules


@pytest.mark.share(0)
@pytest.mark.parametrize("law", [COULOMB, PLASTIC], ids=["coulomb", "plastic"])
def test_exact_a_batch_brings_the_kind_of_its_cases_alone(scene, law):
    """Nor numba, where its code is kept, nor Dask for a Dataset of numbers."""
    code = f"import sys, patchfem\npatchfem.sweep(sys.argv[1], {{'friction.static': [0.1, 0.2]}})\n{MODULES}"
    path = scene(POINT + law + STRUCTURE.replace("cycles = 30", "cycles = 20"))
    modules = loaded_again(code, path)
    absent(modules, "dynamics.smooth")
    assert "xarray" in modules and "dask.array" not in modules
