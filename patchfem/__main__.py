"""The command line. Nothing scientific is imported until a verb needs it."""

import os
import signal

signal.signal(signal.SIGINT, lambda *_: os._exit(130))  # until main() takes over, an interrupt just leaves

import json  # noqa: E402
import sys  # noqa: E402
from pathlib import Path  # noqa: E402
from typing import Annotated  # noqa: E402

from cyclopts import App, CycloptsError, Parameter  # noqa: E402

from . import __version__  # noqa: E402

signal.signal(signal.SIGINT, signal.default_int_handler)

app = App(name="patchfem", version=__version__, help_format="plaintext", suppress_keyboard_interrupt=False,
          help="Contact patches, nonlocal friction and the motion of the joint that rubs. Start: patchfem run SCENE.")
Sets = Annotated[tuple[str, ...], Parameter(name="--set", negative=(), help="table.key=value, may be repeated")]
NOT_BUILT = ("sweep", "profile", "compare", "report", "import", "demo", "new",
             "schema", "doctor", "cite")


def say(text: str) -> None:
    """One line on stderr."""
    print(text, file=sys.stderr, flush=True)


def _scene(path: Path, sets):
    from .scene.scene import load

    return load(path, sets)


def _model(path: Path, sets):
    from .model.model import build

    return build(_scene(path, sets))


@app.command
def check(scene: Path, /, *, set_: Sets = (), json_: Annotated[bool, Parameter(name="--json", negative=())] = False):
    """Name every mistake in SCENE and in the path it slides along; compute nothing."""
    found = _scene(scene, set_)
    if found.slide is not None and found.slide.file is not None:
        from .model.slide import slide_asked

        slide_asked(found)
    for remark in found.remarks:
        say(f"{scene}: {remark}")
    if json_:
        print(json.dumps({"kind": found.kind, "effects": found.named(), "remarks": found.remarks}))
    else:
        print(f"{scene}: a {found.kind} scene without mistakes")


@app.command
def plan(scene: Path, /, *, set_: Sets = (), json_: Annotated[bool, Parameter(name="--json", negative=())] = False,
         probe: Annotated[bool, Parameter(negative=())] = False):
    """Say what SCENE would run and not, its size, cost, stiffness chain and groups; --probe solves the static patch."""
    from .runs.plan import plan as make

    found = make(_scene(scene, set_))
    answer, asked = found.as_json(), found.model.patch
    if probe and asked is not None:
        from .model.source import placed
        from .runs.patch.ladder import solve_all
        from .runs.patch.values import values

        with placed(found.model.source):
            solved = values(solve_all(asked, found.model.accuracy.tolerance, False)[0])
        answer["stiffness_chain"]["pieces_shear"] = solved["tangential_stiffness"] if asked.shear else "rigid"
        answer["probe"] = solved
    if json_:
        print(json.dumps(answer))
        return
    _print_plan(answer, probe)


def _print_plan(answer: dict, probe: bool) -> None:
    print(f"kind     {answer['kind']}, engine {answer['engine']}")
    for effect in answer["effects"]:
        print(f"  runs   {effect['effect']:<28} {effect['equations']}")
    print(f"  not    {', '.join(answer['not_in_scene'])}")
    print("sizes    " + ", ".join(f"{k} {v}" for k, v in answer["unknowns"].items()) + f", steps {answer['steps']}")
    print(f"cost     about {answer['seconds']:.1f} s and {answer['bytes'] / 1e6:.0f} MB")
    print("chain    " + " -> ".join(f"{k} {v:.4g} N/m" if not isinstance(v, str) else f"{k} {v}"
                                   for k, v in answer["stiffness_chain"].items()))
    if not probe and not isinstance(answer["stiffness_chain"].get("pieces_shear", "rigid"), str):
        print("         pieces_shear is an upper estimate from the layers; --probe solves it")
    print("groups   " + ", ".join(f"{k} {v:.4g}" for k, v in answer["groups"].items()))
    for sentence in answer["verdict"]:
        print(f"verdict  {sentence}")


