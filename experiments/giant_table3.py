"""HapticGiant, Table III: the Haptify metrics, adapted to a simulated giant that is not what it believes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import msgspec
import numpy as np

from ..machines.giant.config import GiantConfig
from ..models import Array
from ..runtime.configuration import config
from ..runtime.configuration.config import Loaded
from . import haptify
from .giant_reach import Workspace, workspace
from .haptify import Felt, Place, Way
from .outcome import Outcome, Progress, Row
from .own_plant import Doubt

TITLE = "the Haptify metrics (Table III), in simulation"
PAPER = {
    "volume": ("{:.3g}", (12.2e6, 11.8e3, 10.4e3)),
    "free force": ("{:.2f}", (1.28, 0.98, 0.87)),
    "vibration": ("{:.2f}", (0.81, 0.07, 0.04)),
    "centroid": ("{:.1f}", (77.3, 123.0, 162.8)),
    "surface": ("{:.2f}", (1.96, 0.53, 0.38)),
    "accuracy": ("{:.0f}", (109.0, 47.0, 80.0)),
    "peak": ("{:.1f}", (76.7, 2.7, 5.7)),
}
"""HapticGiant, Touch, Touch X: [cm^3], [N], [m/s^2], [Hz], [N], [%], [N]."""
DOUBT = Doubt(model=True, errors=True)
RATE = 1000.0
SEED, PLANTS = 1, 5
"""Of the first plant, and how many a study draws."""
FREE_S, FREE_SPEED = 16.0, 0.25
"""How long and how fast the hand wanders [m/s]."""
ROOM, HEIGHTS = (1.3, 1.6), (-1.12, -0.95)
"""Where it wanders: +- along x and y, and heights [m]."""
LIGHT = {"mass": 1.5, "inertia": 0.03, "damping": 1.0, "rotational_damping": 0.1}
"""The lightest free mass that docs/twins.md advises [kg], [kg m^2], [N s/m], [N m s/rad]."""
SHAKES = 10.0
"""Above this frequency no hand moves on purpose [Hz]."""
PRESS, SLIDE_SPEED, SLIDE_RADIUS, SLIDE_S = 5.0, 0.1, 0.12, 8.0
"""On the surface: how hard the hand presses [N], how fast and along what circle it slides [m/s], [m]."""
STIFFNESSES, FIRM, PRESS_S = (500.0, 1000.0, 2000.0), 60.0, 3.0
"""Springs that are rendered [N/m], how hard the hand presses into them [N], and how long that takes."""
HARD, HARD_S, BENDS = 300.0, 6.0, 0.1
"""The strongest press [N], and the share by which the rendered stiffness may be off while it counts."""
SHAKEN_HZ, SHAKEN_M, SHAKEN_RAD, SHAKEN_S = 1.0, 0.04, 0.15, 2.0
"""How the hand moves to and fro for the local dynamics."""
DIRECTIONS = ("x", "y", "z", "yaw", "tilt", "roll")
SAMPLES = 3_000_000
"""Random postures for the workspace."""
CONTACT = 1.0
"""Beyond this force the handle is on the surface [N]."""


def run(progress: Progress) -> Outcome:
    """One plant of its own."""
    return _outcome([SEED], progress)


def study(progress: Progress) -> Outcome:
    """Several plants: means over them, and the range."""
    return _outcome(range(SEED, SEED + PLANTS), progress)


@dataclass(frozen=True, slots=True)
class Metrics:
    """What was measured of a plant.

    Attributes:
        values: by the names of ``PAPER``, and what explains them.
        free: the wandering hand; spectrum: of its handle.
        presses: into springs, by their stiffness; the last one is the hardest.
        stops: of the machine.
    """

    values: dict[str, float]
    free: Felt
    spectrum: haptify.Vibration
    presses: dict[float, Felt]
    stops: list[str]


def measure(loaded: Loaded, seed: int, progress: Progress) -> Metrics:
    """All sessions with the plant of a seed."""
    start = haptify.first_place(loaded)
    felt: dict[str, Felt] = {}

    def go(name: str, machine: Loaded, way: Way) -> Felt:
        def say(text: str) -> None:
            progress(f"plant {seed}, {name}: {text}")

        felt[name] = haptify.felt(machine, way, seed, DOUBT, say, HARD)
        return felt[name]

    wander = wandering(start, seed)
    free, light = go("free", loaded, wander), go("light", lighter(loaded), wander)
    slide = go("surface", haptify.with_slider(loaded, None), sliding(start, grip(loaded)))
    local = go("local", loaded, shaking(start))
    presses = {}
    for k in STIFFNESSES:
        way = pressing(start, k, grip(loaded), FIRM, PRESS_S)
        presses[k] = go(f"{k:g} N/m", haptify.with_slider(loaded, k), way)
    hardest = pressing(start, STIFFNESSES[-1], grip(loaded), HARD, HARD_S)
    hard = go("hard", haptify.with_slider(loaded, STIFFNESSES[-1]), hardest)
    presses[0.0] = hard

    spectrum = haptify.vibration(free.acceleration, RATE, SHAKES)
    touching = slide.force[:, 2] < -CONTACT
    values = {
        "free force": _mean(free.force),
        "own": _mean(own(free, loaded)),
        "light": _mean(light.force),
        "light own": _mean(own(light, lighter(loaded))),
        "added": _mean(free.force - own(free, loaded)),
        "light added": _mean(light.force - own(light, lighter(loaded))),
        "speed": _mean(free.velocity),
        "vibration": spectrum.rms,
        "centroid": spectrum.centroid,
        "surface": _mean(slide.force[touching, :2]),
        "surface own": _mean(own(slide, loaded)[touching, :2]),
        "normal": float(-slide.force[touching, 2].mean()),
        "peak": peak(hard, STIFFNESSES[-1]),
        **{f"accuracy {k:g}": accuracy(presses[k], k) for k in STIFFNESSES},
        **dynamics(local),
    }
    values["accuracy"] = float(np.mean([values[f"accuracy {k:g}"] for k in STIFFNESSES]))
    stops = [f"{name}: {each.stop}" for name, each in felt.items() if each.stop]
    return Metrics(values, free, spectrum, presses, stops)


def grip(loaded: Loaded) -> float:
    """Stiffness of the hand [N/m]."""
    simulation: Any = loaded.config.simulation
    return float(simulation.hand.stiffness)


def lighter(loaded: Loaded) -> Loaded:
    """The giant with the lighter mass."""
    whole = loaded.config
    assert isinstance(whole, GiantConfig)
    twin: Any = whole.giant.twin
    less = {name: type(getattr(twin, name))(value) for name, value in LIGHT.items()}
    giant = msgspec.structs.replace(whole.giant, twin=msgspec.structs.replace(twin, **less))
    return replace(loaded, config=msgspec.structs.replace(whole, giant=giant))


def own(felt: Felt, loaded: Loaded) -> Array:
    """Force that the free mass itself asks for under the motion that came about, (k, 3) [N]."""
    whole: Any = loaded.config
    force: Array = whole.giant.twin.mass * felt.acceleration + whole.giant.twin.damping * felt.velocity
    return force


def wandering(start: Place, seed: int) -> Way:
    """From place to place in the room at a mean speed; the handle keeps its direction."""
    random = np.random.default_rng([seed, 3])
    low, high = (
        np.array([sign * ROOM[0], sign * ROOM[1], z]) for sign, z in zip((-1, 1), HEIGHTS, strict=True)
    )
    t, place = 0.0, np.array(start[:3])
    way: list[tuple[float, Place]] = [(t, start)]
    while t < FREE_S:
        there = random.uniform(low, high)
        leg = float(np.linalg.norm(there - place))
        share = min(1.0, (FREE_S - t) * FREE_SPEED / leg)
        t, place = t + share * leg / FREE_SPEED, place + share * (there - place)
        way.append((t, [*place, *start[3:]]))
        if share < 1.0:
            break
    return way


def sliding(start: Place, stiffness: float) -> Way:
    """Down onto the surface, and in circles on it."""
    down, t, turns = PRESS / stiffness, 1.0, SLIDE_SPEED / SLIDE_RADIUS
    way: list[tuple[float, Place]] = [(0.0, start), (t, _moved(start, (0.0, 0.0, -down)))]
    for s in np.arange(0.3, SLIDE_S, 0.3):
        x, y = SLIDE_RADIUS * (1.0 - np.cos(turns * s)), SLIDE_RADIUS * np.sin(turns * s)
        way.append((t + float(s), _moved(start, (float(x), float(y), -down))))
    return way


def pressing(start: Place, stiffness: float, hand: float, force: float, seconds: float) -> Way:
    """Straight down until spring and hand would hold each other with a force."""
    down = force * (1.0 / stiffness + 1.0 / hand)
    steps = np.linspace(0.0, 1.0, 11)
    return [(float(s) * seconds, _moved(start, (0.0, 0.0, -down * float(s)))) for s in steps]


def shaking(start: Place) -> Way:
    """To and fro along x, y, z, then in yaw, tilt and roll, ``SHAKEN_S`` each, at rest between."""
    way: list[tuple[float, Place]] = [(0.0, start)]
    steps = np.arange(1, round(12 * SHAKEN_S * SHAKEN_HZ) + 1) / (12 * SHAKEN_HZ)
    for i, amplitude in enumerate((SHAKEN_M,) * 3 + (SHAKEN_RAD,) * 3):
        begin = way[-1][0]
        for s in steps:
            place = list(start)
            place[i] += amplitude * float(np.sin(2 * np.pi * SHAKEN_HZ * s))
            way.append((begin + float(s), place))
    return way


def dynamics(felt: Felt) -> dict[str, float]:
    """Inertia, damping and what they leave of the effort, in each direction that was shaken."""
    found: dict[str, float] = {}
    for i, name in enumerate(DIRECTIONS):
        part = felt.part(SHAKEN_S * i, SHAKEN_S * (i + 1))
        if i < 3:
            along = np.eye(3)[i]
            effort, rate, speed = part.force, part.acceleration, part.velocity
        else:
            effort, rate, speed = part.torque, part.spin_rate, part.spin
            along = np.linalg.svd(speed - speed.mean(0), full_matrices=False)[2][0]
        terms = haptify.inertia_and_damping(effort @ along, rate @ along, speed @ along)
        found |= {f"{what} {name}": x for what, x in zip(("inertia", "damping", "rest"), terms, strict=True)}
    return found


def accuracy(felt: Felt, stiffness: float) -> float:
    """Rendered over commanded stiffness [%]."""
    firm = felt.force[:, 2] < -CONTACT
    return 100.0 * haptify.stiffness(felt.force[firm, 2], felt.position[firm, 2]) / stiffness


def peak(felt: Felt, stiffness: float) -> float:
    """Largest force up to which force over displacement is the stiffness, within ``BENDS`` [N]."""
    force, depth = -felt.force[:, 2], felt.position[0, 2] - felt.position[:, 2]
    pressed = force > FIRM / 2
    wrong = pressed & (np.abs(force - stiffness * depth) > BENDS * stiffness * depth)
    end = int(np.argmax(wrong)) if wrong.any() else len(force)
    return float(force[:end].max(initial=0.0))


def _moved(place: Place, by: Sequence[float]) -> Place:
    return [*(p + d for p, d in zip(place[:3], by, strict=True)), *place[3:]]


def _mean(vectors: Array) -> float:
    return float(haptify.size(vectors).mean())


def _outcome(seeds: Sequence[int], progress: Progress) -> Outcome:
    loaded = config.load("giant")
    assert isinstance(loaded.config, GiantConfig)
    space = workspace(loaded.config, SAMPLES)
    found = []
    for seed in seeds:
        found.append(measure(loaded, seed, progress))
    v = {name: float(np.mean([each.values[name] for each in found])) for name in found[0].values}
    rows = [*_space_rows(space), *_rows(v, loaded)]
    stops = [stop for each in found for stop in each.stops]
    rows.append(Row("stops of the machine in these sessions", "-", str(len(stops)), "; ".join(stops)))
    rows.append(Row("simulated machines", "-", str(len(found)), _plants(found)))
    figures = {**v, "volume": 1e6 * space.volume, "extent": space.extent.tolist(), "stops": stops}
    return Outcome(rows, figures, lambda figure: _draw(figure, space, found[0]), (9.0, 7.0))


def _space_rows(space: Workspace) -> list[Row]:
    x, y, z = space.extent
    note = (
        f"simulated; {z:.2f} m of height by the limits of joint 4 and of the tilt, which the paper does not"
        f" print; over the same floor its volume would be {PAPER['volume'][1][0] / 1e6 / x / y:.2f} m high"
    )
    shape = f"{x:.2f} x {y:.2f} x {z:.2f} / {space.filled:.2f}"
    return [
        _row("workspace volume [cm^3]", "volume", f"{1e6 * space.volume:.3g}", note),
        Row("workspace along x, y, z [m] / share of that box that is filled", "-", shape, "simulated"),
    ]


def _rows(v: dict[str, float], loaded: Loaded) -> list[Row]:
    whole: Any = loaded.config
    twin = whole.giant.twin
    light = (
        f"simulated, at a mean of {v['speed']:.2f} m/s; {LIGHT['mass']:g} kg and {LIGHT['damping']:g} N s/m"
        f" ask for {v['light own']:.2f} N, the machine adds {v['light added']:.2f} N; the paper tells neither"
        " twin nor speed"
    )
    free = (
        f"simulated; {twin.mass:g} kg and {twin.damping:g} N s/m ask for {v['own']:.2f} N, the machine adds"
        f" {v['added']:.2f} N"
    )
    still = (
        "simulated: no belts, no bearings that run, no ripple of motors, no cables; dry friction and the"
        " errors of the sensors are in it"
    )
    plane = (
        f"simulated; {SLIDE_SPEED:g} m/s, pressed with {v['normal']:.1f} N; the twin's"
        f" {twin.mass:g} kg and {twin.damping:g} N s/m ask for {v['surface own']:.2f} N"
    )
    springs = ", ".join(f"{v[f'accuracy {k:g}']:.1f} with {k:g} N/m" for k in STIFFNESSES)
    gave = "the hand, not the machine, is the limit" if v["peak"] > 0.99 * HARD else f"of {HARD:g} N"
    hard = (
        f"simulated, straight down; up to there {STIFFNESSES[-1]:g} N/m are kept within {100 * BENDS:.0f} %;"
        f" {gave}; giant_forces has all directions"
    )
    rows = [
        _row("mean free-space force, the lightest twin [N]", "free force", f"{v['light']:.2f}", light),
        _row(
            "mean free-space force, the twin as configured [N]", "free force", f"{v['free force']:.2f}", free
        ),
        _row(f"vibration RMS above {SHAKES:g} Hz [m/s^2]", "vibration", f"{v['vibration']:.3f}", still),
        _row(
            "vibration, spectral centroid [Hz]", "centroid", f"{v['centroid']:.1f}", "simulated; up to 500 Hz"
        ),
        _row("frictionless surface, mean force in the plane [N]", "surface", f"{v['surface']:.2f}", plane),
        _row("stiffness rendering accuracy [%]", "accuracy", f"{v['accuracy']:.1f}", f"simulated; {springs}"),
        _row("stiffness peak force [N]", "peak", f"{v['peak']:.1f}", hard),
    ]
    for what, units, names, own_ in (
        ("forces", "kg / N s/m / N", DIRECTIONS[:3], f"{twin.mass:g} kg, {twin.damping:g} N s/m"),
        (
            "torques",
            "kg m^2 / N m s/rad / N m",
            DIRECTIONS[3:],
            f"{twin.inertia:g} kg m^2, {twin.rotational_damping:g} N m s/rad",
        ),
    ):
        here = "; ".join(
            f"{name} {v[f'inertia {name}']:.3g} / {v[f'damping {name}']:.3g} / {v[f'rest {name}']:.2g}"
            for name in names
        )
        quantity = f"local dynamic {what}, {SHAKEN_HZ:g} Hz: inertia / damping / RMS of the rest [{units}]"
        rows.append(Row(quantity, "-", here, f"simulated; the twin has {own_}"))
    return rows


def _row(quantity: str, key: str, here: str, note: str) -> Row:
    form, values = PAPER[key]
    paper = "{} (Touch {}, Touch X {})".format(*map(form.format, values))
    return Row(quantity, paper, here, note)


def _plants(found: Sequence[Metrics]) -> str:
    """What they have in common, and how far they lie apart."""
    text = (
        "each of another model than the controller's (masses 20 %, rotors 30 %, springs 40 %, a tick late),"
        " with dry friction and sensors that err"
    )
    if len(found) < 2:
        return text
    spread = []
    for name in ("light", *(key for key in PAPER if key != "volume")):
        values = [each.values[name] for each in found]
        spread.append(f"{name} {min(values):.3g} to {max(values):.3g}")
    return f"{text}; {', '.join(spread)}"


def _draw(figure: Any, space: Workspace, metrics: Metrics) -> None:
    (area, force), (spectrum, press) = figure.subplots(2, 2)
    heights, areas = space.slices
    area.plot(areas, heights, color="tab:blue")
    area.set(xlabel="area that the handle reaches [m^2]", ylabel="height [m]")
    speed = haptify.size(metrics.free.velocity)[::20]
    force.plot(speed, haptify.size(metrics.free.force)[::20], ".", ms=2, color="tab:blue")
    force.set(xlabel="speed of the free handle [m/s]", ylabel="force of the hand [N]")
    spectrum.loglog(metrics.spectrum.frequency, np.sqrt(metrics.spectrum.density), color="tab:blue", lw=0.8)
    spectrum.set(xlabel="frequency [Hz]", ylabel="free-space vibration [m/s^2 / sqrt(Hz)]")
    for (k, felt), line in zip(metrics.presses.items(), ("-", "--", "-.", ":"), strict=True):
        depth = 1e3 * (felt.position[0, 2] - felt.position[::20, 2])
        name = f"{k:g} N/m" if k else f"{STIFFNESSES[-1]:g} N/m, hard"
        press.plot(depth, -felt.force[::20, 2], ls=line, label=name)
    press.set(xlabel="depth [mm]", ylabel="force of the hand [N]")
    press.legend(fontsize=7)
