"""Files of laws of a single point that are fitted to a patch, with a scene of each law."""

import tomllib
from pathlib import Path

import numpy as np

from ...campaigns.fits.patch import FittedPatch
from ...campaigns.fits.patch_laws import FITTED_LAWS, FittedLaw
from ...formatting import (
    SENTENCE_UNITS,
    choose_axis_unit,
    format_number,
    format_quantity,
    format_value,
)
from ...model.model import build, write_resolved
from ...scene.scene import loads, move_scene
from ...scene.sets import format_scene
from ..drawing import charts
from .files import FITTED_SCENE, FitFiles, describe_measurement

COMPARED_QUANTITIES = ("stiffness", "dissipation")
COLOURS = dict(zip(FITTED_LAWS, ("accent", "warm", "soft"), strict=True))
PATCH_COLOUR = "#000000"
Y_MARGIN = 1.05  # upper end of the stiffness axis, relative to the largest stiffness


def describe_patch_fit(fit: FittedPatch, folder: Path) -> FitFiles:
    """Return the output files of single-point friction laws that are fitted to a patch.

    The paths in the fitted scenes are relative to `folder`.
    """
    fit_data = _collect_fit_data(fit)
    lines = _format_fit_data(fit_data)
    names = {FITTED_SCENE: fit.best} | {f"scene.{law}.toml": law for law in FITTED_LAWS}
    scenes = {name: _scene_text(fit, law, fit_data, folder / name) for name, law in names.items()}
    return FitFiles(
        answer=fit_data,
        lines=lines,
        summary=lines[:1],
        scenes=scenes,
        rows=_csv_rows(fit),
        charts=_draw_charts(fit),
        caption="Stiffness and loss per cycle of the patch and of each fitted law, against slide "
        "amplitude",
    )


def _collect_fit_data(fit: FittedPatch) -> dict:
    """Return the contents of fit.json for friction laws that are fitted to a patch."""
    patch = fit.patch
    laws = {law: _describe_law(law, fitted_law, fit) for law, fitted_law in fit.laws.items()}
    best = laws[fit.best]
    mesh = None
    if patch.mesh_change is not None:
        mesh = _difference_sizes(patch.mesh_change, patch.amplitudes) | {"nodes": patch.nodes}
    scene = fit.scene
    return describe_measurement(scene.title, scene.path.name, "patch", best["outcome"]) | {
        "law": fit.best,
        "values": best["values"],
        "laws": laws,
        "load": patch.load,
        "slip_force": patch.slip_force,
        "stiffness": patch.stiffness,
        "stiffness_error": patch.stiffness_error,
        "rows": int(patch.amplitudes.size),
        "amplitudes": [float(patch.amplitudes[0]), float(patch.amplitudes[-1])],
        "mesh": mesh,
        "warnings": [*scene.remarks, *fit.warnings],
        "seconds": round(fit.seconds, 6),
    }


def _describe_law(law: str, fitted_law: FittedLaw, fit: FittedPatch) -> dict:
    """Return the values and errors of a fitted law, as written in fit.json."""
    units = FITTED_LAWS[law].units
    sizes = _difference_sizes(fitted_law.deviations, fit.patch.amplitudes)
    return {
        "values": {
            f"friction.{key}": {"value": value, "unit": units.get(key, "1")}
            for key, value in fitted_law.values.items()
        },
        "outcome": str(fitted_law.fit.outcome),
        **sizes,
        "dissipation": sizes["dissipation"] | _relative_loss(fitted_law, fit),
    }


def _difference_sizes(deviations, slides) -> dict:
    """Return the largest and the rms difference between two curves, for stiffness and for loss.

    `deviations` (2, k) are the relative differences of both at the amplitudes `slides` (k,).
    """
    out = {}
    for name, row in zip(COMPARED_QUANTITIES, deviations):
        k = np.abs(row).argmax()
        out[name] = {
            "largest": float(row[k]),
            "at": float(slides[k]),
            "rms": float(np.sqrt(np.mean(row**2))),
        }
    return out


