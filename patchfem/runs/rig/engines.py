"""The engines of a rig as records: what each cannot do, how it solves, how a run of it can be coarser, what it costs.

`engine_of` takes the engine that the scene names, or the first that can. What each takes is one table for the rules of
the scene and for this choice, `scene.rules.methods.SUPPORT`. The bytes and the
compile seconds of each stand in `runs.memory`.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache, partial
from importlib import import_module
from typing import Any, NamedTuple

import numpy as np

from ...dynamics.events.elements import JOINED
from ...effects import NO_WAVEFORM, law_has_trait
from ...model.model import Model
from ...response.coarser import CoarserRuns, coarser_space
from ...response.errors import (
    FrictionScale,
    coarser_errors,
    finer_errors,
    friction_errors,
    merged_cell_errors,
    step_errors,
)
from ...scene.rules import methods
from ...scene.rules.accuracy import fixed_settings, has_effect
from ...slip import shear_modes
from ..patch import faces
from .costs import dear_elements, dear_events, not_smooth, pieces_per_cycle
from .solution import gauged

FINER = 0.5  # merge width of the run that shows what merging does
LOOSE = 1e-2  # tail over the tolerance from which it is checked by a run with less; unpinned it is a tenth of that
LESS = 0.1  # tail of that run
MOST_PIECES = 1e5  # of a period, up to which a steady motion is found by the map of its yields


class Variant(NamedTuple):
    """A coarser run of a rig: its Numerics and the Patch that it takes, None under [normal]."""

    numerics: object
    patch: object


CLOSED = 1e-8  # gap of an energy balance that is kept to round-off: a billion steps leave less


def function_of(where: str) -> Callable:
    """The function that "module function" of this folder names, imported now."""
    module, function = where.split()
    return getattr(import_module(f"patchfem.runs.rig.{module}"), function)


class Engine(NamedTuple):
    """One engine of a rig; what it takes stands under its name in `scene.rules.methods.SUPPORT`.

    method: the accuracy.method that names it, "" where only "auto" comes to it. dearer(model) ->
    why a model that names no engine is better served by the next one, "" where not. solve:
    function(model, numerics, patch, frames, say, progress) -> Solution; chosen: function(model,
    Numerics) -> Numerics as the engine has them; refuse: function(model, numerics), which raises
    Missing where a run would not end; cost: function(model, numerics, unknowns) -> (steps,
    seconds); words: function(model, numerics) -> sentences of a plan; notes: function(model,
    numerics, patch, Solution) -> notes of a run. All of these are "module function" of this folder,
    "" where there is none. in_time(model, numerics, patch) and in_space(model, numerics, patch,
    coarse, solution) -> list of `CoarserRuns`; least: relative error that stays; closes: gap of the
    energy balance beyond which a run has not converged, None where the engine's own error of the
    balance says it, infinite of methods that are shown with what they lose. tells: numbers of a run
    that its summary has; resumes: it keeps its state on the way; steady: it finds motions that
    repeat.
    """

    name: str
    method: str
    solve: str
    in_time: Callable
    in_space: Callable
    cost: str
    dearer: Callable = lambda model: ""
    chosen: str = ""
    refuse: str = ""
    words: str = "plan summed_words"
    notes: str = ""
    least: float = 1e-9
    closes: float | None = CLOSED
    tells: tuple = ()
    resumes: bool = False
    steady: bool = False

    def in_modes(self, model: Model, numerics, patch) -> list:
        """The run with more modes of a reduced structure, [] where it leaves none out; in a march at a quarter of the
        steps."""
        if model.rig.structure.richer_rig is None:
            return []
        few = _fewer(numerics, 4) if self.in_time is _march_in_time else numerics
        beside = None if few is numerics else Variant(few, patch)
        return [
            CoarserRuns(
                (Variant(replace(few, richer=True), patch),), finer_errors, beside, "reduced"
            )
        ]

    @property
    def run(self) -> Callable:
        """The function that solves, imported when it is first wanted."""
        solve = function_of(self.solve)
        return lambda model, *given: gauged(model, solve(model, *given))

    def lacks(self, model: Model, steady: bool = False) -> str:
        """The first thing in a model that the engine does not take, as words behind it; "" where it takes all. steady:
        under the sine of a curve, not the drive's own waveform."""
        return methods.unsupported_feature(self.name, motion_of(model, steady))

    def call(self, hook: str, *given) -> Any:
        """What the function of one of its fields gives, None where it has none."""
        where = getattr(self, hook)
        return function_of(where)(*given) if where else None


