"""Frequency and damping of a released rig over its amplitude, with the errors of its coarser runs and of its mesh.

Where the nodes of a mesh and of a coarser one hold, their decays are alike, and both leave out the loss of micro-slip.
So the error of the mesh is read off the static loops of its elements at the same amplitudes (`slip.mesh_correction`).
"""

from dataclasses import replace

import numpy as np

from ...compiled import load
from ...core import NotConverged, PatchfemError
from ...dynamics.harmonic import forces, quasi_static
from ...dynamics.march import models
from ...response.decay_curve import FAINT, DecayCurve, curve_of, of_turns, turns
from ...response.errors import MAX_ORDER, error_of_change
from ...slip.mesh_correction import SPREAD_FACTOR, spread
from ..patch import faces
from . import interface, numerics
from .solution import Solution
from .steady import balance

MOVING = (
    "the contact slides on grooves",
    "the normal load changes",
    "the strips of the patch slide independently of one another",
)
NO_LOOP = "the hysteresis loop of this friction law is not known without a computation in time"
NOT_STATIC = "no static curve of the mode was found at these amplitudes"
MOST = 0.5  # of a value, the error up to which it is one
APART = 16  # amplitudes a decade at which the error of the mesh is computed


def decay_of(raw: Solution) -> DecayCurve | None:
    """The curve of the output of a release, without the points whose errors are above MOST of their values; None where
    there is no other.

    What coarser runs change at the same amplitudes is added to what the reading leaves open; where a coarser run does
    not reach, the error is infinite.
    """
    found = _read(raw)
    if not found.time.size:
        return None
    found = _compared(found, raw)
    known = (found.frequency_error <= MOST * found.frequency) & (
        found.damping_error <= MOST * np.abs(found.damping)
    )
    return found.at(known) if known.any() else None


def _compared(found: DecayCurve, raw: Solution) -> DecayCurve:
    """A curve of a run with what its coarser runs change in its errors."""
    for run, beside in raw.coarser:
        one, other = (
            _read(run).over(found.amplitude),
            found if beside is None else _read(beside).over(found.amplitude),
        )
        found = found.widened(one, other)
    return found


def _read(run: Solution) -> DecayCurve:
    """The curve of the half swings as long as they shrink, and behind the last slip that of the mode that rings on, at
    each of its half swings: there other modes ring beside it, and the turns of their sum tell of none of them."""
    motion, held = run.response, run.extra.get("tail")
    found = curve_of(of_turns(*turns(motion.time, motion.output, motion.output_rate)))
    if held is None:
        return found
    time = np.arange(held.begin, held.end, 0.5 / held.frequency)
    rate = 2 * np.pi * held.frequency * held.damping / np.sqrt(1 - held.damping**2)
    size, still = held.displacement * np.exp(-rate * (time - held.begin)), np.zeros(time.size)
    kept = size > FAINT * np.abs(motion.output).max()
    rings = DecayCurve(time, size, still + held.frequency, still, still + held.damping, still).at(
        kept
    )
    return DecayCurve(*map(np.concatenate, zip(found.at(found.time < held.begin), rings)))


def laws_on(model, patch, meshed: tuple = ()):
    """The `harmonic.forces.Group` of a rig on one of its meshes; patch: of its [contact], None without; meshed:
    interfaces whose own patches are those on a coarser one. PatchfemError where a law has no steady loop of its own."""
    rig = model.rig
    if len(rig.friction.interfaces) < 2:
        return balance.BalanceFinder(
            model, replace(numerics.choose(steadily(model)), meshed=meshed), patch
        ).group
    load("dynamics.harmonic.cycle_kernels", None)
    return forces.Group(
        rig.modes, list(enumerate(map(models.element_model, interface.own_elements(model, meshed))))
    )


def rough_laws(model, coarse) -> list:
    """Groups of the laws with a coarser mesh of one patch after the other; coarse: the Patch of a coarser mesh of its
    [contact] or None."""
    return [
        *([] if coarse is None else [laws_on(model, coarse)]),
        *(laws_on(model, None, numbers) for numbers in faces.meshed(model)),
    ]


def steadily(model):
    """The model with the method left to the program."""
    return replace(model, accuracy=model.accuracy.model_copy(update={"method": "auto"}))


def static_rows(modes, laws, number: int, amplitudes, samples: int) -> np.ndarray:
    """(amplitude [m], frequency [Hz], damping, loss [J]) (4, k) by a static force along the mode `number` held by laws,
    a Group, at amplitudes (k,) [m] of the output; samples: of a cycle."""
    held = modes.stuck_mode(laws.rows, laws.stiffness(), number)
    moved = float(modes.output @ held[1])
    return rows_of(
        modes,
        quasi_static.along(
            modes, laws, amplitudes / abs(moved), held, samples, modes.output / moved
        ),
    )


