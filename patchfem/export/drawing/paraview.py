"""The last cycle for ParaView: its fields as .pvd, and a script that colours and plays them.

The fields have two more point arrays: `motion`, the displacement as pictures draw it, which
includes the gap but not the slide of the upper piece as a whole; and `slide`, this slide. Thus each
can have its own factor. Coloured arrays are in MPa: `shown` in the cells of the pieces,
`contact_pressure` at the points of the interface.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from ...core import PatchfemError
from ...disk.atomic_write import write_text
from ..fields.series import Frame, Series
from ..fields.vtu import frames_folder, write_pvd
from .film import Film, make_film
from .panels import drawn_displacement, upper_piece_slide, upper_points

MPA = 1e-6
# Fraction of the stress values that the colour scale covers; the larger ones are peaks in corners.
MAX_QUANTILE = 0.998
# Title of each component, and its index in the stored stress (xx, yy, zz, xy, yz, xz), or None if
# it is stored as a separate array.
STRESSES = {
    "von_mises": ("von Mises stress", None),
    "sigma_xx": ("stress sigma_xx", 0),
    "sigma_yy": ("stress sigma_yy", 1),
    "sigma_zz": ("stress sigma_zz", 2),
    "tau_xy": ("shear stress tau_xy", 3),
}

STATUS = "status"  # name of the array with the contact state: 0 open, 1 stick, 2 slip

SCRIPT = '''\
"""Show the last cycle (of a bench: the whole slide): {title} in both pieces, contact pressure on their interface.

    pvpython THIS.py            plays the cycle three times
    pvpython THIS.py cycle.png  writes a picture of each frame; .avi or .ogv writes a film, if ParaView can write it
    paraview --script=THIS.py   opens the window of ParaView
    xvfb-run -a pvpython THIS.py cycle.png  works without a display (apt-get install xvfb)