@app.command
def run(scene: Path, /, *, out: Annotated[Path | None, Parameter(name=["-o", "--out"])] = None, set_: Sets = (),
        json_: Annotated[bool, Parameter(name="--json", negative=())] = False,
        resume: Annotated[bool, Parameter(negative=())] = False,
        fresh: Annotated[bool, Parameter(negative=())] = False,
        quiet: Annotated[bool, Parameter(name=["-q", "--quiet"], negative=())] = False,
        verbose: Annotated[bool, Parameter(name=["-v", "--verbose"], negative=())] = False):
    """Run SCENE and write its results folder, by default out/<scene name>; --fresh ignores kept operators."""
    if resume:
        raise Refused("run: --resume is not yet built; run the scene again")
    from .export.folder import run_into
    from .runs.plan import plan as make

    talk = (lambda text: None) if quiet else say
    what = make(_scene(scene, set_))
    if verbose:
        talk(f"about {what.seconds:.1f} s, {what.steps} steps, engine {what.engine}")
    target = out if out is not None else Path("out") / what.model.source.path.stem
    with _progress(quiet or json_) as progress:
        answer = run_into(what, target, talk, progress, fresh)
    if json_:
        print(json.dumps(answer, ensure_ascii=False))
    else:
        _print_answer(answer, target, verbose)
    if answer["outcome"] == "not_converged":
        raise NotReached


class _progress:
    """A bar on a terminal, nothing elsewhere; the call takes the done share."""

    def __init__(self, silent: bool):
        self.bar = None
        if not silent and sys.stderr.isatty():
            from rich.console import Console
            from rich.progress import Progress

            self.bar = Progress(console=Console(stderr=True), transient=True)
            self.task = self.bar.add_task("running", total=1.0)

    def __enter__(self):
        if self.bar is None:
            return None
        self.bar.start()
        return lambda share: self.bar.update(self.task, completed=share)

    def __exit__(self, *_):
        if self.bar is not None:
            self.bar.stop()


def _print_answer(answer: dict, target: Path, verbose: bool) -> None:
    from .core import Outcome

    print(f"{answer['outcome']}: {Outcome(answer['outcome']).sentence}")
    for name, m in answer["measures"].items():
        error = "" if m["error"] is None else f" ± {m['error']:.2g}"
        value = "-" if m["value"] is None else f"{m['value']:.6g}"
        print(f"  {name:<42} {value}{error} {m['unit']}")
    for text in answer["warnings"]:
        say(f"warning: {text}")
    if verbose:
        say("seconds: " + ", ".join(f"{k} {v:.3f}" for k, v in answer["seconds"].items()))
    print(f"results: {target}")


@app.command
def mesh(scene: Path, /, *, out: Annotated[Path, Parameter(name=["-o", "--out"])], set_: Sets = ()):
    """Write the tagged mesh of SCENE as .msh or .vtu."""
    found = _model(scene, set_)
    if found.patch is None:
        raise Refused(f"{scene}: missing [contact]: only a scene with a patch has a mesh")
    from .mesh.files import write_mesh
    from .model.pieces import bodies_of
    from .model.source import placed

    with placed(found.source):
        if found.patch.chosen:
            from .runs.patch.ladder import solve_all

            pair = solve_all(found.patch, found.accuracy.tolerance)[0].pair
            low, high = pair.grid, None if pair.upper is pair.piece else pair.upper_grid
        else:
            low, high = bodies_of(found.patch)
    write_mesh(low, out, high)
    for name, body in (("lower", low), ("upper", high or low)):
        print(f"{out}: {name} piece, {body.x.size} interface nodes, {body.length:.6g} m long, {body.height:.6g} m tall")


@app.command
def cost(scene: Path, /, *, over: str = "", out: Annotated[Path | None, Parameter(name=["-o", "--out"])] = None,
         set_: Sets = (), json_: Annotated[bool, Parameter(name="--json", negative=())] = False,
         quiet: Annotated[bool, Parameter(name=["-q", "--quiet"], negative=())] = False):
    """Error against time of SCENE for a knob (--over element_size, steps_per_cycle, shear_modes), or for all it has."""
    from .campaigns.cost import KNOBS, cheapest, curve, knobs_of, turned_by

    found = _model(scene, set_)
    if over and over not in KNOBS:
        raise Refused(f"cost --over {over}: the knobs are {', '.join(KNOBS)}; others are not yet built")
    knobs = [over] if over else knobs_of(found)
    if not knobs:
        raise Refused(f"{scene}: no knob changes what this scene computes: its answer is exact")
    from .export.cost import write

    target, answer = out if out is not None else Path("out") / f"{found.source.path.stem}-cost", {}
    for knob in knobs:
        runs = curve(found, knob, None if quiet else say)
        names = [name for name in MAIN if name in turned_by(runs)]
        best = cheapest(runs, found.accuracy.tolerance)
        table, picture = write(target, knob, runs, found.accuracy.tolerance, names)
        answer[knob] = {"runs": [{"label": one.label, "value": one.value, "seconds": one.seconds, "values": one.values,
                                  "errors": one.errors} for one in runs], "cheapest": best}
        if not json_:
            _print_cost(knob, runs, names, best, found.accuracy.tolerance)
            print(f"results: {table} {picture}")
    if json_:
        print(json.dumps(answer))


