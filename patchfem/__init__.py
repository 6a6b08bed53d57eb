"""patchfem: from a scene file to the friction, the motion and the error of a rubbing contact patch.

Read the package in this order. A module imports its own entry of the list and the entries before it, nothing after:

1. `lazy_imports`        modules that are loaded at their first use
2. `exceptions`       named failures: a sentence for a person, the exit code
3. `formatting`       numbers as people read them: the unit by the size, the digits by the error
4. `cost_model`        what work takes: one table of CPU seconds, and how fast this machine is
5. `core`         the nouns that travel: interface, compliance, pressure, modal basis, response, measure, outcome
6. `effects`      which key of a scene needs which module and equation
7. `disk`         files written whole, folders with one writer
8. `compiled`     where compiled code is kept
9. `closed_forms` exact answers to small problems of contact
10. `scene`       a TOML file becomes SI values, every mistake named at once
11. `inputs`      files of measurements: columns, slide paths, signals, loops
12. `mesh`        two coated pieces as tagged meshes
13. `surface`     measured height profiles as a share of the gap
14. `elasticity`  the pieces condensed to their interface, fields recovered inside
15. `contact`     gap shapes, unilateral contact, skins, strips
16. `friction`    laws of friction and the sum over bonds along the path
17. `slip`        partial slip of the pieces: elements, shear modes, their tangent
18. `structure`   the modes of the rig and what drives it
19. `dynamics`    the engines: exact events, march in time, harmonic balance
20. `model`       what a scene means: pieces, gap, law, slide, modes, drive, numerics
21. `response`    measures of a run: outcome, events, levels and ringing
22. `wear`        worn depth over many cycles
23. `runs`        patch, bench and rig: where the pillars meet
24. `identify`    values from measurements with intervals
25. `campaigns`   many runs: fits, error against cost, sweeps
26. `export`      summary, netCDF, VTK, report
27. `api`         load, build, plan and run from Python
28. `commands`    the verbs of the command line

From Python: `import patchfem as pf`, then `pf.run("scene.toml")`. Nothing is imported before a name is used,
and a module that is taken as a whole, as in `from .contact import unilateral`, is loaded at its
first use (`lazy_imports`).
"""

import sys
from importlib import import_module
from types import ModuleType

from .lazy_imports import modules_of

TYPE_CHECKING = False  # a type checker takes it for true; typing itself would be loaded before an interrupt is answered
if TYPE_CHECKING:
    from .api import (
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

__version__ = "0.4.0"
__all__ = [
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
_FOLDERS = ("export", "mesh")  # that are verbs too
_later = modules_of(__name__, __path__)


def __getattr__(name: str):
    if name not in __all__:
        return _later(name)
    api = _later("api")
    globals().update({each: getattr(api, each) for each in __all__ if each not in _FOLDERS})
    return globals()[name] if name not in _FOLDERS else import_module(f"{__name__}.{name}")


def __dir__() -> list:
    return [*__all__, "__version__"]


class _Folder(ModuleType):
    """A folder whose name a verb has too: `pf.mesh(scene, out)` beside `patchfem.mesh.files`."""

    def __call__(self, *given, **named):
        return getattr(_later("api"), self.__name__.rpartition(".")[2])(*given, **named)


class _Package(ModuleType):
    """This package, whose folders of these names can be called."""

    def __setattr__(self, name: str, value) -> None:
        if name in _FOLDERS and isinstance(value, ModuleType):
            value.__class__ = _Folder
        super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package
