"""The verb that attacks the program itself; it is for those who change the program and stands in no help."""

import sys
from collections.abc import Callable

from .shared import Ended, Refused, say, word


def torture_of(command: Callable) -> Callable:
    """The verb; command: words -> exit code, what the command line itself would do with them in this process."""
    def torture(*, share: float = 0.02, campaign: word("one campaign, or several with commas") = "", seed: int = 1,
                only: int | None = None):
        """Attack this installation with seeded scenes, files, kills and limits; exit code 3 where something gave way.

        Example: patchfem torture --share 0.001 --campaign grammar
        """
        from ..torture.driver import CAMPAIGNS, table
        from ..torture.driver import torture as run

        names = campaign.split(",") if campaign else list(CAMPAIGNS)
        if unknown := [name for name in names if name not in CAMPAIGNS]:
            raise Refused(f"torture --campaign {unknown[0]}: one of {', '.join(CAMPAIGNS)}")
        if not 0 < share <= 1:
            raise Refused(f"torture --share {share}: above 0 and up to 1 is wanted")
        if only is not None and (len(names) != 1 or only < 0):
            raise Refused("torture --only N: the place of one trial in one --campaign, from 0 on")
        if sys.platform == "win32":
            say("torture: needs a system on which a process can fork, as Linux and macOS")
            raise Ended(4)
        rows = run(command, share, names, seed, only, say)
        print(table(rows), flush=True)
        if any(row.faults for row in rows):
            raise Ended(3)

    return torture
