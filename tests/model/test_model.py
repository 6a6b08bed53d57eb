"""The model of a scene: its parts are immutable, can be replaced, and contain all that a run
needs."""

from dataclasses import FrozenInstanceError, astuple, fields, is_dataclass, replace
from importlib.resources import files

import numpy as np
import pytest
from scene_texts import (
    BENCH,
    COULOMB,
    FORCED,
    GROWING,
    LINEAR,
    MODE,
    PATCH,
    POINT,
    RIG,
    SECOND,
    SHEAR,
    SHORT,
    SMALL_PATCH,
    STRUCTURE,
    TRIANGLE,
)

import patchfem
from patchfem.model import build
from patchfem.runs import find_drive_and_knee
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


def comparable_result(result) -> tuple:
    """Return everything of a result except its computing times, in a form that compares bit by
    bit."""
    response = result.response
    histories = (
        []
        if response is None
        else [
            np.asarray(getattr(response, name)).tobytes()
            for name in ("time", "slide", "force", "slip")
        ]
    )
    measure_values = {name: repr(astuple(measure)) for name, measure in result.measures.items()}
    plan_values = result.plan.as_json() | {"seconds": None, "compile_seconds": None}
    return result.outcome, measure_values, result.warnings, histories, plan_values


# ---- models


@pytest.mark.parametrize("text, kind", KINDS.values(), ids=KINDS)
def test_always_models_of_all_kinds_are_immutable(text, kind):
    """The model of every kind of scene contains the parts of the scene, and no field of them can be
    set."""
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


def test_exact_resolved_text_contains_derived_values():
    """The resolved text contains the rest speed derived from other keys, but no element size that
    the tolerance determines."""
    for text in (PATCH, PATCH + COULOMB + SHORT):
        assert loads(build(loads(text)).source.resolved).contact.element_size is None, (
            "the tolerance chooses it"
        )
    model = build(loads(POINT + GROWING + TRIANGLE))
    assert (
        loads(model.source.resolved).friction.rest_speed
        == model.bonds.growth.rest_speed
        == 1e-3 * model.speed_scale
    )


def test_exact_sliding_speed_of_a_rig_is_that_of_its_interface():
    """A force on a heavy frame moves the interface with the speed of the frame, 5 mm at 1 Hz, from which the default rest
    speed of bonds follows; a base that moves a mode with the ratio .8 moves its interface by .8 times .8 of its speed."""
    text = (files(patchfem) / "scene/templates/joint_laws/lugre.toml").read_text("utf-8")
    rig = build(loads(text)).rig
    assert rig.slide_speed_scale == pytest.approx(2 * np.pi * 5e-3, rel=1e-5)
    bonds = build(loads(POINT + GROWING + STRUCTURE))
    partial = build(loads(POINT + GROWING + STRUCTURE, sets=["structure.mode.axial.slide=0.8"]))
    assert bonds.bonds.growth.rest_speed == 1e-3 * bonds.rig.speed_scale
    assert partial.bonds.growth.rest_speed == pytest.approx(
        0.64 * bonds.bonds.growth.rest_speed, rel=1e-12
    )


def test_exact_layers_in_series_add_their_compliance():
    """A compliance of 2 per length gives twice the height of both pieces, coated or not; equal pairs share the load."""
    pieces = build(loads(SMALL_PATCH)).patch.pieces
    assert pieces.lower.thickness > 0
    for coating in (pieces.lower.coating, None):
        lower = replace(pieces.lower, coating=coating)
        stack = replace(pieces, lower=lower)
        heights = stack.lower.height + stack.upper.height
        compliance = stack.series_compliance(lambda _: 2.0)
        assert compliance == pytest.approx(2 * heights / (stack.length * stack.width), rel=1e-12)
        pairs = replace(stack, pairs=3 * stack.pairs)
        assert pairs.series_compliance(lambda _: 2.0) == pytest.approx(compliance / 3, rel=1e-12)


