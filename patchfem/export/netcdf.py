"""result.nc: histories and interface frames as netCDF4 with CF attributes and provenance.

The file is the same as xarray would write. xarray is not used, because its import takes longer than
most runs.
"""

import hashlib
import json
from dataclasses import dataclass, field
from pathlib import Path

import h5netcdf
import h5py
import numpy as np

from ..disk.atomic_write import open_lossy, write_atomically, write_bytes

# Number of values above which a file is created on disk instead of in memory.
MAX_VALUES_IN_MEMORY = 10_000_000
CACHE_BYTES = 1 << 18  # size of the chunk cache of each variable [bytes]

VARIABLES = {
    "relative_displacement": ("m", "displacement of the output relative to the base"),
    "slide": (
        "m",
        "slide of the interface; friction_force plotted against slide gives the friction loop",
    ),
    "relative_velocity": ("m s-1", "velocity of the output relative to the base"),
    "absolute_acceleration": ("m s-2", "acceleration at the output, base motion included"),
    "base_acceleration": ("m s-2", "acceleration of the base"),
    "friction_force": ("N", "resultant friction force, positive when it opposes positive slip"),
    "lateral_displacement": ("m", "displacement of the upper piece across the sliding direction"),
    "lateral_velocity": ("m s-1", "velocity of the upper piece across the sliding direction"),
    "lateral_force": (
        "N",
        "resultant friction force across the sliding direction, positive when it opposes positive "
        "slip",
    ),
    "yaw_moment": (
        "N m",
        "moment about +z of the friction on the upper piece, sum of y f_x - x f_y",
    ),
    "normal_load": ("N", "normal load on the interface"),
    "friction_work": ("J", "work done against friction since the start of the run"),
    "energy_stored": ("J", "elastic energy of the interface"),
    "energy_dissipated": ("J", "energy dissipated by friction since the start of the run"),
    "energy_created": (
        "J",
        "energy created since the start of the run by a friction law that is not passive",
    ),
    "output_displacement": ("m", "displacement of the output relative to the base"),
    "output_velocity": ("m s-1", "velocity of the output relative to the base"),
    "modal_coordinate": ("m", "modal coordinate"),
    "normal_stress": ("Pa", "normal stress at the nodes, compression positive"),
    "strip_normal_stress": (
        "Pa",
        "normal stress at the nodes of every strip, compression positive",
    ),
    "gap": ("m", "gap that remains between the loaded surfaces"),
    "shear_stress": ("Pa", "frictional shear stress, positive when it opposes positive slip"),
    "slip": ("m", "irreversible local slip"),
    "worn_depth": ("m", "worn depth, sum of both pieces"),
    "weight": (
        "m2",
        "area of the interface that belongs to a node, summed over all pairs of pieces",
    ),
    "unloaded_gap": ("m", "gap of the unloaded surfaces, wear included"),
}

INTERFACE_DESCRIPTIONS = {
    "relative_displacement": "displacement of the first mass of an interface relative to its second mass",
    "relative_velocity": "velocity of the first mass of an interface relative to its second mass",
    "friction_force": "friction force of an interface, positive when it opposes positive slip",
    "normal_load": "normal load on an interface",
    "lateral_displacement": "lateral displacement of the first mass of an interface relative to its second mass",
    "lateral_velocity": "lateral velocity of the first mass of an interface relative to its second mass",
    "lateral_force": "friction force on the lateral pair of an interface, positive when it opposes positive "
    "slip of this pair",
}


@dataclass(frozen=True, eq=False, slots=True)
class Contents:
    """Variables, coordinates and attributes of a netCDF file.

    Attributes
    ----------
    variables, coordinates : dict
        Name -> (dimension or tuple of dimensions, values, attributes).
    attributes : dict
        Attributes of the file.
    """

    variables: dict = field(default_factory=dict)
    coordinates: dict = field(default_factory=dict)
    attributes: dict = field(default_factory=dict)

    def with_entries(
        self,
        variables: dict | None = None,
        coordinates: dict | None = None,
        attributes: dict | None = None,
    ) -> "Contents":
        """Return a copy of the contents with additional entries.

        Parameters
        ----------
        variables, coordinates : dict, optional
            {name: (dimensions, values, attributes)}
        attributes : dict, optional
            Attributes of the file.
        """
        return Contents(
            self.variables | (variables or {}),
            self.coordinates | (coordinates or {}),
            self.attributes | (attributes or {}),
        )

    def to_xarray(self):
        """Convert the contents to an xarray.Dataset."""
        import xarray as xr

        variables, coordinates = (
            {name: _xarray_variable(xr, *variable) for name, variable in group.items()}
            for group in (self.variables, self.coordinates)
        )
        return xr.Dataset(variables, coordinates, self.attributes)


