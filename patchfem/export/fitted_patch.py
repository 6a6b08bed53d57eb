"""Laws of one point fitted to a patch, on disk: their object, rows, picture, and a scene of each, which runs."""

import tomllib

import numpy as np

from .. import __version__
from ..campaigns.fit_patch import SEARCHED, FittedPatch, OneLaw
from ..disk.whole import write_rows, write_text
from ..model.model import build, resolved
from ..scales import SPOKEN, axis_unit, plain, short
from ..scales import told as with_error
from ..scene.scene import loads, moved
from ..scene.sets import text_of
from .drawing.pictures import BLUE, GREY, ORANGE, drawing, styled
from .results import Folder
from .summary import write_json

PARTS = ("stiffness", "dissipation")
COLOURS = dict(zip(SEARCHED, (BLUE, ORANGE, GREY)))


def answer_of(fitted: FittedPatch) -> dict:
    """The object of fit.json, in SI."""
    laws = {law: {"values": {f"friction.{key}": {"value": value, "unit": SEARCHED[law].units.get(key, "1")}
                             for key, value in one.values.items()},
                  "outcome": str(one.found.outcome), **(sizes := _sizes(one.off, fitted.slides)),
                  "dissipation": sizes["dissipation"] | _relative(one, fitted)}
            for law, one in fitted.laws.items()}
    return {"patchfem": __version__, "title": fitted.scene.title, "measured": fitted.scene.path.name,
            "quantity": "patch", "outcome": laws[fitted.best]["outcome"], "law": fitted.best,
            "values": laws[fitted.best]["values"], "laws": laws, "load": fitted.load, "slip_force": fitted.limit,
            "stiffness": fitted.stiffness, "stiffness_error": fitted.stuck_error, "rows": int(fitted.slides.size),
            "amplitudes": [float(fitted.slides[0]), float(fitted.slides[-1])],
            "mesh": None if fitted.mesh is None else _sizes(fitted.mesh, fitted.slides) | {"nodes": fitted.nodes},
            "warnings": [*fitted.scene.remarks, *fitted.warnings], "seconds": round(fitted.seconds, 6)}


def _sizes(off, slides) -> dict:
    """Largest difference by size, where, and rms of those (2, k) of stiffness and loss."""
    return {name: {"largest": float(row[at := np.abs(row).argmax()]), "at": float(slides[at]),
                   "rms": float(np.sqrt(np.mean(row**2)))} for name, row in zip(PARTS, off)}


def _relative(one: OneLaw, fitted: FittedPatch) -> dict:
    """Largest difference of the loss of a law over the loss of the patch itself, however small that is, and where; as
    in `off` where the patch loses nothing."""
    own, loss = fitted.own.loss, one.curves.loss
    share = np.where(own > 0, loss / np.where(own > 0, own, 1.0) - 1, one.off[1])
    at = np.abs(share).argmax()
    return {"relative": float(share[at]), "relative_at": float(fitted.slides[at])}


def scene_text(fitted: FittedPatch, law: str, path) -> str:
    """The scene with one law in place of its patch, in SI with every default, its paths as from `path`."""
    tables = tomllib.loads(fitted.scene.resolved())
    tables.pop("contact")
    tables["normal"] = {"load": fitted.load}
    tables["friction"] = {"law": law, "static": fitted.scene.friction.static, **fitted.laws[law].values}
    tables["accuracy"] = {"tolerance": fitted.scene.accuracy.tolerance}
    whole = loads(text_of(tables), fitted.scene.path)
    told = "\n".join(f"# {line}" for line in [f"law '{law}' in place of the patch of {fitted.scene.path.name}",
                                              *sentences(law, answer_of(fitted))])
    return f"{told}\n\n{resolved(moved(whole, path), build(whole))}"


def fit_into(fitted: FittedPatch, folder: Folder) -> dict:
    """Write fit.json, fit.csv, fit.svg, the scene of the best law as scene.fitted.toml and that of each law under its
    name into an open results folder, and return the object of fit.json."""
    answer = answer_of(fitted)
    for law, name in [(fitted.best, "scene.fitted.toml"), *((law, f"scene.{law}.toml") for law in SEARCHED)]:
        write_text(folder.path / name, scene_text(fitted, law, folder.target / name))
    write_json(answer, folder.path / "fit.json")
    curves = {"patch": fitted.own} | {law: one.curves for law, one in fitted.laws.items()}
    head = ["slide [m]", *(f"{name} {part}" for name in curves for part in ("force [N]", "loss [J]"))]
    rows = np.column_stack([fitted.slides, *(part for one in curves.values() for part in one)]).tolist()
    write_rows(folder.path / "fit.csv", [head, *([*map(repr, row)] for row in rows)])
    write_text(folder.path / "fit.svg", draw(fitted.slides, curves))
    return answer