def inexact(model: Model, steady: bool = False) -> str:
    """Why no engine of accuracy.method = "exact" takes a model, "" where one does; steady as in `Engine.lacks`."""
    reasons = [one.lacks(model, steady) for one in ENGINES.values() if one.method == EXACT.method]
    return reasons[-1] if all(reasons) else ""


def motion_of(model: Model, steady: bool = False) -> methods.Motion:
    """What a model confronts an engine with."""
    rig = model.rig
    spring = (
        "[structure.stiffening]"
        if rig.springs.cubic is not None
        else "structure.bonded.wavelength"
        if rig.springs.interlock is not None
        else f"[{model.grooves.key}]"
        if model.grooves is not None
        else ""
    )
    waveform = NO_WAVEFORM if steady else rig.drive.waveform
    laws = rig.friction.interfaces
    whole = model.partial_slip
    return methods.Motion(
        [methods.Joint(law.numbers, whole or law.partial_slip) for law in laws],
        "under a load that changes" if rig.friction.load_varies else "",
        rig.friction.strips_slide_apart,
        spring,
        waveform,
        is_plane=rig.modes.lateral_faces is not None,
    )


class Finder(NamedTuple):
    """One way to a steady motion: words of a plan; solve: "module class" of this folder; like: the engine whose code it
    runs and whose knobs act on it."""

    name: str
    words: str
    solve: str
    like: str


FINDERS = {
    one.name: one
    for one in (
        Finder(
            "events", "the exact solution from event to event", "steady.maps EventFinder", "exact"
        ),
        Finder(
            "yields",
            "the exact solution between yield events",
            "steady.maps YieldFinder",
            "piecewise",
        ),
        Finder(
            "march",
            "a time integration whose initial state is corrected until the motion repeats",
            "steady.marched MarchFinder",
            "march",
        ),
        Finder("balance", "harmonic balance", "steady.balance BalanceFinder", "harmonic"),
    )
}


def steady_by(model: Model) -> Finder:
    """Choose how the steady motion of a model is found.

    Maps of events or of yields are exact. A march whose initial state is corrected until the motion repeats serves
    grooves. Harmonic balance serves all else, also a scene that names `harmonics`, or whose springs ring without end
    between yields.
    """
    if not EXACT.lacks(model, steady=True):
        return FINDERS["events"]
    if model.grooves is not None:
        return FINDERS["march"]
    named = model.accuracy.harmonics is not None
    return FINDERS[
        "balance"
        if named or PIECES.lacks(model) or pieces_per_cycle(model) > MOST_PIECES
        else "yields"
    ]


def _none(*_) -> list:
    return []


def sampling_errors(values: dict) -> dict:
    """Errors by name of the measures that are read off 400 samples a cycle."""
    loops = (
        "loop_area",
        "equivalent_stiffness",
        "equivalent_damping",
        "slip_amplitude",
        "friction_force_peak",
    )
    return {
        name: 1e-4 * abs(value)
        if name in loops
        else 0.005
        if name in ("stick_fraction", "slip_start_phase")
        else 1e-9 * abs(value)
        for name, value in values.items()
    }


def _exact_in_space(model: Model, numerics, patch, coarse, solution) -> list:
    """The coarser runs of the exact engine: the mesh, where the loads of strips or the limit of an averaged law hang on
    it.

    Strips that slide apart are read off 400 samples a cycle besides, by the trapezoidal rule.
    """
    averaged = model.friction is not None and law_has_trait(model.friction.law, "averaged")
    meshed = coarse is not None and (model.rig.friction.strips_slide_apart or averaged)
    samples = [CoarserRuns((), sampling_errors)] if model.rig.friction.strips_slide_apart else []
    return [*samples, coarser_space(Variant(numerics, coarse))] if meshed else samples


def _pieces_in_space(model: Model, numerics, patch, coarse, solution) -> list:
    """The coarser runs of the engine of pieces: the mesh, where its nodes make the elements, and fewer cells of
    a density."""
    meshes = [Variant(one, patch) for one in _meshed(model, numerics)]
    if coarse is not None and model.partial_slip:
        meshes = [Variant(numerics, coarse), *meshes]
    out = [CoarserRuns((variant,), coarser_errors, of="mesh") for variant in meshes]
    cells = any(law_has_trait(one.numbers.law, "cells") for one in model.rig.friction.interfaces)
    if not cells:
        return out
    merged = tuple(Variant(replace(numerics, joined=one), patch) for one in JOINED)
    return [*out, CoarserRuns(merged, merged_cell_errors, of="cells")]