def _xarray_variable(xr, dimensions, values, attributes=None):
    """Return an xarray variable of numbers or strings without unit conversion.

    To look for arrays of other packages, xarray would import all of Dask, which takes a quarter of
    its own import time.
    """
    values = np.asarray(values)
    texts = values.dtype.kind == "O" and all(isinstance(item, str) for item in values.flat)
    return xr.Variable(
        dimensions, values, attributes, fastpath=texts or values.dtype.kind in "biufcU"
    )


def run_contents(
    histories: dict,
    modal,
    fields: dict,
    x,
    weight,
    strips: tuple | None = None,
    levels: dict | None = None,
    interfaces: tuple = (),
    coordinate: str = "",
) -> Contents:
    """Return the contents of result.nc for a run.

    Parameters
    ----------
    histories : dict
        Name -> (k,), or (i, k) for the named interfaces, with "time".
    modal : tuple or None
        Names and coordinates (k, n) of the modes.
    fields : dict
        Name -> (f, m), or (f, s, m) for strips, with "time"; or {}.
    x, weight : (m,) array or None
        Positions [m] and areas [m2] of the nodes.
    strips : tuple, optional
        Offsets (s,) [m] and pressure (s, m) [Pa] of a patch in strips.
    levels : dict, optional
        Name -> (unit, (l,)) of a run in levels.
    interfaces : tuple of str
    coordinate : str
        Description of the modal coordinates, if they are not modes.

    Returns
    -------
    Contents
    """
    data = {}
    coords = {}
    if histories:
        coords["time"] = ("time", histories["time"], {"units": "s", "standard_name": "time"})
        for name, values in histories.items():
            if name != "time":
                data[name] = (
                    ("interface", "time")[-np.ndim(values) :],
                    values,
                    _variable_attributes(name, np.ndim(values)),
                )
    if interfaces:
        coords["interface"] = (
            "interface",
            list(interfaces),
            {"long_name": "the two masses of the interface; 0 is the base"},
        )
    if modal is not None:
        coords["mode"] = ("mode", list(modal[0]), {"long_name": "mode"})
        data["modal_coordinate"] = (
            ("time", "mode"),
            modal[1],
            _variable_attributes("modal_coordinate")
            | ({"long_name": coordinate} if coordinate else {}),
        )
    if x is not None:
        coords["x"] = (
            "x",
            np.asarray(x),
            {"units": "m", "long_name": "position along the sliding direction"},
        )
        data["weight"] = ("x", np.asarray(weight), _variable_attributes("weight"))
        coords["frame_time"] = (
            "frame",
            fields["time"],
            {"units": "s", "long_name": "time of the frame"},
        )
        for name, values in fields.items():
            if name == "status":
                flags = {
                    "long_name": "contact status: 0 open, 1 stick, 2 slip (FILES.md defines slip)",
                    "flag_meanings": "open stick slip",
                    "flag_values": np.array([0, 1, 2], np.int8),
                }
                data[name] = (("frame", "x"), values, flags)
            elif np.ndim(values) >= 2:
                dimensions = ("frame", "x") if np.ndim(values) == 2 else ("frame", "strip", "x")
                data[name] = (dimensions, values, _variable_attributes(name))
    if strips is not None:
        coords["strip_offset"] = (
            "strip",
            strips[0],
            {"units": "m", "long_name": "position of the strip across the width"},
        )
        data["strip_normal_stress"] = (
            ("strip", "x"),
            strips[1],
            _variable_attributes("strip_normal_stress"),
        )
    for name, (unit, values) in (levels or {}).items():
        drive = "force" if unit == "N" else "acceleration of the base"
        text = {
            "level_drive": drive,
            "level_stuck": "whether the interface sticks",
            "level_outcome": "outcome of the level",
        }
        about = {"units": unit} if unit else {}
        data[name] = (
            "level",
            values,
            about | {"long_name": text.get(name, name.replace("_", " "))},
        )
    return Contents(data, coords)


