"""Two results folders of one patch, new and worn or worn and worn on: what wore off between them, with its errors."""

from html import escape
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ... import __version__
from ...core import Missing, PatchfemError, frozen_array, say
from ...disk.whole import write_text
from ...model.worn import LOADING, SAME
from ...scales import axis_unit
from ...surface.compare import ratios
from ...surface.compare.compare import AMPLITUDE, SLOPE
from ...surface.profile import Profile, level
from ...surface.quantity import LEVEL, Quantity, refused
from ..drawing.charts import axis, chart, line, loop, mark
from ..drawing.pictures import draw
from ..pages import beside
from ..pages.document import Section, document, figure, prose, table, warned
from ..pages.sweep import label
from ..pages.words import pair
from ..readback import numeric, readable, variables, wanted
from .compare import WORDS, plain_of, shown
from .pictures import SIDES, maps, pressures

BESIDE = ("pressure_peak", "contact_fraction", "normal_stiffness", "tangential_stiffness", "approach", "rotation",
          "groove_amplitude", "slip_amplitude", "relative_displacement_amplitude", "loop_area", "friction_force_peak")
NEEDED = {"x": (1,), "weight": (1,), "unloaded_gap": (1, 2), "normal_stress": (2,)}  # of a patch, their dimensions
FLOOR = 5  # parts of a track, the deepest of which is its floor
FLAT = 1e-12  # m, below which a new surface has no waves
TEXTS = {"worn_volume": ("m3", "material lost over the whole patch, both pieces together"),
         "worn_depth_max": ("m", "largest worn depth"), "worn_depth_mean": ("m", "mean worn depth: worn volume divided "
                                                                                 "by the area"),
         "worn_area": ("m2", "worn area of the section: worn volume divided by the width"),
         "worn_share": ("1", "fraction of the patch area that lost more than the error of the depth"),
         "hidden_wear": ("m", "mean of the highest straight line that nowhere exceeds the worn depth: uniform and "
                              "wedge-shaped wear, which a trace of this part alone could not show")}
PLANE = ("mean of the highest plane that nowhere exceeds the worn depth: uniform and wedge-shaped wear, which a scan "
         "of this part alone could not show")


class Worn(NamedTuple):
    """A run as its folder holds it.

    run: `beside.FinishedRun`; path: as it was named; x (m,) [m]; y (s,) [m] of the middles of strips, None without
    them; area [m2] and gap [m] of the unloaded surfaces, wear included, and depth [m] worn so far, (m,) or (s, m);
    pressure (m,) [Pa], of strips their mean; slide [m] and force [N] (k,) of the last cycle, or None; cycles of wear;
    wears: whether it has [wear].
    """

    run: beside.FinishedRun
    path: str
    x: np.ndarray
    y: np.ndarray | None
    area: np.ndarray
    gap: np.ndarray
    depth: np.ndarray
    pressure: np.ndarray
    loop: tuple | None
    cycles: float
    wears: bool

    def measure(self, name: str) -> dict | None:
        """A measure with a value, None where the run has none."""
        one = self.run.summary["measures"].get(name)
        return one if one is not None and one["value"] is not None else None


class Lost(NamedTuple):
    """What wore off between two runs: the gaps [m] of the surfaces before and after and the depth [m] between them,
    (m,) or (s, m) each; values: `Quantity` by name; track: those of the worn part, {} of strips; notes: sentences."""

    before: Worn
    after: Worn
    gaps: tuple
    depth: np.ndarray
    values: dict
    track: dict
    notes: list


def lost(before: Path, after: Path) -> Lost:
    """What wore off between the runs in two results folders, over the whole patch.

    The later run has [wear]; the earlier one may be new. PatchfemError that names the folder where one is no run of a
    patch, and where the two are not states of one patch in this order.
    """
    for path, other in ((before, after), (after, before)):
        if not path.exists():
            raise Missing(f"{path}: there is no such folder")
        if not path.is_dir():
            raise PatchfemError(f"{path}: a file, while {other} is a folder: two files of surfaces or two results "
                                "folders are needed")
    first, second = read(before), read(after)
    if not second.wears:
        raise PatchfemError(f"{after}: this run has no [wear], so nothing wore off; give the run with [wear] as the "
                            f"second folder")
    _one_patch(first, second)
    return _between(first, second)


