"""The answer of `backbone`: frequency and damping ratio of a mode against its amplitude."""

import numpy as np

from ..campaigns.backbone.band import Band
from ..campaigns.backbone.records import METHODS, Backbone, Curve
from ..core import PatchfemError
from ..formatting import format_quantity
from . import quantities
from .answer import Answer, Quantity, Remarks, Variable, make_columns
from .charts import axes, panels
from .charts.table import CHARTS
from .runs import make_origin

COLUMNS = ("amplitude", "frequency", "frequency_error", "damping", "damping_error")
BAND_COLUMNS = ("amplitude", "frequency_low", "frequency_high", "damping_low", "damping_high")
UNITS = {"amplitude": "m", "frequency": "Hz", "damping": "1"}


def make_answer(backbone: Backbone, source) -> Answer:
    """Return the answer of `backbone`.

    Parameters
    ----------
    backbone : Backbone
    source : model.Source
        Scene of the mode.
    """
    measures = _make_quantities(backbone)
    return Answer(
        kind="backbone",
        title=source.title,
        verdict=_make_verdict(backbone, measures),
        quantities=measures,
        data=_make_data(backbone),
        remarks=Remarks(
            notes=(*map(_make_sentence, backbone.notes), *backbone.answer.sentences[1:])
        ),
        details=_make_details(backbone),
        origin=make_origin(source, "backbone"),
    )


def _make_sentence(text: str) -> str:
    """Return a clause as a sentence."""
    return f"{text[0].upper()}{text[1:].rstrip('.')}."


def backbone_axes(dataset, ax=None):
    """Draw the Dataset of a backbone on matplotlib Axes.

    Parameters
    ----------
    dataset : xarray.Dataset
        Result of `Answer.to_xarray`.
    ax : matplotlib.axes.Axes, optional
        Axes for the frequency alone; by default a new figure with frequency and damping ratio.

    Returns
    -------
    matplotlib.axes.Axes
        Axes of the frequency.

    Raises
    ------
    PatchfemError
        If the Dataset has no curve of a backbone.
    """
    data = {}
    for name, array in getattr(dataset, "variables", {}).items():
        data[name] = Variable(array.dims, array.values, array.attrs.get("units", "1"))
    drawn = panels.make_panels({"": Answer("backbone", "", (), data=data)}, CHARTS["backbone"])
    if not drawn:
        raise PatchfemError(
            "plot.backbone: a Dataset returned by pf.backbone is needed, with at least one curve"
        )
    return axes.make_figure(drawn).axes[0] if ax is None else axes.draw(drawn[0], ax)


def _make_quantities(backbone: Backbone) -> dict[str, Quantity]:
    """Return frequencies, ends of the recommended curve, exponents and the amplitude of flutter."""
    frequencies = backbone.frequencies
    out = {}
    band = backbone.answer.band
    curve = band and backbone.curves[band.method]
    if curve is not None:

        def take(name: str, k: int) -> Quantity:
            """Return frequency or damping ratio of point k of the curve."""
            return Quantity(
                getattr(curve, name)[k], UNITS[name], getattr(curve, f"{name}_error")[k]
            )

        largest = int(np.argmax(curve.damping))
        for name in ("frequency", "damping"):
            out[f"{name}_at_smallest_amplitude"] = take(name, 0)
            out[f"{name}_at_largest_amplitude"] = take(name, -1)
        out["largest_damping"] = take("damping", largest)
        out["amplitude_of_largest_damping"] = Quantity(curve.amplitude[largest], "m")
    no_frequency = "" if frequencies.stuck is not None else "a rigid contact leaves no motion"
    out |= {
        "free_frequency": Quantity(frequencies.free, "Hz", frequencies.free_error or None),
        "stuck_frequency": Quantity(
            frequencies.stuck, "Hz", frequencies.stuck_error, reason=no_frequency
        ),
        "exponent_micro": Quantity(backbone.exponents.micro),
        "exponent_gross": Quantity(backbone.exponents.gross),
        "flutter_amplitude": Quantity(backbone.flutter, "m"),
    }
    return {name: one for name, one in out.items() if one.value is not None or one.reason}


