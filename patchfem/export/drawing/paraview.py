"""The last cycle for ParaView: its fields as a .pvd and a script beside it that colours, warps and plays them.

The fields carry two more point arrays: `motion`, the displacement as pictures draw it, whose gap is the gap, without
the slide of the upper piece as a whole; and `slide`, that slide. So each has a factor of its own.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from ...disk.whole import write_text
from ..fields.series import Frame, Series
from ..fields.vtu import frames_beside, write_pvd
from .film import Film, film_of
from .panels import moved, slide_of, upper_points

SCRIPT = '''\
"""Both pieces through the last cycle: von Mises stress in them, contact pressure on their interface.

    pvpython THIS.py            plays the cycle three times
    pvpython THIS.py cycle.png  writes a picture of every frame; .avi or .ogv where ParaView can write films
    paraview --script=THIS.py   opens it
    xvfb-run -a pvpython THIS.py cycle.png  where there is no display (apt-get install xvfb)

For ParaView 5.11 and later. The fields stand beside this script, in a .pvd of the same name and its folder.
"""

import os
import sys

from paraview import simple

HERE = os.path.dirname(os.path.abspath(__file__)) if "__file__" in globals() else os.getcwd()
FIELDS = os.path.join(HERE, {fields!r})
MOTION = {motion!r}  # factor of the motion and the gap
SLIDE = {slide!r}  # factor of the slide of the upper piece as a whole
MISES = {mises!r}  # Pa, ends of the colours in every frame
PRESSURE = {pressure!r}  # Pa, ends of the colours in every frame
TIMES = 3  # the cycle is played
PACE = {pace!r}  # frames per second of a film


def without_display():
    """Whether this ParaView draws on an X display and there is none: it would end by a crash."""
    if not sys.platform.startswith("linux") or os.environ.get("DISPLAY"):
        return False
    import vtkmodules.vtkRenderingOpenGL2  # without it the kind of window of this build is not known
    from vtkmodules.vtkRenderingCore import vtkRenderWindow

    return vtkRenderWindow().GetClassName() == "vtkXOpenGLRenderWindow"


if not os.path.isfile(FIELDS):
    raise SystemExit(FIELDS + " is not there; run this script in the folder where it was written")
if without_display():
    raise SystemExit("there is no display, without which this ParaView crashes; xvfb-run -a pvpython THIS.py cycle.png "
                     "writes pictures (apt-get install xvfb), and so does a ParaView built for EGL or OSMesa")

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
clock.Format = "time {{time:.6f}} s"

view = simple.GetActiveViewOrCreate("RenderView")
view.InteractionMode = "2D"
view.OrientationAxesVisibility = 0


def show(source, where, name, title, ends, colours):
    """Show a source coloured by one of its arrays, with the same colours in every frame."""
    shown = simple.Show(source, view)
    simple.ColorBy(shown, (where, name))
    table = simple.GetColorTransferFunction(name)
    table.AutomaticRescaleRangeMode = "Never"
    table.ApplyPreset(colours, True)
    table.RescaleTransferFunction(*ends)
    shown.SetScalarBarVisibility(view, True)
    bar = simple.GetScalarBar(table, view)
    bar.Title, bar.ComponentTitle = title, "[Pa]"
    return shown


show(pieces, "CELLS", "von_mises", "von Mises stress", MISES, "Viridis (matplotlib)")
show(interface, "POINTS", "normal_stress", "contact pressure", PRESSURE, "Inferno (matplotlib)").LineWidth = 6
simple.Show(clock, view)

scene = simple.GetAnimationScene()
scene.UpdateAnimationUsingDataTimeSteps()
scene.PlayMode = "Snap To TimeSteps"
scene.GoToFirst()
simple.ResetCamera(view)
simple.Render(view)
films = [word for word in sys.argv[1:] if word.endswith((".png", ".avi", ".ogv"))]
if films:
    view.ViewSize = [1280, 800]  # so wide that the scales stand beside the pieces
for film in films:
    simple.SaveAnimation(film, view, FrameRate=PACE)
if not films:
    for _ in range(TIMES):
        scene.Play()
'''


def write_script(folder: Path, out: Path) -> str:
    """Write the script `out`, and its fields beside it, for the last cycle of a results folder; one line on them.

    Missing without fields or where `out` cannot be written; PatchfemError for fields of one moment: nothing moves.
    """
    out = Path(out)
    fields = out.with_suffix(".pvd")
    with Series(folder) as series:
        film = film_of(series)
        text = script(out, film)
        write_pvd(fields, series, film.numbers, with_motion)
        write_text(out, text)
    return f"{out}: {len(film.numbers)} frames, {fields.name} and {frames_beside(fields).name} beside it"


def script(out: Path, film: Film) -> str:
    """The text of the script `out` that plays a film."""
    fields = out.with_suffix(".pvd")
    return SCRIPT.format(fields=fields.name, motion=film.factors[0], slide=film.aside, mises=(0.0, float(film.tops[0])),
                         pressure=(0.0, film.pressure), pace=max(1, round(1 / film.seconds)))


def with_motion(frame: Frame) -> Frame:
    """A frame whose blocks hold `motion` and `slide` (n, 3) [m] too, which add up to the drawn displacement."""
    slide = np.zeros((len(frame.points), 3))
    slide[upper_points(frame), 0] = slide_of(frame)
    motion = np.column_stack([moved(frame), np.zeros(len(slide))]) - slide
    blocks, first = {}, 0
    for name, block in frame.blocks.items():
        mine = slice(first, first + len(block.points))
        more = {"motion": motion[mine].astype(np.float32), "slide": slide[mine].astype(np.float32)}
        blocks[name] = replace(block, point_data=block.point_data | more)
        first = mine.stop
    return replace(frame, blocks=blocks, units=frame.units | {"motion": "m", "slide": "m"})
