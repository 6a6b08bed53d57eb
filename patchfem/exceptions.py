"""Exceptions with messages for the user, and their exit codes on the command line."""


class PatchfemError(Exception):
    """Error that the user can correct.

    The class attribute `code` is the exit code of the command line.

    Parameters
    ----------
    text : str
        Message that describes the problem, its cause and a solution.
    key : str or None
        Scene key that causes the error; `model.source.locate_errors` adds its file and line to the message. "" denotes
        the whole scene, and None a message without a location.
    """

    code = 2

    def __init__(self, text: str = "", key: str | None = None):
        super().__init__(text)
        self.key = key


class UnresolvedTrace(PatchfemError):
    """Error for a surface trace with wavelengths too short for the elements."""


class NotConverged(PatchfemError):
    """Error for a numerical method that does not converge, including all fallbacks.

    The attribute `partial_result` is the result up to this point, with the outcome `not_converged`, or None.
    """

    code = 3
    partial_result = None


class Missing(PatchfemError):
    """Error for a missing file or package, or an exhausted resource."""

    code = 4
