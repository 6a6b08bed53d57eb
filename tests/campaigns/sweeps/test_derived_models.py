"""Models of sweep cases derived from the first model, compared with models built from text."""

from dataclasses import fields, is_dataclass
from pathlib import Path

import numpy as np
import pytest
from point_cases import DRIVES, LAWS
from point_cases import SCENE as POINT_SCENE
from scene_texts import (
    COATED,
    COULOMB,
    DRIVE,
    MODE,
    NONLOCAL,
    POINT,
    SECOND,
    SHEAR,
)

from patchfem.campaigns import SweepScene
from patchfem.core import PatchfemError
from patchfem.model import SimilarModels
from patchfem.runs.batch import lumped
from patchfem.runs.patch.cases import make_cases, take_patch
from patchfem.scene.overrides import PLAIN_KEYS

PLASTIC = '[friction]\nlaw = "elastic-plastic"\nstatic = 0.3\nbond_length = "10 um"\n'
SPRINGS = PLASTIC.replace('bond_length = "10 um"', 'stiffness = "2e6 N/m"')
UNITS = {
    "load": "N",
    "bond_length": "m",
    "acceleration": "m/s^2",
    "frequency": "Hz",
    "moving_mass": "kg",
}
UNITS |= {
    "distance": "m",
    "height": "m",
    "offset": "m",
    "radius": "m",
    "rotational_stiffness": "N m/rad",
}
UNITS |= {"angle": "rad", "reference_speed": "m/s", "stiffness": "N/m", "stribeck_speed": "m/s"}
KEYS = list(
    dict.fromkeys(
        key.replace("mode.", f"mode.{mode}.")
        for key in PLAIN_KEYS
        if not key.startswith("contact.")
        for mode in ("axial", "1")
    )
)
RIG = MODE + SECOND + DRIVE
TILTED = COATED + '[contact.tilt]\nangle = "0.1 mrad"\n'
SCENES = {
    "coulomb": POINT + COULOMB + RIG,
    "elastic-plastic": POINT + PLASTIC + RIG,
    "springs": POINT + SPRINGS + RIG,
    "tanh": POINT + '[friction]\nlaw = "tanh"\nstatic = 0.3\nreference_speed = "5 mm/s"\n' + RIG,
    "lugre": POINT
    + '[friction]\nlaw = "lugre"\nstatic = 0.3\nkinetic = 0.2\nstiffness = "1e7 N/m"\n'
    'stribeck_speed = "1 mm/s"\n' + RIG,
    "weakening": POINT + COULOMB + "kinetic = 0.2\n" + RIG,
    "two loads": POINT + 'amplitude = "3 N"\nfrequency = "70 Hz"\n' + COULOMB + RIG,
    "duration": POINT + COULOMB + RIG.replace("cycles = 30", 'duration = "0.3 s"'),
    "bonded": POINT + COULOMB + RIG + '[structure.bonded]\nstiffness = "1e5 N/m"\n',
    "start": POINT + COULOMB + RIG + '[structure.start]\nvelocity = ["0.1 m/s", "0 m/s"]\n',
}
PATCHES = {
    "static": TILTED,
    "lower": TILTED + 'on = "lower"\n[contact.asperities]\nlaw = "linear"\n'
    'normal_stiffness = "1e14 Pa/m"\n',
    "sheared": TILTED + SHEAR + PLASTIC + RIG,
    "springs": TILTED + SHEAR + SPRINGS + RIG,
    "bonds": TILTED + SHEAR + NONLOCAL + RIG,
    "rigid": TILTED + COULOMB + RIG,
}
HELD = TILTED + '[contact.holder]\nrotational_stiffness = "100 N m/rad"\n'


def are_identical(a, b) -> bool:
    """Return whether two parts of models are equal to the bit in all their fields."""
    if type(a) is not type(b):
        return False
    if isinstance(a, np.ndarray):
        return a.dtype == b.dtype and np.array_equal(a, b)
    if isinstance(a, tuple):
        return len(a) == len(b) and all(map(are_identical, a, b))
    if is_dataclass(a):
        return all(
            are_identical(getattr(a, one.name), getattr(b, one.name))
            for one in fields(a)
            if one.name != "writer"
        ) and (not hasattr(a, "resolved") or a.resolved == b.resolved)
    return a == b and repr(a) == repr(b)


