"""Wear over many cycles as [wear] describes it, and the worn depth at the end of an earlier run, in SI units."""

from __future__ import annotations

import json
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..core import PatchfemError, array_dataclass, max_abs
from ..formatting import format_length
from ..scene.keys.tables import Friction, Tables
from ..scene.scene import Scene
from ..scene.text import format_toml

WEAR_START_KEY = "wear.start"
# Keys of [contact] that may differ between two runs because they do not describe the surfaces.
LOADING_KEYS = (
    "load",
    "approach",
    "holder",
    "shear",
    "element_size",
    "load_line",
    "plane",
)
# Largest difference between the gaps of one patch on two meshes, relative to the range of the gap.
GAP_DIFFERENCE_FRACTION = 1e-2


@array_dataclass
class EarlierWear:
    """State at the end of an earlier run with wear.

    - path: file of the results.
    - axes: positions [m] of the nodes along the interface, (x,), or of the rows and columns of cells of a face, (y, x).
    - depth: depth [m] worn off both pieces, over the axes.
    - gap: gap [m] between the unworn surfaces, over the axes.
    - cycles: number of cycles until then.
    - scene: tables of the scene of that run.
    - measures: measures of that run by name, each with value and error.
    """

    path: Path
    axes: tuple[np.ndarray, ...]
    depth: np.ndarray
    gap: np.ndarray
    cycles: float
    scene: dict[str, dict[str, Any]]
    measures: dict[str, dict[str, float | None]]

    @property
    def sentence(self) -> str:
        """Sentence that tells the user from which state the run continues."""
        return (
            f"continues from {self.path.parent.name}/{self.path.name}, where up to "
            f"{format_length(float(self.depth.max()), 3)} was worn off in {self.cycles:.6g} cycles; the cycles of this "
            "run are counted from that state, but its worn_volume and worn_depth_max are measured from the unworn pieces"
        )

    def depth_at(self, axes) -> np.ndarray:
        """Interpolate the worn depth to the nodes (m,) [m] of other axes on the same interface."""
        return np.maximum(interpolate_nodes(self.axes, self.depth, axes), 0.0)

    def require_same_surfaces(self, axes, gap) -> None:
        """Raise PatchfemError unless the unworn gap of the earlier run equals `gap` (m,) [m] at the nodes of other axes.

        A plane may be added to the gap, because the pieces may be tilted.
        """
        change = interpolate_nodes(self.axes, self.gap, axes) - gap
        plane = np.column_stack([np.ones(gap.size), _list_places(axes)])
        change = max_abs(change - plane @ np.linalg.lstsq(plane, change)[0])
        # Difference between gaps [m] below which it is round-off
        if change > GAP_DIFFERENCE_FRACTION * float(np.ptp(gap)) + 1e-12:
            raise PatchfemError(
                f"{self.path}: the unworn surfaces of that run differ from those of this scene by "
                f"{format_length(change, 3)}; choose a run of the same pieces, and elements of the same length if "
                "the surfaces are rough",
                WEAR_START_KEY,
            )

    def measure_error(self, name: str, value: float) -> float | None:
        """Return the error of a wear measure at the end of the earlier run, or None if it is not known.

        `name` is that of the measure, and `value` its value on the mesh of this run. Its difference from that of the
        earlier run is added to the error of the latter.
        """
        measure = self.measures.get(name, {"error": None})
        if measure["error"] is None:
            return None
        return measure["error"] + abs(measure["value"] - value)


def interpolate_nodes(axes, values, others) -> np.ndarray:
    """Interpolate values at the nodes of axes linearly to the nodes (m,) of other axes.

    Parameters
    ----------
    axes, others : tuple of (k,) array
        Positions [m] of nodes, (x,), or of the rows and columns of cells of a face, (y, x).
    values : array
        Values at all nodes, in any unit.
    """
    if len(axes) == 1:
        return np.interp(others[0], axes[0], values)
    from scipy.interpolate import RegularGridInterpolator

    # The outer cells of a finer grid lie beyond those of a coarser one.
    values = values.reshape([axis.size for axis in axes])
    field = RegularGridInterpolator(axes, values, bounds_error=False, fill_value=None)
    return field(_list_places(others))


def _list_places(axes) -> np.ndarray:
    """Return the places (m, d) [m] of the nodes of d axes, row by row."""
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))


def read_end_state(path: Path) -> EarlierWear:
    """Read the state at the end of an earlier run from its result.nc.

    Parameters
    ----------
    path : Path
        Output file of the earlier run.

    Returns
    -------
    EarlierWear

    Raises
    ------
    PatchfemError
        If the file is not that of a run with [wear] of a patch.
    """
    import h5py

    # Depth and gap are per node or cell of the earlier mesh. The gap in the file is that of the worn pieces.
    try:
        with h5py.File(path, "r") as file:
            depth = np.array(file["worn_depth"][-1], float)
            earlier = EarlierWear(
                path=path,
                axes=tuple(np.array(file[name], float) for name in "yx"[-depth.ndim :]),
                depth=depth,
                gap=np.array(file["unloaded_gap"], float) - depth,
                cycles=float(np.array(file["wear_cycle"], float)[-1]),
                scene=tomllib.loads(file.attrs["scene"]),
                measures=json.loads(file.attrs["measures"]),
            )
        is_usable = _has_depth_over_axes(earlier) and "cycles" in earlier.scene["wear"]
    # Exceptions of h5py, json and tomllib for a file of another kind
    except (OSError, KeyError, ValueError, TypeError, IndexError, RuntimeError, AttributeError):
        raise PatchfemError(
            f"{path}: not the result.nc of a run with [wear] and [contact]; give such a file",
            WEAR_START_KEY,
        ) from None

    # What the file has but this run cannot use.
    if not is_usable:
        raise PatchfemError(
            f"{path}: the worn depth in this file does not fit the nodes of a patch; run that scene again",
            WEAR_START_KEY,
        )
    return earlier


