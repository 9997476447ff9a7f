"""A robot at its place in a cell."""

from pydantic import model_validator

from nlpweld.cell.checked import Name, Sourced, Vector
from nlpweld.cell.robot import Body, Robot
from nlpweld.cell.task import Coupling, Tool


class Station(Sourced):
    """A robot at its place in the cell, with its tool and its coupling to the work."""

    name: Name
    robot: Robot
    tool: Tool
    base_position_m: Vector
    base_rpy_deg: Vector = (0.0, 0.0, 0.0)
    coupling: Coupling

    @model_validator(mode="after")
    def _bodies_are_told_apart(self) -> "Station":
        names = [body.name for body in self.bodies]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"two bodies of robot and tool are named '{name}'; rename one")
            if name == "floor":
                raise ValueError("body 'floor' is named like the floor; rename it")
        return self

    @property
    def bodies(self) -> tuple[Body, ...]:
        """Capsules of arm and tool, from base to tip."""
        return self.robot.bodies + self.tool.bodies
