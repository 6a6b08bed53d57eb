"""Law `grooves` with a reference speed, so that an interface has a displacement under any force."""

from .grooves import force_and_rates, switch, write_margins

__all__ = ["RIGID", "force_and_rates", "switch", "write_margins"]

RIGID = False