def _relative_loss(fitted_law: FittedLaw, fit: FittedPatch) -> dict:
    """Return the largest difference between the losses of a law and of the patch, relative to the latter.

    The loss of the patch is the reference also where it is tiny. If the patch dissipates nothing,
    the difference is that of `fitted_law.deviations`.
    """
    patch_loss = fit.patch.curves.loss
    loss = fitted_law.curves.loss
    relative_difference = np.where(
        patch_loss > 0,
        loss / np.where(patch_loss > 0, patch_loss, 1.0) - 1,
        fitted_law.deviations[1],
    )
    k = np.abs(relative_difference).argmax()
    return {
        "relative": float(relative_difference[k]),
        "relative_at": float(fit.patch.amplitudes[k]),
    }


def _scene_text(fit: FittedPatch, law: str, fit_data: dict, path: Path) -> str:
    """Return the text of the scene in which a fitted law replaces the patch, in SI units."""
    scene = fit.scene
    tables = tomllib.loads(scene.resolved())
    tables.pop("contact")
    tables["normal"] = {"load": fit.patch.load}
    values = fit.laws[law].values
    tables["friction"] = {"law": law, "static": scene.friction.static, **values}
    tables["accuracy"] = {"tolerance": scene.accuracy.tolerance}
    lumped_scene = loads(format_scene(tables), scene.path)
    comments = [
        f"law '{law}' in place of the patch of {scene.path.name}",
        *_error_sentences(law, fit_data),
    ]
    head = "\n".join(f"# {line}" for line in comments)
    return f"{head}\n\n{write_resolved(move_scene(lumped_scene, path), build(lumped_scene))}"


def _csv_rows(fit: FittedPatch) -> list:
    """Return the rows of fit.csv: force and loss of the patch and of each fitted law."""
    curves = {"patch": fit.patch.curves} | {law: one.curves for law, one in fit.laws.items()}
    parts = ("force [N]", "loss [J]")
    head = ["slide [m]", *(f"{name} {part}" for name in curves for part in parts)]
    columns = [fit.patch.amplitudes]
    for curve in curves.values():
        columns += [curve.force, curve.loss]
    return [head, *([*map(repr, row)] for row in np.column_stack(columns).tolist())]


def _draw_charts(fit: FittedPatch) -> list:
    """Draw the stiffness and the loss per cycle against the slip amplitude."""
    slides = fit.patch.amplitudes
    unit, scale = choose_axis_unit(slides, "m")
    along = charts.make_axis("amplitude of the slide", unit, True)
    x = slides * scale
    patch_curves = fit.patch.curves
    stiffness = [charts.make_dots(x, patch_curves.force / slides, PATCH_COLOUR, "patch", size=4)]
    loss = [
        charts.make_dots(x, _mask_nonpositive(patch_curves.loss), PATCH_COLOUR, "patch", size=4)
    ]
    peak = float((patch_curves.force / slides).max())
    for law, fitted_law in fit.laws.items():
        values = fitted_law.curves.force / slides
        peak = max(peak, float(values.max()))
        stiffness.append(charts.make_line(x, values, COLOURS[law], law))
        loss.append(
            charts.make_line(x, _mask_nonpositive(fitted_law.curves.loss), COLOURS[law], law)
        )
    from_zero = charts.make_axis("stiffness", "N/m") | {"range": [0.0, Y_MARGIN * peak]}
    return [
        charts.make_chart("Stiffness", along, from_zero, stiffness),
        charts.make_chart(
            "Loss per cycle", along, charts.make_axis("loss per cycle", "J", True), loss
        ),
    ]


def _mask_nonpositive(values) -> np.ndarray:
    """Replace values that are not positive by NaN, for a logarithmic axis."""
    return np.where(values > 0, values, np.nan)