The script needs ParaView 5.11 or later. The fields are in the .pvd file of the same name next to this script,
and in the folder that the file refers to.
"""

import os
import sys

from paraview import simple

HERE = os.path.dirname(os.path.abspath(__file__)) if "__file__" in globals() else os.getcwd()
FIELDS = os.path.join(HERE, {fields!r})
MOTION = {motion!r}  # magnification of the motion and the gap
SLIDE = {slide!r}  # magnification of the rigid slide of the upper piece
STRESS = {stress!r}  # range of the colours [MPa], the same in all frames
PRESSURE = {pressure!r}  # range of the colours [MPa], the same in all frames
# Whether the interface is coloured by open, stick and slip instead of by its pressure.
STATUS = {status!r}
TIMES = 3  # how often the cycle is played
PACE = {pace!r}  # frames per second of a film


def without_display():
    """Return whether this ParaView needs an X display and there is none, so that it would crash."""
    if not sys.platform.startswith("linux") or os.environ.get("DISPLAY"):
        return False
    import vtkmodules.vtkRenderingOpenGL2  # this import registers the window class of this build
    from vtkmodules.vtkRenderingCore import vtkRenderWindow

    return vtkRenderWindow().GetClassName() == "vtkXOpenGLRenderWindow"


if not os.path.isfile(FIELDS):
    raise SystemExit(FIELDS + " does not exist; keep this script in the folder in which it was written")
if without_display():
    raise SystemExit("there is no display, which this ParaView needs; xvfb-run -a pvpython THIS.py cycle.png writes "
                     "pictures without one (apt-get install xvfb), as does a ParaView built for EGL or OSMesa")

reader = simple.PVDReader(registrationName={fields!r}, FileName=FIELDS)
bent = simple.WarpByVector(registrationName="motion", Input=reader)
bent.Vectors = ["POINTS", "motion"]
bent.ScaleFactor = MOTION
slid = simple.WarpByVector(registrationName="slide", Input=bent)
slid.Vectors = ["POINTS", "slide"]
slid.ScaleFactor = SLIDE
pieces = simple.ExtractBlock(registrationName="pieces", Input=slid)
pieces.Selectors = ["//lower", "//upper"]
interface = simple.ExtractBlock(registrationName="interface", Input=slid)
interface.Selectors = ["//interface"]
clock = simple.AnnotateTimeFilter(registrationName="time", Input=reader)
clock.Format = "time {{time:.6f}} s; motion and gap x {motion:.4g}, slide x {slide:.4g}"

view = simple.GetActiveViewOrCreate("RenderView")
view.InteractionMode = "2D"
view.OrientationAxesVisibility = 0


def show(source, where, name, title, ends, colours, unit="[MPa]"):
    """Show a source, coloured by one of its arrays with the same range in all frames."""
    shown = simple.Show(source, view)
    simple.ColorBy(shown, (where, name))
    table = simple.GetColorTransferFunction(name)
    table.AutomaticRescaleRangeMode = "Never"
    table.ApplyPreset(colours, True)
    table.RescaleTransferFunction(*ends)
    shown.SetScalarBarVisibility(view, True)
    bar = simple.GetScalarBar(table, view)
    bar.Title, bar.ComponentTitle = title, unit
    shown.Ambient, shown.Diffuse = 1.0, 0.0  # no light and shade, so that the colours are those of the scale
    return shown


show(pieces, "CELLS", "shown", {title!r}, STRESS, {colours!r})
if STATUS:
    line = show(interface, "POINTS", "status", "interface", (0, 2), "Inferno (matplotlib)", "")
    words = simple.GetColorTransferFunction("status")
    words.InterpretValuesAsCategories = 1
    words.Annotations = ["0", "open", "1", "sticks", "2", "slips"]
    words.IndexedColors = [0.6, 0.6, 0.6, 0.12, 0.37, 0.6, 0.78, 0.33, 0.11]
else:
    line = show(interface, "POINTS", "contact_pressure", "contact pressure", PRESSURE, "Inferno (matplotlib)")
line.LineWidth = 6
simple.Show(clock, view)

scene = simple.GetAnimationScene()
scene.UpdateAnimationUsingDataTimeSteps()
scene.PlayMode = "Snap To TimeSteps"
scene.GoToFirst()
simple.ResetCamera(view)
simple.Render(view)
films = [word for word in sys.argv[1:] if word.endswith((".png", ".avi", ".ogv"))]
if films:
    view.ViewSize = [1280, 800]  # wide enough to show the scales next to the pieces
for film in films:
    simple.SaveAnimation(film, view, FrameRate=PACE)
if not films:
    for _ in range(TIMES):
        scene.Play()
'''


def write_script(folder: Path, out: Path, component: str = "von_mises") -> str:
    """Write a ParaView script and the fields of the last cycle; return a line of text about them.

    Parameters
    ----------
    folder : Path
    out : Path
        File of the script; the fields are written next to it.
    component : str
        Stress that colours the pieces, a key of STRESSES; or STATUS for von Mises stress in the
        pieces and the state of the interface.

    Raises
    ------
    Missing
        If there are no fields, or `out` cannot be written.
    PatchfemError
        If the fields have only one frame, or the stress is unknown.
    """
    status = component == STATUS
    component = "von_mises" if component == STATUS else component
    if component not in STRESSES:
        raise PatchfemError(
            f"--of {component}: no stress of this name; the stresses are {', '.join(STRESSES)}; {STATUS} "
            "shows where the interface sticks and slips"
        )
    out = Path(out)
    fields = out.with_suffix(".pvd")
    with Series(folder) as series:
        film = make_film(series)
        text = script_text(out, film, component, _colour_range(series, film, component), status)
        write_pvd(fields, series, film.numbers, lambda frame: add_motion(frame, component))
        write_text(out, text)
    return f"{out}: {len(film.numbers)} frames, {fields.name} and {frames_folder(fields).name} beside it"


def _colour_range(series: Series, film: Film, component: str) -> tuple:
    """Return the smallest and largest stress [Pa] of a colour scale.

    For the von Mises stress they are those of pictures; for a component they are symmetric about 0.
    """
    if component == "von_mises":
        return 0.0, float(film.tops[0])
    top = 0.0
    for number in film.numbers:
        values = get_stress(series.frame(number).cell_data, component)
        top = max(
            top,
            float(np.quantile(np.abs(values[np.isfinite(values)]), MAX_QUANTILE, method="higher")),
        )
    return -top, top


def get_stress(cell_data: dict, component: str) -> np.ndarray:
    """Return one component of the stress (cells,) [Pa], with tension positive."""
    place = STRESSES[component][1]
    return cell_data["von_mises"] if place is None else cell_data["stress"][:, place]


def script_text(out: Path, film: Film, component: str, ends: tuple, status: bool = False) -> str:
    """Return the ParaView script that plays an animation.

    Parameters
    ----------
    out : Path
    film : Film
    component : str
        A key of STRESSES.
    ends : tuple
        Ends of the colours of the stress [Pa].
    status : bool
        Whether the interface shows where it sticks and slips.
    """
    fields = out.with_suffix(".pvd")
    return SCRIPT.format(
        fields=fields.name,
        motion=film.factors[0],
        slide=film.slide_factor,
        stress=tuple(MPA * end for end in ends),
        pressure=(0.0, MPA * film.pressure),
        status=status,
        pace=max(1, round(1 / film.seconds)),
        title=STRESSES[component][0],
        colours="Viridis (matplotlib)" if component == "von_mises" else "Cool to Warm",
    )


def add_motion(frame: Frame, component: str = "von_mises") -> Frame:
    """Return a frame with additional point arrays for the motion and the slip.

    Their sum is the displacement as drawn. The stress `component`, a name of STRESSES, and the
    contact pressure are added in MPa as well.
    """
    slide = np.zeros((len(frame.points), 3))
    slide[upper_points(frame), 0] = upper_piece_slide(frame)
    motion = np.column_stack([drawn_displacement(frame), np.zeros(len(slide))]) - slide
    blocks = {}
    first = 0
    for name, block in frame.blocks.items():
        mine = slice(first, first + len(block.points))
        more = {"motion": motion[mine].astype(np.float32), "slide": slide[mine].astype(np.float32)}
        cells = {}
        if "von_mises" in block.cell_data:
            cells["shown"] = (MPA * get_stress(block.cell_data, component)).astype(np.float32)
        if "normal_stress" in block.point_data:
            more["contact_pressure"] = (MPA * block.point_data["normal_stress"]).astype(np.float32)
        blocks[name] = replace(
            block, point_data=block.point_data | more, cell_data=block.cell_data | cells
        )
        first = mine.stop
    return replace(
        frame,
        blocks=blocks,
        units=frame.units
        | {"motion": "m", "slide": "m", "shown": "MPa", "contact_pressure": "MPa"},
    )
