"""Joint sequences of a timed plan as text: CSV, ROS 2 trajectories, ABB RAPID and KUKA KRL."""

from nlpweld.export.formats import FORMATS, Export, export_plan

__all__ = ["FORMATS", "Export", "export_plan"]
