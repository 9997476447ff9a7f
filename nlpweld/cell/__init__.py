"""Cells and robots: strictly validated files loaded into frozen types."""

from nlpweld.cell.cell import VARIABLES, Cell, Seam
from nlpweld.cell.files import library_names
from nlpweld.cell.levels import OVER_SEAM, READINGS, Reading
from nlpweld.cell.load import load_cell, load_positioner, load_robot
from nlpweld.cell.robot import Body, End, Joint, Robot
from nlpweld.cell.seams import Composite, Polyline
from nlpweld.cell.station import Station
from nlpweld.cell.task import Capsule, Grasp, Positioner, Saddle, Tool, Torch, TorchAngles

__all__ = [
    "OVER_SEAM",
    "READINGS",
    "VARIABLES",
    "Body",
    "Capsule",
    "Cell",
    "Composite",
    "End",
    "Grasp",
    "Joint",
    "Polyline",
    "Positioner",
    "Reading",
    "Robot",
    "Saddle",
    "Seam",
    "Station",
    "Tool",
    "Torch",
    "TorchAngles",
    "library_names",
    "load_cell",
    "load_positioner",
    "load_robot",
]
