"""Warnings of measures that are known less well than the tolerance asks: the worst one, how well, and what cures it."""

from math import ceil, log2, log10

from .patch_rows import DECISIVE, TABLE

MOST = 1e9  # times that an error exceeds what is allowed, beyond which it does not matter
MARGIN = 2.0  # on second order: where between its nodes a contact ends changes errors that much from size to size
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
    return [*out, _said(result, moving, _finer_motion(result, max(moving.values())))] if moving else out


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
        return f"the mesh ({nodes} interface nodes) was not chosen for it; {wider}"
    return f"a mesh finer than {nodes} interface nodes would take too long; {wider}"


def _finer_motion(result, times: float) -> str:
    """What cures the errors of a motion that are `times` as large as allowed."""
    if result.extra.get("engine") == "harmonic" and result.extra.get("map") != "march":
        return "raise accuracy.harmonics"
    steps = result.extra.get("steps_per_cycle") or result.extra.get("steps")
    if steps is None:
        return f"accuracy.tolerance = {_up(result.plan.model.accuracy.tolerance * times):g} would be met"
    return f"set accuracy.steps_per_cycle = {int(steps) * 2**max(1, ceil(log2(times) / 2))}"


def _rounded(size: float) -> float:
    """A size rounded down to two digits."""
    unit = 10.0 ** (ceil(log10(size)) - 2)
    return int(size / unit * (1 + 1e-9)) * unit


def _up(value: float) -> float:
    """A value rounded up to one digit."""
    unit = 10.0 ** (ceil(log10(value)) - 1)
    return ceil(value / unit * (1 - 1e-9)) * unit
