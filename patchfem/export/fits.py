"""A fit as the command line and Python ask for it, of a loop, of rows, of a curve over the amplitude, of wear or of the
scene's own patch: its folder and its lines of text."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from pathlib import Path

from .. import scales
from ..campaigns import fit_decay as decays
from ..campaigns import wear_coefficient
from ..campaigns.fit import fit_loop
from ..campaigns.fit_decay import fit_decay, is_curve
from ..campaigns.fit_patch import fit_patch, slides_of
from ..campaigns.fit_path import LoopOptions
from ..campaigns.rows.asked import Question
from ..campaigns.rows.fit import RowsOptions, fit_rows
from ..campaigns.rows.search import UNSTABLE, Search
from ..core import PatchfemError
from ..disk.whole import write_text
from ..model.model import build
from ..scene import axes
from ..scene.ranges import ranges
from ..scene.scene import SceneError, loads
from . import fit as loop_lines
from . import fit_folder, fit_page, fitted_decay, fitted_patch, wear_fit
from . import fit_rows as written
from .results import PAGE, STARTS, Folder

LOOP, ROWS = ("offset", "warm_up"), ("leave_out", "seed", "unstable", "placebo", "resume")
STARTED = {"rows": 8, "curve": decays.STARTS}  # starts of a search, unless given
BELONG = {"hold": "fits to a loop under a prescribed slide "
                  "or to rows of a rig", **dict.fromkeys(LOOP, "fits to a loop under a prescribed slide"),
          "starts": "fits to rows of a rig or to its curve of frequency and damping against "
                    "amplitude", **dict.fromkeys(ROWS, "fits to rows of a rig"),
          "amplitudes": "fits with --from-patch"}


@dataclass(frozen=True, slots=True)
class Options:
    """What stands beside the free keys: `hold` of a loop and of rows, LOOP of a loop, ROWS of rows, `starts` of rows
    and of a curve (None: STARTED), `amplitudes` of the patch that stands in place of a measurement."""

    hold: tuple = ()
    offset: tuple = ()
    warm_up: bool = False
    leave_out: str = ""
    starts: int | None = None
    seed: int = 0
    unstable: str = UNSTABLE[0]
    placebo: tuple = ()
    resume: bool = False
    from_patch: bool = False
    amplitudes: str = ""

    def given(self) -> list:
        """Names of those that are not as they are by default."""
        return [one.name for one in fields(self) if getattr(self, one.name) != one.default]


@dataclass(frozen=True, slots=True)
class Heard:
    """Who hears of the work: say(line) and progress(share), or None; named(option): its name at this door."""

    say: Callable | None = None
    progress: Callable | None = None
    named: Callable = str


def fit_into(whole, to: str, free: Sequence[str], options: Options, target: Path, heard: Heard = Heard()) -> dict:
    """Fit the keys `free` ("table.key=low..high" texts) of a scene to what was measured, or laws of one point to its
    patch, and write the folder `target`, which is claimed before the work; the object of fit.json, in SI.

    SceneError and PatchfemError name bad input and options that this scene does not have, before anything is computed.
    """
    kind = "patch" if options.from_patch else kind_of(whole, to)
    _refuse(kind, options, heard.named)
    if options.from_patch == bool(to) or (options.from_patch and free):
        raise PatchfemError(f"{heard.named('to')} MEASURED and {heard.named('free')} KEYS are needed, or "
                            f"{heard.named('from_patch')} alone, which fits lumped laws to the scene's own patch")
    slides = slides_of(axes.lengths(options.amplitudes, heard.named("amplitudes")) if options.amplitudes else None)
    with Folder(target, options.resume) as folder:
        if folder.dropped and heard.say is not None:
            heard.say(folder.dropped)
        if kind == "patch":
            answer = fitted_patch.fit_into(fit_patch(whole, slides), folder)
        elif kind == "rows":
            answer = _of_rows(whole, Path(to), free, options, folder, heard)
        elif kind == "curve":
            answer = fitted_decay.fit_into(fit_decay(whole, Path(to), free, heard.say, options.starts or
                                                    STARTED[kind]), folder)
        elif kind == "loop":
            how = LoopOptions(options.offset, options.warm_up)
            answer = fit_folder.fit_into(fit_loop(whole, Path(to), free, options.hold, heard.say, how), folder)
        else:
            found = wear_coefficient.wear_coefficient(build(whole), to, free, heard.progress)
            text = loads(whole.text, whole.path, [*whole.sets, found.bounds.assigned(found.value)]).resolved()
            answer = wear_fit.fit_into(found, whole.title, text, folder)
        write_text(folder.path / PAGE, fit_page.page(answer, lines_of(answer), folder.path))
        return answer


def kind_of(whole, to: str) -> str:
    """What a scene is fitted to, by its tables and the file: "wear", "loop", "curve" or "rows"."""
    if whole.wear is not None:
        return "wear"
    return "loop" if whole.kind not in ("rig", "linear") else "curve" if is_curve(to) else "rows"


def _refuse(kind: str, options: Options, named: Callable) -> None:
    here = {"loop": ("hold", *LOOP), "rows": ("hold", "starts", *ROWS), "curve": ("starts",),
            "patch": ("from_patch", "amplitudes")}.get(kind, ())
    is_ = {"loop": "a bench", "rows": "a rig", "wear": "one with [wear]",
           "curve": "a rig, fitted to a curve of frequency and damping against amplitude", "patch": "fitted to its "
                                                                                                    "own patch"}[kind]
    others = [name for name in options.given() if name not in here]
    if others:
        belong = "; ".join(f"{named(name)} applies only to {BELONG[name]}" for name in others)
        raise PatchfemError(f"{belong}; this scene is {is_}; leave "
                            f"{'this option' if len(others) == 1 else 'these options'} out")
    for name, least in (("starts", 1), ("seed", 0)):
        value = getattr(options, name)
        if value is not None and (not isinstance(value, int) or value < least):
            wanted = "at least one is needed" if least else "a whole number >= 0 is needed"
            raise PatchfemError(f"{named(name)} {value}: {wanted}")
    if options.unstable not in UNSTABLE:
        raise PatchfemError(f"{named('unstable')} {options.unstable}: one of {', '.join(UNSTABLE)} is needed")


def _of_rows(whole, path: Path, free: Sequence[str], options: Options, folder: Folder, heard: Heard) -> dict:
    wanted, wrong = ranges(free)
    if wrong:
        raise SceneError(wrong)
    question = (whole.resolved(), free, options.hold, options.leave_out, options.placebo, options.seed,
                options.unstable, path.read_bytes() if path.is_file() else "")
    kept = written.Starts(folder.path / STARTS, question, options.resume)
    how = Search(options.starts or STARTED["rows"], options.seed, options.unstable, kept)
    asked = RowsOptions(options.hold, options.leave_out, options.placebo, how)
    found = fit_rows(Question(whole, wanted, path), asked, heard.say, heard.progress)
    return written.fit_into(found, folder.path, folder.target)


def lines_of(answer: dict) -> list:
    """The answer of any fit as lines of text; answer: the object of fit.json."""
    one = answer["values"].get(wear_coefficient.KEY)
    if one is None or "runs" not in answer:
        own = {"rows": written, "decay": fitted_decay, "patch": fitted_patch}
        return own.get(answer["quantity"], loop_lines).lines_of(answer)
    value, low, high = (scales.plain(number, 4) for number in (one["value"], *one["interval"]))
    return [f"{wear_coefficient.KEY} {value} {one['unit']}, {low} to {high} from the interval of {answer['quantity']}"]
