"""A device of our own, and its simulated counterpart: the force in the handle, in two components."""

from pathlib import Path

from hapticd.configs.quantities import Force
from hapticd.devices.device import Device, Quantity, Word
from hapticd.devices.force_torque import SensorStatus
from hapticd.sim.node import SimNode


class PlanarForce(Device, frozen=True, kw_only=True, tag="planar_force"):
    """Reports SI units, and NaN for what it cannot measure; ``force`` is its full scale."""

    force: Force
    group: str = "planar_force"
    eds: str = str(Path(__file__).with_name("planar_force.eds"))

    def inputs(self):
        return {(0x2600, 1): Quantity("force"), (0x2600, 2): Quantity("force"), (0x2601, 0): Word("status")}


class SimPlanarForce(SimNode):
    force, status = (0.0, 0.0), int(SensorStatus.READY)
