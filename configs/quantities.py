"""The kinds of numbers in a configuration: dimension, length and range of each."""

# ruff: noqa: D101 - the names say it all

from __future__ import annotations

from math import pi

from .ranges import Range
from .units import Quantity, Vector


class Duration(Quantity):
    dimension = "time"


class Instant(Quantity):
    dimension = "time"
    strict = False


class Frequency(Quantity):
    dimension = "frequency"


class BitRate(Quantity):
    dimension = "bit rate"


class Length(Quantity):
    dimension = "length"
    strict = False


class SessionTime(Duration):
    range = Range(0.1, 1e7, "s", "shorter than devices come up; four months")


class Thickness(Length):
    strict = True
    range = Range(1e-4, 5.0, "m", "a sheet of paper; a room")


class Angle(Quantity):
    dimension = "angle"
    strict = False


class EitherAngle(Angle):
    minimum = -2.0 * pi


class StopMargin(Angle):
    range = Range(1e-3, 0.2, "rad", "what encoders and springs do at rest; a limit that keeps nothing")


class StopMarginLength(Length):
    strict = True
    range = Range(1e-4, 0.2, "m", "what encoders and springs do at rest; a limit that keeps nothing")


class Clearance(Length):
    strict = True
    range = Range(1e-3, 0.2, "m", "what models are wrong by; an arm's length that nobody can use")


class LimitMargin(Angle):
    strict = True
    range = Range(1e-2, 1.0, "rad", "the play of a gear; half the range of a motor")


class Speed(Quantity):
    dimension = "speed"


class AngularSpeed(Quantity):
    dimension = "angular speed"


class Acceleration(Quantity):
    dimension = "acceleration"


class AngularAcceleration(Quantity):
    dimension = "angular acceleration"


class Mass(Quantity):
    dimension = "mass"


class Inertia(Quantity):
    dimension = "inertia"


class Force(Quantity):
    dimension = "force"


class Torque(Quantity):
    dimension = "torque"


class DryForce(Force):
    range = Range(1e-6, 5000.0, "N", "nothing that can be told from none; a closed brake")
    strict = False


class DryTorque(Torque):
    range = Range(1e-6, 500.0, "N m", "nothing that can be told from none; a closed brake")
    strict = False


class Stiffness(Quantity):
    dimension = "stiffness"


class AngularStiffness(Quantity):
    dimension = "angular stiffness"


class Damping(Quantity):
    dimension = "damping"
    strict = False


class AngularDamping(Quantity):
    dimension = "angular damping"
    strict = False


class DampingGain(Damping):
    strict = True


class AngularDampingGain(AngularDamping):
    strict = True


class Rate(Quantity):
    dimension = "rate"


class RateSquared(Quantity):
    dimension = "rate squared"


class Fade(Duration):
    range = Range(1e-6, 60.0, "s", "a person waits for it")


class Horizon(Duration):
    range = Range(1e-4, 0.2, "s", "a period of the fastest loop; a limit that is felt from afar")


class RelaxTime(Duration):
    range = Range(0.03, 2.0, "s", "faster than springs and drives follow; whoever is pinned has waited")


class LeadTime(Duration):
    range = Range(1e-4, 5e-3, "s", "nobody feels less; noise grows by a third")


class PeakTime(Duration):
    range = Range(0.2, 60.0, "s", "a stop takes longer; who can hold it for a minute may rate it higher")


class TimeConstant(Duration):
    range = Range(1e-4, 10.0, "s", "an inverter's current loop; slower than any person")


class AccelerationScale(Acceleration):
    range = Range(15.0, 1e3, "m/s^2", "gravity alone is 9.81 m/s^2")


class SensedForce(Force):
    range = Range(0.5, 5000.0, "N", "a stylus; what no person pulls")


class SensedTorque(Torque):
    range = Range(5e-3, 500.0, "N m", "a stylus; what no person turns")


class HandForce(Force):
    range = Range(0.1, 2000.0, "N", "a finger; a strong person")


class HandTorque(Torque):
    range = Range(1e-3, 200.0, "N m", "a finger; a strong person")


class HandStiffness(Stiffness):
    range = Range(1.0, 1e5, "N/m", "a loose finger; bone")


class HandDamping(Damping):
    strict = True
    range = Range(1e-3, 1e3, "N s/m", "a loose finger; a tense arm")


class HandAngularStiffness(AngularStiffness):
    range = Range(1e-3, 1e3, "N m/rad", "a loose finger; a tense arm")


class HandAngularDamping(AngularDamping):
    strict = True
    range = Range(1e-6, 100.0, "N m s/rad", "a loose finger; a tense arm")


class TwinMass(Mass):
    range = Range(0.05, 500.0, "kg", "lighter than the hand that holds it; nobody moves more")


class TwinInertia(Inertia):
    range = Range(1e-4, 100.0, "kg m^2", "lighter than the hand that holds it; nobody turns more")


class LeastMass(Mass):
    strict = False
    range = Range(1e-3, 500.0, "kg", "what no hand feels; nobody moves more")


class LeastInertia(Inertia):
    strict = False
    range = Range(1e-6, 100.0, "kg m^2", "what no hand feels; nobody turns more")


class HandleMass(Mass):
    range = Range(1e-3, 20.0, "kg", "a stylus; two hands carry no more")


class CueForce(Quantity):
    dimension = "force"
    range = Range(0.05, 5.0, "N", "what nobody feels; what pushes a hand about")
    strict = False


