"""Robots of one file are independent of each other."""

import numpy as np
from hapticd.models import Robot
from hapticd.runtime.configuration.config import load


def test_who_changes_a_robot_changes_no_other_of_the_same_file() -> None:
    loaded = load("panda")
    first, second = (Robot.from_urdf(loaded.model_text, loaded.model_source) for _ in range(2))
    mass, number = second.model.inertias[1].mass, len(second.shapes)
    first.model.inertias[1].mass = mass + 1.0
    first.model.gravity.linear = np.zeros(3)
    first.shapes.clear()
    third = Robot.from_urdf(loaded.model_text, loaded.model_source)
    for other in (second, third):
        assert other.model.inertias[1].mass == mass and len(other.shapes) == number
        assert other.model.gravity.linear.any()
