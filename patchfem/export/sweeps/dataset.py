"""The answer of a sweep as xarray.Dataset, and the plot of one of its measures."""

from __future__ import annotations

import numpy as np

from ...core import PatchfemError
from .. import netcdf
from ..answer import Answer, Variable
from ..charts import axes as drawing
from ..charts.sweeps import list_keys, make_measure_panel


def to_dataset(answer: Answer):
    """Return the xarray.Dataset of a sweep: keys, measures with errors, outcome and messages.

    Its attributes are those of sweep.nc, the `answer` in one sentence and the `tolerance`.
    """
    return netcdf.to_dataset(answer).set_coords(list_keys(answer))


def sweep_axes(dataset, measure: str, axes=None):
    """Draw a measure of a sweep on matplotlib Axes and return them; hollow points miss the tolerance.

    Parameters
    ----------
    dataset : xarray.Dataset
        From `to_dataset`, or the content of sweep.nc.
    measure : str
    axes : matplotlib.axes.Axes, optional
        By default those of a new figure.

    Raises
    ------
    PatchfemError
        If the dataset is not that of a sweep, or does not have this measure.
    """
    names = [str(name) for name in getattr(dataset, "data_vars", ()) if f"{name}_error" in dataset]
    if measure not in names:
        listed = ", ".join(sorted(names)) or "none; give a Dataset returned by pf.sweep"
        raise PatchfemError(f"plot.sweep: no measure {measure!r}; there are {listed}", "")
    if axes is None:
        from matplotlib.figure import Figure

        axes = Figure(figsize=drawing.PANEL_SIZE, layout="constrained").subplots()
    data = {
        str(name): Variable(
            tuple(map(str, variable.dims)),
            np.asarray(variable.values),
            variable.attrs.get("units", ""),
            variable.attrs.get("long_name", ""),
        )
        for name, variable in dataset.variables.items()
    }
    keys = [str(name) for name in dataset.coords if name != "case"]
    details = {"of": {"keys": keys}, "tolerance": dataset.attrs.get("tolerance")}
    answer = Answer("sweep", "", (), data=data, details=details)
    return drawing.draw(make_measure_panel({"": answer}, measure), axes)
