"""A command imports only the modules that its scene needs, and answers without delay."""

import os
import subprocess
import sys
from pathlib import Path
from resource import RUSAGE_CHILDREN, getrusage

import pytest
from command_line import (
    FROM_PYTHON,
    FROM_SHELL,
    assert_not_loaded,
    has_code_of,
    modules_after,
    modules_after_cached,
)
from scene_texts import BENCH, COATED, COULOMB, PLASTIC, POINT, SHEAR, STRUCTURE, TRIANGLE

RIG = Path(__file__).parents[1] / "studies/rig/rig.toml"
PATCH = COATED + '[contact.tilt]\nangle = "0.1 mrad"\n'
COULOMB_RIG = POINT + COULOMB + STRUCTURE
PLASTIC_RIG = POINT + PLASTIC + STRUCTURE


@pytest.fixture
def write_scene(tmp_path):
    """Return a function that writes a scene file and returns its path."""

    def write(text):
        """Write the text of a scene and return the path."""
        path = tmp_path / "scene.toml"
        path.write_text(text, "utf-8")
        return path

    return write


PHYSICS = set(
    "closed_forms kernel_cache contact elasticity friction event_driven identify inputs mesh points measures partial_slip "
    "structure surface time_steps wear".split()
)
PIECES = "contact elasticity mesh "  # folders needed to solve a static patch
MOTION = "kernel_cache event_driven measures structure "  # folders needed to integrate the motion of a rig
SLIDING = MOTION + "friction "  # the same with friction
BENCH_FOLDERS = "friction measures "  # folders needed to follow a prescribed slide
WEAR = '[wear]\ncoefficient = "1e-15 1/Pa"\ncycles = 100\n'
FOLDERS = {  # kind of scene -> text, folders of the physics that `patchfem run` loads for the run and its page
    "static patch": (PATCH, PIECES),
    "bench of a point": (BENCH, BENCH_FOLDERS),
    "bench of a patch": (COATED + COULOMB + TRIANGLE, PIECES + BENCH_FOLDERS),
    "linear rig": (STRUCTURE, MOTION),
    "rig of a point": (COULOMB_RIG, SLIDING),
    "rig of elements": (PLASTIC_RIG, SLIDING),
    "rig of a patch": (COATED + PLASTIC + STRUCTURE, PIECES + SLIDING),
    "rig of a patch with slip": (
        COATED + SHEAR + PLASTIC + STRUCTURE,
        PIECES + SLIDING + "partial_slip",
    ),
    "wear": (COATED + COULOMB + TRIANGLE + WEAR, PIECES + BENCH_FOLDERS + "time_steps wear"),
}


@pytest.mark.share(0, 1, 3, 8)
@pytest.mark.parametrize("kind", FOLDERS)
def test_exact_run_loads_folders_of_its_scene(write_scene, tmp_path, kind):
    """`patchfem run` in a new process imports the physics folders listed for its kind of scene and no others.

    The `__init__` of a folder counts, although it has only a docstring and a table of names.
    """
    text, folders = FOLDERS[kind]
    words = (FROM_SHELL, "run", write_scene(text), "-o", tmp_path / "out", "-q")
    modules = modules_after_cached(*words)
    assert {name for name in PHYSICS if f"patchfem.{name}" in modules} == set(folders.split())


PATCH_KEYS = "elasticity.mortar surface"
ROUGH_LAYER = (
    "contact.asperity_laws contact.asperity_layer model.peaks model.layer_heights runs.patch.skin "
    "wear.rough_layer surface"
)
RIG_KEYS = {"structure.bonded", "event_driven.periodic"}
MODULES_OF_SCENES = {  # run from Python -> text of the scene, modules that are loaded, modules that are not
    "patch": (
        PATCH,
        "contact.press contact.unilateral mesh.grid",
        f"kernel_cache {ROUGH_LAYER} contact.bounded elasticity.mortar "
        "elasticity.recovery export mesh.pieces mesh.checks measures scipy skfem",
    ),
    "skin": (
        PATCH + '[contact.asperities]\nlaw = "exponential"\ndecay_length = "1 um"\n',
        "contact.asperity_laws",
        PATCH_KEYS,
    ),
    "wear of a smooth patch": (
        COATED + COULOMB + TRIANGLE + WEAR,
        "runs.wear.evolve wear.jumps",
        ROUGH_LAYER,
    ),
    "rig on a smooth patch": (COATED + COULOMB + STRUCTURE, "contact.press", ROUGH_LAYER),
    "smooth face": (
        COATED.replace('element_size = "0.5 mm"\n', "") + "[contact.area]\ncells = 32\n",
        "runs.patch.area",
        ROUGH_LAYER,
    ),
    "linear rig": (
        STRUCTURE,
        "event_driven.runs",
        "event_driven.stored_energy event_driven.laws.grooves event_driven.laws.masing event_driven.laws.springs",
    ),
    "point on a rig": (
        COULOMB_RIG,
        "event_driven.runs structure.modes",
        "structure.matrices structure.masses structure.arrays structure.universal structure.drives "
        "event_driven.free_motions event_driven.periodic_curves "
        "time_steps runs.rig.steady " + " ".join(RIG_KEYS),
    ),
    **{
        name: (COULOMB_RIG + lines, module, " ".join(RIG_KEYS - {module}))
        for name, lines, module in (
            ("bonded spring", '[structure.bonded]\nstiffness = "1e6 N/m"\n', "structure.bonded"),
            ("harmonic", '[accuracy]\nmethod = "harmonic"\n', "event_driven.periodic"),
        )
    },
    "bench": (BENCH, "runs.bench.bench", "campaigns export.sweeps scene.assignments runs.batch"),
}