def _has_depth_over_axes(earlier: EarlierWear) -> bool:
    """Return whether positions, depth and gap of an earlier run are finite and fit together.

    Depth and gap must have one number per node, in which positions increase and no depth is negative.
    """
    shape = tuple(axis.size for axis in earlier.axes)
    for values in (earlier.depth, earlier.gap):
        if values.shape != shape or not np.isfinite(values).all():
            return False
    if min(shape) < 2 or earlier.depth.min() < 0:
        return False
    return all((np.diff(axis) > 0).all() for axis in earlier.axes)


def read_earlier_wear(path: Path, tables: Tables) -> EarlierWear:
    """Read the state at the end of an earlier run from its result.nc file `path`.

    Raises PatchfemError unless that run has the pieces of the scene with these `tables`.
    """
    earlier = read_end_state(path)
    pieces_before = _describe_pieces(earlier.scene)
    pieces_now = _describe_pieces(tomllib.loads(format_toml(tables)))
    different_keys = [
        key
        for key in {**pieces_before, **pieces_now}
        if pieces_before.get(key) != pieces_now.get(key)
    ]
    if different_keys:
        raise PatchfemError(
            f"{path}: the pieces of that run are not those of this scene ({', '.join(different_keys)} "
            "differ); choose a run of the same pieces",
            WEAR_START_KEY,
        )
    return earlier


def _describe_pieces(scene: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """Return the scene keys, with their values, that describe the pieces that wear."""
    pieces = {
        f"contact.{key}": value
        for key, value in scene["contact"].items()
        # Shapes may be written differently; the gap shows whether the surfaces are the same
        if key not in (*LOADING_KEYS, "tilt", "profile", "mesh", "mesh_unit")
    }
    # Paths are relative to the folder of each run.
    for key, names in (("contact.area", ("cells",)), ("contact.asperities", ("from", "heights"))):
        if key in pieces:
            pieces[key] = pieces[key] | dict.fromkeys(names)
    return pieces | {"wear.upper_share": scene["wear"]["upper_share"]}


@dataclass(frozen=True, slots=True)
class FrictionOverWear:
    """Factors by which friction parameters change with the mean wear depth.

    They are linear between their rows and constant beyond the last row.

    - depth: mean worn depth (k,) [m] of each row, rising from 0: the worn volume of both pieces over
      the area of the patch.
    - coefficient: factors (k,) on the static and the kinetic coefficient, or None.
    - bond_length: factors (k,) on the bond length, or None.
    """

    depth: tuple[float, ...]
    coefficient: tuple[float, ...] | None
    bond_length: tuple[float, ...] | None

    def compute_worn_law(self, law: Friction, depth: float) -> Friction:
        """Return a friction law whose parameters are changed for a mean worn depth [m]."""
        factors = {
            "static": self.coefficient,
            "kinetic": self.coefficient,
            "bond_length": self.bond_length,
        }
        changes = {}
        for name, factor in factors.items():
            value = getattr(law, name)
            if factor is not None and value is not None:
                changes[name] = value * float(np.interp(depth, self.depth, factor))
        return law.model_copy(update=changes)


@dataclass(frozen=True, slots=True)
class WearModel:
    """Wear over many cycles.

    - coefficient: volume worn off both pieces per load and slip path, or per friction work [m2/N].
    - cycles: number of cycles.
    - jumps: number of equal jumps, None if they are chosen automatically.
    - upper_share: fraction of the worn depth that the upper piece loses.
    - uses_friction_work: whether the volume follows the friction work in place of load and slip path.
    - friction: change of the friction law with wear, or None.
    - start: wear of an earlier run from which this one continues, None for new pieces.
    """

    coefficient: float
    cycles: float
    jumps: int | None
    upper_share: float
    uses_friction_work: bool
    friction: FrictionOverWear | None = None
    start: EarlierWear | None = None

    def compute_earlier_depth(self, axes, area) -> np.ndarray:
        """Return the depth [m] worn before the first cycle at the nodes of axes, distributed like `area`."""
        return np.zeros(np.shape(area)) if self.start is None else self.start.depth_at(axes)


def build_wear_model(scene: Scene) -> WearModel:
    """Build the wear model of a scene with [wear]."""
    wear = scene.wear
    friction = start = None
    if wear.friction is not None:
        table = wear.friction
        friction = FrictionOverWear(table.depth, table.coefficient_factor, table.bond_length_factor)
    if wear.start is not None:
        start = read_earlier_wear(scene.resolve_path(wear.start), scene.tables())
    return WearModel(
        coefficient=wear.coefficient,
        cycles=wear.cycles,
        jumps=None if wear.jumps == "auto" else wear.jumps,
        upper_share=wear.upper_share,
        uses_friction_work=wear.form == "energy",
        friction=friction,
        start=start,
    )
