"""The base of every model read from a file: frozen, strict, and no number without a source."""

from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, model_validator

Finite = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Positive = Annotated[float, Field(strict=True, gt=0.0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(strict=True, ge=0.0, allow_inf_nan=False)]
Vector = tuple[Finite, Finite, Finite]
Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_+-]*$")]


class Checked(BaseModel):
    """A frozen model that refuses unknown fields, NaN, and numbers written as text."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Sourced(Checked):
    """A table with numbers in it, each of which says where it comes from.

    Attributes:
        source: one text for the whole table, or a table with one text for every numeric field.
    """

    source: str | dict[str, str]

    @model_validator(mode="before")
    @classmethod
    def _every_number_has_a_source(cls, data: Any) -> Any:
        """Refuse a table whose ``source`` is empty, misses a number, or names a field that is not there."""
        if not isinstance(data, dict):
            return data
        source = data.get("source")
        if isinstance(source, str) and not source.strip():
            raise ValueError("source is empty; say where the numbers come from")
        if isinstance(source, dict):
            numbers = {key for key, value in data.items() if key != "source" and holds_number(value)}
            for key in sorted(numbers - set(source)):
                raise ValueError(f"number '{key}' has no source; add source.{key} = \"...\"")
            for key in sorted(set(source) - set(data)):
                raise ValueError(f"source names '{key}', which this table does not have")
        return data

    def source_of(self, field: str) -> str:
        """Return the stated source of one field."""
        return self.source if isinstance(self.source, str) else self.source.get(field, "")


def holds_number(value: Any) -> bool:
    """Tell whether a value read from a file is a number or a list of them."""
    if isinstance(value, list | tuple):
        return any(holds_number(item) for item in value)
    return isinstance(value, int | float) and not isinstance(value, bool)
