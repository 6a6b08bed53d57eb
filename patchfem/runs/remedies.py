"""Warnings of measures that are known less well than the tolerance asks: the worst one, how well, and what cures it."""

from collections.abc import Mapping
from dataclasses import replace
from math import ceil, log2, log10, pi
from types import MappingProxyType
from typing import NamedTuple

from ..core import say
from ..effects import has
from ..response import rows
from ..scales import plain
from .patch import faces, ladder, press
from .results import notes, patch_rows
from .rig import costs, engines

MOST = 1e9  # times that an error exceeds what is allowed, beyond which it does not matter
TIGHTER = 0.1  # times the tolerance: a mesh of at least one halving more
MOST_HALVINGS = 4  # of the steps, as far ahead as an order seen at two of them is trusted
LEAST_LEFT = 0.2  # share of an allowed error that steps may be asked to meet, where the mesh takes more than the rest
MOST_STRIPS = 64  # that are proposed: four times the strips are some twenty times the time
SIZE = "contact.element_size"  # an even mesh finds the ends of a contact at first order, one that is chosen at second
OF_PEAK = ("pressure_peak", "loaded_fraction")
OF_SAMPLES = ("stick_fraction", "slip_start_phase")  # of a cycle of a balance, however many harmonics it has
RINGS = "ring_"  # measures of a ring beside the motion, which an engine without steps need not have
STEADY = "relative_displacement_amplitude_steady"
READ = "no known setting makes this value more accurate; use the value with its stated error"
# what a run answers first, named before what misses its tolerance by more
FIRST = ("relative_displacement_amplitude", "absolute_acceleration_peak", "loop_area", "friction_ratio_peak",
         "pressure_peak", "contact_fraction")


class Finding(NamedTuple):
    """What warnings and cures are told by: measures by name, patch and `extra` as a Result has them.

    climbed: the patch before wear on the meshes of its ladder, fine to coarse: this patch chose the mesh of a worn one.
    """

    model: object
    measures: dict
    patch: object = None
    extra: Mapping = MappingProxyType({})
    climbed: tuple = ()


def beyond_tolerance(seen: Finding, coarse=(), still=()) -> list:
    """A warning for the mesh and one for the motion, each with the measures that miss the tolerance and the cure.

    Where any that a run answers first, FIRST, do so, these are named and the worst of them is cured. coarse:
    the patch of the result on the coarser meshes of its ladder, where they are at hand; still: the patch on the ladder
    of its static measures, fine to coarse, where that is another one.
    """
    model = seen.model
    tolerance = model.accuracy.tolerance
    wide = {name: min(times, MOST) for name, m in seen.measures.items() if (times := m.beyond(tolerance)) > 1}
    faced = seen.patch is None and model.faced
    pressed = faces.measured(model) if faced else patch_rows.TABLE if seen.patch is not None else ()
    static = {name: times for name, times in wide.items() if name in pressed}
    moving = {name: times for name, times in wide.items() if name not in pressed}
    if faced:
        out = faces.together(model, lambda face: beyond_tolerance(_of_face(seen, face), face.patches[1:]))
    else:
        at_rest = _of_ladder(seen, still) if still else seen
        out = [_said(seen, static, _finer_mesh(at_rest, static, still[1:] or coarse))] if static else []
    return [*out, _said(seen, moving, _finer_motion(seen, moving, coarse))] if moving else out


def _of_ladder(seen, still: tuple) -> Finding:
    """What is told of static measures that stand on a ladder of their own, patches fine to coarse."""
    asked = replace(seen.model.patch, still=True, slip=None)
    return seen._replace(model=replace(seen.model, patch=asked), patch=still[0])


def _of_face(seen, face) -> Finding:
    """What is told of the patch of an interface: its static measures, which have no number behind their names."""
    own = {name: seen.measures.get(rows.of_number(name, face.number)) for name in patch_rows.TABLE}
    return Finding(face.model, {name: found for name, found in own.items() if found is not None}, face.patch)


