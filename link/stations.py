"""Stations, their roles, and how a certificate says both."""

from __future__ import annotations

import re
from enum import StrEnum
from typing import Final, NamedTuple

from cryptography import x509

from .errors import KeysError

NAME: Final = re.compile(r"[a-z0-9][a-z0-9-]{0,31}")
"""Of a station; a folder is called so, too."""
SCHEME: Final = "hapticd"


class Role(StrEnum):
    """What a station may do.

    An avatar is moved, and never asks. An operator moves it, one at a time. A maintainer may end an
    operator's session, and moves nothing. An observer may ask who moves it, and look at what a publisher
    shows; neither moves anything.
    """

    AVATAR = "avatar"
    OPERATOR = "operator"
    MAINTAINER = "maintainer"
    OBSERVER = "observer"
    PUBLISHER = "publisher"

    @property
    def waits(self) -> bool:
        """Whether others call such a station, and it calls nobody."""
        return self in (Role.AVATAR, Role.PUBLISHER)


class Station(NamedTuple):
    """Who holds a certificate."""

    name: str
    role: Role

    def __str__(self) -> str:
        return f"{self.role} '{self.name}'"

    @property
    def uri(self) -> str:
        """As the certificate has it."""
        return f"{SCHEME}:{self.role}:{self.name}"


def named(name: str, role: Role) -> Station:
    """A station of that name.

    Raises:
        KeysError: no station is called so.
    """
    if not NAME.fullmatch(name):
        raise KeysError(
            f"'{name}' is no name of a station: up to 32 small letters, digits and '-', the first no '-'"
        )
    return Station(name, role)


def station_of(certificate: x509.Certificate) -> Station:
    """Whose certificate it is.

    Raises:
        KeysError: it names no station, or several.
    """
    try:
        names = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
        (uri,) = names.get_values_for_type(x509.UniformResourceIdentifier)
        scheme, role, name = uri.split(":")
        if scheme == SCHEME:
            return named(name, Role(role))
    except (x509.ExtensionNotFound, ValueError, KeysError):
        pass
    raise KeysError(
        "the certificate names no station and role (hapticd:ROLE:NAME); make one with `hapticd link keygen`"
    )