def _meshed(model: Model, numerics) -> list:
    """Numerics with a coarser mesh of one patch of interfaces after the other."""
    if not model.rig.friction.has_partial_slip:
        return []
    return [replace(numerics, meshed=one) for one in faces.meshed(model)]


def _fewer(numerics, share: int):
    """Numerics with the steps divided by `share`."""
    return replace(numerics, steps=max(1, numerics.steps // share))


def _march_in_time(model: Model, numerics, patch) -> list:
    """The coarser runs of the march in time: half and a quarter of the steps."""
    return [
        CoarserRuns(
            _halves(numerics, patch), partial(step_errors, steps=numerics.steps), of="steps"
        )
    ]


def _halves(numerics, patch) -> tuple:
    return tuple(Variant(_fewer(numerics, share), patch) for share in (2, 4))


def _march_in_space(model: Model, numerics, patch, coarse, solution) -> list:
    """The coarser runs of the march in space: the mesh, the number of shear modes and the sum over bonds, at a quarter
    of the steps."""
    few, varies, out = _fewer(numerics, 4), model.rig.friction.load_varies, []
    quarter = Variant(few, patch)
    shape = getattr(getattr(solution.contact, "reduction", None), "stiffness", None)
    if coarse is not None and (varies or model.partial_slip):
        # one change at a time
        fixed = few if shape is None else replace(few, shear_modes=shape.size)
        out.append(coarser_space(Variant(fixed, coarse), quarter))
    out += [coarser_space(Variant(one, patch), quarter) for one in _meshed(model, few)]
    climbs, gathers = (
        model.grooves is not None,
        model.patch is not None and model.patch.mesh.can_gather_points,
    )
    # few points state themselves what their modes leave out
    pointed = coarse is not None and not gathers
    if shape is not None and (
        varies or climbs or (pointed and law_has_trait(model.friction.law, "bonds"))
    ):
        other = replace(few, shear_modes=shear_modes.comparison_count(shape.size))
        out.append(coarser_space(Variant(other, patch), quarter, "modes"))
    return [*out, *_summed(model, few, patch, solution)]


def _summed(model: Model, few, patch, solution) -> list:
    """The coarser runs of a list of bonds: its stated bound on forces and energies, and, where it merges or its tail
    was set loose, the change of the motion with narrower strips and a smaller tail, at the steps of `few`."""
    choice = solution.summed
    if choice is None or not choice.error:
        return []
    out = [
        CoarserRuns(
            (), lambda fine: _sum_errors(model, patch, choice.error, fine, solution), of="bonds"
        )
    ]
    if choice.merge > 0 or choice.tail > LOOSE * model.accuracy.tolerance:
        finer = replace(choice, merge=FINER * choice.merge, tail=LESS * choice.tail)
        same, narrow = (Variant(replace(few, choice=one), patch) for one in (choice, finer))
        out.append(CoarserRuns((narrow,), finer_errors, same, "bonds"))
    return out


def _sum_errors(model: Model, patch, fraction: float, values: dict, solution) -> dict:
    """Return `friction_errors` of a sum over bonds whose error is a fraction [1] of the friction limit."""
    friction, load = model.friction, patch.pressure.load if patch is not None else model.point.load
    passed = np.abs(np.diff(solution.window.extra["ledger"][0])).sum()
    span = solution.window.time[-1] - solution.window.time[0]
    cycle_work = passed * model.rig.drive.signal.period / max(span, 1e-300)
    scale = FrictionScale(
        friction.static,
        friction.static * load,
        friction.bond_length,
        solution.book["passed"],
        cycle_work,
    )
    return friction_errors(values, fraction, scale)


def _own_errors(model: Model, numerics, patch, coarse, solution) -> list:
    """What a run itself leaves open: the residual of a balance and the change at half the harmonics, or what samples do
    not resolve."""
    return [CoarserRuns((), lambda fine: {name: solution.errors.get(name, 0.0) for name in fine})]


def _steady_in_space(model: Model, numerics, patch, coarse, solution) -> list:
    """The coarser runs of a steady motion: what it leaves open itself, and the mesh where nodes are elements."""
    meshed = (
        _pieces_in_space(model, numerics, patch, coarse, solution)
        if steady_by(model).like == PIECES.name
        else []
    )
    return [*_own_errors(model, numerics, patch, coarse, solution), *meshed]


COARSER = 30.0  # times the error of a step
WIDER_TOLERANCE = partial(coarser_errors, ratio=COARSER)


def _smooth_in_time(model: Model, numerics, patch) -> list:
    """The coarser runs of the smooth engine: a run whose steps may make COARSER times the error.

    The error of a run follows that of its steps.
    """
    wider = Variant(replace(numerics, local=numerics.local * COARSER), patch)
    return [CoarserRuns((wider,), WIDER_TOLERANCE)]


EXACT = Engine(
    "exact",
    "exact",
    "pieces run_exact",
    _none,
    _exact_in_space,
    "costs exact_cost",
    dearer=dear_events,
    refuse="costs refuse_endless",
)
PIECES = Engine(
    "piecewise",
    "exact",
    "pieces run_piecewise",
    _none,
    _pieces_in_space,
    "costs exact_cost",
    dearer=dear_elements,
    chosen="numerics by_pieces",
    refuse="costs refuse_endless",
)
SMOOTH = Engine(
    "smooth",
    "",
    "smooth run_smooth",
    _smooth_in_time,
    _own_errors,
    "costs smooth_cost",
    dearer=not_smooth,
    chosen="numerics by_error",
    least=3e-8,
    closes=None,
    tells=("iterations",),
)
MARCH = Engine(
    "march",
    "march",
    "march run_march",
    _march_in_time,
    _march_in_space,
    "plan march_cost",
    chosen="numerics by_steps",
    refuse="lists refuse_long_list",
    notes="motion_warnings marched_elements",
    tells=("steps_per_cycle", "iterations"),
    resumes=True,
)
HARMONIC = Engine(
    "harmonic",
    "harmonic",
    "steady.steady run_steady",
    _none,
    _steady_in_space,
    "plan steady_cost",
    words="plan steady_words",
    notes="motion_warnings unmoved_elements",
    closes=None,
    steady=True,
)
ENGINES = {engine.name: engine for engine in (EXACT, PIECES, SMOOTH, MARCH, HARMONIC)}
AUTOMATIC = (EXACT, PIECES, SMOOTH, MARCH)  # in the order in which they are tried


def unbalanced(engine: Engine, measures: dict) -> str:
    """The sentence on an energy balance that does not close as this engine closes it; "" where it does.

    measures: by name, with their errors, of a run of the engine.
    """
    found = measures.get("energy_balance")
    if found is None or found.value is None:
        return ""
    bar = max(CLOSED, found.error or 0.0) if engine.closes is None else engine.closes
    if not found.value > bar:  # a motion that is not finite has been seen before
        return ""
    return (
        f"the energy balance of engine {engine.name} has an error of {found.value:.2g} of the energy exchanged, "
        f"more than the limit of {bar:.2g}, so the numerical method created or lost energy"
    )


@lru_cache(8)
def engine_of(model: Model, per_point: bool = False) -> Engine:
    """The engine that a scene names, of several of that name the first that takes the model, or the first of AUTOMATIC
    that takes it and is not dearer than the next.

    per_point: bonds are followed at every node, which the smooth engine does not.
    """
    named = [one for one in ENGINES.values() if one.method == model.accuracy.method]
    if named:
        return next((one for one in named if len(named) > 1 and not one.lacks(model)), named[-1])
    return next(
        one
        for one in AUTOMATIC
        if not (one.lacks(model) or one.dearer(model) or (per_point and one is SMOOTH))
    )


def knobs_idle(model: Model, engine: str) -> list:
    """Sentences on the knobs of [accuracy] that a rig names and that the engine it is run by does not take."""
    by = steady_by(model).like if ENGINES[engine].steady else engine
    where = {
        "steps_per_cycle": f"for engine '{engine}', which has no steps,",
        "harmonics": "if the steady motion is found by the exact solution from event to event",
    }
    plain = f"for engine '{engine}'"
    return [
        f"accuracy.{knob} has no meaning {where.get(knob, plain)} and is not used"
        for knob in fixed_settings(model.accuracy)
        if not has_effect(knob, model.kind, by)
    ]