@styled
def draw(slides, curves: dict):
    """Draw stiffness from turn to turn and loss per cycle over the amplitude (k,) [m] of the slide, of the patch and of
    each law, as SVG text; curves: `Curves` by name."""
    from matplotlib.ticker import LogLocator

    figure, axes = drawing(2, 3.6)
    along, size = axis_unit(slides, "m")
    for axis, name, unit, of in zip(axes, ("stiffness", "loss per cycle"), ("N/m", "J"),
                                    (lambda one: one.force / slides, lambda one: one.loss)):
        for law, one in curves.items():
            y = of(one)
            style = {"color": "black", "marker": ".", "ls": "none", "ms": 4} if law == "patch" else \
                {"color": COLOURS[law], "lw": 1.2}
            axis.loglog(slides * size, np.where(y > 0, y, np.nan), label=law, **style)
        axis.xaxis.set_minor_locator(LogLocator(subs=(2, 5)))
        axis.xaxis.set_major_formatter("{x:g}")
        axis.xaxis.set_minor_formatter("{x:g}")
        axis.set(xlabel=f"amplitude of the slide [{along}]", ylabel=f"{name} [{unit}]")
    axes[0].set_yscale("linear")
    axes[0].set_ylim(bottom=0)
    axes[0].legend()
    return figure


def _held(answer: dict) -> str:
    """Stiffness of the patch while nothing slips in words, with its error where one is known."""
    value, error = answer["stiffness"], answer["stiffness_error"]
    return _value(value, "N/m") if error is None else with_error(value, error, unit=SPOKEN["N/m"])


def lines_of(answer: dict) -> list:
    """The answer as lines of text; answer: the object of fit.json."""
    low, high = (short(one, "m", 3) for one in answer["amplitudes"])
    out = [f"{answer['outcome']}: laws of a single point fitted to a patch under a load of "
           f"{short(answer['load'], 'N', 4)}; the patch slips as a whole at {short(answer['slip_force'], 'N', 4)} and "
           f"has {_held(answer)} while the whole patch sticks; "
           f"{answer['rows']} amplitudes of the slide from {low} to {high}. {_headline(answer)}",
           f"  {'law':<16}{'error of stiffness':>22}{'error of loss':>22}   values"]
    for law, one in answer["laws"].items():
        parts = (f"{_percent(one[part]['largest'])} (rms {_percent(one[part]['rms'])})" for part in PARTS)
        values = ", ".join(f"{key.partition('.')[2]} {_value(part['value'], part['unit'])}"
                           for key, part in one["values"].items())
        out.append(f"  {law:<16}{next(parts):>22}{next(parts):>22}   {values}")
    out += [f"  {line}" for line in sentences(answer["law"], answer)]
    if answer["mesh"] is not None:
        stiff, loss = (answer["mesh"][part] for part in PARTS)
        out.append(f"  A mesh coarser than the present one ({answer['mesh']['nodes']} interface nodes) changes the "
                   f"stiffness of the patch by at most {_percent(abs(stiff['largest']))}, and the energy dissipated "
                   f"per cycle by at most "
                   f"{_percent(abs(loss['largest']))} (at {short(loss['at'], 'm', 3)}) and by {_percent(loss['rms'])} "
                   "rms.")
    return out


def _headline(answer: dict) -> str:
    """The law that fits best, with the signs and sizes of its largest errors over the range of amplitudes."""
    stiff, loss = (answer["laws"][answer["law"]][part] for part in PARTS)
    return (f"Law '{answer['law']}' fits best; its largest errors over this range are "
            f"{_signed(stiff['largest'])} of the stiffness (at {short(stiff['at'], 'm', 3)}) and "
            f"{_signed(loss['relative'])} of the energy loss per cycle (at {short(loss['relative_at'], 'm', 3)})")


def sentences(law: str, answer: dict) -> list:
    """What a law costs against the patch; answer: the object of fit.json."""
    (low, high), (stiff, loss) = answer["amplitudes"], (answer["laws"][law][part] for part in PARTS)
    low, high, at, there = (short(one, "m", 3) for one in (low, high, stiff["at"], loss["at"]))
    return [f"For slide amplitudes from {low} to {high} the stiffness of '{law}' differs from that of the patch by at "
            f"most {_percent(abs(stiff['largest']))} (at {at}) and by {_percent(stiff['rms'])} rms.",
            f"The energy that this law dissipates per cycle is up to {_percent(abs(loss['largest']))} "
            f"{'larger' if loss['largest'] > 0 else 'smaller'} than that of the patch (at {there}) and differs by "
            f"{_percent(loss['rms'])} rms; where this energy is below a thousandth of 4 x force x slide, the "
            f"difference is given relative to that thousandth.{_small(loss)}",
            "If this law replaces the patch, the relative error of a mode's frequency is at most about half the error "
            "of the stiffness. The relative error of the friction damping of this mode is at most the sum of the "
            "errors of the stiffness and of the dissipated energy."]


def _small(loss: dict) -> str:
    """The largest difference over the energy that the patch itself dissipates, where that is another."""
    return "" if loss["relative"] == loss["largest"] else (
        " Relative to the energy that the patch itself dissipates, the largest difference is "
        f"{_signed(loss['relative'])} (at {short(loss['relative_at'], 'm', 3)}).")


def _percent(share: float) -> str:
    return f"{plain(100 * share, 2)} %"


def _signed(share: float) -> str:
    return f"{'+' * (share > 0)}{_percent(share)}"


def _value(value: float, unit: str) -> str:
    return short(value, SPOKEN.get(unit, unit), 5)
