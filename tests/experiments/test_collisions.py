"""Random motions towards collisions, and past them: a few of those that the experiment runs."""

from __future__ import annotations