def read(path: Path) -> Worn:
    """The run of a patch in a results folder; PatchfemError that names it where there is none."""
    run = beside.read(path)
    if "contact" not in run.resolved:
        raise PatchfemError(f"{path}: a run without [contact] has no surfaces to compare")
    file = path / "result.nc"
    if not file.is_file():
        raise PatchfemError(f"{path}: not a results folder of a run: it has no result.nc")
    names = {*NEEDED, "strip_offset", "worn_depth", "time", "slide", "relative_displacement", "friction_force",
             "wear_cycle"}
    held = {name: one.values for name, one in variables(file, names)[1].items()}
    with readable(file, "results of a patch"):
        for name, dimensions in NEEDED.items():
            wanted(name in held, f"it contains no {name}; run the scene again")
            wanted(numeric(held[name]) and held[name].ndim in dimensions and np.isfinite(held[name]).all(),
                   f"{name} is not a field along the patch")
        size = held["x"].size
        wanted(size > 1 and all(held[name].shape[-1] == size for name in (*NEEDED, "worn_depth") if name in held),
               "its fields differ in length")
        wanted((np.diff(held["x"]) > 0).all() and held["weight"].sum() > 0, "x is not a list of positions")
        y = held.get("strip_offset")
        shape = (size,) if y is None else (y.size, size)
        depth = held["worn_depth"][-1] if "worn_depth" in held else np.zeros(size)
        wanted(all(one.shape in ((size,), shape) for one in (depth, held["unloaded_gap"])),
               "the fields do not match the strips")
    area, gap, depth = (np.broadcast_to(one, shape) for one in (held["weight"], held["unloaded_gap"], depth))
    cycles = float(held["wear_cycle"][-1]) if "wear_cycle" in held else 0.0
    return Worn(run, str(path), held["x"], y, area if y is None else area / y.size, gap, depth,
                held["normal_stress"][-1], _last_loop(run, held), cycles, "wear" in run.resolved)


def _last_loop(run, held: dict) -> tuple | None:
    """Slide [m] and friction force [N] (k,) of the last cycle, of the whole run where no sine drives it."""
    slide = held.get("slide", held.get("relative_displacement"))
    if slide is None or "friction_force" not in held or held["friction_force"].ndim != 1:
        return None
    time, period = held["time"], beside.period_of(run)
    late = time >= (time[-1] - period * (1 + 1e-9) if period else time[0])
    return slide[late], held["friction_force"][late]


def _one_patch(first: Worn, second: Worn) -> None:
    """PatchfemError unless the runs are two states of one patch, the less worn one first."""
    tables = [{key: one for key, one in each.run.resolved["contact"].items() if key not in LOADING}
              for each in (first, second)]
    unlike = [key for key in {**tables[0], **tables[1]} if tables[0].get(key) != tables[1].get(key)]
    if unlike:
        raise PatchfemError(f"{first.path} and {second.path}: these are two different patches: "
                            f"{', '.join(f'contact.{key}' for key in unlike)} differ")
    news = [_at(second.x, each.x, each.gap - each.depth) for each in (first, second)]
    off = float(np.abs(news[0] - news[1]).max())
    if off > SAME * float(np.ptp(news[1])) + FLAT:
        raise PatchfemError(f"{first.path} and {second.path}: these are two different patches: their unworn surfaces "
                            f"differ by {say(off, 3)}")
    volumes = [0.0 if (one := each.measure("worn_volume")) is None else one["value"] for each in (first, second)]
    if volumes[1] < volumes[0]:
        raise PatchfemError(f"{first.path} is worn more than {second.path}; give the less worn run as the first folder")


def _at(x, own, values) -> np.ndarray:
    """Values at x (m,) of those at own (k,), (k,) or (s, k)."""
    return np.apply_along_axis(lambda row: np.interp(x, own, row), -1, values)


