"""Fields over a face as image data: fields.vtkhdf of a scene with [contact.area], its frames, CSV and pictures.

The file is a vtkImageData of the format VTKHDF 2.2, whose cells are those of the face. VTK 9.4 and ParaView 5.13 read it.
"""

from pathlib import Path
from typing import NamedTuple

import h5py
import numpy as np

from ...core import PatchfemError
from ...disk.atomic_write import open_lossy, write_atomically, write_rows
from ...formatting import choose_axis_unit
from ..charts.axes import save_figure
from .blocks import VTK_FIELDS
from .vtkhdf import VTKHDF_VERSION

IMAGE_TYPE = b"ImageData"
FACE_FORMATS = (".vtkhdf", ".csv")
# Fields of a picture, in the order of its panels
DRAWN_FIELDS = ("normal_stress", "gap", "shear_stress", "slip")
FIGURE_SIZE_INCHES = (11.0, 8.0)
PIXELS_PER_INCH = 100


class FaceFrames(NamedTuple):
    """Fields over the cells of a face in all frames of a file.

    - path: the file.
    - times (f,): [s].
    - x, y: edges of the cells [m], (nx + 1,) and (ny + 1,).
    - fields: (f, ny, nx) by name.
    """

    path: Path
    times: np.ndarray
    x: np.ndarray
    y: np.ndarray
    fields: dict[str, np.ndarray]


def collect_face_frames(result) -> FaceFrames:
    """Return the fields over the face of a run with [contact.area]."""
    patch = result.patch
    pieces = patch.model.pieces
    rows, columns = patch.shape
    fields = {}
    for name, values in result.fields.items():
        if name in VTK_FIELDS and np.shape(values)[1:] == (patch.x.size,):
            fields[name] = np.reshape(values, (-1, rows, columns))
    x = np.linspace(-pieces.length / 2, pieces.length / 2, columns + 1)
    y = np.linspace(-pieces.width / 2, pieces.width / 2, rows + 1)
    return FaceFrames(Path(), np.asarray(result.fields["time"], float), x, y, fields)


def write_image(frames: FaceFrames, path: Path) -> None:
    """Write the fields over a face as a VTKHDF file, which gets its name when it is complete."""
    with (
        write_atomically(Path(path)) as partial,
        open_lossy(partial) as opened,
        h5py.File(opened, "w", libver=("earliest", "v110")) as file,
    ):
        root = file.create_group("VTKHDF", track_order=True)
        root.attrs["Version"] = VTKHDF_VERSION
        root.attrs["Type"] = np.bytes_(IMAGE_TYPE)
        root.attrs["WholeExtent"] = [0, frames.x.size - 1, 0, frames.y.size - 1, 0, 0]
        root.attrs["Origin"] = [frames.x[0], frames.y[0], 0.0]
        root.attrs["Spacing"] = [frames.x[1] - frames.x[0], frames.y[1] - frames.y[0], 1.0]
        root.attrs["Direction"] = np.eye(3).ravel()
        steps = root.create_group("Steps", track_order=True)
        steps.attrs["NSteps"] = frames.times.size
        steps["Values"] = frames.times

        # A cell field of an image without depth is (frame, y, x); its offset is the number of the frame.
        arrays = root.create_group("CellData", track_order=True)
        offsets = steps.create_group("CellDataOffsets", track_order=True)
        for name, values in frames.fields.items():
            field = VTK_FIELDS[name]
            kind = np.int8 if field.codes else np.float64
            packing = {"shuffle": True, "compression": "gzip", "compression_opts": 1}
            stored = arrays.create_dataset(
                name, data=values.astype(kind), chunks=(1, *values.shape[1:]), **packing
            )
            stored.attrs["units"] = field.unit
            if field.codes:
                stored.attrs["flag_values"] = np.arange(len(field.codes), dtype=np.int8)
                stored.attrs["flag_meanings"] = " ".join(field.codes)
            offsets[name] = np.arange(frames.times.size)


def is_image(path: Path) -> bool:
    """Return whether a file of fields holds those over a face; False for another or a damaged file."""
    try:
        with h5py.File(path, "r") as file:
            return bytes(file["VTKHDF"].attrs["Type"]) == IMAGE_TYPE
    except (OSError, KeyError):
        return False


