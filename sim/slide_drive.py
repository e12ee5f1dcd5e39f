"""A simulated drive of a joint that slides."""

from .torque_drive import SimTorqueDrive


class SimSlideDrive(SimTorqueDrive):
    """Its joint slides."""