def derive_model(sweep_scene: SweepScene, sets: tuple, values: tuple):
    """Return the model of a case that is derived from the first model; None if this is not possible."""
    keys = tuple(text.partition("=")[0] for text in sets)
    base = sweep_scene.build_similar_base(keys, sets)
    if base is None or not base.plain_numbers.are_plain(np.array([values])).all():
        return None
    return SimilarModels(*base, np.array([values]), lambda _: tuple(sets), np.zeros(1, int))[0]


def model_or_reason(sweep_scene: SweepScene, sets: tuple, values: tuple):
    """Return the model of a case, or the message of the error that prevents it."""
    try:
        derived = derive_model(sweep_scene, sets, values) if values else None
        return derived or sweep_scene.build_model(sets)
    except PatchfemError as error:
        return str(error)


def format_case(keys: list, values: tuple) -> tuple:
    """Return a case as strings `key=value`."""
    return tuple(
        f"{key}={value!r} {UNITS.get(key.rpartition('.')[2], '')}".strip()
        for key, value in zip(keys, values)
    )


def random_cases(seed: int, count: int):
    """Yield (sets, values) of random cases over random keys, some of them invalid."""
    r = np.random.default_rng(seed)
    while count > 0:
        keys = list(r.choice(KEYS, r.integers(1, 5), replace=False))
        keys = [
            key
            for k, key in enumerate(keys)
            if not any(
                other.replace(".1.", ".axial.") == key.replace(".1.", ".axial.")
                for other in keys[:k]
            )
        ]
        for _ in range(min(count, 5)):
            values = tuple(
                float(
                    r.choice([10.0 ** r.uniform(-3, 2), 0.0, -1.0, 0.7], p=[0.8, 0.07, 0.06, 0.07])
                )
                for _ in keys
            )
            yield format_case(keys, values), values
            count -= 1


@pytest.mark.long
@pytest.mark.share(0, 4)
@pytest.mark.parametrize("name", SCENES)
def test_exact_derived_models_equal_models_built_from_text(name):
    """Models of rigs derived from the first model equal those built from text, to the bit."""
    sweep_scene = SweepScene(Path("a.toml"), SCENES[name], ("normal.load=20 N",))
    n_derived = 0
    for sets, values in random_cases(len(name), 150):
        derived = model_or_reason(sweep_scene, sets, values)
        built = model_or_reason(sweep_scene, sets, ())
        assert are_identical(derived, built), sets
        n_derived += (
            derive_model(sweep_scene, sets, values) is not None if not isinstance(built, str) else 0
        )
    assert n_derived == 0 if name == "duration" else n_derived > 5


@pytest.mark.share(0, 2, 5)
@pytest.mark.parametrize("name", PATCHES)
def test_exact_derived_patches_equal_patches_built_from_text(name):
    """Models of patches derived from the first model equal those built from text, to the bit.

    A patch with a holder in a rig, or with a bonded interface, is not derived.
    """
    sweep_scene = SweepScene(Path("a.toml"), PATCHES[name])
    r = np.random.default_rng(len(name))
    keys = ["contact.load", "contact.tilt.angle"]
    keys += ["friction.static", "drive.acceleration"] if "friction" in PATCHES[name] else []
    for _ in range(20):
        chosen_keys = list(r.choice(keys, r.integers(1, len(keys) + 1), replace=False))
        values = 10.0 ** r.uniform(-6, -1, len(chosen_keys))
        values *= [
            r.choice([1, -1, 0]) if key == "contact.tilt.angle" else 1 for key in chosen_keys
        ]
        values = tuple(values.tolist())
        sets = format_case(chosen_keys, values)
        is_derived = "friction.static" not in chosen_keys or "kinetic" not in PATCHES[name]
        assert (derive_model(sweep_scene, sets, values) is not None) == is_derived
        assert are_identical(
            model_or_reason(sweep_scene, sets, values), model_or_reason(sweep_scene, sets, ())
        ), sets
    for sets, values in (
        (("contact.load=-1 N",), (-1.0,)),
        (("contact.tilt.angle=-0.2 rad",), (-0.2,)),
        (("contact.tilt.angle=0.2 rad",), (0.2,)),
        (("contact.load=1e12 N",), (1e12,)),
    ):
        assert derive_model(sweep_scene, sets, values) is None and are_identical(
            model_or_reason(sweep_scene, sets, values), model_or_reason(sweep_scene, sets, ())
        )
    for text in (
        HELD + COULOMB + RIG,
        PATCHES["rigid"] + '[structure.bonded]\nstiffness = "1e5 N/m"\n',
    ):
        assert derive_model(SweepScene(Path("b.toml"), text), ("contact.load=3 N",), (3.0,)) is None