def rows_of(modes, found: list) -> np.ndarray:
    """(amplitude [m] at the output, frequency [Hz], damping, loss [J]) (4, k) of `quasi_static.Static`s."""
    return np.array(
        [
            (abs(float(modes.output @ one.z)), one.omega / (2 * np.pi), one.zeta, one.loss)
            for one in found
        ]
    ).T


def mesh_error(fine, rough, read) -> np.ndarray:
    """Return the error by the mesh of what read(Group) gives of a patch that slips part by part.

    It is the change by a coarser mesh at second order, and no less than what the elements change when they spread over
    the yield slides between the nodes (`slip.mesh_correction`): a slide in which no node slips shows no change at all.

    Parameters
    ----------
    fine : Group
        Laws on the mesh of the run.
    rough : list of Group
        Laws with a coarser mesh of one patch after the other.
    read : callable
        Function of a Group that returns an array.
    """
    best = read(fine)
    changes = (read(other) - best for other in rough)
    by_meshes = sum(error_of_change(one, order=MAX_ORDER) for one in changes)
    return np.fmax(SPREAD_FACTOR * np.abs(read(fine.remade(_spread)) - best), by_meshes)


def _spread(stiffness, slide) -> tuple:
    """`slip.mesh_correction.spread` of elements in any order."""
    order = np.argsort(slide, kind="stable")
    return spread(stiffness[order], slide[order])


def left_by_mesh(model, patch, coarse, amplitudes, mode) -> tuple:
    """(Static errors (2, k) of frequency [Hz] and damping by the mesh at amplitudes (k,) [m] of the output, why). The
    errors are 0 without a patch that slips part by part, and where they are not known; why: the reason, else "".

    patch, coarse: of the [contact] of the rig, None without; mode(Group) -> number of the mode. amplitudes: rising;
    between those that have a static motion the errors are interpolated.
    """
    rig, none = model.rig, np.zeros((2, len(amplitudes)))
    if not (model.partial_slip or rig.friction.has_partial_slip):
        return none, ""
    moves = (model.grooves is not None, rig.friction.load_varies, rig.friction.strips_slide_apart)
    if any(moves):
        return none, MOVING[moves.index(True)]
    try:
        fine = laws_on(model, patch)
        number = mode(fine)
        error = mesh_error(
            fine,
            rough_laws(model, coarse),
            lambda laws: static_rows(rig.modes, laws, number, amplitudes, balance.SAMPLES)[1:3],
        )
    except NotConverged as reason:
        return none, str(reason)
    except PatchfemError:
        return none, NO_LOOP
    known = np.isfinite(error).all(axis=0)
    if not known.any():
        return none, NOT_STATIC
    return np.array(
        [np.interp(np.log(amplitudes), np.log(amplitudes[known]), one[known]) for one in error]
    ), ""


def left_by_mesh_on(amplitude, frequency: float, model, patch, coarse) -> tuple:
    """(Errors (2, k), why) of `left_by_mesh` at many amplitudes (k,) [m], of the held mode nearest to a frequency
    [Hz]."""
    low, high = np.log10([amplitude.min(), amplitude.max()])
    at = np.logspace(low, high, 2 + int(APART * (high - low)))
    wide, why = left_by_mesh(
        model, patch, coarse, at, lambda laws: _mode(model.rig.modes, laws, frequency)
    )
    return np.array([np.interp(np.log(amplitude), np.log(at), one) for one in wide]), why


def without_slip_between_nodes(whys: dict, ways) -> list:
    """Sentences on errors that leave out what `left_by_mesh` would add.

    whys: reason, or "", by what has these errors; ways() -> the `CoarserRuns` runs in space that are part of them.
    """
    out = []
    for why in dict.fromkeys(filter(None, whys.values())):
        whose = " and of ".join(name for name, one in whys.items() if one == why)
        lacks = (
            "the change on a coarser mesh, but not the energy that is lost in slip too small for either mesh to "
            "resolve"
            if any(one.of == "mesh" for one in ways())
            else "no error of the mesh"
        )
        out.append(f"the errors of {whose} include {lacks}, because {why}")
    return out


def _mode(modes, laws, frequency: float) -> int:
    """Number of the held mode that moves the output and is nearest to a frequency [Hz]."""
    held = [modes.stuck_mode(laws.rows, laws.stiffness(), k) for k in range(modes.omega.size)]
    return int(
        np.argmin(
            [
                abs(omega / (2 * np.pi) - frequency) if modes.output @ shape else np.inf
                for omega, shape in held
            ]
        )
    )
