"""A configuration of an arm as a commented text."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from math import inf

from ...configs.printable import printable
from .config import DIRECTIONS
from .guess import MARGIN, STOP_TIME, Guess

PLACE, RATE, SECOND = ("rad", "m"), ("rad/s", "m/s"), ("rad/s^2", "m/s^2")
INERTIA, SPRING, DAMPER = ("kg m^2", "kg"), ("N m/rad", "N/m"), ("N m s/rad", "N s/m")
TORQUE = ("N m", "N")
WIDTH = 110
"""Of a comment."""
NOISE = 1.5e-4
"""Of a force-torque sensor, as part of its full scale."""


def write_toml(guess: Guess, source: str, model: str) -> str:
    """The whole file, for the URDF beside it."""
    parts = [
        _head(guess, source, model),
        _safety(guess),
        _devices(guess),
        _arm(guess),
        _joints(guess),
        _surroundings(guess),
        _simulation(guess),
        _hand(guess),
    ]
    return "\n".join(parts)


def _number(value: float) -> str:
    if abs(value) == inf:
        return "inf" if value > 0.0 else "-inf"
    return f"{value:.6g}"


def _numbers(values: Sequence[float]) -> str:
    return " ".join(map(_number, values))


def _head(guess: Guess, source: str, model: str) -> str:
    remarks = "\n".join(map(_remark, guess.arm.remarks))
    return f'''# {guess.arm.name}, simulated, in a hand that pulls it to the sides of its box.
# Written by `hapticd init` from {printable(source)}. What was guessed on the way:
#
{remarks}
#
# Every number carries its unit; docs/configuration.md explains every key, and docs/arm.md what they do.
# `hapticd check` says what is wrong with this file, and where.

system = "arm"
model = "{model}"

[loop]
rate = "1 kHz"
duration = "{guess.path[-1][0] + 0.2:.1f} s"
on_overrun = "record"   # a simulated plant survives a stalled host; a real bus wants "stop"

[bus]
kind = "simulated"      # or "socketcan", or "python-can"

[arming]
by = "dead-man"         # a press of the dead-man switch arms; on a real bus: "command", then a press
fade = "3 s"
'''


def _remark(words: str) -> str:
    """A sentence as comments: a file has no line of any length, nor any character."""
    return textwrap.fill(
        printable(" ".join(words.split())), WIDTH, initial_indent="# * ", subsequent_indent="#   "
    )


def _safety(guess: Guess) -> str:
    slides = f'slide_margin = "{1e3 * MARGIN[True]:g} mm"\n' if any(guess.sliding) else ""
    return f'''[safety]
position_margin = "{1e3 * MARGIN[False]:g} mrad"     # joints measured beyond it stop the machine
{slides}stop_time = "{1e3 * STOP_TIME:g} ms"            # detection and ramp together
'''


def _devices(guess: Guess) -> str:
    parts = ["# " + 87 * "-" + " devices (all of them guessed)\n"]
    for node, (name, joint) in enumerate(guess.arm.joints.items(), 1):
        slides = guess.sliding[node - 1]
        lead = 'lead = "10 mm"            # of the spindle: way in a turn of its shaft\n' if slides else ""
        rated = joint.effort / 3.0 * (LEAD / TURN if slides else 1.0)
        parts.append(
            f'''[devices.{name}]
type = "{"slide_drive" if slides else "joint_drive"}"
node = {node}
counts_per_turn = 65536   # of the motor's encoder
gear_ratio = [{"1, 1" if slides else "101, 1"}]
link_counts_per_turn = {65536 if slides else 1048576}
{lead}rated_torque = "{max(0.001, round(rated, 3)):g} N m"
'''
        )
    m = len(guess.arm.joints)
    force, torque = guess.scales
    parts.append(
        f'''[devices.force_torque]
type = "force_torque"
node = {m + 1}
force = "{_number(force)} N"           # full scale: what lies beyond is no measurement
torque = "{_number(torque)} N m"

[devices.safety_plc]
type = "safety_plc"
node = {m + 2}
'''
    )
    return "\n".join(parts)


TURN, LEAD = 6.283185307179586, 0.01


def _arm(guess: Guess) -> str:
    names = ", ".join(f'"{DIRECTIONS[i]}"' for i in guess.directions)
    free = len(guess.arm.joints) > len(guess.directions)
    posture = (
        """
