"""The pantograph as a kind of machine: what hapticd finds by the entry point."""

from hapticd.runtime.configuration.system import System
from hapticd.runtime.core.machine import RAMP_SHARE, FigureSpec, LimitSpec

from .config import PantographConfig
from .linkage import MOTORS, Linkage
from .machine import PantographMachine
from .plant import PantographPlant

DEVICES = [*((name, "JointDrive") for name in MOTORS), ("force", "PlanarForce"), ("safety_plc", "SafetyPlc")]


class Limits:  # what a session may touch
    def __init__(self, config) -> None:
        self.specs = (LimitSpec("wall", float("-inf"), 0.0, "m"),)

    def values(self, state):
        return [float(state["depth"])]


class Figures:  # what people see besides
    specs = (FigureSpec("distance to the twin", "mm"),)

    def values(self, state):
        return [1e3 * float(abs(state["handle"] - state["puck"]).max())]

    def live(self, mode, state):
        return [f"force {abs(state['force']).max():.0f} N"]


def check(config, robot):
    if [(name, type(device).__name__) for name, device in config.devices.items()] != DEVICES:
        return [("devices", "are not those of a pantograph", f"give {DEVICES}, in this order")]
    ramp = Linkage(robot, 0.0).motors.velocity[0] / config.pantograph.deceleration
    long = ramp > RAMP_SHARE * config.safety.stop_time
    return [("safety.stop_time", f"braking alone takes {ramp:g} s", "give more")] if long else []


PANTOGRAPH = System(PantographConfig, PantographMachine, Limits, lambda _: Figures(), PantographPlant, check)
