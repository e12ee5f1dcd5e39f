"""Robots from URDF and DH tables over pinocchio, and the linter that refuses unsafe ones."""

from .dh import Array, DhRow
from .errors import ModelError
from .linter import lint
from .robot import Robot

__all__ = ["Array", "DhRow", "ModelError", "Robot", "lint"]