def _first(seen, wide: dict) -> list:
    """Those of FIRST among `wide` (name -> error over what is allowed) that are not 0 within it, else the worst."""
    known = seen.measures
    out = [name for name in FIRST if name in wide and known[name].error < abs(known[name].value)]
    asked = {name: times for name, times in wide.items() if not name.startswith(RINGS)} or wide
    return out or [max(asked, key=asked.get)]


def _said(seen, wide: dict, remedy: str) -> str:
    """The measures that speak for `wide` (name -> error over what is allowed), and how many others there are."""
    tolerance, names = seen.model.accuracy.tolerance, _first(seen, wide)
    known, left = [_known(seen.measures[name]) for name in names], len(wide) - len(names)
    more = "".join(f", {name} of {one}" for name, one in zip(names[1:], known[1:], strict=True))
    others = f" ({left} other measure{'s' * (left > 1)} also exceed{'s' * (left < 2)} the tolerance)" if left else ""
    return f"{names[0]} has an estimated error of {known[0]}{more}; the tolerance is {tolerance:g}{others}; {remedy}"


def _known(found) -> str:
    share = abs(found.error) < abs(found.value)
    return f"{abs(found.error / found.value):.2g} of its value" if share else f"at least its value ({found})"


def _finer_mesh(seen, wide: dict, coarse) -> str:
    """What cures the errors of a mesh in the measures `wide` (name -> error over what is allowed).

    A tighter tolerance only where a ladder of meshes climbs further for it; a looser one where it is met by all.
    """
    asked, tolerance = seen.model.patch, seen.model.accuracy.tolerance
    times = max(wide.values())
    peak = seen.measures.get("pressure_peak")
    if "worn_depth_max" in _first(seen, wide) and peak is not None and peak.value is None:
        return ("the wear is deepest where the pressure is unbounded, so a finer mesh may not help; use the value with "
                "its stated error")
    if times >= MOST:
        return READ  # it is 0
    if asked.mesh is not None:
        return "split the elements of contact.mesh"
    nodes, wider = seen.patch.x.size, f"the results would meet accuracy.tolerance = {_up(tolerance * times):g}"
    if asked.strips is not None and asked.strips[0] > 1:
        return (f"the mesh ({nodes} interface nodes) and the number of strips cause this error; "
                f"{_more_strips(asked, wide)}")
    if not asked.chosen:
        return f"leave out {SIZE}"
    if not wide.keys() - set(patch_rows.DECISIVE):
        return f"a mesh finer than {nodes} interface nodes would take too long; {wider}"
    tighter = _climbing(seen, coarse)
    if tighter is None:
        finer = f"points less than {say(seen.patch.averaging, 3)} apart" if seen.patch.averaging and \
            seen.patch.sharper else f"a mesh finer than {nodes} interface nodes"
        return (f"{finer} would take too long; use "
                f"{'these values with their stated errors' if len(wide) > 1 else 'this value with its stated error'}")
    return (f"the mesh ({nodes} interface nodes) was not refined for this measure; set accuracy.tolerance = "
            f"{tighter:.3g} for a finer mesh")


def _more_strips(asked, wide: dict) -> str:
    """The number of strips that meets the tolerance, where few more do.

    The peak of the outermost strip is that of its middle, so its error is of first order in the strips; that of all
    else is of second order, as that of the mesh is.
    """
    count = asked.strips[0] * max(times if name in OF_PEAK else times**0.5 for name, times in wide.items())
    sized = f" and leave out {SIZE}" if not asked.chosen else ""
    return f"set contact.strips.count = {ceil(count)}{sized}" if count <= MOST_STRIPS else READ