def add_events(
    data: Contents, time, interface, kind, slide, count: int, meanings, source: str
) -> Contents:
    """Add a table of e events to the contents of a file.

    Parameters
    ----------
    data : Contents
    time : (e,) array
        [s]
    interface : (e,) array
        Number of the interface from 1; 0 for a change of the drive.
    kind : (e,) array
        Index of `meanings`.
    slide : (e,) array
        [m]
    count : int
        Total number of events, of which the last ones are stored.
    meanings : sequence of str
    source : str
        How the events were found.
    """
    flags = {
        "long_name": "kind of event; `up` in a name means towards positive slip",
        "flag_meanings": " ".join(meanings),
        "flag_values": np.arange(len(meanings), dtype=np.int8),
    }
    about = {"long_name": "time of the event", "units": "s", "source": source, "total_count": count}
    return data.with_entries(
        {
            "event_time": ("event", time, about),
            "event_interface": (
                "event",
                np.asarray(interface, np.int32),
                {
                    "units": "1",
                    "long_name": "number of the interface, or of the strip if strips yaw, "
                    "counted from 1; 0 if the drive changes",
                },
            ),
            "event_kind": ("event", np.asarray(kind, np.int8), flags),
            "event_slide": (
                "event",
                slide,
                {
                    "units": "m",
                    "long_name": "relative displacement at the event; missing at a "
                    "change of the drive",
                },
            ),
        }
    )


# Unit and description of each column of a curve of steady motions.
CURVE_COLUMNS = {
    "amplitude": ("m", "half the peak-to-peak motion at the output"),
    "acceleration_peak": ("m s-2", "largest absolute acceleration"),
    "acceleration_fundamental": ("m s-2", "first harmonic of the absolute acceleration"),
    "acceleration_distortion": (
        "1",
        "third harmonic of the absolute acceleration divided by its first harmonic",
    ),
}


def add_curve(data: Contents, curve: dict) -> Contents:
    """Add a curve of steady motions (c,) to the contents of a file.

    curve: frequency [Hz], level, amplitude [m], regime, multiplier, folds, and if they exist the
    columns of CURVE_COLUMNS and the errors of all that is read.
    """
    names, number = np.unique(np.asarray(curve["regime"], str), return_inverse=True)
    point = "curve_point"
    meanings = [name.replace(" ", "_") for name in names]
    variables = {
        "curve_frequency": (
            point,
            curve["frequency"],
            {"units": "Hz", "long_name": "drive frequency"},
        ),
        "curve_level": (
            point,
            curve["level"],
            {
                "units": "m s-2",
                "long_name": "drive: acceleration of the base, or force divided by the modal mass",
            },
        ),
        "curve_regime": (
            point,
            number.astype(np.int8),
            {
                "flag_values": np.arange(len(names), dtype=np.int8),
                "flag_meanings": " ".join(meanings),
                "long_name": "regime of the steady motion",
            },
        ),
        "curve_multiplier": (
            point,
            curve["multiplier"],
            {"units": "1", "long_name": "largest Floquet multiplier"},
        ),
    }
    for name, (unit, text) in CURVE_COLUMNS.items():
        if name in curve:
            variables[f"curve_{name}"] = (
                point,
                curve[name],
                {"units": unit, "long_name": f"{text} of the steady motion"},
            )
        if f"{name}_error" in curve:
            variables[f"curve_{name}_error"] = (
                point,
                curve[f"{name}_error"],
                {"units": unit, "long_name": f"estimated half-width of the {text}"},
            )
    if len(curve.get("folds", ())):
        varied_quantity, unit = (
            ("frequency", "Hz") if np.ptp(curve["frequency"]) > 0 else ("level", "m s-2")
        )
        variables["curve_fold"] = (
            "fold",
            np.asarray(curve["folds"], float),
            {"units": unit, "long_name": f"{varied_quantity} at which the curve turns back"},
        )
    return data.with_entries(variables)


DECAY = {
    "amplitude": ("m", "half the peak-to-peak motion of the output during the decay"),
    "frequency": ("Hz", "frequency of the decay"),
    "damping": ("1", "damping ratio of the decay"),
}


