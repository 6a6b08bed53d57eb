"""Warnings of measures that are known less well than the tolerance asks: the worst one, how well, and what cures it."""

from math import ceil, log2, log10

from .patch_rows import DECISIVE, TABLE

MOST = 1e9  # times that an error exceeds what is allowed, beyond which it does not matter
MARGIN = 2.0  # on second order: where between its nodes a contact ends changes errors that much from size to size
TIGHTER = 0.1  # times the tolerance: a mesh of at least one halving more
MOST_HALVINGS = 4  # of the steps, as far ahead as an order seen at two of them is trusted
LEAST_LEFT = 0.2  # share of an allowed error that steps may be asked to meet, where the mesh takes more than the rest
LEAST_ELEMENTS = 1e-4  # of the length, an element that is still proposed


def loose(result) -> list:
    """A warning for the mesh and one for the motion, each with the measure that misses the tolerance most."""
    model = result.plan.model
    tolerance = model.accuracy.tolerance
    wide = {name: min(m.error / max(tolerance * abs(m.value) + m.floor, 1e-300), MOST)
            for name, m in result.measures.items()
            if m.value is not None and m.error is not None and m.error > tolerance * abs(m.value) + m.floor}
    pressed = TABLE if result.patch is not None else ()
    static = {name: times for name, times in wide.items() if name in pressed}
    moving = {name: times for name, times in wide.items() if name not in pressed}
    worst = max(static, key=static.get, default="")
    out = [_said(result, static, _finer_mesh(result, worst, static[worst]))] if static else []
    worst = max(moving, key=moving.get, default="")
    return [*out, _said(result, moving, _finer_motion(result, worst, moving[worst]))] if moving else out


def _said(result, wide: dict, remedy: str) -> str:
    """The worst of the measures `wide` (name -> error over what is allowed), and how many others there are."""
    name = max(wide, key=wide.get)
    found, tolerance = result.measures[name], result.plan.model.accuracy.tolerance
    known = f"to {abs(found.error / found.value):.2g} of its value" if abs(found.error) < abs(found.value) else \
        f"no better than {found}"
    others = f" ({len(wide) - 1} other measure{'s' * (len(wide) > 2)} beside it)" if len(wide) > 1 else ""
    return f"{name} is known {known}, the tolerance is {tolerance:g}{others}; {remedy}"


def _finer_mesh(result, name: str, times: float) -> str:
    """What cures the errors of a mesh that are `times` as large as allowed, most of the measure `name`."""
    asked, tolerance = result.plan.model.patch, result.plan.model.accuracy.tolerance
    if asked.mesh is not None:
        return "split the elements of contact.mesh"
    if not asked.chosen:
        size = max(_rounded(asked.element_size / (MARGIN * times**0.5)), _rounded(LEAST_ELEMENTS * asked.length))
        return f'leave out contact.element_size, or set it to "{1e6 * size:.3g} um"'
    nodes, wider = result.patch.x.size, f"accuracy.tolerance = {_up(tolerance * times):g} would be met"
    if asked.strips is not None:  # strips leave an error of second order, as the mesh does
        return f"the mesh ({nodes} interface nodes) and the strips share it; set contact.strips.count = " \
               f"{ceil(asked.strips[0] * times**0.5)}, or {wider}"
    if name not in DECISIVE:
        return f"the mesh ({nodes} interface nodes) was not chosen for it; {_tighter(tolerance)}"
    return f"a mesh finer than {nodes} interface nodes would take too long; {wider}"


def _finer_motion(result, name: str, times: float) -> str:
    """What cures the errors of a motion that are `times` as large as allowed, most of the measure `name`.

    Steps where they leave most of it open and it was seen to fall with them, by as many as its order asks for; the mesh
    where that leaves it open. A looser tolerance is met only where it chooses nothing: with a patch it chooses a
    coarser mesh.
    """
    extra, tolerance = result.extra, result.plan.model.accuracy.tolerance
    if extra.get("engine") == "harmonic" and extra.get("map") != "march":
        return "raise accuracy.harmonics"
    if name in (rings := extra.get("still_rings", {})):
        return rings[name]
    left, steps = extra.get("left_open"), extra.get("steps_per_cycle") or extra.get("steps")
    of_steps, rest = (left[kind].get(name, 0.0) for kind in ("steps", "space")) if left else (1.0, 0.0)
    if steps is not None and of_steps >= rest:
        order = left["orders"].get(name) if left else 2.0
        if order is None:
            return f"its change did not fall from {int(steps) // 4} to {int(steps)} steps per cycle, so more steps " \
                   f"are not known to cure it; {_stepless(result.plan.model) or 'read it by its error'}"
        allowed = (of_steps + rest) / times
        share = of_steps / max(allowed - rest, LEAST_LEFT * allowed)  # by which that of the steps is to fall
        halvings = max(1, ceil(log2(share) / order))
        exact = _stepless(result.plan.model) if halvings > MOST_HALVINGS else ""
        return exact or f"set accuracy.steps_per_cycle = {int(steps) * 2**halvings}"
    if result.patch is not None:
        return _finer_under(result, tolerance)
    return f"accuracy.tolerance = {_up(tolerance * times):g} would be met" if steps is None else _tighter(tolerance)


def _finer_under(result, tolerance: float) -> str:
    """What refines the mesh that leaves a motion open."""
    asked, nodes = result.plan.model.patch, result.patch.x.size
    if asked.mesh is not None:
        return "the mesh leaves it open; split the elements of contact.mesh"
    if not asked.chosen:
        return "the mesh leaves it open; leave out contact.element_size, or make it smaller"
    return f"the mesh ({nodes} interface nodes) leaves it open; {_tighter(tolerance)}"


def _tighter(tolerance: float) -> str:
    return f"accuracy.tolerance = {TIGHTER * tolerance:.3g} refines it"


def _stepless(model) -> str:
    """The exact engine where it follows a motion that steps do not resolve; "" where none does."""
    if model.kind == "rig":
        from ..rig.engines import no_closed_form, no_pieces

        if model.accuracy.method != "exact" and not (no_closed_form(model) and no_pieces(model)):
            pinned = "leave out accuracy.steps_per_cycle and " * (model.accuracy.steps_per_cycle is not None)
            return f'{pinned}set accuracy.method = "exact", which has no steps'
    return ""


def _rounded(size: float) -> float:
    """A size rounded down to two digits."""
    unit = 10.0 ** (ceil(log10(size)) - 2)
    return int(size / unit * (1 + 1e-9)) * unit


def _up(value: float) -> float:
    """A value rounded up to one digit."""
    unit = 10.0 ** (ceil(log10(value)) - 1)
    return ceil(value / unit * (1 - 1e-9)) * unit
