"""What goes wrong with the link; the codes are those of docs/errors.md."""

from __future__ import annotations


class LinkError(Exception):
    """The other station cannot be reached, or does not speak as it should.

    Attributes:
        code: stable name of the error.
        exit_status: of a command that ends with it.
    """

    code = "link"
    exit_status = 1


class KeysError(LinkError):
    """Keys or certificates that cannot be used: which file, why, and how to mend it."""

    code = "link-keys"
    exit_status = 2


class RefusedError(LinkError):
    """One of the stations does not want the other.

    Attributes:
        cause: a word for it, as counted: "role", "lease", "identity", ...
    """

    code = "link-refused"

    def __init__(self, cause: str, why: str) -> None:
        super().__init__(why)
        self.cause = cause
