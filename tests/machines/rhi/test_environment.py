"""Bodies: depths against closed forms and sampled surfaces, forces against differences of the energy."""

from collections.abc import Callable, Sequence

import numpy as np
import pytest
from hapticd.machines.rhi.environment import Body, Environment
from hapticd.machines.rhi.fields import Assist, Resist
from hapticd.machines.rhi.passivity import SPARE, Tank
from hapticd.machines.rhi.shapes import Box, Plane, Sampled, Shape, Sphere
from hapticd.machines.rhi.solid import solid
from hapticd.machines.rhi.surface import SolidError
from hapticd.machines.rhi.tissue import ENTRY, Spot, Tissue

LAYERS = ((2e-3, 300.0), (5e-3, 1500.0))
TUMOUR = Spot((0.52, 0.12), 0.02, 4.0)
OUTLINE = np.array([(0.4, 0.1), (0.6, 0.08), (0.62, 0.25), (0.5, 0.17), (0.38, 0.24)])
"""Five corners, one of them a notch."""
CUBE = 0.1 * np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
FACES = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1),
         (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)]  # fmt: skip


def tilted() -> np.ndarray:
    return np.array([[0.8, -0.6], [0.6, 0.8]])


SHAPES: dict[str, Callable[[], Shape]] = {
    "plane": lambda: Plane((0.5, 0.1), (1.0, 3.0)),
    "disc": lambda: Sphere((0.5, 0.15), 0.07),
    "box": lambda: Box((0.5, 0.15), (0.2, 0.12), tilted(), 3e-3),
    "outline": lambda: solid(OUTLINE, (), 4e-3),
    "ball": lambda: Sphere((0.5, 0.15, 0.1), 0.08),
    "cube": lambda: solid(CUBE, FACES, 8e-3),
}
MIDDLE = {"cube": (0.05, 0.05, 0.05), "ball": (0.5, 0.15, 0.1)}


@pytest.fixture(scope="module", params=list(SHAPES))
def shape(request: pytest.FixtureRequest) -> tuple[Shape, np.ndarray]:
    return SHAPES[request.param](), np.array(MIDDLE.get(request.param, (0.5, 0.15)))


def energy(body: Body, x: np.ndarray) -> float:
    body.force(x.tolist(), [0.0] * len(x))
    return body.energy


@pytest.mark.parametrize("plain", [True, False])
def test_a_force_is_the_slope_of_the_energy_everywhere(shape: tuple[Shape, np.ndarray], plain: bool) -> None:
    """So no closed way gains anything, corners and layers and spots included."""
    (place, middle), h = shape, 1e-7
    spots = [Spot(middle + shift, radius, 4.0) for shift, radius in ((0.02, 0.05), (-0.03, 0.08))]
    tissue = Tissue(1000.0) if plain else Tissue(800.0, 0.0, LAYERS, spots)
    body, rng, inside = Body(place, tissue), np.random.default_rng(1), 0
    for _ in range(300):
        x = middle + rng.uniform(-0.08, 0.08, len(middle))
        force = body.force(x.tolist(), [0.0] * len(x))
        if force is None:
            assert body.energy == 0.0
            continue
        inside += 1
        steps = h * np.eye(len(x))
        slope = [(energy(body, x + e) - energy(body, x - e)) / (2.0 * h) for e in steps]
        np.testing.assert_allclose(force, np.negative(slope), atol=2e-4 * max(1.0, np.linalg.norm(force)))
    assert inside > 30


def test_the_force_is_continuous_across_corners_and_middles(shape: tuple[Shape, np.ndarray]) -> None:
    """Along straight ways through the body no step is larger than the stiffness and the rounding explain."""
    place, middle = shape
    body, rng, step = Body(place, Tissue(1000.0)), np.random.default_rng(2), 1e-5
    for _ in range(6):
        begin = middle + rng.uniform(-0.12, 0.12, len(middle))
        along = rng.standard_normal(len(middle))
        along *= step / np.linalg.norm(along)
        forces = [
            np.array(body.force((begin + k * along).tolist(), [0.0] * len(begin)) or [0.0] * len(begin))
            for k in range(2000)
        ]
        # gradients turn by at most 2 within about the least rounding, 3 mm, at depths of at most 0.1 m
        assert np.linalg.norm(np.diff(forces, axis=0), axis=1).max() < 1000.0 * step * (1.0 + 2 * 0.1 / 3e-3)


