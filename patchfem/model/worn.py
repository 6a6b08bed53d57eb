"""The worn depth at the end of an earlier run, from which a run with [wear] goes on."""

import json
import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..core import PatchfemError, say
from ..scene.keys.tables import Tables
from ..scene.text import format_toml

KEY = "wear.start"
# of [contact]; no surface
LOADING = (
    "load",
    "approach",
    "holder",
    "shear",
    "element_size",
    "load_line",
    "plane",
)
# of [contact]: put together anew or read from a file, and seen in the gap
SURFACES = (
    "tilt",
    "profile",
    "mesh",
)
SAME = 1e-2  # of the largest difference of a gap, by which the gaps of one patch on two meshes may differ
FLAT = 1e-12  # m, below which gaps do not differ
UNREADABLE = OSError, KeyError, ValueError, TypeError, IndexError, RuntimeError, AttributeError


@dataclass(frozen=True, eq=False, slots=True)
class WornBefore:
    """The end of an earlier run.

    depth (k,) [m] worn off both pieces and gap (k,) [m] of their unworn surfaces at x (k,) [m]; cycles: how many wore
    them; scene: of that run, as tables; measures: of that run, name -> value, error and more.
    """

    path: Path
    x: np.ndarray
    depth: np.ndarray
    gap: np.ndarray
    cycles: float
    scene: dict
    measures: dict

    @property
    def sentence(self) -> str:
        """What the run goes on from."""
        asked, cycles = float(self.scene["wear"]["cycles"]), f"{self.cycles:.6g}"
        if self.cycles < asked * (1 - 1e-9):
            cycles += f" of {asked:.6g}"
        return (
            f"continues from {self.path.parent.name}/{self.path.name}, where up to "
            f"{say(float(self.depth.max()), 3)} was worn off in {cycles} cycles; the cycles of this run are "
            "counted from that state, but its worn_volume and worn_depth_max are measured from the unworn pieces"
        )

    def on(self, x) -> np.ndarray:
        """Worn depth (m,) [m] at x (m,) [m] of an interface; PatchfemError unless it is as long."""
        self._as_long(x[0], x[-1])
        return np.interp(x, self.x, self.depth)

    def refuse_others(self, x, gap) -> None:
        """PatchfemError unless the unworn surfaces leave the gap (m,) [m] at x (m,) [m], up to a straight line."""
        self._as_long(x[0], x[-1])
        off = np.interp(x, self.x, self.gap) - gap
        off = float(np.abs(off - np.polyval(np.polyfit(x, off, 1), x)).max())
        if off > SAME * float(np.ptp(gap)) + FLAT:
            raise PatchfemError(
                f"{self.path}: the unworn surfaces of that run differ from those of this scene by "
                f"{say(off, 3)}; choose a run of the same pieces, and elements of the same length if "
                "the surfaces are rough",
                KEY,
            )

    def missing(self, name: str, value: float) -> float | None:
        """Error of a measure of wear at the end of that run, and how far `value`, found of its depth on another mesh,
        is off; None where that run has no error."""
        found = self.measures.get(name, {"error": None})
        return None if found["error"] is None else found["error"] + abs(found["value"] - value)

    def _as_long(self, first: float, last: float) -> None:
        if not np.allclose(self.x[[0, -1]], (first, last), rtol=1e-6, atol=0):
            raise PatchfemError(
                f"{self.path}: the interface of that run is {say(float(np.ptp(self.x)))} long, but "
                f"that of this scene {say(last - first)}; choose a run of the same pieces",
                KEY,
            )


def read(path: Path) -> WornBefore:
    """The end of the run in a result.nc; PatchfemError where it is none with [wear] over a patch."""
    import h5py

    try:
        with h5py.File(path, "r") as file:
            x, gap, cycles = (
                np.array(file[name], float) for name in ("x", "unloaded_gap", "wear_cycle")
            )
            depth = np.array(file["worn_depth"][-1], float)
            scene, measures = (
                tomllib.loads(file.attrs["scene"]),
                json.loads(file.attrs["summary"])["measures"],
            )
        strips = "strips" in scene["contact"]
        row = all(
            one.ndim == 1 and one.shape == x.shape and np.isfinite(one).all()
            for one in (x, depth, gap)
        )
        found = WornBefore(path, x, depth, gap - depth, float(cycles[-1]), scene, measures)
        right = (
            row
            and x.size > 1
            and (np.diff(x) > 0).all()
            and depth.min() >= 0
            and bool(found.sentence)
        )
    except UNREADABLE:
        raise PatchfemError(
            f"{path}: not the result.nc of a run with [wear] and [contact]; give such a file", KEY
        ) from None
    if strips:
        raise PatchfemError(
            f"{path}: that run has strips, and wear of strips cannot be continued yet; choose a run "
            "without [contact.strips]",
            KEY,
        )
    if not right:
        raise PatchfemError(
            f"{path}: the worn depth in this file is not a list of depths along a patch; run that "
            "scene again",
            KEY,
        )
    return found


def of_pieces(path: Path, tables: Tables) -> WornBefore:
    """The end of the run in a result.nc; PatchfemError unless it wore the pieces of a scene's tables."""
    found, here = read(path), tomllib.loads(format_toml(tables))
    one, two = (
        {key: value for key, value in each["contact"].items() if key not in (*LOADING, *SURFACES)}
        | {"wear.upper_share": each["wear"]["upper_share"]}
        for each in (found.scene, here)
    )
    unlike = [
        key if "." in key else f"contact.{key}"
        for key in {**one, **two}
        if one.get(key) != two.get(key)
    ]
    if unlike:
        raise PatchfemError(
            f"{path}: the pieces of that run are not those of this scene ({', '.join(unlike)} differ); "
            "choose a run of the same pieces",
            KEY,
        )
    return found
