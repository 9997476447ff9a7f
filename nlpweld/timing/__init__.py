"""When everything a plan moves is where: the time axis of a plan."""

from nlpweld.timing.time_plan import time_plan

__all__ = ["time_plan"]