def add_decay(data: Contents, decay) -> Contents:
    """Add a decay curve to the contents of a file."""
    dimension = "decay_time"
    variables = {}
    for name, (unit, text) in DECAY.items():
        variables[f"decay_{name}"] = (
            dimension,
            getattr(decay, name),
            {"units": unit, "long_name": text},
        )
        if name != "amplitude":
            variables[f"decay_{name}_error"] = (
                dimension,
                getattr(decay, f"{name}_error"),
                {"units": unit, "long_name": f"half-width of the interval of the {text}"},
            )
    return data.with_entries(
        variables,
        {
            dimension: (
                dimension,
                decay.time,
                {"units": "s", "long_name": "time at the middle of the evaluated cycle"},
            )
        },
    )


def add_spectra(data: Contents, spectra) -> Contents:
    """Add the spectra of a random response to the contents of a file."""
    columns = {
        "base_acceleration_spectrum": (
            "m2 s-3",
            spectra.drive,
            "one-sided spectral density of the base acceleration",
        ),
        "relative_displacement_spectrum": (
            "m2 Hz-1",
            spectra.displacement,
            "one-sided spectral density of the displacement of the output",
        ),
        "absolute_acceleration_spectrum": (
            "m2 s-3",
            spectra.acceleration,
            "one-sided spectral density of the acceleration at the output",
        ),
        "gain": (
            "s2",
            np.abs(spectra.gain),
            "magnitude of H1, displacement of the output over base acceleration",
        ),
        "phase": ("rad", np.angle(spectra.gain), "phase of H1"),
        "coherence": ("1", spectra.coherence, "coherence"),
    }
    return data.with_entries(
        {
            name: ("frequency", values, {"units": unit, "long_name": text})
            for name, (unit, values, text) in columns.items()
        },
        {"frequency": ("frequency", spectra.frequency, {"units": "Hz"})},
    )


def add_surfaces(data: Contents, gap) -> Contents:
    """Add the unloaded gap (m,) [m] between the surfaces to the contents of a file.

    With strips the gap is (s, m).
    """
    return data.with_entries(
        {
            "unloaded_gap": (
                ("strip", "x")[-np.ndim(gap) :],
                np.asarray(gap),
                _variable_attributes("unloaded_gap"),
            )
        }
    )


def add_faces(data: Contents, faces) -> Contents:
    """Add the patches of all interfaces, frame by frame, to the contents of a file.

    faces: list of `runs.patch.faces.Face`. The number at the end of a name is that of the
    interface, from 1.
    """
    variables = {}
    coordinates = {}
    for face in faces:
        number = face.number + 1
        surface = face.surface
        contents = run_contents({}, None, face.fields, surface.x, surface.weight)
        frame = "frame" if face.fields["time"].size > 1 else "frame_at_rest"
        renamed = {"x": f"x_{number}", "frame": frame}
        for source, target, suffix in (
            (contents.variables, variables, f"_{number}"),
            (contents.coordinates, coordinates, ""),
        ):
            for name, (dimensions, *content) in source.items():
                dimensions = (dimensions,) if isinstance(dimensions, str) else dimensions
                name = {"x": renamed["x"], "frame_time": f"{frame}_time"}.get(
                    name, f"{name}{suffix}"
                )
                target[name] = (tuple(renamed[dimension] for dimension in dimensions), *content)
    return data.with_entries(variables, coordinates)


EDGE_PEAK = (
    "how far wear_pressure_peak stands above all pressures more than two nodes inside the contact, where it "
    "is that of a node at the edge of the contact, else 0; such a peak has an error of this size"
)


def add_wear(data: Contents, history: dict, units: dict) -> Contents:
    """Add the measures over the wear cycles to the contents of a file.

    Parameters
    ----------
    data : Contents
    history : dict
        Name -> (j,), with `cycle`.
    units : dict
        Unit by name.
    """
    variables = {
        f"wear_{name}": (
            "wear_cycle",
            values,
            {"units": units[name], "long_name": name.replace("_", " ")},
        )
        for name, values in history.items()
        if name in units
    }
    if (edge_peaks := history.get("pressure_peak_at_edge")) is not None:
        variables["wear_pressure_peak_at_edge"] = (
            "wear_cycle",
            edge_peaks,
            {"units": "Pa", "long_name": EDGE_PEAK},
        )
    count = {"units": "1", "long_name": "cycles of wear so far"}
    return data.with_entries(variables, {"wear_cycle": ("wear_cycle", history["cycle"], count)})


def _variable_attributes(name: str, dimensions: int = 1) -> dict:
    """Return unit and description of a variable."""
    unit, text = VARIABLES[name]
    if dimensions == 2 and name in INTERFACE_DESCRIPTIONS:
        text = INTERFACE_DESCRIPTIONS[name]
    return {"units": unit, "long_name": text}