[arm.posture]           # draws the joints home where the handle leaves them free
stiffness = "25 1/s^2"
damping = "10 1/s"
"""
        if free
        else ""
    )
    along = [i for i in guess.directions if i < 3]
    box = (
        f'''
[[arm.boxes]]           # of the handle; one more for each frame of the model that has a range
frame = "handle"
lower = "{_numbers(guess.box[0])} m"
upper = "{_numbers(guess.box[1])} m"
'''
        if along
        else ""
    )
    mass, inertia = guess.mass, guess.inertia
    return f'''# {87 * "-"} control

[arm]
directions = [{names}]      # of the base, in which the handle follows the twin

[arm.frames]
handle = "handle"
sensor = "force_torque"

[arm.force_control]
detection = "gauss"
p_gain = "100 1/s^2"
d_gain = "20 1/s"
viability_horizon = "5 ms"
point_horizon = "15 ms"

[arm.twin]              # what the hand feels: a free mass
kind = "cartesian"
mass = "{_number(mass)} kg"
inertia = "{_number(inertia)} kg m^2"
damping = "{_number(2.0 * mass)} N s/m"
rotational_damping = "{_number(4.0 * inertia)} N m s/rad"
velocity = "1 m/s"
rotational_velocity = "3 rad/s"
acceleration = "20 m/s^2"
rotational_acceleration = "80 rad/s^2"

[arm.handle]            # what hangs on the force-torque sensor; later measured by a calibration
mass = "{_number(guess.arm.handle)} kg"
centre = "0 0 0.07 m"   # in the sensor's frame
{posture}{box}'''


def _joints(guess: Guess) -> str:
    free = len(guess.arm.joints) > len(guess.directions)
    parts = ["# without a stiffness nothing yields between rotor and link\n"]
    for i, name in enumerate(guess.arm.joints):
        slides = guess.sliding[i]
        kind = "prismatic" if slides else "revolute"
        home = f'home = "{_number(guess.home[i])} {PLACE[slides]}"\n' if free else ""
        parts.append(
            f'''[arm.joints.{name}]
type = "{kind}"
range = "{_number(guess.lower[i])} {_number(guess.upper[i])} {PLACE[slides]}"
velocity = "{_down(guess.velocity[i])} {RATE[slides]}"
acceleration = "{_number(guess.acceleration[i])} {SECOND[slides]}"
rotor_inertia = "{_number(guess.rotor[i])} {INERTIA[slides]}"
p_gain = "{_number(guess.p_gain[i])} {SPRING[slides]}"
d_gain = "{_number(guess.d_gain[i])} {DAMPER[slides]}"
{home}'''
        )
    return "\n".join(parts)


def _down(value: float) -> str:
    """Never above the model's."""
    return _number(value * (1.0 - 1e-5))


def _surroundings(guess: Guess) -> str:
    shaped = len(guess.arm.shapes) > 1  # the handle has a shape anyhow
    own = "or itself" if shaped else "but not itself: the model has no shapes for collisions but meshes"
    return f"""# {87 * "-"} surroundings

# The arm halts before it meets what stands here, {own}.
# Uncomment the floor, and add [[look_ahead.obstacles]] with name, centre and size.
[look_ahead]
margin = "15 mm"
# floor = "0 m"
"""


def _simulation(guess: Guess) -> str:
    mass, r, h = guess.arm.handle, 0.016, 0.1
    across = mass * (3.0 * r * r + h * h) / 12.0
    parts = [
        f'''# {87 * "-"} simulated plant

[simulation]
seed = 1

[simulation.arm]
handle_inertia = "{_numbers((across, across, mass * r * r / 2.0))} kg m^2"
force_noise = "{_number(NOISE * guess.scales[0])} N"
torque_noise = "{_number(NOISE * guess.scales[1])} N m"
substeps = {guess.substeps}
'''
    ]
    for i, name in enumerate(guess.arm.joints):
        slides = guess.sliding[i]
        parts.append(
            f'''[simulation.arm.joints.{name}]
type = "{"prismatic" if slides else "revolute"}"
start = "{_number(guess.home[i])} {PLACE[slides]}"
brake = "{_number(guess.brake[i])} {TORQUE[slides]}"
'''
        )
    return "\n".join(parts)


def _hand(guess: Guess) -> str:
    stiffness = guess.force / 0.04
    turning = (
        f'''rotational_stiffness = "{_number(guess.torque / 0.1)} N m/rad"
rotational_damping = "{_number(0.004 * guess.torque / 0.1 + 0.01 * guess.torque)} N m s/rad"
torque = "{_number(guess.torque)} N m"
'''
        if guess.torque is not None
        else ""
    )
    sides = "\n".join(f'"handle {DIRECTIONS[i]}" = "{side}"' for i, side in guess.touches.items())
    touches = f"""[simulation.touches]   # where the hand pulls it: the end of a run says if it got there
{sides}

"""
    parts = [
        f'''{touches if sides else ""}[simulation.hand]
stiffness = "{_number(stiffness)} N/m"
damping = "{_number(0.05 * stiffness)} N s/m"
force = "{_number(guess.force)} N"
{turning}dead_man = [{{ at = "0.3 s", pressed = true }}]

# places along the axes of the base, and rotation vectors from where the handle begins
'''
    ]
    for at, place, turned in guess.path:
        parts.append(
            f'''[[simulation.hand.path]]
at = "{_number(at)} s"
position = "{_numbers(place)} m"
turned = "{_numbers(turned)} rad"
'''
        )
    return "\n".join(parts)