LOADINGS = {
    "step": (
        TILTED + '[contact.step]\nheight = "1 um"\nat = "2 mm"\n',
        "contact.step.height",
        "m",
        1e-6,
        (-3.0, 3.0),
    ),
    "approach": (
        COATED.replace('load = "26 lbf"\n', "") + '[contact.approach]\ndistance = "1 um"\n',
        "contact.approach.distance",
        "m",
        1e-6,
        (0.1, 3.0),
    ),
    "line": (
        COATED + '[contact.load_line]\noffset = "1 mm"\n',
        "contact.load_line.offset",
        "m",
        1e-3,
        (-5.0, 5.0),
    ),
    "holder": (HELD, "contact.holder.rotational_stiffness", "N m/rad", 1e2, (0.1, 9.0)),
}


@pytest.mark.parametrize("name", LOADINGS)
def test_exact_derived_loadings_equal_those_built_from_text(name):
    """Patches with other steps, approaches, load lines and holders equal those built from text."""
    text, key, unit, scale, limits = LOADINGS[name]
    sweep_scene = SweepScene(Path("a.toml"), text)
    for value in np.random.default_rng(8).uniform(*limits, 12) * scale:
        sets = (f"{key}={float(value)!r} {unit}",)
        derived = derive_model(sweep_scene, sets, (float(value),))
        assert derived is not None and are_identical(derived, sweep_scene.build_model(sets)), sets


# Scene that has each plain key, and three of its values in SI
COLUMN_LAWS = {
    "friction.bond_length": "elastic-plastic",
    "friction.reference_speed": "tanh",
    "friction.stiffness": "bouc-wen",
    "friction.stribeck_speed": "lugre",
}
COLUMN_TEXTS = {
    **{key: text for text, key, *_ in LOADINGS.values()},
    "contact.load": TILTED,
    "contact.tilt.angle": HELD,
    "contact.crown.radius": TILTED + '[contact.crown]\nradius = "3 m"\n',
}


@pytest.mark.parametrize("key", [*PLAIN_KEYS, "contact.load_line.offset"])
def test_exact_columns_of_a_plain_key_are_those_of_each_model(key):
    """Numbers that are arrays over the cases give each case the numbers of its own model, to the bit."""
    law = LAWS[COLUMN_LAWS.get(key, "coulomb")]
    point = POINT_SCENE.format(law=law, drive=DRIVES["drive.acceleration"])
    sweep_scene = SweepScene(Path("a.toml"), COLUMN_TEXTS.get(key, point))
    full_key = key.replace("mode.", "mode.0.")
    values = np.array([[1e-3], [2e-3], [4e-3]])
    sets = [
        (f"{full_key}={value!r} {UNITS.get(key.rpartition('.')[2], '')}".strip(),)
        for (value,) in values.tolist()
    ]
    base = sweep_scene.build_similar_base((full_key,), sets[1])
    similar = SimilarModels(*base, values, lambda case: sets[case], np.arange(3))
    models = [sweep_scene.build_model(texts) for texts in sets]
    if not key.startswith("contact."):
        together, apart = lumped.collect_cases(similar), lumped.collect_cases(models)
        assert are_identical(together, apart)
        assert len(np.unique(np.column_stack(together.cases[:2]), axis=0)) == 3
        return

    columns = similar.columns().patch
    cases = make_cases(columns, 3)
    for case, model in enumerate(models):
        assert are_identical(take_patch(columns, case), model.patch)
        alone = make_cases(model.patch, 1)
        assert np.array_equal(cases.take([case]).holders, alone.holders, equal_nan=True)
        assert np.array_equal(cases.amplitudes[case], alone.amplitudes[0])
    numbers = np.nan_to_num(np.column_stack([*cases.holders, cases.amplitudes]))
    assert len(np.unique(numbers, axis=0)) == 3