def _make_verdict(backbone: Backbone, measures: dict[str, Quantity]) -> tuple[str, ...]:
    """Return the ends of the recommended curve, natural frequencies, largest damping, and which curve to use."""

    def show(name: str) -> str:
        """Return a quantity as text."""
        return quantities.format_quantity(name, measures[name])

    band = backbone.answer.band
    curve = band and backbone.curves[band.method]
    free = f"without the contact {show('free_frequency')}"
    stuck = ""
    if backbone.frequencies.stuck is not None:
        stuck = f", with a sticking contact {show('stuck_frequency')}"
    natural = f"Natural frequencies of mode {backbone.mode}: {free}{stuck}."
    if curve is None:
        headline = f"No method found frequency and damping of mode {backbone.mode}."
        return (headline, natural, *backbone.answer.sentences[:1])

    # first and last point of the recommended curve
    changes = []
    for name, label in (("frequency", "frequency"), ("damping", "damping ratio")):
        first, last = (measures[f"{name}_at_{size}_amplitude"] for size in ("smallest", "largest"))
        texts = [show(f"{name}_at_{size}_amplitude") for size in ("smallest", "largest")]
        if abs(last.value - first.value) <= (first.error or 0.0) + (last.error or 0.0):
            changes.append(f"{label} stays at {texts[0]}")
        else:
            verb = "rises" if last.value > first.value else "falls"
            changes.append(f"{label} {verb} from {texts[0]} to {texts[1]}")
    ends = [format_quantity(float(curve.amplitude[k]), "m", 3) for k in (0, -1)]
    span = f"from {ends[0]} to {ends[1]}" if curve.amplitude.size > 1 else f"at {ends[0]}"
    headline = f"{changes[0][0].upper()}{changes[0][1:]}, {changes[1]}, {span}."

    if backbone.flutter is None:
        amplitude = show("amplitude_of_largest_damping")
        extreme = f"The damping ratio is largest, {show('largest_damping')}, at {amplitude}."
    else:
        extreme = (
            f"Above {show('flutter_amplitude')} the mode gains energy: friction dissipates less than the "
            "negative damping supplies."
        )
    return (headline, natural, extreme, *backbone.answer.sentences[:1])


def _make_data(backbone: Backbone) -> dict[str, Variable]:
    """Return the curves of all methods, the recommended one first, and the band of tests around it.

    The band has variables of its own and, for the charts, is the interval of the recommended curve.
    """
    records = [
        (method.replace("-", "_"), backbone.curves[method], COLUMNS)
        for method in METHODS
        if method in backbone.curves
    ]
    band = backbone.answer.band
    if band is not None:
        records.insert(1, (records[0][0], band, BAND_COLUMNS[1:]))
        records.append(("band", band, BAND_COLUMNS))
    data = {}
    for prefix, record, names in records:
        columns = {
            f"{prefix}_{name}": (getattr(record, name), UNITS[name.partition("_")[0]])
            for name in names
        }
        data |= make_columns(f"{prefix}_amplitude", columns)
    return data


def _make_details(backbone: Backbone) -> dict:
    """Return the content of backbone.json in SI units."""
    frequencies = backbone.frequencies
    band = backbone.answer.band

    def list_columns(record: Curve | Band, names: tuple[str, ...]) -> dict[str, list[float]]:
        """Return some columns of a curve or of the band as lists."""
        return {name: getattr(record, name).tolist() for name in names}

    return {
        "mode": backbone.mode,
        "free_frequency": frequencies.free,
        "free_frequency_error": frequencies.free_error,
        "stuck_frequency": frequencies.stuck,
        "stuck_frequency_error": frequencies.stuck_error,
        "curves": {name: list_columns(one, COLUMNS) for name, one in backbone.curves.items()},
        "missing": backbone.missing,
        "exponent": backbone.exponents._asdict(),
        "flutter_amplitude": backbone.flutter,
        "notes": list(backbone.notes),
        "method": band and band.method,
        "band": band and list_columns(band, BAND_COLUMNS),
        "advice": backbone.answer.advice,
    }
