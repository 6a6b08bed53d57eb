"""What a pass of a bench is told from outside, and what it tells."""

from dataclasses import dataclass

BLOCK = 4096  # samples between two words of progress; what it costs to enter compiled code is lost in it


@dataclass(frozen=True, slots=True)
class Watch:
    """What a pass is told from outside. choice: how bonds are summed, None to choose; say: called with one line when
    something compiles; progress: called with the done share; springs: function of the (stiffness, yield slide) of the
    elements of partial slip -> those that move, None: they do."""

    choice: object = None
    say: object = None
    progress: object = None
    springs: object = None

    def tell(self, share: float) -> None:
        """Pass the done share (0 to 1) on to `progress`, if there is one."""
        if self.progress is not None:
            self.progress(share)


UNWATCHED = Watch()
