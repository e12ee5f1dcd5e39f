"""Meshes of STL and OBJ files: what is in them, what is felt of them, and what is said of broken ones."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from random import Random

import numpy as np
import pytest
from hapticd.configs import read_text
from hapticd.machines.rhi.bodies import environment
from hapticd.machines.rhi.config import RhiConfig
from hapticd.machines.rhi.mesh import MOST_TRIANGLES, read_mesh
from hapticd.machines.rhi.shapes import Sphere
from hapticd.runtime.command_line.cli import main
from hapticd.runtime.configuration import config
from hapticd.runtime.configuration.beside import UnfitFileError
from hapticd.runtime.configuration.session import build
from hapticd.runtime.configuration.toml_lines import key_lines
from hapticd.runtime.errors import ConfigError

from . import meshes

FORMATS: dict[str, tuple[str, Callable[[meshes.Mesh], bytes]]] = {
    "binary": ("organ.stl", meshes.binary_stl),
    "ASCII": ("organ.STL", meshes.ascii_stl),
    "OBJ": ("organ.obj", meshes.obj),
}
BALL = read_text("panda_rhi.toml").partition("[rhi.bodies.ball]")[2].partition("[rhi.hold]")[0]
CENTRE, RADIUS = (0.45, 0.15, 0.38), 0.05
ORGAN = """
kind = "solid"
mesh = "organ.stl"
unit = "mm"
point = "0.45 0.15 0.38 m"
stiffness = "1000 N/m"
damping = "5 N s/m"
"""
COUNT = 120
"""Damaged copies of each file."""


def written(folder: Path, content: bytes, *changes: tuple[str, str], machine: str = "panda_rhi") -> str:
    """Path of a machine whose ball is a mesh."""
    body = ORGAN
    for old, new in changes:
        assert old in body
        body = body.replace(old, new, 1)
    text = read_text(f"{machine}.toml")
    text = text.replace("scan = 2000", "scan = 60")
    if machine == "panda_rhi":
        text = text.replace(BALL, f"{body}\n", 1)
        model = "panda.urdf"
    else:
        text, model = (
            text.replace("[rhi.hold]", f"[rhi.bodies.ball]\n{body}\n[rhi.hold]", 1),
            f"{machine}.urdf",
        )
    (folder / model).write_text(read_text(model))
    (folder / "organ.stl").write_bytes(content)
    path = folder / "machine.toml"
    path.write_text(text)
    return str(path)


def refusal(path: str) -> tuple[str, str]:
    """The only thing that is wrong with a machine, and the line that it is about."""
    with pytest.raises(ConfigError) as error:
        build(config.load(path))
    (found,) = error.value.findings
    assert found.fix and error.value.source == path
    return str(found), Path(path).read_text().splitlines()[found.line - 1]


@pytest.mark.parametrize("name", FORMATS)
def test_a_file_holds_the_mesh_and_vertices_that_coincide_are_one(name: str) -> None:
    file, write = FORMATS[name]
    vertices, faces = meshes.torus()
    found = read_mesh(file, write((vertices, faces)))
    assert len(found.vertices) == len(vertices) and len(found.triangles) == len(faces)
    corners = 1e-3 * found.vertices[found.triangles]
    np.testing.assert_allclose(corners, vertices[faces], atol=1e-8)


def test_faces_of_many_corners_are_fans_and_indices_may_count_back() -> None:
    content = b"""mtllib some.mtl