def _climbing(seen, coarse) -> float | None:
    """The tolerance for which the ladder of a patch climbs further; None where it has ended for good.

    Where its coarser meshes are not at hand it is one of at least one halving more.
    """
    asked, tolerance = seen.model.patch, seen.model.accuracy.tolerance
    if asked.meshes is not None and asked.chosen and isinstance(seen.patch, press.Patch) and \
            ladder.next_seconds(seen.patch) > ladder.most_seconds(asked):
        return None
    if not any(coarse) or asked.meshes is not None:
        return TIGHTER * tolerance

    return ladder.climbs_at(asked, seen.climbed or [seen.patch, *coarse], asked.mesh_tolerance or tolerance)


def _finer_motion(seen, wide: dict, coarse) -> str:
    """What cures the errors of a motion in the measure that speaks for `wide` (name -> error over what is allowed).

    It is that of what leaves most of it open. Steps cure it where it was seen to fall with them, by as many as its
    order asks for. A looser tolerance is no cure: it chooses coarser steps and meshes.
    """
    name = max(_first(seen, wide), key=wide.get)
    steps, cause = seen.extra.get("steps_per_cycle") or seen.extra.get("steps"), _cause(seen, name)
    if cause == "steps" and steps is not None:
        return _more_steps(seen, name, wide, int(steps))
    if cause == "end":
        return _to_a_sample(seen.extra["cycles"], int(steps))
    if cause == "mesh":
        return _finer_under(seen, coarse)
    if cause == "reduced":
        return f"set structure.reduced.modes = {_more_modes(seen, wide[name])}"
    if cause == "modes" and seen.extra["shear_modes"] < seen.patch.x.size:
        return f"set accuracy.shear_modes = {min(4 * seen.extra['shear_modes'], seen.patch.x.size)}"
    if cause == "bonds":
        return _finer_bonds(seen.model.accuracy)
    if name == STEADY:  # what is left of it dies out in a longer run
        return "more drive cycles make this value more accurate; raise drive.cycles"
    balanced = seen.extra.get("harmonics")  # None where a steady motion is exact between yields
    return READ if balanced is None or name.startswith(OF_SAMPLES) else \
        notes.more_harmonics(balanced, _sharp(seen))


def _more_modes(seen, times: float) -> int:
    """Modes of a reduced structure that bring an error down by `times`, which falls with the square of their number, of
    those that there are."""
    kept = seen.model.rig.modes.omega.size
    return min(ceil(kept * min(max(2.0, times**0.5), 16.0)), seen.model.rig.most)


def _cause(seen, name: str) -> str:
    """What leaves most of a measure open: one of the kinds of `response.coarser.left_open`."""
    extra = seen.extra
    if (left := extra.get("left_open")) is None:  # a batch, which has no steps, or a run without an estimate
        return "steps" if extra.get("steps_per_cycle") or extra.get("steps") else \
            "own" if seen.patch is None else "mesh"
    return max(left["parts"], key=lambda kind: left["parts"][kind].get(name, 0.0), default="own")


def _more_steps(seen, name: str, wide: dict, steps: int) -> str:
    """As many steps as the order at which the measure `name` was seen to fall asks for, or what helps without one."""
    model, left = seen.model, seen.extra.get("left_open") or {"parts": {}, "orders": {name: 2.0}}
    order = left["orders"].get(name)
    if order is None:
        return _unproven(model, steps, name, wide)
    parts = [part.get(name, 0.0) for part in left["parts"].values()]
    of_steps = left["parts"].get("steps", {}).get(name, 1.0)
    rest = sum(parts) - of_steps if parts else 0.0
    allowed = (of_steps + rest) / wide[name]
    share = of_steps / max(allowed - rest, LEAST_LEFT * allowed)  # by which that of the steps is to fall
    halvings = max(1, ceil(log2(share) / order))
    exact = _stepless(model) if halvings > MOST_HALVINGS and not name.startswith(RINGS) else ""
    return exact or f"set accuracy.steps_per_cycle = {steps * 2**min(halvings, notes.FARTHEST)}"


