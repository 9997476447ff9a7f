"""The base of every model read from a file: frozen, strict, and no number without a source."""

from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag, model_validator

Finite = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Positive = Annotated[float, Field(strict=True, gt=0.0, allow_inf_nan=False)]
Rate = Annotated[float, Field(strict=True, ge=1e-6, le=1e9, allow_inf_nan=False)]  # beyond any drive, yet no overflow
Offset = Annotated[float, Field(strict=True, ge=-1e3, le=1e3, allow_inf_nan=False)]  # a length to either side [m]
Span = Annotated[float, Field(strict=True, ge=1e-6, le=1e3, allow_inf_nan=False)]  # a length [m], likewise
NonNegative = Annotated[float, Field(strict=True, ge=0.0, allow_inf_nan=False)]
Vector = tuple[Finite, Finite, Finite]
Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_+-]*$")]
Source = Annotated[
    Annotated[str, Tag("text")] | Annotated[dict[str, str], Tag("table")],
    Discriminator(lambda value: "table" if isinstance(value, dict) else "text"),
]


class Checked(BaseModel):
    """A frozen model that refuses unknown fields, NaN, and numbers written as text."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Sourced(Checked):
    """A table with numbers in it, each of which says where it comes from.

    Attributes:
        source: one text for the whole table, or a table with one text for every numeric field.
    """

    source: Source

    @model_validator(mode="after")
    def _every_number_has_a_source(self) -> "Sourced":
        """Refuse a table whose ``source`` is empty, misses a number, or names a field that is not there."""
        texts = {"source": self.source} if isinstance(self.source, str) else self.source
        for key, text in texts.items():
            if not text.strip():
                raise ValueError(f"source of '{key}' is empty; say where the numbers come from")
        if isinstance(self.source, dict):
            fields = self.model_fields_set - {"source"}
            numbers = {name for name in fields if holds_number(getattr(self, name))}
            for key in sorted(numbers - set(texts)):
                raise ValueError(f"number '{key}' has no source; add source.{key} = \"...\"")
            for key in sorted(set(texts) - fields):
                raise ValueError(f"source names '{key}', which this table does not have; remove it")
        return self

    def source_of(self, field: str) -> str:
        """Return the stated source of one field."""
        return self.source if isinstance(self.source, str) else self.source.get(field, "")


def holds_number(value: Any) -> bool:
    """Tell whether a field's value is a number or holds one that does not have its own source."""
    if isinstance(value, Sourced):
        return False
    if isinstance(value, Checked):
        return any(holds_number(getattr(value, name)) for name in value.model_fields_set)
    if isinstance(value, tuple):
        return any(holds_number(item) for item in value)
    return isinstance(value, int | float) and not isinstance(value, bool)
