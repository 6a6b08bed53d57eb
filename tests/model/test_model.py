"""The model of a scene: frozen, made once, all that a run takes; parts of it exchanged without a scene."""

from dataclasses import FrozenInstanceError, astuple, fields, is_dataclass, replace

import numpy as np
import pytest
from scene_texts import (
    BENCH,
    COULOMB,
    GROWING,
    LINEAR,
    PATCH,
    POINT,
    RIG,
    SHEAR,
    SHORT,
    SMALL_PATCH,
    STRUCTURE,
    TRIANGLE,
    line_of,
)

from patchfem.core import Missing, PatchfemError
from patchfem.model import build
from patchfem.runs.plan import plan
from patchfem.runs.run import run
from patchfem.scene import loads

KINDS = {
    "a patch": (PATCH, "patch"),
    "a small patch": (SMALL_PATCH, "patch"),
    "a point on a bench": (BENCH, "bench"),
    "growing bonds on a bench": (POINT + GROWING + TRIANGLE, "bench"),
    "a patch on a bench": (SMALL_PATCH + COULOMB + TRIANGLE, "bench"),
    "a rig": (RIG, "rig"),
    "a point on a rig": (POINT + COULOMB + STRUCTURE, "rig"),
    "a soft patch on a rig": (SMALL_PATCH + SHEAR + COULOMB + SHORT, "rig"),
    "a linear rig": (LINEAR, "linear"),
}
FEW = ["drive.cycles=6", "accuracy.steps_per_cycle=100", "contact.element_size=0.5 mm"]
RUNS = {
    "patch": (SMALL_PATCH, []),
    "bench": (BENCH, ["accuracy.steps_per_cycle=100"]),
    "march": (RIG, FEW),
    "exact": (POINT + COULOMB + SHORT, []),
    "harmonic": (POINT + COULOMB + SHORT, ["accuracy.method=harmonic"]),
    "linear": (LINEAR, ["drive.cycles=6"]),
}


def seen(result) -> tuple:
    """All of a result but its times, as text, so that two results compare bit by bit."""
    response = result.response
    histories = (
        []
        if response is None
        else [
            np.asarray(getattr(response, name)).tobytes()
            for name in ("time", "slide", "force", "slip")
        ]
    )
    measured = {name: repr(astuple(measure)) for name, measure in result.measures.items()}
    stated = result.plan.as_json() | {"seconds": None, "compile_seconds": None}
    return result.outcome, measured, result.warnings, histories, stated


# ---- the model itself


@pytest.mark.parametrize("text, kind", KINDS.values(), ids=KINDS)
def test_always_a_model_of_every_kind_is_frozen(text, kind):
    model = build(loads(text))
    assert model.kind == kind
    assert (model.rig is not None, model.slide is not None) == (
        kind in ("rig", "linear"),
        kind == "bench",
    )
    assert (model.patch is not None) == ("[contact]" in text) and (model.point is not None) == (
        "[normal]" in text
    )
    assert (model.friction is not None) == ("[friction]" in text)
    parts = [model, *(part for part in (model.source, model.patch, model.patch and model.patch.gap, model.point,
                                        model.slide, model.rig) if part is not None)]  # fmt: skip
    for part in parts:
        assert is_dataclass(part)
        for field in fields(part):
            with pytest.raises(FrozenInstanceError):
                setattr(part, field.name, None)
        with pytest.raises((FrozenInstanceError, AttributeError, TypeError)):
            part.another = None


@pytest.mark.parametrize("text, kind", KINDS.values(), ids=KINDS)
def test_always_a_model_keeps_the_scene_it_came_from(text, kind):
    scene = loads(text, "a.toml")
    source = build(scene).source
    assert (source.text, source.title, source.effects) == (
        text,
        scene.title,
        tuple(scene.effect_names()),
    )
    again = loads(source.resolved)
    assert (
        again.kind == kind
        and again.remarks == []
        and build(again).source.resolved == source.resolved
    )


def test_exact_the_resolved_text_has_what_follows_from_other_keys():
    for text in (PATCH, PATCH + COULOMB + SHORT):
        assert loads(build(loads(text)).source.resolved).contact.element_size is None, (
            "the tolerance chooses it"
        )
    model = build(loads(POINT + GROWING + TRIANGLE))
    assert (
        loads(model.source.resolved).friction.rest_speed
        == model.bonds.rest_speed
        == 1e-3 * model.speed_scale
    )


def test_always_the_speed_of_a_released_rig_can_be_written():
    """Several modes in rest at t = 0: the speed to expect is a number of numpy, which a text does not take."""
    modes = "".join(
        f'[[structure.mode]]\nname = "m{k}"\nfrequency = "{f} Hz"\ndamping = 0.01\nslide = {s}\n'
        for k, (f, s) in enumerate([(120, 1.0), (300, 0.3)])
    )
    model = build(
        loads(
            POINT + GROWING + '[structure]\nmoving_mass = "1 kg"\n' + modes + "[structure.start]\n"
            'displacement = ["0.4 mm", "0 mm"]\n[drive]\nkind = "free"\ncycles = 3\n'
        )
    )
    assert loads(model.source.resolved).friction.rest_speed == model.bonds.rest_speed


# ---- runs of it


@pytest.mark.parametrize("text, sets", RUNS.values(), ids=RUNS)
def test_exact_the_run_of_a_model_is_the_run_of_its_scene(text, sets):
    scene = loads(text, sets=sets)
    model = build(scene)
    ours = run(model)
    want = run(scene)
    assert seen(ours) == seen(want) == seen(run(plan(model)))
    assert ours.plan.model is model and ours.measures


