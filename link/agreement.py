"""What follows from two offers: a refusal, or the keys of a session."""

from __future__ import annotations

from .channel import SessionKeys
from .messages import PROTOCOL, SECRET, Offer, Refused
from .ratchet import roots
from .stations import Station
from .terms import Terms, difference


def refusal(terms: Terms, there: Offer) -> Refused | None:
    """Why this station does not want the other; None where it does."""
    if there.protocol != PROTOCOL:
        return Refused(
            "version", f"protocol {there.protocol} there, {PROTOCOL} here; install the same version"
        )
    if len(there.secret) != SECRET:
        return Refused("message", f"{len(there.secret)} random bytes; {SECRET} are wanted")
    if (there.sends, there.receives) != (terms.receives, terms.sends):
        return Refused(
            "sizes",
            f"{there.sends} bytes a packet there, {terms.receives} expected here; {terms.sends} here,"
            f" {there.receives} expected there; install the same version, and the same configuration",
        )
    different = difference(terms.identity, there.identity)
    if different:
        return Refused(
            "identity", f"the stations differ in {different}; copy one station's files to the other"
        )
    return None


def session_keys(
    session: int, secret_operator: bytes, secret_avatar: bytes, operator: Station, avatar: Station
) -> SessionKeys:
    """Keys that both stations derive from both secrets, and from who they are."""
    names = f"{operator.uri} {avatar.uri}".encode()
    made = roots(secret_operator + secret_avatar, session.to_bytes(8, "little"), names)
    return SessionKeys(session, *made)
