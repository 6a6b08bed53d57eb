"""Stand-in for ParaView that records what a script calls and runs its pipeline with VTK filters.

Names of proxies and of their properties are those of ParaView 5.11; any other name is an error.
"""

from __future__ import annotations

import types
import xml.etree.ElementTree as ElementTree
from pathlib import Path

from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkFiltersExtraction import vtkExtractBlockUsingDataAssembly
from vtkmodules.vtkFiltersGeneral import vtkWarpVector
from vtkmodules.vtkIOXML import vtkXMLMultiBlockDataReader

PROPERTIES = {
    "PVDReader": {"FileName"},
    "WarpByVector": {"Input", "Vectors", "ScaleFactor"},
    "ExtractBlock": {"Input", "Selectors", "Assembly"},
    "AnnotateTimeFilter": {"Input", "Format"},
    "RenderView": {"InteractionMode", "OrientationAxesVisibility", "ViewSize"},
    "Display": {"LineWidth", "Ambient", "Diffuse"},
    "ScalarBar": {"Title", "ComponentTitle"},
    "Table": {
        "AutomaticRescaleRangeMode",
        "InterpretValuesAsCategories",
        "Annotations",
        "IndexedColors",
    },
    "AnimationScene": {"PlayMode"},
}
CALLS = {
    "Display": {"SetScalarBarVisibility"},
    "Table": {"ApplyPreset", "RescaleTransferFunction"},
    "AnimationScene": {"UpdateAnimationUsingDataTimeSteps", "GoToFirst", "Play"},
}


class Proxy:
    """Proxy that accepts the properties of its kind and records its method calls."""

    def __init__(self, kind: str, **given):
        self.__dict__.update(kind=kind, called=[])
        for name, value in given.items():
            setattr(self, name, value)

    def __setattr__(self, name: str, value) -> None:
        """Set a property; AssertionError if ParaView has none of this name."""
        assert name in PROPERTIES[self.kind], f"{self.kind} has no property {name}"
        self.__dict__[name] = value

    def __getattr__(self, name: str):
        """Return a method that records its calls."""
        if name not in CALLS.get(self.kind, ()):
            raise AttributeError(f"{self.kind} has no {name}")
        return lambda *words: self.called.append((name, *words))


class SimpleModule(types.ModuleType):
    """Stand-in for `paraview.simple` that records what is shown and how."""

    def __init__(self):
        super().__init__("paraview.simple")
        self.shown = []
        self.coloured = {}
        self.tables = {}
        self.saved = []
        self.view = Proxy("RenderView")
        self.scene = Proxy("AnimationScene")
        self.bars = {}
        for kind in ("PVDReader", "WarpByVector", "ExtractBlock", "AnnotateTimeFilter"):
            setattr(self, kind, lambda registrationName, kind=kind, **given: Proxy(kind, **given))

    def GetActiveViewOrCreate(self, kind):
        """Return the render view."""
        assert kind == "RenderView"
        return self.view

    def Show(self, source, view):
        """Record a source and return its display."""
        self.shown.append((source, Proxy("Display")))
        return self.shown[-1][1]

    def ColorBy(self, display, array):
        """Record the array by which a display is colored."""
        self.coloured[id(display)] = array

    def GetColorTransferFunction(self, name):
        """Return the color table of an array."""
        return self.tables.setdefault(name, Proxy("Table"))

    def GetScalarBar(self, table, view):
        """Return the scalar bar of a color table."""
        return self.bars.setdefault(id(table), Proxy("ScalarBar"))

    def GetAnimationScene(self):
        """Return the animation scene."""
        return self.scene

    def ResetCamera(self, view):
        """Check the view; nothing is drawn."""
        assert view is self.view

    Render = ResetCamera

    def SaveAnimation(self, path, view, FrameRate):
        """Record path and frame rate of an animation."""
        self.saved.append((path, FrameRate))


def read_frames(reader: Proxy) -> list:
    """Return (time, file) of the frames of a .pvd file."""
    path = Path(reader.FileName)
    sets = ElementTree.parse(path).getroot().iter("DataSet")
    return [
        (float(data_set.get("timestep")), path.parent / data_set.get("file")) for data_set in sets
    ]


def compute_blocks(source: Proxy, file: Path) -> list:
    """Return (points (n, 3), point data, cell data) of each grid that a source produces if its reader reads `file`."""
    final_filter = _make_filter(source, file)
    final_filter.Update()
    iterator = final_filter.GetOutputDataObject(0).NewIterator()
    out = []
    iterator.InitTraversal()
    while not iterator.IsDoneWithTraversal():
        grid = iterator.GetCurrentDataObject()
        out.append(
            (
                vtk_to_numpy(grid.GetPoints().GetData()),
                *(
                    {
                        data.GetArrayName(k): vtk_to_numpy(data.GetArray(k))
                        for k in range(data.GetNumberOfArrays())
                    }
                    for data in (grid.GetPointData(), grid.GetCellData())
                ),
            )
        )
        iterator.GoToNextItem()
    return out


def _make_filter(source: Proxy, file: Path):
    """Return the VTK filter of a source, connected to those before it."""
    if source.kind == "PVDReader":
        vtk_filter = vtkXMLMultiBlockDataReader()
        vtk_filter.SetFileName(str(file))
        return vtk_filter
    input_filter = _make_filter(source.Input, file)
    if source.kind == "WarpByVector":
        vtk_filter = vtkWarpVector()
        vtk_filter.SetInputArrayToProcess(
            0, 0, 0, ("POINTS", "CELLS").index(source.Vectors[0]), source.Vectors[1]
        )
        vtk_filter.SetScaleFactor(source.ScaleFactor)
    else:
        vtk_filter = vtkExtractBlockUsingDataAssembly()
        vtk_filter.SetAssemblyName("Hierarchy")
        for selector in source.Selectors:
            vtk_filter.AddSelector(selector)
    vtk_filter.SetInputConnection(input_filter.GetOutputPort())
    return vtk_filter
