"""Every key of the schema in nine small scenes changes the result, gives a remark that it has no effect, or is refused."""

import copy
import tomllib
from typing import get_args

import numpy as np
import pytest
from scene_texts import (
    COATED,
    DRIVE,
    FORCED,
    GROWING,
    KILOGRAM,
    MODE,
    NONLOCAL,
    PAIR,
    PIECE,
    PLASTIC,
    POINT,
)
from torture.toml import list_schema_keys, to_toml

from patchfem.core import Missing, NotConverged, PatchfemError
from patchfem.runs.plan import plan
from patchfem.runs.run import run
from patchfem.scene import UNIT_FACTORS, Tables, loads
from patchfem.scene.keys.types import list_keys
from patchfem.scene.scene import SceneError

FLAT = PIECE + 'load = "26 lbf"\nelement_size = "2 mm"\nsubstrate = "Ti-8Al-1Mo-1V"\n'
SHAKEN = KILOGRAM + DRIVE.replace("cycles = 30", "cycles = 6")
BRIEF = '[slide]\nkind = "triangle"\namplitude = "10 um"\nspeed = "5 mm/s"\n'
COULOMB = '[friction]\nlaw = "coulomb"\nstatic = 0.3\nkinetic = 0.2\n'
SCENES = {
    "patch": COATED.replace("0.5 mm", "2 mm") + '[contact.tilt]\nangle = "0.02 mrad"\n'
    '[contact.crown]\nradius = "20 m"\n',
    "rough patch": FLAT + '[contact.asperities]\nlaw = "linear"\nnormal_stiffness = "1e13 Pa/m"\n'
    '[contact.holder]\nrotational_stiffness = "1e4 N m/rad"\n',
    "face": FLAT.replace('element_size = "2 mm"\n', "")
    + '[contact.area]\ncells = 32\n[contact.crown]\nradius = "50 m"\n',
    "worn bench": FLAT + COULOMB + BRIEF + '[wear]\ncoefficient = "1e-14 m^2/N"\ncycles = 1e5\n',
    "grown bench": POINT
    + GROWING
    + '[friction.temperature]\nsurface = "330 K"\nreference = "300 K"\n'
    'rest_activation = "2000 K"\n' + BRIEF,
    "bonded bench": FLAT + "[contact.shear]\n" + NONLOCAL + BRIEF,
    "exact rig": POINT + COULOMB + SHAKEN,
    "shared rig": FLAT + "[contact.shear]\n" + PLASTIC + SHAKEN,
    "masses": PAIR + FORCED.replace("cycles = 25", "cycles = 5"),
    "linear": MODE + DRIVE.replace("cycles = 30", "cycles = 6"),
}
WORDS = {
    "accuracy.merge": [0.3, 1e-3],
    "accuracy.tail": [1e-2, 1e-8],
    "accuracy.steps_per_cycle": [60, 17],
    "wear.jumps": [3],
    **{f"contact.{shape}.on": ["lower"] for shape in ("tilt", "crown", "step")},
}
NUMBERS = [0.37, 3, 1.7, 0.01]
SIZES = {
    "length": ["0.9 mm", "3 um", "0.02 um"],
    "temperature": ["310 K", "900 K"],
    "pressure": ["150 GPa"],
    "density": ["5000 kg/m^3"],
    "force": ["70 N", "10 N"],
    "frequency": ["110 Hz"],
    "acceleration": ["20 m/s^2"],
    "velocity": ["2 mm/s", "20 mm/s"],
    "mass": ["0.3 kg"],
    "time": ["13 ms"],
    "angle": ["0.03 mrad", "0.4 rad"],
    "stiffness": ["3e6 N/m", "2e7 N/m"],
    "rotational stiffness": ["300 N m/rad"],
}
QUICK = 0, 1, 5, 8  # positions in SCENES of scenes that run in seconds
# keys used only in messages or for errors, a limit of CPU time that short runs do not reach, and choices that "auto" also
# makes
NEVER = (
    "title",
    "structure.mode.0.name",
    "accuracy.tolerance",
    "accuracy.max_seconds",
    "accuracy.quadrature",
    "accuracy.method",
)


def trial_values(path: tuple, kind: str | None) -> list:
    """Return values for a key: all its choices, or quantities and numbers that are no defaults."""
    name = ".".join(map(str, path))
    if name in WORDS:
        return WORDS[name]
    if kind is not None:
        return SIZES.get(
            kind, [f"{number} {next(iter(UNIT_FACTORS[kind]))}" for number in (0.7, 1e3, 1e7)]
        )
    model = Tables
    for key in path[:-1]:
        model = list_keys(model)[key].inner if isinstance(key, str) else model
    field = list_keys(model)[path[-1]].field
    words = [
        one
        for part in (field.annotation, *get_args(field.annotation))
        for one in get_args(part)
        if isinstance(one, str)
    ]
    return [one for one in words if one != field.default] or NUMBERS


def set_key(tables: dict, path: tuple, value) -> dict | None:
    """Return the tables with another value at a path, or None if nothing would change."""
    out = at = copy.deepcopy(tables)
    if path[0] not in ("accuracy", *tables):
        return None
    for key in path[:-1]:
        if isinstance(key, int):
            at = at[key] if isinstance(at, list) and key < len(at) else None
        else:
            at = at.setdefault(key, {}) if isinstance(at, dict) else None
    if not isinstance(at, dict) or at.get(path[-1]) == value:
        return None
    at[path[-1]] = value
    return out


def run_and_collect(text: str) -> tuple:
    """Return all numbers of a run as bytes, and its warnings."""
    run_plan = plan(loads(text))
    result = run(run_plan)
    numbers = [str((name, m.value, m.error)) for name, m in sorted(result.measures.items())]
    arrays = [getattr(result.response, name, None) for name in ("time", "slide", "force")] + list(
        result.fields.values()
    )
    if result.patch is not None:
        arrays += [result.patch.x, result.patch.pressure.sigma_n]
    return (
        *numbers,
        *(np.asarray(one).tobytes() for one in arrays if one is not None),
    ), result.warnings


def keys_without_effect(scene: str) -> list:
    """Return the keys that change no result at any value and give no remark."""
    tables = tomllib.loads(SCENES[scene])
    base = run_and_collect(to_toml(tables))
    out = []
    for path, kind, model in list_schema_keys():
        name = ".".join(map(str, path))
        if model is not None or path[-1] == "file" or name in NEVER:
            continue
        is_silent = False
        for value in trial_values(path, kind):
            if (changed := set_key(tables, path, value)) is None:
                continue
            try:
                is_silent = run_and_collect(to_toml(changed)) == base
            except (SceneError, PatchfemError, Missing, NotConverged):
                continue
            if not is_silent:
                break
        if is_silent:
            out.append(name)
    return out


@pytest.mark.share(*QUICK)
@pytest.mark.parametrize("scene", SCENES)
def test_always_key_changes_result_or_gives_remark(scene):
    """No key of the schema is accepted silently without an effect."""
    assert keys_without_effect(scene) == []


@pytest.mark.parametrize("method", ["auto", "harmonic"])
def test_always_unused_steps_per_cycle_give_remark(method):
    """The key steps_per_cycle gives a remark with engines that have no time steps."""
    text = SCENES["exact rig"] + f'[accuracy]\nmethod = "{method}"\nsteps_per_cycle = 60\n'
    engine = "harmonic" if method == "harmonic" else "event_driven"
    told = (
        f"accuracy.steps_per_cycle has no meaning for engine '{engine}', which does not use steps of equal length, and "
        "is not used"
    )
    assert told in run_and_collect(text)[1] and told in plan(loads(text)).verdict
