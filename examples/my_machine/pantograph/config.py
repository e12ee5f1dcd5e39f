"""The pantograph's sections of a configuration; every number has a unit there and is SI here."""

from hapticd.configs import quantities as q
from hapticd.configs.strict import Strict
from hapticd.runtime.core.sections import Config, Simulation


class Pantograph(Strict, frozen=True):
    """The model holds the left half; ``base`` is how far to the right its mirror image stands."""

    base: q.Length
    puck: q.TwinMass
    puck_damping: q.Damping
    room: q.Lengths2  # its centre
    radius: q.Length
    wall: q.Stiffness
    coupling: q.Stiffness  # from the puck to the handle
    coupling_damping: q.Damping
    hold: q.AngularStiffness  # of the motors, where they stand
    hold_damping: q.AngularDamping
    deceleration: q.AngularAcceleration


class PantographSimulation(Simulation, frozen=True, kw_only=True):
    posture: q.Angles2  # of the motors, at first
    rotor_inertia: q.Inertia
    friction: q.AngularDamping
    brake_torque: q.Torque
    noise: q.NoiseForce


class PantographConfig(Config, frozen=True, kw_only=True, tag="pantograph"):
    pantograph: Pantograph
    simulation: PantographSimulation | None = None
