"""Named failures: what went wrong, as a sentence for a person, with the exit code of the command line."""


class PatchfemError(Exception):
    """A named failure that a person can act on; `code` is the exit code of the command line.

    key: the key of the scene at fault. `model.source.locate_errors` adds its file and line. "" stands for the
    scene as a whole, None where the text says it all.
    """

    code = 2

    def __init__(self, text: str = "", key: str | None = None):
        super().__init__(text)
        self.key = key


class NotConverged(PatchfemError):
    """A numerical method missed its residual after every fallback.

    partial_result: what a run had computed before, as a Result marked not_converged; None for nothing.
    """

    code = 3
    partial_result = None


class Missing(PatchfemError):
    """A file, package or resource is missing or ran out."""

    code = 4