def read_image(path: Path) -> FaceFrames:
    """Read the fields over a face from a file of `write_image`.

    PatchfemError is raised if it is damaged.
    """
    try:
        with h5py.File(path, "r") as file:
            root = file["VTKHDF"]
            counts = np.asarray(root.attrs["WholeExtent"])[[1, 3]] + 1
            axes = []
            for count, start, step in zip(counts, root.attrs["Origin"], root.attrs["Spacing"]):
                axes.append(start + step * np.arange(count))
            fields = {name: values[:] for name, values in root["CellData"].items()}
            return FaceFrames(Path(path), root["Steps/Values"][:], *axes, fields)
    except Exception as fault:  # a damaged file can raise exceptions of many classes
        reason = " ".join(str(fault).split())[:200] or type(fault).__name__
        raise PatchfemError(
            f"{path}: not the fields of a run of this version of patchfem ({reason}); run the scene again"
        ) from None


def export_image(frames: FaceFrames, out: Path, number: int) -> None:
    """Write the fields over a face as .vtkhdf of all frames, or as .csv of one frame.

    Parameters
    ----------
    frames : FaceFrames
        Fields over the face.
    out : Path
        File whose suffix chooses the format; PatchfemError for another one.
    number : int
        Number of the frame of a .csv.
    """
    if out.suffix == ".vtkhdf":
        write_image(frames, out)
        return
    if out.suffix != ".csv":
        raise PatchfemError(
            f"{out}: fields over a face are exported as {', '.join(FACE_FORMATS)}; ParaView 5.13 and pyvista.read open "
            ".vtkhdf"
        )
    centres = [(edges[1:] + edges[:-1]) / 2 for edges in (frames.x, frames.y)]
    columns = {"x [m]": np.tile(centres[0], centres[1].size)}
    columns["y [m]"] = np.repeat(centres[1], centres[0].size)
    for name, values in frames.fields.items():
        columns[f"{name} [{VTK_FIELDS[name].unit}]"] = values[number].ravel()
    write_rows(out, [columns, *zip(*columns.values())])


def draw_face(frames: FaceFrames, number: int, title: str = "", onto=None):
    """Draw the fields over a face in one frame, and return the figure.

    Parameters
    ----------
    frames : FaceFrames
        Fields over the face.
    number : int
        Number of the frame.
    title : str
        First words of the title, before the time.
    onto : matplotlib Axes, optional
        Axes for the pressure; the other fields are then omitted.
    """
    from matplotlib.figure import Figure

    names = [name for name in DRAWN_FIELDS if name in frames.fields]
    if onto is not None:
        names = names[:1]
        panels = [onto]
        figure = onto.figure
    else:
        figure = Figure(figsize=FIGURE_SIZE_INCHES, dpi=PIXELS_PER_INCH, layout="constrained")
        panels = figure.subplots(2, 2).ravel()
        figure.suptitle(f"{title}, {frames.times[number]:.6g} s")
    length_unit, length_scale = choose_axis_unit([frames.x[-1]], "m")
    for axes, name in zip(panels, names):
        values = frames.fields[name][number]
        unit, scale = choose_axis_unit([np.abs(values).max()], VTK_FIELDS[name].unit)
        map_ = axes.pcolormesh(
            length_scale * frames.x, length_scale * frames.y, scale * values, cmap="viridis"
        )
        label = f"{name.replace('_', ' ')} [{unit}]"
        figure.colorbar(map_, ax=axes, label=label)
        axes.set(aspect="equal", xlabel=f"x [{length_unit}]", ylabel=f"y [{length_unit}]")
    for axes in panels[len(names) :]:
        axes.set_axis_off()
    return figure


def write_face_picture(frames: FaceFrames, number: int, title: str, out: Path) -> str:
    """Write a picture of one frame of the fields over a face, and return a line on it.

    Parameters
    ----------
    frames : FaceFrames
        Fields over the face.
    number : int
        Number of the frame.
    title : str
        First words of the title.
    out : Path
        File to write.
    """
    with write_atomically(out) as partial:
        figure = draw_face(frames, number, title)
        save_figure(figure, partial, out.suffix[1:].lower(), 1.5 * PIXELS_PER_INCH)
    last = frames.times.size - 1
    return f"{out}: {title}, frame {number} of 0 to {last}, {frames.times[number]:.6g} s"
