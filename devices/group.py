"""The devices of a group, as arrays of what their kind describes."""

from __future__ import annotations

from typing import ClassVar, TypeAlias

import msgspec
import numpy as np
from numpy.typing import NDArray

from .device import Device, Quantity
from .errors import NetworkError
from .image import ProcessImage

Quantities: TypeAlias = NDArray[np.float64]
Words: TypeAlias = NDArray[np.uint32]


class Group:
    """Views of the image, which a subclass annotates by the names of the fields, one row a device.

    What is put out is read only but for words: the gate alone writes quantities.

    Attributes:
        kind: of the devices; it says which group they are in where nobody says otherwise.
    """

    kind: ClassVar[type[Device]]

    def __init__(self, image: ProcessImage, group: str = "") -> None:
        """Take the views.

        Raises:
            NetworkError: there is no such group, or its devices have other fields.
        """
        name = group or _default(self.kind)
        network = image.network
        if name not in network.groups:
            raise NetworkError("", f"there is no group {name!r}; there are {', '.join(network.groups)}")
        self._devices = [network.devices[i] for i in network.groups[name]]
        for own in [key for key in type(self).__annotations__ if key != "kind"]:
            field = network.fields.get(f"{name}.{own}")
            if field is None or field.kind is Quantity:
                view: NDArray[np.generic] = image[f"{name}.{own}"]
                view.flags.writeable = field is None or not field.output
            else:
                view = image.word(f"{name}.{own}")
            setattr(self, own, view)


def _default(kind: type[Device]) -> str:
    (field,) = (field for field in msgspec.structs.fields(kind) if field.name == "group")
    return str(field.default)
