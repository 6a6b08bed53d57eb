"""Exceptions that tell the user what went wrong, with the exit codes of the command line."""


class PatchfemError(Exception):
    """Error that the user can act on.

    The class attribute `code` is the exit code of the command line.

    Parameters
    ----------
    text : str
        Message: what is wrong, why, and what to change.
    key : str or None
        Key of the scene at fault; `model.source.locate_errors` adds its file and line to the text. "" stands for the
        scene as a whole, None for a text that needs no place.
    """

    code = 2

    def __init__(self, text: str = "", key: str | None = None):
        super().__init__(text)
        self.key = key


class UnresolvedTrace(PatchfemError):
    """Error of a trace with waves that are too short for the elements."""


class NotConverged(PatchfemError):
    """Error of a numerical method that misses its residual, also with every fallback.

    The attribute `partial_result` is what the run computed before, with the outcome `not_converged`, or None.
    """

    code = 3
    partial_result = None


class Missing(PatchfemError):
    """Error of a file or package that is missing, or of a resource that is used up."""

    code = 4
