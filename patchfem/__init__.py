"""patchfem: friction, motion and numerical error of a contact patch from a scene file.

Read the package in this order. A module imports its own entry of the list and the entries before it, nothing after:

1. `lazy_imports` modules that are loaded at their first use
2. `exceptions`   errors that tell the user what to do, with exit codes
3. `formatting`   text of numbers: unit by size, digits by error
4. `cost_model`   CPU seconds of the parts of a run, and the speed of this machine
5. `core`         records that travel: interface, compliance, contact state, modal basis, response, measure, outcome
6. `effects`      module and equation of everything that a scene can ask for
7. `disk`         atomic writes, locks and the user's cache
8. `compiled`     machine code of the kernels and its cache
9. `closed_forms` exact solutions of contact problems
10. `scene`        a TOML file becomes checked SI values
11. `inputs`       files of measurements: columns, slide paths, signals, loops
12. `mesh`         tagged meshes of two coated pieces
13. `surface`      measured height profiles, for roughness, wear and gaps
14. `elasticity`   the pieces condensed to their interface, and the fields inside
15. `contact`      gap shapes, unilateral contact, asperity layers, strips
16. `friction`     friction laws and the sum over bonds along the path
17. `slip`         partial slip of the pieces: elements, shear modes, their tangent
18. `structure`    modes and drive of the rig
19. `dynamics`     the engines: event-driven, time stepping, harmonic balance
20. `model`        what a scene means: pieces, gap, law, slide, modes, drive, numerics
21. `response`     measures of a run: outcome, events, levels and free vibration
22. `wear`         wear depth over many cycles
23. `runs`         patch, bench and rig: static contact, friction and dynamics combined
24. `identify`     parameters from measurements, with confidence intervals
25. `campaigns`    many runs: fits, error against cost, sweeps
26. `export`       summary, netCDF, VTK, report
27. `api`          load, build, plan and run from Python
28. `commands`     the verbs of the command line

From Python: `import patchfem as pf`, then `pf.run("scene.toml")`. Nothing is imported before a name is used. A module
that is imported as a whole, as in `from .contact import unilateral`, is loaded at its first use (`lazy_imports`).
"""

import sys
from importlib import import_module
from types import ModuleType

from .lazy_imports import make_getattr

# type checkers take this name for true; `typing` itself is loaded only after the command line handles interrupts
TYPE_CHECKING = False
if TYPE_CHECKING:
    from .api import (
        FitOptions,
        Measure,
        Missing,
        Model,
        NotConverged,
        Outcome,
        PatchfemError,
        Plan,
        Result,
        Scene,
        SceneError,
        backbone,
        build,
        compare,
        cost,
        demo,
        export,
        fit,
        import_,
        load,
        mesh,
        new,
        plan,
        plot,
        profile,
        report,
        run,
        run_many,
        sweep,
        view,
    )

__version__ = "1.0.0"
__all__ = [
    "FitOptions",
    "Measure",
    "Missing",
    "Model",
    "NotConverged",
    "Outcome",
    "PatchfemError",
    "Plan",
    "Result",
    "Scene",
    "SceneError",
    "backbone",
    "build",
    "compare",
    "cost",
    "demo",
    "export",
    "fit",
    "import_",
    "load",
    "mesh",
    "new",
    "plan",
    "plot",
    "profile",
    "report",
    "run",
    "run_many",
    "sweep",
    "view",
]
_CALLABLE_FOLDERS = ("export", "mesh")  # folders whose names are verbs as well
_get_module = make_getattr(__name__, __path__)


def __getattr__(name: str):
    if name not in __all__:
        return _get_module(name)
    api = _get_module("api")
    globals().update(
        {verb: getattr(api, verb) for verb in __all__ if verb not in _CALLABLE_FOLDERS}
    )
    return import_module(f"{__name__}.{name}") if name in _CALLABLE_FOLDERS else globals()[name]


def __dir__() -> list:
    return [*__all__, "__version__"]


class _CallableFolder(ModuleType):
    """Folder that is called as a verb: `pf.mesh(scene, out)` beside `patchfem.mesh.files`."""

    def __call__(self, *arguments, **options):
        verb = self.__name__.rpartition(".")[2]
        return getattr(_get_module("api"), verb)(*arguments, **options)


class _Package(ModuleType):
    """This package, which makes the folders in _CALLABLE_FOLDERS callable."""

    def __setattr__(self, name: str, value) -> None:
        if name in _CALLABLE_FOLDERS and isinstance(value, ModuleType):
            value.__class__ = _CallableFolder
        super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package
