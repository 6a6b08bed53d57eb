"""Materials known by name, with the sources of Young's modulus and the other properties."""

from __future__ import annotations

from typing import NamedTuple


class ElasticProperties(NamedTuple):
    """Isotropic elastic constants and density of one material, with the source of the numbers."""

    young: float
    poisson: float
    density: float
    source: str


MATERIALS: dict[str, ElasticProperties] = {
    "Ti-8Al-1Mo-1V": ElasticProperties(
        121e9, 0.32, 4370.0, "Handbook values of the mill-annealed near-alpha alloy at 20 degC."
    ),
    "WC-Co": ElasticProperties(
        250e9,
        0.24,
        14500.0,
        "Assumed value for a sprayed coating: pores and splat boundaries reduce Young's modulus "
        "from 600 GPa (sintered) to 200-350 GPa.",
    ),
    "WC-Co sintered": ElasticProperties(
        600e9, 0.22, 14900.0, "Handbook values of the dense cermet with about 6 % cobalt."
    ),
    "steel": ElasticProperties(
        210e9, 0.30, 7850.0, "Handbook values of plain carbon steel at 20 degC."
    ),
    "stainless steel": ElasticProperties(
        193e9, 0.29, 8000.0, "Handbook values of austenitic steel 304 at 20 degC."
    ),
    "cast iron": ElasticProperties(
        110e9,
        0.26,
        7200.0,
        "Handbook values of grey cast iron; Young's modulus is near the middle "
        "of the range 66-140 GPa of the grades.",
    ),
    "aluminium": ElasticProperties(69e9, 0.33, 2700.0, "Handbook values of alloy 6061 at 20 degC."),
    "bronze": ElasticProperties(
        110e9,
        0.34,
        8800.0,
        "Handbook values of tin bronze; Young's modulus is about 100-115 GPa, "
        "depending on the alloy.",
    ),
    "alumina": ElasticProperties(
        370e9, 0.22, 3900.0, "Handbook values of dense sintered ceramic with 99.5 % Al2O3."
    ),
    "PTFE": ElasticProperties(
        0.5e9,
        0.46,
        2200.0,
        "Handbook values of the unfilled polymer at 20 degC; Young's modulus is "
        "0.4-0.6 GPa; this material creeps.",
    ),
}


class YieldStrength(NamedTuple):
    """Yield strength in tension [Pa] at 20 degC, with the source of the number."""

    strength: float
    source: str


YIELD_STRENGTHS: dict[str, YieldStrength] = {
    "Ti-8Al-1Mo-1V": YieldStrength(
        930e6,
        "MatWeb MTA816: value after annealing for 8 h at 790 degC; the specified minimum "
        "is 828 MPa.",
    ),
    "steel": YieldStrength(
        235e6,
        "EN 10025-2: minimum yield strength of S235 (up to 16 mm thick), the common grade with "
        "the lowest strength.",
    ),
    "stainless steel": YieldStrength(
        205e6, "ASTM A240: minimum yield strength of annealed 304; a typical value is 310 MPa."
    ),
    "aluminium": YieldStrength(240e6, "ASTM B209: minimum yield strength of 6061-T6."),
}


class ThermalProperties(NamedTuple):
    """Thermal conductivity [W m-1 K-1] and heat capacity [J kg-1 K-1] near 20 degC, with the source of the numbers."""

    conductivity: float
    heat_capacity: float
    source: str


THERMAL_PROPERTIES: dict[str, ThermalProperties] = {
    "Ti-8Al-1Mo-1V": ThermalProperties(
        7.0, 526.0, "Handbook values of the alloy; the volumetric heat capacity is 2.3e6 J/m3/K."
    ),
    "steel": ThermalProperties(50.0, 490.0, "Handbook values of plain carbon steel."),
}