def _between(first: Worn, second: Worn) -> Lost:
    x, depth = second.x, second.depth - _at(second.x, first.x, first.depth)
    gaps = second.gap - depth, second.gap
    length, area = float(np.ptp(x)), float(second.area.sum())
    volume, volume_error = _less(first, second, "worn_volume")
    _, deep_error = _less(first, second, "worn_depth_max")
    deep_error = None if deep_error is None else deep_error + _between_nodes(first, x)
    off = deep_error or 0.0
    share = float(second.area[depth > max(off, 1e-3 * depth.max())].sum()) / area if depth.max() > 0 else 0.0
    under = hidden(second, depth)
    found = {"worn_volume": (volume, volume_error), "worn_depth_max": (float(depth.max()), deep_error),
             "worn_depth_mean": (volume / area, volume_error and volume_error / area),
             "worn_area": (volume / area * length, volume_error and volume_error / area * length),
             "hidden_wear": (max(float(np.mean(under)), 0.0), deep_error)}
    values = {name: _with(value, error, *TEXTS[name]) for name, (value, error) in found.items()}
    if second.y is not None:
        values["hidden_wear"] = values["hidden_wear"]._replace(text=PLANE)
    values["worn_share"] = Quantity(share, share, share, *TEXTS["worn_share"])
    values |= _waves(x, gaps)
    notes = [f"{name}: {text}" for name, one in (("before", first), ("after", second))
             for text in one.run.summary.get("warnings", ())]
    if float(depth.min()) < -off:
        notes.append(f"at {place_of(second, np.argmin(depth))} the later run is worn by {say(-float(depth.min()), 3)} "
                     "less, so it does not continue the earlier one")
    track = _track(x, depth, off, length * volume / area) if second.y is None else {}  # strips have a map
    return Lost(first, second, gaps, depth, values, track, notes)


def place_of(one: Worn, number: int) -> str:
    """The place of a node by its number in the flat depth of a run."""
    strip, node = divmod(int(number), one.x.size)
    return f"x = {say(float(one.x[node]), 3)}" + ("" if one.y is None else f", y = {say(float(one.y[strip]), 3)}")


def hidden(one: Worn, depth) -> tuple:
    """Depths [m] of what a trace or a scan alone could not show of a depth, at the ends or corners of the patch."""
    return hidden_line(one.x, depth) if one.y is None else hidden_plane(one.x, one.y, depth)


def hidden_plane(x, y, depth) -> tuple:
    """Depths [m] at the four corners of the strips' middles, none below zero, of the plane of the highest mean that no
    depth (s, m) [m] over x (m,) and y (s,) [m] lies below: a linear programme of three numbers."""
    from scipy.optimize import linprog

    scale = float(depth.max())
    if not scale > 0:
        return 0.0, 0.0, 0.0, 0.0
    along, over = (np.interp(one, (one[0], one[-1]), (-1, 1)) if one.size > 1 else np.zeros(1) for one in (x, y))
    places = np.array([(1.0, a, b) for b in over for a in along])
    corners = np.array([(1.0, a, b) for b in (over[0], over[-1]) for a in (-1, 1)])
    found = linprog((-1.0, 0.0, 0.0), np.concatenate([places, -corners]),
                    np.concatenate([np.maximum(depth, 0.0).ravel() / scale, np.zeros(4)]), bounds=(None, None))
    return tuple(np.maximum(corners @ found.x * scale, 0.0).tolist())


def _between_nodes(first: Worn, x) -> float:
    """Error [m] of the depth before at places x (m,) [m] between its own nodes: a quarter of what half of these
    change."""
    if np.array_equal(first.x, x) or not first.depth.any():
        return 0.0
    every = np.unique([*range(0, first.x.size, 2), first.x.size - 1])
    return float(np.abs(first.depth - _at(first.x, first.x[every], first.depth[..., every])).max()) / 4


def _less(first: Worn, second: Worn, name: str) -> tuple:
    """(a measure of the later run less that of the earlier, the sum of their errors or None)."""
    parts = [one for each in (first, second) if (one := each.measure(name)) is not None]
    errors = [one["error"] for one in parts]
    value = parts[-1]["value"] - (parts[0]["value"] if len(parts) > 1 else 0.0)
    return value, None if None in errors else float(sum(errors))


def _with(value: float, error: float | None, unit: str, text: str) -> Quantity:
    if error is None:
        return Quantity(value, value, None, unit, text, "no error is estimated")
    return Quantity(value, max(value - error, 0.0), value + error, unit, text)


