"""Frames of fields.vtkhdf as the reader of VTK returns them."""

import pyvista
from vtkmodules.vtkIOHDF import vtkHDFReader


def read_with_vtk(path) -> list:
    """Return the frames of a file as VTK reads them."""
    reader = vtkHDFReader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    frames = []
    for number in range(reader.GetNumberOfSteps()):
        reader.SetStep(number)
        reader.Update()
        frames.append((reader.GetTimeValue(), pyvista.wrap(reader.GetOutputDataObject(0)).copy()))
    return frames
