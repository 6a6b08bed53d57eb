"""Normal contact of a patch whose pressure changes with the motion, for the march (compiled)."""

from ..contact.press_kernels import compute_energy, find_set, press_state
from ..contact.press_path_kernels import path_mean

__all__ = ["compute_energy", "find_set", "path_mean", "press_state"]