v 0 0 0
v 0 1 0 1.0
v 1 1 0 0.5 0.5 0.5
v 1 0 0
vt 0 0
vn 0 0 1
g side
f 1/1/1 2//1 3/1 4
l 1 2
v 0 0 -1
f -1 1 -2 # apex
"""
    found = read_mesh("a.obj", content)
    corners = found.vertices[found.triangles].tolist()
    assert corners == [
        [[0, 0, 0], [0, 1, 0], [1, 1, 0]],
        [[0, 0, 0], [1, 1, 0], [1, 0, 0]],
        [[0, 0, -1], [0, 0, 0], [1, 0, 0]],
    ]


@pytest.mark.parametrize(
    ("file", "content", "told"),
    [
        ("a.ply", b"ply", "is neither STL nor OBJ"),
        ("a.stl", b"", "has 0 bytes"),
        ("a.stl", meshes.binary_stl(meshes.box())[:-1], "683 bytes, and a binary STL of the 12"),
        ("a.stl", meshes.ascii_stl(meshes.box())[:-20], "ends before its"),
        ("a.stl", meshes.ascii_stl(meshes.box()).replace(b"vertex", b"vertx", 1), "'vertx' in its line 4"),
        ("a.stl", meshes.ascii_stl(meshes.box()).replace(b"3.0", b"nan", 1), "no finite number in its line"),
        ("a.stl", b"solid\nouter loop\nvertex 0 0 0\nendloop\nendsolid", "a loop of 1 corners in its line 4"),
        ("a.stl", b"solid x\nendsolid x", "holds no triangles"),
        ("a.obj", b"v 0 0\n", "has 2 numbers in its line 1, where 3 belong"),
        ("a.obj", b"v 0 0 0\nf 1 1 2\n", "a corner '2' in its line 2, and 1 vertices before it"),
        ("a.obj", b"v 0 0 0\nf 1 1\n", "a face of 2 corners in its line 2"),
        ("a.obj", b"v 0 0 0\nf 1 1 1\n", "holds no triangles that have an extent"),
        ("a.obj", b"v 1e39 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\n", "a corner of triangle 1 that is no number"),
        ("a.obj", b"v 0 0 0\nf 1 \\\n1 1\n", "goes on in another line after its line 2"),
        ("a.obj", b"v 0 0 0\n" + b"f 1 1 1\n" * 25_001, f"25001 triangles; the most are {MOST_TRIANGLES}"),
    ],
    ids=range(15),
)  # fmt: skip
def test_what_is_wrong_with_a_file_is_said(file: str, content: bytes, told: str) -> None:
    with pytest.raises(UnfitFileError) as error:
        read_mesh(file, content)
    assert told in error.value.problem and error.value.fix


def of_file(path: str) -> RhiConfig:
    found = config.load(path).config
    assert isinstance(found, RhiConfig)
    return found


def test_a_ball_of_triangles_is_felt_as_a_ball(tmp_path: Path) -> None:
    """To the sagitta of its triangles and what cells of 4 mm round off: together half a millimetre."""
    content = meshes.binary_stl(meshes.ball(4, RADIUS))
    organ = environment({"ball": of_file(written(tmp_path, content)).rhi.bodies["ball"]})
    exact, rng = Sphere(CENTRE, RADIUS), np.random.default_rng(3)
    for _ in range(100):
        away = rng.standard_normal(3)
        x = (np.array(CENTRE) + away * rng.uniform(0.4, 1.1) * RADIUS / np.linalg.norm(away)).tolist()
        depth, inwards = exact.depth(x)
        force = np.array(organ.force(x))
        np.testing.assert_allclose(force, -1000.0 * max(0.0, depth) * np.array(inwards), atol=0.5)


def test_unit_scale_point_and_turn_say_where_it_is(tmp_path: Path) -> None:
    """A box of 10 x 8 x 6 cm in metres, half as large, turned about z, then moved."""
    changes = ('unit = "mm"', 'unit = "m"\nscale = 0.5\nturn = "0 0 90 deg"\ncell = "3 mm"')
    path = written(tmp_path, meshes.binary_stl(meshes.box(), 1.0), changes)
    organ = environment({"ball": of_file(path).rhi.bodies["ball"]})
    for along, half in zip(np.eye(3), (0.02, 0.025, 0.015), strict=True):
        organ.force((np.array(CENTRE) + (half - 2e-3) * along).tolist())
        assert organ.depth == pytest.approx(2e-3, abs=1e-6)


def test_a_solid_that_is_written_down_is_turned_and_moved_as_well() -> None:
    square = ["-0.1 -0.05 m", "0.1 -0.05 m", "0.1 0.05 m", "-0.1 0.05 m"]
    body = (
        f'kind = "solid"\nvertices = {square}\nturn = "90 deg"\npoint = "0.5 0.3 m"\nstiffness = "900 N/m"\n'
    )
    text = read_text("rhi.toml").replace("[rhi.hold]", f"[rhi.bodies.square]\n{body}\n[rhi.hold]")
    parsed = config.parse(text.replace("scan = 4000", "scan = 60"), "rhi.toml")
    assert isinstance(parsed, RhiConfig)
    organ = environment({"square": parsed.rhi.bodies["square"]})
    organ.force([0.5, 0.21])
    assert organ.depth == pytest.approx(0.01, abs=1e-6)
    build(config.Loaded("rhi", parsed, text, "rhi.toml", read_text("rhi.urdf"), "rhi.urdf"))


VERTICES, FACES = meshes.ball(2, RADIUS)
OPEN = VERTICES, FACES[1:]
DIFFERENT = VERTICES, np.concatenate([FACES[:1, ::-1], FACES[1:]])
FLAT = VERTICES * (1, 1, 0), FACES
SQUARE = 'vertices = ["0 0 0 m", "1 0 0 m", "1 1 0 m"]'
MESH, GOOD = 'mesh = "organ.stl"', meshes.binary_stl((VERTICES, FACES))


@pytest.mark.parametrize(
    ("content", "changes", "told", "line"),
    [
        (meshes.binary_stl(OPEN), [], '"organ.stl" is not closed at 3 edges, the first from (', MESH),
        (meshes.binary_stl(DIFFERENT), [], "turn differently at 3 edges, the first from (", MESH),
        (meshes.binary_stl(FLAT), [], '"organ.stl" encloses nothing', MESH),
        (GOOD, [('"mm"', '"m"')], '"organ.stl" needs ', MESH),
        (GOOD, [('"mm"', '"mm"\nscale = 0.02')], "thicker than a cell: it is 0.002 x 0.002 x 0.002 m", MESH),
        (GOOD[:-3], [], '"organ.stl" has ', MESH),
        (GOOD, [("organ.stl", "../organ.stl")], '"../organ.stl" leaves the folder', 'mesh = "../organ.stl"'),
        (GOOD, [("organ.stl", "origin.stl")], 'no mesh "origin.stl" beside it', 'mesh = "origin.stl"'),
        (GOOD, [('unit = "mm"\n', "")], 'unit: is missing: "organ.stl" says none', "[rhi.bodies.ball]"),
        (GOOD, [(MESH, "")], "has neither vertices nor a mesh", "[rhi.bodies.ball]"),
        (GOOD, [(MESH, SQUARE)], "unit: is that of a mesh, and there is none", 'unit = "mm"'),
        (GOOD, [("0.45 0.15", "2.45 0.15")], "away from everything", 'point = "2.45 0.15 0.38 m"'),
        (GOOD, [("0.15 0.38", "0.15")], "point: holds 2 entries", 'point = "0.45 0.15 m"'),
        (GOOD, [(MESH, f'{MESH}\ntriangles = [[0, 1, 2]]')], "says again what", "triangles = [[0, 1, 2]]"),
        (GOOD, [(MESH, f"{MESH}\nmash = 1")], "mash: unknown key", "mash = 1"),
    ],
    ids=lambda given: f"{len(given)} bytes" if isinstance(given, bytes) else str(given)[:40],
)  # fmt: skip
def test_what_is_wrong_with_a_mesh_is_said_with_its_line(
    tmp_path: Path, content: bytes, changes: list[tuple[str, str]], told: str, line: str
) -> None:
    found, at = refusal(written(tmp_path, content, *changes))
    assert told in found
    assert at.startswith(line)


def test_an_open_edge_is_where_the_file_says(tmp_path: Path) -> None:
    found, _ = refusal(written(tmp_path, meshes.binary_stl(OPEN)))
    corners = [f"({' '.join(f'{x:.6g}' for x in np.float32(1e3 * VERTICES[k]))})" for k in FACES[0]]
    assert sum(corner in found for corner in corners) == 2


def test_a_file_that_is_too_large_is_refused(tmp_path: Path) -> None:
    found, _ = refusal(written(tmp_path, bytes((16 << 20) + 1)))
    assert '"organ.stl" is larger than 16777216 bytes' in found
    again = ORGAN.replace("0.15 0.38", "0.1 0.38")
    both = ('damping = "5 N s/m"\n', f'damping = "5 N s/m"\n\n[rhi.bodies.another]{again}')
    found, _ = refusal(written(tmp_path, meshes.binary_stl(meshes.ball(5, RADIUS)), both))
    assert "rhi.bodies.another.mesh" in found and "bytes in a recording; the most are 1000000" in found


def test_a_planar_device_has_no_mesh(tmp_path: Path) -> None:
    found, at = refusal(written(tmp_path, GOOD, machine="rhi"))
    assert (
        '"organ.stl" is a mesh in space, and the task has 2 directions; give the corners of an outline'
        in found
    )
    assert at == MESH


def test_what_is_kept_is_judged_as_a_file_is(tmp_path: Path) -> None:
    kept = ('damping = "5 N s/m"\n', 'damping = "5 N s/m"\n[rhi.bodies.ball.kept]\nobj = "v 0 0 0"\n')
    assert '"organ.stl" holds no triangles' in refusal(written(tmp_path, GOOD, kept))[0]
    alone = (MESH + '\nunit = "mm"\n', SQUARE + "\n")
    assert "kept: belongs to no file" in refusal(written(tmp_path, GOOD, kept, alone))[0]


def test_a_table_in_braces_is_refused_with_its_line(tmp_path: Path) -> None:
    path = Path(written(tmp_path, GOOD))
    text = path.read_text()
    braces = (
        'kind = "solid", mesh = "organ.stl", unit = "mm", point = "0.45 0.15 0.38 m", stiffness = "900 N/m"'
    )
    text = text.replace(f"[rhi.bodies.ball]{ORGAN}", f"[rhi.bodies]\nball = {{ {braces} }}\n")
    path.write_text(text)
    found, at = refusal(str(path))
    assert "mesh: stands in braces" in found and "write a table [rhi.bodies.ball]" in found
    assert at.startswith("ball = ")


def test_names_that_no_key_may_have_bare_are_kept_in_quotes(tmp_path: Path) -> None:
    path = Path(written(tmp_path, GOOD))
    path.write_text(path.read_text().replace("[rhi.bodies.ball]", '[rhi.bodies."my ball"]'))
    body = of_file(str(path)).rhi.bodies["my ball"]
    assert getattr(body, "kept", None) is not None


def test_check_names_file_line_and_edge(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = written(tmp_path, meshes.ascii_stl(OPEN))
    assert main(["check", path]) == 2
    told = capsys.readouterr().err
    line = key_lines(Path(path).read_text())["rhi.bodies.ball.mesh"]
    assert f'{path}:{line}: rhi.bodies.ball.mesh: "organ.stl" is not closed at 3 edges' in " ".join(
        told.split()
    )
    (tmp_path / "organ.stl").write_bytes(GOOD)
    assert main(["check", path]) == 0


def damaged(content: bytes, random: Random) -> bytes:
    """A file with some bytes changed, cut out or put in."""
    data = bytearray(content)
    for _ in range(random.choice((1, 1, 2, 8))):
        at = random.randrange(len(data))
        match random.randrange(4):
            case 0:
                data[at] = random.randrange(256)
            case 1:
                data[at] ^= 1 << random.randrange(8)
            case 2:
                del data[at : at + random.choice((1, 50, len(data)))]
            case 3:
                data[at:at] = random.randbytes(random.choice((1, 4, 50)))
        if not data:
            break
    return bytes(data)


@pytest.mark.parametrize("name", FORMATS)
def test_a_damaged_file_is_refused_or_is_a_mesh(tmp_path: Path, name: str) -> None:
    """And a mesh that it is by chance is felt, or refused with its line."""
    file, write = FORMATS[name]
    content, refused = write(meshes.ball(1, RADIUS)), 0
    for seed in range(COUNT):
        data = damaged(content, Random(f"{name} {seed}"))
        toml = written(tmp_path, b"", ("organ.stl", file), ('unit = "mm"', 'unit = "mm"\ncell = "8 mm"'))
        (tmp_path / file).write_bytes(data)
        try:
            parsed = of_file(toml)
        except ConfigError as error:
            refused += 1
            (found,) = error.findings
            assert found.key == "rhi.bodies.ball.mesh" and found.line and found.fix, seed
            assert str(error).isprintable(), seed
            continue
        try:
            environment(parsed.rhi.bodies)
        except ValueError as error:
            refused += 1
            assert str(error).isprintable() and ";" in str(error), seed
    assert COUNT / 4 < refused
