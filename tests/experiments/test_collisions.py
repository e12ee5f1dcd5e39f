"""Random motions towards collisions, and past them: a few of those that the experiment runs."""

from __future__ import annotations

from math import inf

import pytest
from hapticd.experiments.collisions import FIRST, REASON, judge
from hapticd.runtime.configuration.config import load
