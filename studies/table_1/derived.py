"""Rungs of which a free number is no key of a scene: rods in series with the flexure, and friction that follows wear.

A `Number` stands beside the ranges of a fit; `Derived` asks a scene with what is made of such numbers. `Worn` computes
the rows of the table one after the other, on the pieces as the rows before wore them.
"""

from dataclasses import dataclass, replace
from math import pi

import numpy as np

from patchfem.campaigns.rows.condition_models import ConditionModels
from patchfem.campaigns.rows.model_readings import ModelReadings
from patchfem.core import frozen_array
from patchfem.model import build
from patchfem.scene.scene import add_sets

MASS = 1.19396625  # [kg] mass of the block in all scenes
AXIAL = 143.0  # [Hz] axial mode in all scenes
COEFFICIENT = 1e-14  # [m^2/N] wear coefficient, assumed as in studies/report/repeats.py
AREA = 0.0127**2  # [m^2] area of the patch
MINUTES = 10  # [min] duration of each level, assumed as in studies/report/repeats.py
DEPTH = 1e-6  # [m] worn depth at which friction has changed by the factor of `Worn`
BOND = 0.243e-6  # [m] elastic displacement of the contact point before it slips


@dataclass(frozen=True, slots=True)
class Number:
    """Free number with its range that is not a key of the scene; it is used in place of a Range."""

    key: str
    low: float
    high: float
    kind: None = None
    unit: str = "1"


class FitRequest:
    """Question to a fit of a rig: scene, ranges of its free keys, and file of the measured responses."""

    def __init__(self, scene, ranges, measured):
        self.scene = scene
        self.ranges = ranges
        self.measured = measured

    def make_condition_models(self, conditions, *sets: str) -> ConditionModels:
        """Return the rig models at conditions (c, 2), with additional --set strings."""
        return ConditionModels(add_sets(self.scene, sets), conditions, self.ranges, self.measured)


class Derived(FitRequest):
    """Question whose last numbers together become --set strings: derive(*numbers) -> strings."""

    def __init__(self, scene, wanted, measured, derive):
        super().__init__(scene, wanted, measured)
        self.derive = derive

    def make_condition_models(self, conditions, *sets: str) -> ConditionModels:
        return DerivedAsked(self.scene, conditions, self.ranges, self.measured, self.derive)


class DerivedAsked(ConditionModels):
    """Conditions of a Derived question."""

    def __init__(self, scene, conditions, wanted, measured, derive):
        super().__init__(scene, conditions, wanted, measured)
        self.derive = derive

    def strings(self, values) -> list:
        """Return the --set strings of values (n,)."""
        keys = [k for k in self.model_parameters if not isinstance(self.ranges[k], Number)]
        numbers = [float(values[k]) for k in self.model_parameters if k not in keys]
        return [
            *(self.ranges[k].format_assignment(values[k]) for k in keys),
            *(self.derive(*numbers) if self.derive else ()),
        ]

    def build_model(self, values):
        return build(self.base.override(self.strings(values)))


def rods(share: float, mass: float) -> list:
    """Return the --set strings of a block on rods in series with the flexures that carry the strain gauge.

    share: of the static compliance that the rods have; mass: at the tip of the flexures, over that of the block. The
    first mode stays at 143 Hz; the gage reads the tip, by the factor of a static test. Modes have the mass of both, so
    that the squares of their shares of the base motion sum to 1.
    """
    flexure = 1 / (1 - share)
    rod = 1 / share
    root = np.sqrt([1.0, mass])
    stiffness = np.array([[rod, -rod], [-rod, rod + flexure]]) / np.outer(root, root)
    square, turned = np.linalg.eigh(stiffness)
    shapes = turned / root[:, None] * np.sqrt(1 + mass)  # shape (2, 2): block and tip, modes
    shapes *= np.sign(shapes[0])
    base = (shapes[0] + mass * shapes[1]) / (1 + mass) * (1 - 1e-12)
    out = [f"structure.moving_mass={MASS * (1 + mass)!r} kg"]
    for k, name in enumerate(("axial", "rods")):
        frequency = AXIAL * float(np.sqrt(square[k] / square[0]))
        numbers = {
            "slide": shapes[0, k],
            "base": base[k],
            "accelerometer": shapes[0, k],
            "gauge": shapes[1, k] / (1 - share),
        }
        out += [
            f"structure.mode.{name}.frequency={frequency!r} Hz",
            *(f"structure.mode.{name}.{key}={float(value)!r}" for key, value in numbers.items()),
        ]
    return out


def by_row(cells):
    """Return cells for which every row of the table, in the order of the print, is a separate condition."""
    conditions = np.array([(row.frequency, row.input) for row in cells.rows])
    return replace(
        cells, conditions=frozen_array(conditions), condition=frozen_array(cells.row, np.int64)
    )


class Worn(ModelReadings):
    """Computed conditions of a Derived question: the rows of the table in the order in which they were run.

    The friction of a row is that of new pieces times 1 + (factor - 1) depth/DEPTH, `factor` the last value: as
    [wear.friction] has it between two rows of its table. Depth: COEFFICIENT times the mean pressure times the path of
    the rows before, four times their amplitude less the stretch of the point, for MINUTES at each.
    """

    def _compute_readings(self, values, conditions) -> dict:
        first = float(values[0])
        depth = 0.0
        found = {}
        load = self.models.scene.normal.load
        for row in range(max(conditions) + 1):
            static = first * max(1 + (values[-1] - 1) * depth / DEPTH, 0.05)
            found |= super()._compute_readings([static, *values[1:]], [row])
            swing = found[row][1]
            cycles = self.models.rigs[row].drive.signal.omega / (2 * pi) * 60 * MINUTES
            depth += COEFFICIENT * load / AREA * 4 * max(min(swing, 1e-3) - BOND, 0.0) * cycles
        return found