class NoiseForce(Quantity):
    dimension = "force"
    range = Range(1e-6, 10.0, "N", "of a force sensor that is worth one")
    strict = False


class NoiseTorque(Quantity):
    dimension = "torque"
    range = Range(1e-6, 1.0, "N m", "of a torque sensor that is worth one")
    strict = False


class NoiseAcceleration(Quantity):
    dimension = "acceleration"
    range = Range(1e-6, 10.0, "m/s^2", "of an accelerometer that is worth one")
    strict = False


class ErrorAngle(Angle):
    range = Range(1e-9, 0.1, "rad", "beyond any encoder; a sensor that is broken")


class ErrorAngularSpeed(AngularSpeed):
    range = Range(1e-7, 1.0, "rad/s", "beyond any gyroscope; a sensor that is broken")
    strict = False


class ErrorForce(Quantity):
    dimension = "force"
    range = Range(1e-6, 100.0, "N", "below any sensor's noise; a sensor that is broken")
    strict = False


class ErrorTorque(Quantity):
    dimension = "torque"
    range = Range(1e-6, 50.0, "N m", "below any sensor's noise; a sensor that is broken")
    strict = False


class ErrorAcceleration(Quantity):
    dimension = "acceleration"
    range = Range(1e-6, 10.0, "m/s^2", "below any sensor's noise; a sensor that is broken")
    strict = False


class MassError(Quantity):
    dimension = "mass"
    range = Range(1e-9, 20.0, "kg", "finer than any balance; two hands carry no more")
    strict = False


class DriftTime(Duration):
    range = Range(1e-2, 1e5, "s", "faster is noise; slower than a day is bias")


class Inertias3(Vector):
    dimension, length, minimum = "inertia", 3, 0.0


class Angles6(Vector):
    dimension, length = "angle", 6


class AngleLimits6(Vector):
    dimension, length, infinite = "angle", 6, True


class AngularSpeeds6(Vector):
    dimension, length, minimum = "angular speed", 6, 0.0


class AngularAccelerations6(Vector):
    dimension, length, minimum = "angular acceleration", 6, 0.0


class Inertias6(Vector):
    dimension, length, minimum = "inertia", 6, 0.0


class AngularStiffnesses6(Vector):
    dimension, length, minimum = "angular stiffness", 6, 0.0


class AngularDampings6(Vector):
    dimension, length, minimum = "angular damping", 6, 0.0


class Torques6(Vector):
    dimension, length, minimum = "torque", 6, 0.0


class DryTorques6(Vector):
    dimension, length, minimum, strict = "torque", 6, 0.0, False
    range = Range(1e-6, 500.0, "N m", "nothing that can be told from none; a closed brake")


class GearDampings6(Vector):
    dimension, length, minimum, strict = "angular damping", 6, 0.0, False
    range = Range(1e-6, 1000.0, "N m s/rad", "nothing that can be told from none; a locked joint")


class Angles2(Vector):
    dimension, length = "angle", 2


class Angles3(Vector):
    dimension, length = "angle", 3


class Reach3(Vector):
    dimension, length, minimum = "length", 3, 0.0
    range = Range(1e-3, 1.0, "m", "nothing moves; further than a neck reaches")


class Turn3(Vector):
    dimension, length, minimum = "angle", 3, 0.0
    range = Range(1e-2, 1.6, "rad", "nothing turns; further than a neck turns")


class Forces3(Vector):
    dimension, length = "force", 3


class Torques3(Vector):
    dimension, length = "torque", 3


class LengthErrors3(Vector):
    dimension, length = "length", 3
    range = Range(1e-9, 20.0, "m", "finer than any gauge; a hall")


class Lengths2(Vector):
    dimension, length = "length", 2


class Lengths3(Vector):
    dimension, length = "length", 3


class Sizes3(Vector):
    dimension, length, minimum = "length", 3, 0.0


class Angles(Vector):
    dimension = "angle"


class AngularSpeeds(Vector):
    dimension, minimum = "angular speed", 0.0


class AngularAccelerations(Vector):
    dimension, minimum = "angular acceleration", 0.0


class AngularStiffnesses(Vector):
    dimension, minimum = "angular stiffness", 0.0


class AngularDampings(Vector):
    dimension, minimum = "angular damping", 0.0


class Inertias(Vector):
    dimension, minimum = "inertia", 0.0


class Torques(Vector):
    dimension, minimum = "torque", 0.0


class Lengths(Vector):
    dimension = "length"


class Sizes(Vector):
    dimension, minimum = "length", 0.0
    range = Range(1e-4, 20.0, "m", "a sheet of paper; a hall")


class AnyAngle(Quantity):
    dimension, minimum, strict = "angle", float("-inf"), False


class AnyLength(Quantity):
    dimension, minimum, strict = "length", float("-inf"), False


class AnyTorque(Quantity):
    dimension, minimum, strict = "torque", float("-inf"), False


class AnyForce(Quantity):
    dimension, minimum, strict = "force", float("-inf"), False


class SomeAngle(Quantity):
    dimension = "angle"


class Gravity(Acceleration):
    range, strict = Range(0.01, 30.0, "m/s^2", "an asteroid, or 0 for none; Jupiter"), False


class AngleRange(Vector):
    dimension, length, infinite = "angle", 2, True


class LengthRange(Vector):
    dimension, length, infinite = "length", 2, True


class Corner(Vector):
    dimension, length, infinite = "length", 3, True


class Delay(Quantity):
    dimension, strict = "time", False
    range = Range(1e-6, 2.0, "s", "two processes of one computer; nobody leads an arm through more")