@app.command
def fit(scene: Path, /, *, to: Path, free: Annotated[tuple[str, ...], Parameter(negative=())],
        hold: Annotated[tuple[str, ...], Parameter(negative=())] = (),
        out: Annotated[Path | None, Parameter(name=["-o", "--out"])] = None, set_: Sets = (),
        json_: Annotated[bool, Parameter(name="--json", negative=())] = False,
        quiet: Annotated[bool, Parameter(name=["-q", "--quiet"], negative=())] = False):
    """Fit keys of SCENE (--free table.key=low..high,...) to the measured loop --to FILE; rows that --hold names
    (column=value,...) are only predicted."""
    found = _scene(scene, set_)
    from .campaigns.fit import fit_loop
    from .export.fit_folder import fit_into

    fitted = fit_loop(found, to, free, hold, None if quiet else say)
    target = out if out is not None else Path("out") / f"{found.path.stem}-fit"
    answer = fit_into(fitted, target)
    if json_:
        print(json.dumps(answer, ensure_ascii=False))
    else:
        from .export.fit import lines_of

        print("\n".join(lines_of(answer)))
        for text in answer["warnings"]:
            say(f"warning: {text}")
        print(f"results: {target}")
    if answer["outcome"] == "not_converged":
        raise NotReached


MAIN = ("relative_displacement_amplitude", "absolute_acceleration_peak", "loop_area", "friction_force_peak",
        "pressure_peak", "contact_fraction", "approach", "rotation", "normal_stiffness", "tangential_stiffness")


def _print_cost(knob: str, runs: list, names: list, best: dict, tolerance: float) -> None:
    print(f"{knob:<16} {'seconds':>9}  " + "  ".join(f"{name[:16]:>16}" for name in names) + "   (relative errors)")
    for one in runs:
        cells = (one.errors.get(name) for name in names)
        text = (f"{error / abs(one.values[name]):16.1e}" if error is not None and one.values[name] else f"{'-':>16}"
                for name, error in zip(names, cells))
        print(f"{one.label:<16} {one.seconds:9.3f}  " + "  ".join(text))
    for name in names:
        print(f"  {name}: " + (f"no setting meets {tolerance:g}" if best[name] is None else
                               f"{best[name]} is the quickest within {tolerance:g}"))


@app.command
def export(folder: Path, /, *, out: Annotated[Path, Parameter(name=["-o", "--out"])], frame: int | None = None):
    """Write the fields of a results folder as .pvd (series), .vtu or .csv (last or --frame), or .vtkhdf."""
    from .export.fields.vtu import export as write

    print(write(folder, out, frame))


@app.command
def view(folder: Path, /, *, out: Annotated[Path | None, Parameter(name=["-o", "--out"])] = None,
         frame: int | None = None, magnify: float | None = None):
    """Show the pressed pieces of a results folder in a window, or draw them into -o PICTURE.png."""
    from .export.drawing.view import view as show

    show(folder, out, frame, magnify, say)


class NotReached(Exception):
    """The run is on disk and marked not_converged, exit code 3."""


class Refused(Exception):
    """A request that the command line itself turns down, exit code 2."""


def main(argv: list | None = None) -> None:
    """Entry point: exit codes 0 done, 2 bad input, 3 not converged, 4 missing or out of a resource, 130 interrupted."""
    words = sys.argv[1:] if argv is None else argv
    sys.exit(_guarded(words))


def _guarded(words: list) -> int:
    try:
        from .scene.scene import SceneError
    except KeyboardInterrupt:
        return 130
    try:
        if words and words[0] in NOT_BUILT:
            raise Refused(f"patchfem {words[0]}: not yet built; built are check, plan, run, cost, fit, "
                          "mesh, export, view")
        app(words, exit_on_error=False, print_error=False)
        sys.stdout.flush()
        return 0
    except SceneError as error:
        for line in error.mistakes:
            say(line)
        return 2
    except (Refused, CycloptsError) as error:
        say(f"patchfem: {' '.join(str(error).split())}")
        return 2
    except NotReached:
        return 3
    except KeyboardInterrupt:
        say("interrupted; nothing was replaced")
        return 130
    except MemoryError:
        say("out of memory; make contact.element_size larger or the run shorter")
        return 4
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        say(f"{error.filename or 'patchfem'}: {error.strerror or error}")
        return 4
    except Exception as error:
        code = getattr(error, "code", None)
        if isinstance(code, int) and type(error).__module__.startswith("patchfem"):
            say(str(error))
            return code
        say(f"patchfem: internal fault, please report it: {type(error).__name__}: {error}")
        if os.environ.get("PATCHFEM_DEBUG"):
            raise
        return 1


if __name__ == "__main__":
    main()
