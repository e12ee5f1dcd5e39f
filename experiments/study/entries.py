"""What the files of studies hold, whatever their protocol."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta

Count = Annotated[int, Meta(ge=1, le=10_000)]
Text = Annotated[str, Meta(min_length=1, max_length=10_000)]
Label = Annotated[str, Meta(pattern="^[A-Za-z0-9]+$", max_length=40)]
Seconds = Annotated[float, Meta(gt=0.0, le=3600.0)]
