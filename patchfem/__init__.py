"""patchfem: friction, motion and numerical error of a contact patch from a scene file.

Read the package in this order. A module imports only from its own entry of the list and from earlier entries:

1. `lazy_imports` modules that are loaded on first use
2. `exceptions`   errors with messages for the user and exit codes
3. `formatting`   numbers as text: readable units, digits that match the error
4. `cost_model`   CPU time without that of compiling
5. `core`         exchanged records: interface, compliance, contact state, modal basis, response, measure, outcome
6. `convergence`    error of a value from its changes between successive runs
7. `motion_measures`  measures that several engines have: loops, energy balance, reversals
8. `effects`      physical effects and methods that a scene can request
9. `disk`         atomic writes, locks and the user's cache
10. `kernel_cache` machine code of the kernels and its cache
11. `closed_forms` exact solutions of contact at rounded edges
12. `scene`        parsing and validation of a TOML file, with values in SI units
13. `inputs`       measured data files: columns, slide paths, signals, loops
14. `mesh`         tagged meshes of two coated pieces
15. `surface`      measured height profiles for roughness, wear and gaps
16. `elasticity`   static condensation of the pieces to their interface, and stress recovery
17. `contact`      gap shapes, unilateral contact, asperity layers, cells of a face
18. `friction`     friction laws and the sum over bonds along the path
19. `partial_slip` partial slip of the pieces: elements, shear modes, tangents
20. `structure`    modes and drive of the rig
21. `event_driven` motion from event to event by steps of order 8
22. `points`       sweeps over many cases of one mode and one contact point
23. `time_steps`   steps of order 2 of contact points under every law with every effect
24. `model`        model of a scene: pieces, gap, law, slide, modes, drive, numerics
25. `measures`     measures of a run: outcome, events, levels and free vibration
26. `wear`         wear depth over many cycles
27. `runs`         patch, bench and rig: static contact, friction and dynamics combined
28. `identify`     parameters from measurements, with confidence intervals
29. `campaigns`    studies with many runs: fits, error against cost, sweeps
30. `export`       summary, netCDF, VTK, report
31. `api`          Python interface: load, build, plan and run
32. `commands`     verbs of the command line

From Python: `import patchfem as pf`, then `pf.run("scene.toml")`. All imports are lazy: a module
that is imported as a whole, as in `from .contact import unilateral`, is loaded on first use (`lazy_imports`).
"""

import sys
from importlib import import_module
from types import ModuleType

from .lazy_imports import make_getattr

# type checkers assume that this name is true; `typing` is imported only after interrupts are handled
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

__version__ = "3.0.0a8"
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
# subpackages whose names are also functions of the Python interface
_CALLABLE_FOLDERS = ("export", "mesh")
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
    """Subpackage that is also callable, such as `pf.mesh(scene, out)` beside `patchfem.mesh.files`."""

    def __call__(self, *arguments, **options):
        verb = self.__name__.rpartition(".")[2]
        return getattr(_get_module("api"), verb)(*arguments, **options)


class _Package(ModuleType):
    """Module class of this package, which makes the subpackages in _CALLABLE_FOLDERS callable."""

    def __setattr__(self, name: str, value) -> None:
        if name in _CALLABLE_FOLDERS and isinstance(value, ModuleType):
            value.__class__ = _CallableFolder
        super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package
