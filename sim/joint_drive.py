"""A simulated drive of a joint that turns."""

from .torque_drive import SimTorqueDrive


class SimJointDrive(SimTorqueDrive):
    """Its joint turns."""
