"""Files of a fitted wear coefficient."""

from pathlib import Path

from ...campaigns.fits.wear import COEFFICIENT_KEY, FittedCoefficient
from ...formatting import format_number
from ...scene.scene import Scene, loads
from .files import FITTED_SCENE, FitFiles, describe_measurement


def describe_wear_fit(fit: FittedCoefficient, scene: Scene) -> FitFiles:
    """Return the output files of a fitted wear coefficient.

    `scene` is the scene before the fit.
    """
    measured = fit.measured
    bounds = fit.bounds
    fitted_scene = loads(scene.text, scene.path, [*scene.sets, bounds.format_assignment(fit.value)])
    value = {
        "value": fit.value,
        "unit": "m2 N-1",
        "low": fit.low,
        "high": fit.high,
        "interval": [fit.low, fit.high],
        "bounds": [bounds.low, bounds.high],
    }
    fit_data = describe_measurement(scene.title, measured.source, measured.name, "done") | {
        "runs": fit.runs,
        "model": fit.model,
        "data": {"value": measured.value, "low": measured.low, "high": measured.high},
        "values": {COEFFICIENT_KEY: value},
        "warnings": [],
    }
    source = "" if measured.source == "--to" else f" of {Path(measured.source).name}"
    numbers = (fit.value, fit.low, fit.high)
    number, low, high = (format_number(entry, 4) for entry in numbers)
    line = f"{COEFFICIENT_KEY} {number} {value['unit']}, {low} to {high} from the interval of {measured.name}"
    return FitFiles(
        answer=fit_data,
        lines=[line],
        summary=[line],
        scenes={
            FITTED_SCENE: f"# {COEFFICIENT_KEY} fitted to {measured.name}{source}\n\n{fitted_scene.resolved()}"
        },
    )