def hidden_line(x, depth) -> tuple:
    """Depths [m] at both ends, neither below zero, of the straight line of the highest mean that no depth (m,) [m] at
    x (m,) [m] lies below: an edge of the lower convex hull, or a line from zero at one end. An unworn stretch leaves
    none: from there a trace shows all."""
    x, depth = np.asarray(x, float), np.asarray(depth, float)
    hull = []
    for point in zip(x, depth):
        while len(hull) > 1 and _right(hull[-2], hull[-1], point) <= 0:
            hull.pop()
        hull.append(point)
    at = next(k for k in range(1, len(hull)) if hull[k][0] >= (x[0] + x[-1]) / 2)
    (a, low), (b, high) = hull[at - 1], hull[at]
    slope = (high - low) / (b - a)
    edge = float(low + slope * (x[0] - a)), float(low + slope * (x[-1] - a))
    if min(edge) >= 0:
        return edge
    along = (x - x[0]) / (x[-1] - x[0])
    left, right = (max(float((depth[part] / share[part]).min()), 0.0) for part, share in
                   ((along < 1, 1 - along), (along > 0, along)))
    return (left, 0.0) if left >= right else (0.0, right)


def _right(one, two, three) -> float:
    return (two[0] - one[0]) * (three[1] - one[1]) - (two[1] - one[1]) * (three[0] - one[0])


def _waves(x, gaps: tuple) -> dict:
    """Ratios of amplitude and slope of the surfaces, after over before, None where the nodes do not show the waves."""
    pairs = (("amplitude", AMPLITUDE), ("slope", SLOPE))
    if gaps[0].ndim == 2:
        return {f"{part}_ratio": refused("1", text, "the patch is in strips") for part, text in pairs}
    sides = [Profile(frozen_array(x), frozen_array(gap), "the patch") for gap in gaps]
    why = "the unworn surfaces are flat" if level(sides[0]).z.std() < FLAT else ""
    if not why:
        try:
            step = float(np.diff(x).min())
            sizes = [ratios.size_of(one, step) for one in sides]
        except PatchfemError as error:
            why = str(error)
    if why:
        return {f"{part}_ratio": refused("1", text, why) for part, text in pairs}
    heights = [ratios.at_step(one, step) for one in sides]
    alike = ratios.likeness(heights[0][0], heights[1][0], heights[0][1])
    return {f"{part}_ratio": ratios.ratio(part, text, sizes[1], sizes[0], one)
            for (part, text), one in zip(pairs, alike)}


def _track(x, depth, off: float, area: float) -> dict:
    """Ends, depths and areas of the part that wore by more than its error `off` [m]; area: lost over the width."""
    deep = np.flatnonzero(depth > max(off, 1e-3 * float(depth.max())))
    if not deep.size or depth.max() <= 0:
        return {}
    a, b = (max(int(deep[0]) - 1, 0), min(int(deep[-1]) + 1, x.size - 1))
    cells = [float(x[min(k + 1, x.size - 1)] - x[max(k - 1, 0)]) / 2 for k in (a, b)]
    ends = [Quantity(float(x[k]), float(x[k]) - cell, float(x[k]) + cell, "m", text)
            for k, cell, text in zip((a, b), cells, ("where the worn part begins", "where the worn part ends"))]
    width = float(x[b] - x[a])
    even = np.interp(np.linspace(x[a], x[b], 100 * FLOOR), x, depth)
    floor = float(np.convolve(even, np.full(100, 0.01), "valid").max())
    under = max(float(np.mean(hidden_line(x[a:b + 1], depth[a:b + 1]))), 0.0)
    return {"from": ends[0], "to": ends[1], "hidden_wear": _with(under, off, *TEXTS["hidden_wear"]),
            "depth_mean": _with(area / width, off + area / width * sum(cells) / width, "m", "area lost divided by the "
                                                                                            "width"),
            "depth_floor": _with(floor, off, "m", "mean depth over the deepest fifth of the width"),
            "area_net": _with(area, off * width, "m2", "lost area minus pile-up; pile-up is zero in a computed run"),
            "area_gross": _with(area, off * width, "m2", "lost area"),
            "pile_up": Quantity(0.0, 0.0, 0.0, "m2", "computed wear makes no pile-up")}


