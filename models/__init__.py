"""Robots from URDF and DH tables over pinocchio, and the linter that refuses unsafe ones."""