def _to_a_sample(cycles: float, steps: int) -> str:
    """As many steps, up to twice as many, as end a run of so many cycles closest to the end that was asked for; they
    have a half and a quarter."""
    found = min(range(4 * ceil(steps / 4), 2 * steps + 4, 4), key=lambda n: abs(cycles * n - round(cycles * n)))
    return (f"the run ends between two samples; set accuracy.steps_per_cycle = {found}, so that a sample lies closer "
            "to the end of the run")


def _finer_bonds(accuracy) -> str:
    """What makes the sum over bonds finer: the tolerance, where nothing is pinned."""
    pinned = [f"accuracy.{key}" for key in ("tail", "merge") if getattr(accuracy, key) is not None]
    return f"leave out {' and leave out '.join(pinned)}" if pinned else \
        f"set accuracy.tolerance = {TIGHTER * accuracy.tolerance:.3g} to refine the sum over bonds"


def _sharp(seen) -> float:
    """Harmonics that show how fast a friction turns that follows the speed: the largest speed over that of the law."""
    law, slip = seen.model.friction, seen.measures.get("slip_amplitude")
    if law is None or slip is None or not has(law.law, "creeps"):
        return 0.0
    return 2 * pi / seen.extra["period"] * slip.value / law.reference_speed


def _unproven(model, steps: int, name: str, wide: dict) -> str:
    """What helps where the changes of the measure `name` do not fall with the steps: none, or as many as are chosen.

    Steps that are left out are doubled until the displacement is met.
    """
    seen = (f"the steps per cycle were doubled twice, up to {steps}, and the second doubling changed {name} at least "
            "as much as the first")
    if exact := _stepless(model):
        return f"{seen}, so more steps may not help; {exact}"
    if model.kind == "rig" and model.accuracy.steps_per_cycle is not None and 2 * steps <= costs.MOST_STEPS and \
            "relative_displacement_amplitude" in wide:
        return (f"{seen}; leave out accuracy.steps_per_cycle, so that patchfem doubles the number of steps until the "
                "displacement meets the tolerance")
    return f"{seen}, so more steps may not help; use the value with its stated error"


def _finer_under(seen, coarse) -> str:
    """What refines the mesh that leaves a motion open."""
    every = [(seen, coarse)] if seen.patch is not None else [
        (_of_face(seen, face), face.patches[1:]) for face in faces.faces_of(seen.model) if face.soft]
    asked, nodes = [one.model.patch for one, _ in every], max(one.patch.x.size for one, _ in every)
    if any(one.mesh is not None for one in asked):
        return faces.in_scene(seen.model, "the mesh causes this error; split the elements of contact.mesh")
    if not all(one.chosen for one in asked):
        return faces.in_scene(seen.model, f"the mesh causes this error; leave out {SIZE}")
    tighter = min((found for one in every if (found := _climbing(*one)) is not None), default=None)
    if tighter is None:
        seconds, most = max(ladder.next_seconds(one.patch) for one, _ in every), ladder.most_seconds(asked[0])
        what = "a bench" if asked[0].slip else "a run with motion"
        why = "no accuracy.tolerance leads to a finer mesh"
        if seconds > most:
            why += f": the next one would take about {plain(seconds, 2)} CPU s, and {what} spends at most {most:g} " \
                   "CPU s on its mesh"
        return (f"the mesh ({nodes} interface nodes) causes this error, and {why}; use the value with its stated "
                "error")
    return (f"the mesh ({nodes} interface nodes) causes this error; set accuracy.tolerance = {tighter:.3g} for a "
            "finer mesh")


def _stepless(model) -> str:
    """The exact engine where it follows a motion that steps do not resolve; "" where none does."""
    if model.kind == "rig":
        if model.accuracy.method != "exact" and not engines.inexact(model):
            pinned = "leave out accuracy.steps_per_cycle and " * (model.accuracy.steps_per_cycle is not None)
            return f'{pinned}set accuracy.method = "exact", which has no steps'
    return ""


def _up(value: float) -> float:
    """A value rounded up to one digit."""
    unit = 10.0 ** (ceil(log10(value)) - 1)
    return ceil(value / unit * (1 - 1e-9)) * unit