def test_depths_are_distances_next_to_a_side() -> None:
    box = Box((0.5, 0.15), (0.2, 0.12), tilted(), 2e-3)
    outline = SHAPES["outline"]()
    ball = Sphere((0.0, 0.0, 0.0), 0.1)
    for depth in (0.0, 1e-3, 5e-3, 0.015):
        x = np.array([0.5, 0.15]) + tilted() @ [0.03, 0.06 - depth]
        assert box.depth(x.tolist())[0] == pytest.approx(depth, abs=1e-9)
        along = (OUTLINE[1] - OUTLINE[0]) / np.linalg.norm(OUTLINE[1] - OUTLINE[0])
        x = 0.5 * (OUTLINE[0] + OUTLINE[1]) + depth * np.array([-along[1], along[0]])
        assert outline.depth(x.tolist())[0] == pytest.approx(depth, abs=1e-9)
        assert ball.depth([0.0, 0.1 - depth, 0.0])[0] == pytest.approx(depth, abs=1e-12)


def test_a_mesh_of_a_ball_has_the_depth_of_the_ball() -> None:
    """To the sagitta of its triangles, 0.9 mm, and what cells of 8 mm round off, 0.5 mm."""
    rings, around = 12, 24
    angles = [(np.pi * i / rings, 2.0 * np.pi * j / around) for i in range(1, rings) for j in range(around)]
    vertices = [(0.0, 0.0, 0.05), (0.0, 0.0, -0.05)]
    vertices += [
        (0.05 * np.sin(a) * np.cos(b), 0.05 * np.sin(a) * np.sin(b), 0.05 * np.cos(a)) for a, b in angles
    ]

    def at(ring: int, j: int) -> int:
        return 2 + (ring - 1) * around + j % around

    faces = [(0, at(1, j), at(1, j + 1)) for j in range(around)]
    faces += [(1, at(rings - 1, j + 1), at(rings - 1, j)) for j in range(around)]
    for ring in range(1, rings - 1):
        for j in range(around):
            faces += [
                (at(ring, j), at(ring + 1, j), at(ring + 1, j + 1)),
                (at(ring, j), at(ring + 1, j + 1), at(ring, j + 1)),
            ]
    sampled, exact = solid(np.array(vertices), faces, 0.008), Sphere((0.0, 0.0, 0.0), 0.05)
    rng = np.random.default_rng(3)
    for _ in range(50):
        x = rng.standard_normal(3)
        x *= rng.uniform(0.03, 0.05) / np.linalg.norm(x)
        assert sampled.depth(x.tolist())[0] == pytest.approx(exact.depth(x.tolist())[0], abs=1.5e-3)


@pytest.mark.parametrize(
    ("vertices", "triangles", "cell", "problem"),
    [
        (CUBE, FACES[:-1], 0.01, "not closed at 3 edges, the first from vertex 1 to vertex 3, where one"),
        (CUBE, [*FACES[:-1], (1, 3, 7)], 0.01, "turn differently at 3 edges, the first from vertex 1 to"),
        (CUBE, [(0, 1, 9)], 0.01, "from 0 to 7"),
        (CUBE, FACES, 1e-4, "nodes; the most are"),
        (np.array([(0.0, 0.0), (0.1, 0.0), (0.2, 0.0)]), (), 0.01, "encloses nothing"),
    ],
)
def test_a_surface_that_encloses_nothing_is_refused(
    vertices: np.ndarray, triangles: Sequence[Sequence[int]], cell: float, problem: str
) -> None:
    with pytest.raises(SolidError, match=problem):
        solid(vertices, triangles, cell)


def test_layers_add_up() -> None:
    """Stiffness is the slope of the force, layer by layer, and energy its integral."""
    tissue = Tissue(800.0, 0.0, LAYERS)
    depths = np.linspace(0.0, 0.02, 4001)
    force, stored = np.array([tissue.press(d) for d in depths]).T
    stiffness = np.diff(force) / np.diff(depths)
    wanted = np.select([depths[1:] <= 2e-3, depths[1:] <= 7e-3], [300.0, 1500.0], 800.0)
    assert np.count_nonzero(np.abs(stiffness - wanted) > 1e-6 * wanted) <= 2  # the steps across a border
    steps = 0.5 * (force[1:] + force[:-1]) * np.diff(depths)
    np.testing.assert_allclose(stored[1:], np.cumsum(steps), rtol=1e-6, atol=1e-12)


def test_damping_only_dissipates_and_never_pulls() -> None:
    plane = Plane((0.0, 0.1), (0.0, 1.0))
    bare, damped = Body(plane, Tissue(1000.0)), Body(plane, Tissue(1000.0, 20.0))
    rng, pulled = np.random.default_rng(4), 0
    for _ in range(500):
        x, v = [rng.uniform(-0.1, 0.1), rng.uniform(0.1, 0.12)], rng.uniform(-1.0, 1.0, 2).tolist()
        with_it, without = damped.force(x, v), bare.force(x, v)
        assert with_it is not None and without is not None
        assert with_it[1] <= 0.0  # out of the wall, always
        assert (np.array(with_it) - without) @ v <= 1e-12
        pulled += with_it[1] == 0.0
    assert pulled > 20  # there was something to cut
    at = 0.1 + 0.5 * ENTRY
    force = damped.force([0.0, at], [0.0, 0.1])
    assert force is not None
    assert force[1] == pytest.approx(-(1000.0 * 0.5 * ENTRY + 0.5 * 20.0 * 0.1))


