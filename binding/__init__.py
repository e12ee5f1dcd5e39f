"""Arrays for C: checked once, where they are bound, against what the header says of them."""

from .bind import BindError, bind, hold, places, pointer, put

__all__ = ["BindError", "bind", "hold", "places", "pointer", "put"]
