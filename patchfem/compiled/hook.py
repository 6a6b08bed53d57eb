"""Build hook of hatchling that adds machine code to a wheel (`prebuilt`) on request.

    PATCHFEM_MACHINE_CODE=1 pip wheel --no-deps --no-build-isolation .

The environment must contain hatchling and all packages that a run needs, including numba. The code is compiled by runs
of the program, so this CPU must be able to execute it. Without the variable PATCHFEM_MACHINE_CODE, the wheel contains
only the sources and suits any machine.
"""

import os
import subprocess
import sys
import sysconfig
from itertools import product
from pathlib import Path
from shutil import copytree, ignore_patterns
from tempfile import TemporaryDirectory

REPOSITORY_FOLDER = Path(__file__).parents[2]
# Program that prints the name of the common CPU in LLVM and the folder name KEY.
CPU_AND_KEY_PROGRAM = """import platform, numba
from patchfem.compiled import hash_sources, prebuilt
if not prebuilt.is_cpu_sufficient():
    raise SystemExit('this CPU lacks instruction sets of the machine code')
print(prebuilt.COMMON_CPUS[platform.machine()].name, prebuilt.compute_key(hash_sources))"""
# Scene of a rig whose kernels are compiled
RIG_SCENE_TEXT = """
[normal]
load = "26 lbf"
[structure]
moving_mass = "0.884 kg"
[[structure.mode]]
name = "axial"
frequency = "143 Hz"
damping = 0.003
slide = 1.0
"""
SECOND_MODE_TABLE_TEXT = (
    '[[structure.mode]]\nname = "second"\nfrequency = "990 Hz"\ndamping = 0.01\nslide = 0.1\n'
)
DRIVE_TABLE_TEXT = """[drive]
kind = "base"
frequency = "143 Hz"
acceleration = "5 g"
cycles = 20
[friction]
static = 0.3
law = """
# Laws whose kernels are compiled, as the table [friction] gives them
FRICTION_LAW_TEXTS = (
    '"coulomb"',
    '"elastic-plastic"\nbond_length = "1 um"',
    '"nonlocal"\nbond_length = "1 um"',
    '"iwan"\nstiffness = "1e7 N/m"\nchi = -0.5\nbeta = 0.5',
    '"tanh"\nreference_speed = "1 mm/s"',
    '"bouc-wen"\nstiffness = "1e7 N/m"',
    '"lugre"\nstiffness = "1e7 N/m"\nstribeck_speed = "1 mm/s"',
)


def list_usual_commands(folder: Path):
    """Yield the arguments of commands that call the usual kernels.

    These are runs of the rig in `studies`, runs of rigs with each friction law, and two sweeps. Their scenes are written
    into this folder.
    """
    yield "run", REPOSITORY_FOLDER / "studies" / "rig" / "rig.toml"
    for number, (modes, law) in enumerate(
        product(("", SECOND_MODE_TABLE_TEXT), FRICTION_LAW_TEXTS)
    ):
        scene = folder / f"{number}.toml"
        scene.write_text(f"{RIG_SCENE_TEXT}{modes}{DRIVE_TABLE_TEXT}{law}\n", "utf-8")
        yield "run", scene
    for number in range(2):  # for these laws, a sweep integrates many cases at once
        yield "sweep", folder / f"{number}.toml", "--over", "drive.acceleration=3 g..6 g:64"


def build_machine_code(target: Path, commands=list_usual_commands) -> None:
    """Compile the kernels that some commands call for a common CPU, into the folder `target`/KEY.

    Parameters
    ----------
    target : Path
        Folder; KEY is the hash `prebuilt.compute_key`.
    commands : callable
        Generator of the arguments of the commands, which takes a folder for their scenes.

    Raises
    ------
    CalledProcessError
        If a command fails.
    """
    python = [sys.executable, "-P"]
    with TemporaryDirectory() as work:
        # Without its own CPU features numba compiles for the common CPU alone.
        cache = Path(work) / "cache"
        environment = os.environ | {
            "NUMBA_CPU_FEATURES": "",
            "PATCHFEM_CACHE": str(cache),
            "PYTHONPATH": str(REPOSITORY_FOLDER),
        }
        cpu, key = subprocess.run(
            [*python, "-c", CPU_AND_KEY_PROGRAM],
            env=environment,
            cwd=work,
            check=True,
            stdout=subprocess.PIPE,
            text=True,
        ).stdout.split()

        # Each command compiles the kernels that it calls into the empty cache.
        for number, arguments in enumerate(commands(Path(work))):
            subprocess.run(
                [
                    *python,
                    "-m",
                    "patchfem",
                    *map(str, arguments),
                    "-q",
                    "-o",
                    f"{work}/{number}",
                ],
                env=environment | {"NUMBA_CPU_NAME": cpu},
                cwd=work,
                check=True,
            )

        # The cache also has a folder of compliance matrices, which no wheel needs.
        [code_folder] = (cache / "patchfem").glob("*/code")
        for name in ("code", "kinds"):
            copytree(
                code_folder.with_name(name), target / key / name, ignore=ignore_patterns("*.lock")
            )


def get_build_hook():
    """Return the class of the build hook; hatchling calls this function."""
    from hatchling.builders.hooks.plugin.interface import BuildHookInterface

    class MachineCode(BuildHookInterface):
        """Build hook that adds machine code to a wheel if PATCHFEM_MACHINE_CODE is set."""

        def initialize(self, version: str, build_data: dict[str, object]) -> None:
            """Compile the kernels, add their files to the wheel and tag it for this platform.

            `version` is "editable" for an installation that refers to the source folder; it gets no machine code.

            `build_data` is the description of the wheel by the build tool hatchling, which is changed.
            """
            if version == "editable" or os.environ.get("PATCHFEM_MACHINE_CODE", "0") in ("", "0"):
                return
            self.work = TemporaryDirectory()
            build_machine_code(Path(self.work.name))
            build_data["force_include"][self.work.name] = "patchfem/compiled/generic"
            build_data["pure_python"] = False
            machine = sysconfig.get_platform().replace("-", "_").replace(".", "_")
            build_data["tag"] = f"py3-none-{machine}"

    return MachineCode