def with_load(model, size: float):
    """The model under another load [N]."""
    if model.patch is not None:
        return replace(model, patch=model.patch.with_loading(load=size))
    return replace(model, point=replace(model.point, load=size))


def with_tilt(model, angle: float):
    """The model under another tilt [rad]."""
    ((name, tilt),) = model.patch.gap.shapes
    shapes = ((name, tilt.model_copy(update={"angle": angle})),)
    return replace(model, patch=replace(model.patch, gap=replace(model.patch.gap, shapes=shapes)))


def with_size(model, size: float):
    """The model on another mesh [m]."""
    return replace(model, patch=model.patch.with_element_size(size))


CHANGES = {
    "load": (with_load, 200.0, "contact.load=200 N"),
    "gap": (with_tilt, 5e-5, "contact.tilt.angle=0.05 mrad"),
    "mesh": (with_size, 4e-4, "contact.element_size=0.4 mm"),
}


@pytest.mark.share(0, 1, 2, 3, 4, 5, 6)
@pytest.mark.parametrize("change", CHANGES)
@pytest.mark.parametrize(
    "text, sets",
    [
        (SMALL_PATCH, []),
        (RIG, FEW),
        (SMALL_PATCH + SHEAR + COULOMB + SHORT, ["accuracy.steps_per_cycle=100"]),
    ],
    ids=["patch", "rig", "soft patch on a rig"],
)
def test_exact_an_exchanged_part_is_the_scene_with_that_set(text, sets, change):
    exchanged, value, one = CHANGES[change]
    before = build(loads(text, sets=sets))
    ours = run(exchanged(before, value))
    want = run(loads(text, sets=[*sets, one]))
    assert seen(ours) == seen(want) != seen(run(before))


def test_exact_another_law_is_the_scene_with_that_set():
    """The first interface of the rig and the law of the model are one law in two places: both are exchanged."""
    text = SMALL_PATCH + SHEAR + COULOMB + SHORT
    sets = ["accuracy.steps_per_cycle=100"]
    before = build(loads(text, sets=sets))
    less = before.friction.model_copy(update={"static": 0.2, "kinetic": 0.2})
    friction = before.rig.friction
    interfaces = (replace(friction.interfaces[0], numbers=less),)
    other = replace(before.rig, friction=replace(friction, interfaces=interfaces))
    ours = run(replace(before, friction=less, rig=other))
    assert seen(ours) == seen(
        run(loads(text, sets=[*sets, "friction.static=0.2", "friction.kinetic=0.2"]))
    )


# ---- messages

TINY = SMALL_PATCH.replace('"0.5 mm"', '"0.2 um"')
STILL = STRUCTURE.replace("slide = 1.0", "slide = 1.0\nbase = 0.0")


@pytest.mark.parametrize(
    "text, key, line, says",
    [
        (STILL, "drive.kind", 'kind = "base"', "the drive excites no mode"),
        (TINY, "", "", "GB of memory are needed"),
    ],
    ids=["a key of a run", "a size"],
)
def test_refuses_with_file_and_line_once_whoever_asks(text, key, line, says):
    """The same sentence from the scene, its model and its plan; file and line of the key once, at the beginning."""
    where = f"a.toml:{line_of(text, line)}: {key}: " if key else "a.toml: "
    scene = loads(text, "a.toml")
    messages = set()
    for act in (lambda: run(scene), lambda: run(build(scene)), lambda: run(plan(scene))):
        with pytest.raises(PatchfemError) as caught:
            act()
        messages.add(str(caught.value))
        assert caught.value.key is None and isinstance(caught.value, Missing) == (text == TINY)
    [message] = messages
    assert message.startswith(where) and message.count("a.toml") == 1 and says in message


def test_refuses_what_no_model_can_be_made_of_with_file_and_line_once():
    text = (
        POINT + GROWING + '[friction.temperature]\nsurface = "1 K"\nreference = "293.15 K"\n'
        'rest_activation = "2500 K"\nslip_activation = "1500 K"\n' + TRIANGLE
    )
    for act in (build, plan, run):
        with pytest.raises(PatchfemError, match="rest_growth would be about 1e-") as caught:
            act(loads(text, "a.toml"))
        where = f"a.toml:{line_of(text, '[friction.temperature]')}: friction.temperature: "
        assert str(caught.value).startswith(where) and str(caught.value).count("a.toml") == 1


def test_refuses_a_key_of_a_set_with_the_file_alone():
    sets = [
        "drive.kind=base",
        "drive.frequency=143 Hz",
        "drive.acceleration=5 g",
        "drive.cycles=20",
    ]
    with pytest.raises(
        PatchfemError, match=r"^a\.toml: drive\.kind: the drive excites no mode"
    ) as caught:
        run(loads(STILL.partition("[drive]")[0], "a.toml", sets))
    assert str(caught.value).count("a.toml") == 1


def test_exact_the_frequency_of_a_model_of_two_masses_is_that_of_its_eigenproblem():
    text = """[structure]
masses = ["1 kg", "2 kg"]
spring = [{between = [1, 0], stiffness = "9 N/m"}, {between = [2, 1], stiffness = "9 N/m"}]
[drive]
kind = "base"
frequency = "1 Hz"
acceleration = "1 m/s^2"
cycles = 3
"""
    found = build(loads(text, "a.toml")).rig
    assert found.first_mode.frequency == pytest.approx(
        3 / (2 * np.pi) * np.sqrt((5 - 17**0.5) / 4), rel=1e-12
    )