def verdict(one: Lost) -> tuple:
    """(headline, sentences)."""
    mean, unseen, track = one.values["worn_depth_mean"], one.values["hidden_wear"], one.track
    if not mean.value > 0:
        return "nothing wore off between the two runs", []
    head, x = f"worn by {say(mean.value, 3)} on average over the patch", one.after.x
    seen, ends = "trace" if one.after.y is None else "scan", hidden(one.after, one.depth)
    if track and one.values["worn_share"].value < 0.999:
        mean, unseen, seen = track["depth_mean"], track["hidden_wear"], "trace within this part"
        inside = (x >= track["from"].value) & (x <= track["to"].value)
        ends = hidden_line(x[inside], one.depth[inside])
        head += (f", and by {say(mean.value, 3)} on average from x = {say(track['from'].value, 3)} to "
                 f"{say(track['to'].value, 3)}")
    if unseen.value > 0.01 * mean.value:
        head += (f"; of the {say(mean.value, 3)}, {say(unseen.value, 3)} is {_kind(ends)} that a {seen} alone could "
                 "not show")
    place, volume = place_of(one.after, np.argmax(one.depth)), one.values["worn_volume"]
    told = [f"Worn volume of both pieces together: {' '.join(shown(volume)[::2])}; largest worn depth: "
            f"{say(float(one.depth.max()), 3)}, {place}; after {one.after.cycles:.6g} cycles of wear"
            f"{_since(one.after)}"
            f"{f' (the surface before: {one.before.cycles:.6g} cycles)' if one.before.cycles else ''}."]
    for name in ("contact_fraction", "pressure_peak", "loop_area"):
        sides = [each.measure(name) for each in (one.before, one.after)]
        if None not in sides:
            first, second = (pair(name, side) for side in sides)
            told.append(f"{label(name)}: {first} before, {second} after.")
    return head, told


def _since(one: Worn) -> str:
    """What the cycles of a run that goes on from another come after."""
    start = one.run.resolved["wear"].get("start")
    return f" after those of {start}" if start else ""


def _kind(ends: tuple) -> str:
    """What wear along a straight line with these depths at both ends, or along a plane with
    these at its corners, is."""
    low, high = min(ends), max(ends)
    return "a wedge" if low < 0.2 * high else "uniform wear" if low > 0.8 * high else "uniform wear with a wedge"


def data_of(one: Lost, found: tuple) -> dict:
    """The answer as plain data in SI, by the names that traces have."""
    zero = Quantity(0.0, 0.0, 0.0, "m", "positions are known, because both runs are of the same patch")
    return {"patchfem": __version__, "verdict": found[0], "sentences": found[1], "confidence": LEVEL,
            "before": one.before.path, "after": one.after.path, "direction": "x", "reference": "run",
            "shift": plain_of(zero), **{name: plain_of(each) for name, each in one.values.items()},
            "registration": {"shift": plain_of(zero), "mirrored": False},
            "track": {name: plain_of(each) for name, each in one.track.items()} or None,
            "removed": {"before": 0, "after": 0},
            "runs": {when: {"outcome": each.run.summary["outcome"], "cycles": each.cycles,
                            "measures": {name: {key: m[key] for key in ("value", "error", "unit")}
                                         for name in BESIDE if (m := each.measure(name)) is not None}}
                     for when, each in (("before", one.before), ("after", one.after))},
            "notes": one.notes}


def lines_of(one: Lost, found: tuple) -> list:
    """The answer as lines."""
    out = [found[0], *(f"  {text}" for text in found[1]), "", f"{one.before.path} -> {one.after.path}",
           f"  {'':<38} {'value':>10}  {'95 %':<22} unit"]
    for name, each in _rows(one):
        value, interval, unit = _texts(each)
        out.append(f"  {name:<38} {value:>10}  {interval:<22} {unit:<5}".rstrip())
    out += ["", f"  {'':<38} {'before':>24} {'after':>24}"]
    return out + [f"  {name:<38} {first:>24} {second:>24}" for name, first, second in _beside(one)]


def _rows(one: Lost) -> list:
    """(words, Quantity) of the table."""
    track = {f"track_{name.removesuffix('_mean')}": each for name, each in one.track.items()}
    words = WORDS | {"track_from": "worn part from", "track_to": "worn part to", "track_depth": "worn part, mean",
                     "track_depth_floor": "worn part, floor",
                     "track_hidden_wear": "uniform and wedge-shaped wear, in the worn part",
                     "hidden_wear": "uniform wear and wedge, mean",
                     "worn_share": "fraction of the patch area that is worn"}
    of_part = ("track_from", "track_to", "track_depth", "track_depth_floor", "track_hidden_wear")
    shown_of = one.values | {name: track[name] for name in of_part if name in track}
    return [(words[name], each) for name, each in shown_of.items()]


def _texts(each: Quantity) -> tuple:
    value, interval, unit = shown(each)
    return value, interval if each.value is not None and each.high is not None else "", unit