def add_provenance(data: Contents, summary: dict, scene_text: str, versions: dict) -> Contents:
    """Add program, scene, outcome, measures and versions to the contents of a file.

    It names neither host nor path.

    Parameters
    ----------
    data : Contents
    summary : dict
        Content of summary.json.
    scene_text : str
        Text of the resolved scene.
    versions : dict
        Package -> version.
    """
    return data.with_entries(
        attributes={
            "Conventions": "CF-1.11",
            "title": summary["title"],
            "source": f"patchfem {summary['patchfem']}",
            "outcome": summary["outcome"],
            "scene": scene_text,
            "scene_sha256": hashlib.sha256(scene_text.encode()).hexdigest(),
            "summary": json.dumps(
                {k: summary[k] for k in ("kind", "measures", "warnings")}, ensure_ascii=False
            ),
            "versions": json.dumps(versions),
        }
    )


def write_netcdf(data: Contents, path: Path) -> None:
    """Write contents as a netCDF4 file.

    A file is created in memory, so that a full disk gives one OSError and leaves nothing open. A
    file with more than MAX_VALUES_IN_MEMORY numbers is created on disk; errors of writing are raised when it is
    closed.
    """
    path = Path(path)
    size = sum(np.size(variable[1]) for variable in (data.variables | data.coordinates).values())
    if size > MAX_VALUES_IN_MEMORY:
        with (
            write_atomically(path) as partial,
            open_lossy(partial) as opened,
            _CachingFile(opened, "w", track_order=True, rdcc_nbytes=CACHE_BYTES) as file,
        ):
            _write_file(file, data)
        return
    with _CachingFile(
        path.name, "w", driver="core", backing_store=False, track_order=True
    ) as memory:
        _write_file(memory, data)
        memory.flush()
        image = memory.id.get_file_image()
    write_bytes(path, image)


def _write_file(opened: h5py.File, data: Contents) -> None:
    """Write contents into an open HDF5 file."""
    with h5netcdf.File(opened, "w") as file:
        file.attrs.update(data.attributes)
        _write_variables(file, data)


class _CachingFile(h5py.File):
    """HDF5 file that opens each of its objects only once.

    h5netcdf opens an object again whenever it needs one of its properties, 680 times for 26
    variables, which took half of the time of writing them.
    """

    def __init__(self, *arguments, **options):
        self.known = {}
        super().__init__(*arguments, **options)

    def __getitem__(self, name):
        if name == "/":
            return self
        if not isinstance(name, str):
            return super().__getitem__(name)
        if name not in self.known:
            self.known[name] = super().__getitem__(name)
        return self.known[name]

    def __delitem__(self, name):
        # A coordinate variable replaces the dimension of the same name.
        self.known = {
            path: item for path, item in self.known.items() if path.strip("/") != name.strip("/")
        }
        super().__delitem__(name)


def _write_variables(file, data: Contents) -> None:
    """Write variables and coordinates into an open HDF5 file.

    Coordinates that are not a dimension are named by the variables that have them.
    """
    contents = {
        name: ((dims,) if isinstance(dims, str) else tuple(dims), values, attributes)
        for name, (dims, values, attributes) in (data.variables | data.coordinates).items()
    }
    dimensions_of = {
        name: set(contents[name][0]) for name in data.coordinates if contents[name][0] != (name,)
    }
    for dims, values, _ in contents.values():
        sizes = dict(zip(dims, np.shape(values)))
        file.dimensions.update(
            {name: size for name, size in sizes.items() if name not in file.dimensions}
        )
    for name, (dims, values, attributes) in contents.items():
        values = np.asarray(values)
        coordinates = [
            coordinate
            for coordinate, own_dimensions in dimensions_of.items()
            if name in data.variables and own_dimensions <= set(dims)
        ]
        options = {"fillvalue": np.nan} if values.dtype.kind == "f" else {}
        if name in data.variables and values.ndim and values.size:
            options |= {"compression": "gzip", "compression_opts": 1}
        texts = values.dtype.kind in "UO"
        variable = file.create_variable(
            name, dims, h5py.string_dtype() if texts else values.dtype, **options
        )
        variable[...] = values.astype(object) if texts else values
        variable.attrs.update(
            attributes | ({"coordinates": " ".join(coordinates)} if coordinates else {})
        )