def _format_fit_data(fit_data: dict) -> list:
    """Return the results of a fit to a patch as lines of text."""
    low, high = (format_quantity(end, "m", 3) for end in fit_data["amplitudes"])
    out = [
        f"{fit_data['outcome']}: laws of a single point fitted to a patch under a load of "
        f"{format_quantity(fit_data['load'], 'N', 4)}; the patch slips as a whole at "
        f"{format_quantity(fit_data['slip_force'], 'N', 4)} and has {_format_stiffness(fit_data)} while the "
        f"whole patch sticks; {fit_data['rows']} amplitudes of the slide from {low} to {high}. "
        f"{_best_law_sentence(fit_data)}",
        f"  {'law':<16}{'error of stiffness':>22}{'error of loss':>22}   values",
    ]
    for law, described_law in fit_data["laws"].items():
        cells = [
            f"{_format_percent(described_law[part]['largest'])} (rms {_format_percent(described_law[part]['rms'])})"
            for part in COMPARED_QUANTITIES
        ]
        values = ", ".join(
            f"{key.partition('.')[2]} {_format_in_unit(value['value'], value['unit'])}"
            for key, value in described_law["values"].items()
        )
        out.append(f"  {law:<16}{cells[0]:>22}{cells[1]:>22}   {values}")
    out += [f"  {line}" for line in _error_sentences(fit_data["law"], fit_data)]
    if fit_data["mesh"] is not None:
        stiffness, loss = (fit_data["mesh"][part] for part in COMPARED_QUANTITIES)
        out.append(
            f"  A mesh coarser than the present one ({fit_data['mesh']['nodes']} interface nodes) "
            "changes the stiffness of the patch by at most "
            f"{_format_percent(abs(stiffness['largest']))}, and the energy dissipated per cycle by at "
            f"most {_format_percent(abs(loss['largest']))} (at {format_quantity(loss['at'], 'm', 3)}) and by "
            f"{_format_percent(loss['rms'])} rms."
        )
    return out


def _format_stiffness(fit_data: dict) -> str:
    """Format the stiffness of the sticking patch, with its error if the error is known."""
    value = fit_data["stiffness"]
    error = fit_data["stiffness_error"]
    if error is None:
        return _format_in_unit(value, "N/m")
    return format_value(value, error, unit=SENTENCE_UNITS["N/m"])


def _best_law_sentence(fit_data: dict) -> str:
    """State which law fits a patch best, and its largest errors."""
    stiffness, loss = (fit_data["laws"][fit_data["law"]][part] for part in COMPARED_QUANTITIES)
    return (
        f"Law '{fit_data['law']}' fits best; its largest errors over this range are "
        f"{_format_signed_percent(stiffness['largest'])} of the stiffness "
        f"(at {format_quantity(stiffness['at'], 'm', 3)}) and {_format_signed_percent(loss['relative'])} of the "
        f"energy loss per cycle (at {format_quantity(loss['relative_at'], 'm', 3)})"
    )


def _error_sentences(law: str, fit_data: dict) -> list:
    """Describe the errors that arise if a fitted law replaces the patch."""
    low, high = (format_quantity(end, "m", 3) for end in fit_data["amplitudes"])
    stiffness, loss = (fit_data["laws"][law][part] for part in COMPARED_QUANTITIES)
    side = "larger" if loss["largest"] > 0 else "smaller"
    return [
        f"For slide amplitudes from {low} to {high} the stiffness of '{law}' differs from that of "
        f"the patch by at most {_format_percent(abs(stiffness['largest']))} "
        f"(at {format_quantity(stiffness['at'], 'm', 3)}) and by {_format_percent(stiffness['rms'])} rms.",
        "The energy that this law dissipates per cycle is up to "
        f"{_format_percent(abs(loss['largest']))} {side} than that of the patch "
        f"(at {format_quantity(loss['at'], 'm', 3)}) and differs by {_format_percent(loss['rms'])} rms; where this "
        "energy is below a thousandth of 4 x force x slide, the difference is given relative to "
        f"that thousandth.{_relative_sentence(loss)}",
        "If this law replaces the patch, the relative error of a mode's frequency is at most about "
        "half the error of the stiffness. The relative error of the friction damping of this mode "
        "is at most the sum of the errors of the stiffness and of the dissipated energy.",
    ]


def _relative_sentence(loss: dict) -> str:
    """Describe the largest difference between the losses of a law and of the patch, relative to the latter.

    "" if it equals the largest difference that is already stated.
    """
    if loss["relative"] == loss["largest"]:
        return ""
    return (
        " Relative to the energy that the patch itself dissipates, the largest difference is "
        f"{_format_signed_percent(loss['relative'])} (at {format_quantity(loss['relative_at'], 'm', 3)})."
    )


def _format_percent(fraction: float) -> str:
    """Format a fraction in percent."""
    return f"{format_number(100 * fraction, 2)} %"


def _format_signed_percent(fraction: float) -> str:
    """Format a fraction in percent with its sign."""
    sign = "+" if fraction > 0 else ""
    return f"{sign}{_format_percent(fraction)}"


def _format_in_unit(value: float, unit: str) -> str:
    """Format a value [SI] in a unit that suits its size."""
    return format_quantity(value, SENTENCE_UNITS.get(unit, unit), 5)
