"""patchfem: from a scene file to the friction, the motion and the error of a rubbing contact patch.

Read the package in this order. A module imports its own entry of the list and the entries before it, nothing after:

1. `faults`       named failures: a sentence for a person, the exit code
2. `scales`       numbers as people read them: the unit by the size, the digits by the error
3. `core`         the nouns that travel: interface, compliance, pressure, modal basis, response, measure, outcome
4. `effects`      which key of a scene needs which module and equation
5. `disk`         files written whole, folders with one writer
6. `compiled`     where compiled code is kept
7. `closed_forms` exact answers that tests, studies and users share
8. `scene`        a TOML file becomes SI values, every mistake named at once
9. `inputs`       files of measurements: columns, slide paths, signals, loops
10. `mesh`         two coated pieces as tagged meshes
11. `surface`     measured height profiles as a share of the gap
12. `elasticity`   the pieces condensed to their interface, fields recovered inside
13. `contact`     gap shapes, unilateral contact, skins, strips
14. `friction`    laws of friction and the sum over bonds along the path
15. `slip`        partial slip of the pieces: elements, shear modes, their tangent
16. `structure`   the modes of the rig and what drives it
17. `dynamics`    the engines: exact events, march in time, harmonic balance, comparison methods
18. `model`       what a scene means: pieces, gap, law, slide, modes, drive, numerics
19. `response`    measures of a run, outcome, events, levels, ringing
20. `wear`        worn depth over many cycles
21. `runs`        patch, bench and rig: where the pillars meet
22. `identify`    values from measurements with intervals
23. `campaigns`   many runs: fits, error against cost, sweeps
24. `export`      summary, netCDF, VTK, report
25. `api`         load, build, plan and run from Python
26. `commands`    the verbs of the command line

From Python: `import patchfem as pf`, then `pf.run("scene.toml")`. Nothing is imported before a name is used.
"""

from typing import TYPE_CHECKING

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
        build,
        compare,
        cost,
        demo,
        load,
        new,
        plan,
        plot,
        run,
        run_many,
        sweep,
    )

__version__ = "0.4.0"
__all__ = ["Measure", "Missing", "Model", "NotConverged", "Outcome", "PatchfemError", "Plan", "Result", "Scene",
           "SceneError", "build", "compare", "cost", "demo", "load", "new", "plan", "plot", "run",
           "run_many", "sweep"]


def __getattr__(name: str):
    if name not in __all__:
        raise AttributeError(f"module 'patchfem' has no attribute {name!r}")
    from . import api

    globals().update({each: getattr(api, each) for each in __all__})
    return globals()[name]


def __dir__() -> list:
    return [*__all__, "__version__"]