def _beside(one: Lost) -> list:
    """(words, before, after) of the measures of both runs."""
    rows = [(name, [each.measure(name) for each in (one.before, one.after)]) for name in BESIDE]
    return [(label(name), *("-" if m is None else pair(name, m) for m in sides)) for name, sides in rows if any(sides)]


def write_page(path: Path, one: Lost, found: tuple) -> None:
    """Write the page, the verdict first, nothing fetched."""
    names = [Path(each.path).resolve().name for each in (one.before, one.after)]
    lead = (f"<p class=soft>patchfem {escape(__version__)}</p><div class=verdict>"
            f"<b>{prose(found[0][0].upper() + found[0][1:])}.</b>"
            + "".join(f"<p>{prose(text)}</p>" for text in found[1]) + "</div>" + warned(one.notes))
    rows = [[escape(name), *map(escape, _texts(each)),
             f"<td class=soft>{prose(each.text + (f': {each.reason}' if each.reason else ''))}</td>"]
            for name, each in _rows(one)]
    body = [figure(number, *each) for number, each in enumerate(_figures(one))]
    body.append(table(("quantity", ">value", ">interval", "unit", "meaning"), rows))
    body.append("<p class=soft>The intervals follow from the numerical errors that the runs state. In 19 of 20 "
                "scenes the stated error is at least as large as the true error.</p>")
    runs = [figure("p", pressures([(each.x, each.pressure, name) for each, (_, name) in
                                   zip((one.before, one.after), SIDES)]), "Normal stress of the pressed patch"
                   f"{'' if one.after.y is None else ', mean over the width'}.",
                   "Pressure along the patch before and after")]
    if one.before.loop is not None and one.after.loop is not None:
        made = [part for each, (_, name) in zip((one.before, one.after), SIDES)
                for part in loop(*each.loop, f"Friction loop {name}")]
        runs.append(figure("l", draw(made, height=2.9), "Friction force over the slide in the last cycle.",
                           "Friction loops before and after"))
    runs.append(table(("measure", ">before", ">after"), [[escape(text) for text in row] for row in _beside(one)]))
    sections = [Section("changes", "What wore off", "\n".join(body)),
                Section("runs", "Pressure, contact and loop", "\n".join(runs))]
    write_text(path, document(f"{names[0]} and {names[1]}: before and after", lead, sections))


def _figures(one: Lost) -> list:
    """Pictures (svg, caption, alternative text): the surfaces with the wear on, and the worn depth."""
    if one.after.y is not None:
        return [(maps(one.after.x, one.after.y, (*one.gaps, one.depth)), "Left and middle: gap between the unloaded "
                 "surfaces before and after, wear included. Right: depth lost by both pieces together between the two "
                 "runs. The values of a strip stand at the middle of its width.",
                 f"Maps of the gaps and of the worn depth: mean {say(one.values['worn_depth_mean'].value, 3)}")]
    x, under = one.after.x, hidden_line(one.after.x, one.depth)
    (along, mm), (up, um) = axis_unit(x, "m"), axis_unit(np.concatenate(one.gaps), "m")
    place = axis("x", along) | {"range": [x[0] * mm, x[-1] * mm]}
    marks = [line(x * mm, gap * um, colour, name) for gap, (colour, name) in zip(one.gaps, SIDES)]
    marks.append(mark("band", "warm", "worn off", x=x * mm, low=one.gaps[0] * um, high=one.gaps[1] * um))
    deep, scale = axis_unit(one.depth, "m")
    depths = [line(x * mm, one.depth * scale, "warm", "worn depth"),
              line(x[[0, -1]] * mm, np.array(under) * scale, "#4d4d4d", "uniform wear and wedge", width=0.9,
                   dash="dashed")]
    ends = [*under, 0.0, float(one.depth.max()), float(one.depth.min())]
    down = axis("worn depth", deep) | {"range": [(max(ends) + 0.05 * np.ptp(ends)) * scale,
                                                 (min(ends) - 0.05 * np.ptp(ends)) * scale]}
    return [(draw([chart("", place, axis("gap of the unloaded surfaces", up), marks)], height=2.9),
             "The gap between the unloaded surfaces includes the wear.", "Gap of the surfaces before and after"),
            (draw([chart("", place, down, depths)], height=2.5), "The curve is the depth lost by both pieces together "
             "between the two runs. The dashed line is the part of this depth that a trace alone could not show.",
             f"Worn depth: mean {say(one.values['worn_depth_mean'].value, 3)}")]
