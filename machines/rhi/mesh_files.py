"""Files of meshes that a configuration names, and what a recording keeps of them."""

from __future__ import annotations

from ...runtime.configuration.beside import Beside
from .config import RhiConfig, RhiSolid
from .mesh import MOST_BYTES, read_mesh
from .obj import obj_lines


def mesh_files(config: RhiConfig) -> list[Beside]:
    """Those that the text does not hold yet."""
    return [
        _file(name, body.mesh)
        for name, body in config.rhi.bodies.items()
        if isinstance(body, RhiSolid) and body.mesh is not None and body.kept is None
    ]


def _file(body: str, file: str) -> Beside:
    def keep(content: bytes) -> str:
        mesh = read_mesh(file, content)
        lines = "\n".join(obj_lines(mesh.vertices, mesh.triangles))
        return f"obj = '''\n{lines}\n'''\n"

    return Beside(("rhi", "bodies", body), "mesh", file, MOST_BYTES, "mesh", keep)