# ---- runs of a model


@pytest.mark.parametrize("text, sets", RUNS.values(), ids=RUNS)
def test_exact_run_of_model_equals_run_of_scene(text, sets):
    """The runs of a scene, of its model and of its plan give bit-identical results."""
    scene = loads(text, sets=sets)
    model = build(scene)
    result = run(model)
    expected = run(scene)
    assert (
        comparable_result(result)
        == comparable_result(expected)
        == comparable_result(run(plan(model)))
    )
    assert result.plan.model is model and result.measures


def with_load(model, size: float):
    """Return the model with another normal load [N]."""
    if model.patch is not None:
        return replace(model, patch=model.patch.with_loading(load=size))
    return replace(model, point=replace(model.point, load=size))


def with_tilt(model, angle: float):
    """Return the model with another tilt [rad]."""
    ((name, tilt),) = model.patch.gap.shapes
    shapes = ((name, tilt.model_copy(update={"angle": angle})),)
    return replace(model, patch=replace(model.patch, gap=replace(model.patch.gap, shapes=shapes)))


def with_element_size(model, size: float):
    """Return the model with another element size [m]."""
    return replace(model, patch=model.patch.with_element_size(size))


CHANGES = {
    "load": (with_load, 200.0, "contact.load=200 N"),
    "gap": (with_tilt, 5e-5, "contact.tilt.angle=0.05 mrad"),
    "mesh": (with_element_size, 4e-4, "contact.element_size=0.4 mm"),
}


@pytest.mark.share(0, 4, 8)
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
def test_exact_replaced_part_equals_changed_scene_key(text, sets, change):
    """A model with a replaced load, gap or mesh gives the results of the scene in which that key is
    set."""
    replace_part, value, setting = CHANGES[change]
    original = build(loads(text, sets=sets))
    result = run(replace_part(original, value))
    expected = run(loads(text, sets=[*sets, setting]))
    assert (
        comparable_result(result) == comparable_result(expected) != comparable_result(run(original))
    )


# ---- error messages


# ---- effects and derived properties


def test_exact_run_in_of_one_stroke_has_steps_of_cycles():
    """A run-in as long as the amplitude of a triangle has the same steps as its cycles."""
    slide = build(loads(BENCH, sets=["slide.distance=10 um", "slide.cycles=2"])).slide
    path = slide.samples(80)
    assert path.time.size == 20 + 160 + 1 and path.last_cycle == 20 + 80
    assert np.abs(np.diff(path.rel_disp)) == pytest.approx(0.5e-6, rel=1e-9)
    assert path.rel_disp[20] == slide.amplitude
    assert np.diff(path.time) == pytest.approx(0.5e-6 / slide.speed, rel=1e-9)


@pytest.mark.parametrize("length, overhangs", [(12.7, False), (16.0, True), (26.0, True)])
def test_exact_longer_piece_overhangs_interface(length, overhangs):
    """A piece that is longer than the interface, by 26 % or by 105 %, overhangs it."""
    text = SMALL_PATCH + f'[contact.lower]\nlength = "{length} mm"\n'
    assert build(loads(text)).patch.pieces.has_overhang == overhangs


@pytest.mark.parametrize(
    "text, sets, has_knee",
    [
        (STRUCTURE, [], True),
        (STRUCTURE, ['drive.frequency="120 Hz"'], False),
        (STRUCTURE + SECOND, [], False),
        (MODE + FORCED.replace("mass = 2\n", ""), ['drive.frequency="143 Hz"'], False),
    ],
    ids=["resonance", "below resonance", "two modes", "force"],
)
def test_exact_only_base_sine_at_resonance_of_single_mode_has_knee(text, sets, has_knee):
    """Only a sine of the base at resonance of a single mode has a drive that friction can bound."""
    model = build(loads(POINT + COULOMB + text, sets=sets))
    assert set(find_drive_and_knee(model)) == ({"drive", "knee"} if has_knee else set())