def test_contacts_add_up_and_the_tank_keeps_them_passive() -> None:
    """A hand that wanders through several bodies, which are rendered in part, gets no more than it put in."""
    environment = Environment(
        [
            Body(SHAPES["plane"](), Tissue(900.0, 3.0, LAYERS)),
            Body(SHAPES["disc"](), Tissue(500.0, 0.0, (), (TUMOUR,))),
            Body(SHAPES["box"](), Tissue(1500.0)),
        ]
    )
    tank, rng = Tank(2), np.random.default_rng(5)
    work, least, both = 0.0, 0.0, 0
    x, t = np.array([0.5, -0.04]), 1e-3
    force = np.zeros(2)
    for k in range(12000):
        wanted = [0.5 + 0.15 * np.sin(0.0021 * k + np.sin(0.0007 * k)), 0.13 - 0.17 * np.cos(0.0031 * k)]
        v = (np.array(wanted) - x) / t
        work -= float(force @ v) * t
        x = x + v * t
        demand = np.array(environment.force(x.tolist(), v.tolist()))
        both += sum(part.depth > 0.0 for part in environment.parts) > 1
        share = tank.update(x.tolist(), environment.energy) * rng.uniform(0.2, 1.0)
        force = share * demand
        tank.render(force.tolist(), share)
        if environment.energy == 0.0:
            least, work = min(least, work), 0.0
    assert both > 1000
    assert least >= -5.0 * SPARE


def test_a_field_assists_with_no_more_than_it_holds_and_another_resists() -> None:
    assist = Assist((0.5, 0.1), 4.0, 0.01)
    force = assist.force([0.3, 0.1], [0.0, 0.0])
    assert force is not None
    assert force[0] == pytest.approx(4.0, rel=2e-3) and force[1] == 0.0
    h = 1e-6
    for x in (0.3, 0.495, 0.51):
        assist.force([x + h, 0.12], [0.0, 0.0])
        up = assist.energy
        assist.force([x - h, 0.12], [0.0, 0.0])
        slope = (up - assist.energy) / (2.0 * h)
        force = assist.force([x, 0.12], [0.0, 0.0])
        assert force is not None and force[0] == pytest.approx(-slope, abs=1e-6)
    assert Environment([assist]).granted == assist.energy > 0.0
    resist = Resist((0.5, 0.1), 0.1, 15.0)
    assert resist.force([0.5, 0.1], [0.2, -0.1]) == [-3.0, 1.5]
    assert resist.force([0.61, 0.1], [0.2, -0.1]) is None


def test_a_field_that_assists_moves_the_hand_and_stops_giving_when_it_is_spent() -> None:
    """To the place and back and again, for as long as anybody likes: work never exceeds what was granted."""
    field = Environment([Assist((0.0,), 5.0, 0.01)])
    tank, x = Tank(1), 0.1
    field.force([x])
    tank.reset(field.granted)
    granted, got, force = field.granted, 0.0, 0.0
    for k in range(4000):
        before, x = x, 0.1 * np.cos(0.004 * k) ** 2 + 0.02
        got += force * (x - before)
        demand = field.force([x])
        # rendered better on the way in than on the way out: without a tank that pumps energy into the hand
        share = tank.update([x], field.energy) * (1.0 if x < before else 0.3)
        force = share * demand[0]
        tank.render([force], share)
        assert got <= granted + 1.1 * SPARE
    assert got > 0.9 * granted


def test_the_surface_next_to_a_place() -> None:
    environment = Environment([Body(SHAPES["box"](), Tissue(1.0)), Body(SHAPES["outline"](), Tissue(1.0))])
    rng, found = np.random.default_rng(6), 0
    for _ in range(100):
        x = rng.uniform((0.35, 0.05), (0.65, 0.25))
        if (place := environment.surface(x.tolist())) is None:
            continue
        found += 1
        (point, inwards), depths = place, []
        for part in environment.parts:
            assert part.shape
            depths.append(part.shape.depth(place[0])[0])
        assert min(abs(d) for d in depths) < 1e-6
        assert np.linalg.norm(inwards) == pytest.approx(1.0)
        deeper = np.array(point) + 1e-4 * np.array(inwards)
        assert max(p.shape.depth(deeper.tolist())[0] for p in environment.parts if p.shape) > 0.0
    assert found > 20


def test_off_its_grid_a_solid_is_nowhere() -> None:
    outline = SHAPES["outline"]()
    assert isinstance(outline, Sampled)
    for far in ([5.0, 0.1], [0.5, -3.0]):
        assert outline.depth(far)[0] < 0.0
