"""The redundant interface as a kind of machine."""

from __future__ import annotations

from ...runtime.configuration.system import System
from .check import check_rhi, remarks_on_rhi
from .config import RhiConfig
from .figures import RhiFigures
from .limits import RhiLimits
from .machine import RedundantInterface
from .mesh_files import mesh_files
from .pushed import rhi_pushed
from .scene import RhiScene
from .simulation import rhi_plant
from .stance import rhi_bodies, rhi_stance

RHI = System(
    RhiConfig,
    RedundantInterface,
    RhiLimits,
    lambda config: RhiFigures(),
    rhi_plant,
    check_rhi,
    rhi_stance,
    scene=RhiScene,
    remarks=remarks_on_rhi,
    variations={"bodies": rhi_bodies},
    pushed=rhi_pushed,
    beside=mesh_files,
)
