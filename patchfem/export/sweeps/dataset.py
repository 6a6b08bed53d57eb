"""The answer of a sweep as xarray.Dataset, and the plot of one of its measures."""

from dataclasses import replace

from ...core import PatchfemError
from .. import netcdf
from ..answer import Answer
from ..charts import axes as drawing
from ..charts.sweeps import list_keys, list_measures, make_measure_panel


def to_dataset(answer: Answer):
    """Return the xarray.Dataset of a sweep: keys, measures with errors, outcome and messages.

    Its attributes are those of sweep.nc, the `answer` in one sentence and the `tolerance`.
    """
    return netcdf.to_dataset(answer).set_coords(list_keys(answer))


def draw_sweep(dataset, measure: str, axes=None):
    """Draw a measure of a sweep on matplotlib Axes and return them; crosses mark cases that did not settle.

    Parameters
    ----------
    dataset : xarray.Dataset
        From `to_dataset`, or the content of sweep.nc, also of selected values of the keys.
    measure : str
        Name of a variable that has an error.
    axes : matplotlib.axes.Axes, optional
        By default those of a new figure.

    Raises
    ------
    PatchfemError
        If the dataset is not that of a sweep, has no value of this measure, or has a single case without a dimension.
    """
    answer = netcdf.from_dataset(dataset, "sweep")
    names = list_measures({"": answer})
    if measure not in names:
        listed = ", ".join(sorted(names)) or "none; give a Dataset returned by pf.sweep"
        raise PatchfemError(f"plot.sweep: no measure {measure!r}; there are {listed}", "")
    # a key of which one value was selected is no longer a dimension
    coordinates = dataset.coords.items()
    keys = [str(name) for name, values in coordinates if values.ndim and name != "case"]
    if not keys:
        raise PatchfemError("plot.sweep: the Dataset has a single case; select fewer keys")
    panel = make_measure_panel({"": replace(answer, details={"of": {"keys": keys}})}, measure)
    return drawing.draw_panels([panel], axes, "plot.sweep")