@pytest.mark.share(0, 2, 3, 4)
@pytest.mark.parametrize("name", MODULES_OF_SCENES)
def test_exact_run_loads_modules_of_its_keys(write_scene, name):
    """A run from Python loads the modules of the keys in its scene, and not those of absent keys."""
    text, present, missing = MODULES_OF_SCENES[name]
    modules = modules_after(FROM_PYTHON, write_scene(text))
    assert {f"patchfem.{module}" for module in present.split()} <= modules
    found = [module for module in missing.split() if has_code_of(modules, module)]
    assert not found and "pyuff" not in modules


def rig_without_files() -> str:
    """Return the shipped rig without its table of measured rows, so that the scene names no file."""
    return RIG.read_text("utf-8").partition("[measured]")[0]


HEAVY = "numpy scipy skfem numba matplotlib xarray h5py pyvista meshio"
OUT = ("-o", "OUT", "-q", "--no-page")
NO_PATCH = "contact mesh skfem export.page export.charts.panels"
SLOW_SCIPY = "scipy.signal scipy.stats scipy.interpolate matplotlib"
TRACE = "x [um],z [um]\n" + "".join(f"{k},{k % 7}\n" for k in range(600))
COMMANDS = {  # command -> scene, arguments, modules of patchfem and packages that are not loaded
    **{
        f"run of a {name}": (
            text,
            ("run", "SCENE", *OUT),
            NO_PATCH,
            "matplotlib pandas xarray scipy",
        )
        for name, text in (("rig", COULOMB_RIG), ("linear rig", STRUCTURE), ("bench", BENCH))
    },
    "run of a patch": (
        PATCH,
        ("run", "SCENE", *OUT),
        "",
        "pyvista vtkmodules numba meshio skfem scipy matplotlib pandas xarray",
    ),
    "check": (rig_without_files(), ("check", "SCENE"), "", HEAVY),
    "check of measured rows": ("", ("check", str(RIG)), "", HEAVY),
    "help": ("", ("--help",), "scene.keys.lines", HEAVY + " pydantic"),
    "sweep": (
        BENCH,
        ("sweep", "SCENE", "--over", "friction.static=0.1,0.2", "-o", "OUT", "-q"),
        "contact mesh export.fields",
        "matplotlib pandas xarray dask distributed",
    ),
    "run of the rig with its page": (
        "",
        ("run", str(RIG), "--set", "drive.cycles=12", "-o", "OUT", "-q"),
        "runs.bench.bench runs.wear",
        "numpy.random cyclopts.completion numba email socket",
    ),
    "compare": (TRACE, ("compare", "SCENE", "SCENE"), "", SLOW_SCIPY),
}


@pytest.mark.share(3, 5, 6, 7, 8, 9)
@pytest.mark.parametrize("name", COMMANDS)
def test_exact_command_loads_only_needed_packages(write_scene, tmp_path, name):
    """A command does not load the modules and packages listed as unnecessary for it."""
    text, words, modules, packages = COMMANDS[name]
    places = {"SCENE": write_scene(text), "OUT": tmp_path / "out"}
    found = modules_after_cached(FROM_SHELL, *(places.get(word, word) for word in words))
    assert_not_loaded(found, *modules.split())
    roots = {one.partition(".")[0] for one in found} | found
    assert not roots & set(packages.split())
    assert not list(tmp_path.glob("out/fields*")) or "patch" in name or words[1] == str(RIG)


def test_exact_few_modules_load_before_signal_handling():
    """`import patchfem` loads only a few standard modules, so that `patchfem.__main__` handles interrupts early.

    Neither do its version and the list of its names need more.
    """
    code = (
        "import sys; had = {*sys.modules}; sys.path[0] = sys.argv[1]; import patchfem as pf; dir(pf), pf.__version__; "
        "print(*{*sys.modules} - had)"
    )
    words = [sys.executable, "-S", "-c", code, str(RIG.parents[2])]
    run = subprocess.run(words, capture_output=True, text=True, check=True)
    modules = {name for name in run.stdout.split() if not name.startswith("importlib.")}
    assert modules - {"importlib", "types", "warnings"} == {"patchfem", "patchfem.lazy_imports"}


def cpu_seconds(pairs: int, *commands) -> list:
    """Return the minimum CPU seconds of an interpreter for each of the commands, run alternately."""
    best = [float("inf")] * len(commands)
    keeping = {
        name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"
    }
    for _ in range(pairs):
        for k, words in enumerate(commands):
            begin = getrusage(RUSAGE_CHILDREN)
            subprocess.run([sys.executable, *words], capture_output=True, check=True, env=keeping)
            end = getrusage(RUSAGE_CHILDREN)
            best[k] = min(best[k], end.ru_utime + end.ru_stime - begin.ru_utime - begin.ru_stime)
    return best


@pytest.mark.share(1)
@pytest.mark.parametrize("words", [("--help",), ("check",)], ids=["help", "check"])
def test_always_help_and_check_are_fast(write_scene, words):
    """`--help` and `check` take less than 0.55 of the CPU time of importing matplotlib.pyplot.

    This is 0.3 s on a machine where the import takes 0.55 s.
    """
    words = (*words, str(write_scene(rig_without_files()))) if words == ("check",) else words
    seconds, pyplot = cpu_seconds(2, ("-m", "patchfem", *words), ("-c", "import matplotlib.pyplot"))
    assert seconds < 0.55 * pyplot
