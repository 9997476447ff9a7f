"""Cells and robots: strictly validated files loaded into frozen types."""

from nlpweld.cell.cell import READINGS, Cell, Reading, Station
from nlpweld.cell.load import library_names, load_cell, load_robot
from nlpweld.cell.robot import Body, End, Joint, Robot
from nlpweld.cell.task import Capsule, Grasp, Tool, Torch

__all__ = [
    "READINGS",
    "Body",
    "Capsule",
    "Cell",
    "End",
    "Grasp",
    "Joint",
    "Reading",
    "Robot",
    "Station",
    "Tool",
    "Torch",
    "library_names",
    "load_cell",
    "load_robot",
]
