"""The keys and certificates of this station, read and judged before TLS uses them."""

from __future__ import annotations

import os
import ssl
import stat
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

from cryptography import x509
from cryptography.exceptions import InvalidSignature, UnsupportedAlgorithm
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import load_pem_private_key

from .errors import KeysError
from .stations import Role, Station, station_of

AUTHORITY, CERTIFICATE, KEY = "authority.pem", "certificate.pem", "key.pem"
"""Files of a station's folder."""
MAX_BYTES: Final = 65536
ANEW: Final = "make the keys anew with `hapticd link keygen`"


@dataclass(frozen=True)
class Credentials:
    """Who this station is, and what proves it.

    Attributes:
        folder: the files.
        station: whose they are.
        end: until when.
    """

    folder: Path
    station: Station
    end: datetime

    def context(self) -> ssl.SSLContext:
        """TLS 1.3 and nothing older, certificates on both sides, no resumption; an avatar's end waits.

        Raises:
            KeysError: OpenSSL does not take the files.
        """
        server = self.station.role is Role.AVATAR
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER if server else ssl.PROTOCOL_TLS_CLIENT)
        context.minimum_version = context.maximum_version = ssl.TLSVersion.TLSv1_3
        context.check_hostname = False  # stations are known by role and name, wherever they are
        context.verify_mode = ssl.CERT_REQUIRED
        context.verify_flags |= ssl.VERIFY_X509_STRICT
        if server:
            context.num_tickets = 0
        try:
            context.load_verify_locations(self.folder / AUTHORITY)
            context.load_cert_chain(self.folder / CERTIFICATE, self.folder / KEY)
        except (ssl.SSLError, OSError) as error:
            raise KeysError(f"{self.folder}: TLS does not take these files: {error}; {ANEW}") from error
        return context


def load(folder: Path) -> Credentials:
    """The credentials in a folder that `hapticd link keygen` wrote.

    Raises:
        KeysError: a file is missing, may be read by others, is damaged, or does not belong to the others;
            the certificate has expired.
    """
    authority, own = read_certificate(folder / AUTHORITY), read_certificate(folder / CERTIFICATE)
    key = read_key(folder / KEY)
    if own.public_key() != key.public_key():
        raise KeysError(f"{folder / KEY} is not the key of {folder / CERTIFICATE}; copy both from one folder")
    try:
        own.verify_directly_issued_by(authority)
    except (InvalidSignature, ValueError, TypeError) as error:
        raise KeysError(
            f"{folder / CERTIFICATE} is not signed by {folder / AUTHORITY}; copy both from one folder"
        ) from error
    now = datetime.now(UTC)
    for path, each in ((folder / CERTIFICATE, own), (folder / AUTHORITY, authority)):
        if now > each.not_valid_after_utc:
            raise KeysError(f"{path} expired on {each.not_valid_after_utc:%Y-%m-%d %H:%M} UTC; {ANEW}")
        if now < each.not_valid_before_utc:
            raise KeysError(
                f"{path} is not valid before {each.not_valid_before_utc:%Y-%m-%d %H:%M} UTC; is this host's"
                f" clock right? It shows {now:%Y-%m-%d %H:%M} UTC"
            )
    try:
        station = station_of(own)
    except KeysError as error:
        raise KeysError(f"{folder / CERTIFICATE}: {error}") from error
    return Credentials(folder, station, own.not_valid_after_utc)


def read_certificate(path: Path) -> x509.Certificate:
    """A certificate in PEM.

    Raises:
        KeysError: it cannot be read, or is none.
    """
    try:
        return x509.load_pem_x509_certificate(_read(path, secret=False))
    except (ValueError, UnsupportedAlgorithm) as error:
        raise KeysError(f"{path} is not a certificate in PEM ({_said(error)}); {ANEW}") from error


def read_key(path: Path) -> ec.EllipticCurvePrivateKey:
    """A private key in PEM that nobody else may read.

    Raises:
        KeysError: it cannot be read, others may read it, or it is none.
    """
    try:
        key = load_pem_private_key(_read(path, secret=True), password=None)
    except (ValueError, TypeError, UnsupportedAlgorithm) as error:
        raise KeysError(f"{path} is not a private key in PEM without a password; {ANEW}") from error
    if not isinstance(key, ec.EllipticCurvePrivateKey):
        raise KeysError(f"{path} is not a key of an elliptic curve; {ANEW}")
    return key


def _read(path: Path, secret: bool) -> bytes:
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
    except OSError as error:
        raise KeysError(f"{path}: {error.strerror}; {ANEW}, or copy the station's folder here") from error
    with os.fdopen(descriptor, "rb") as file:
        status = os.fstat(descriptor)
        if not stat.S_ISREG(status.st_mode):
            raise KeysError(f"{path} is not a file; {ANEW}")
        if secret and status.st_mode & (stat.S_IRWXG | stat.S_IRWXO):
            raise KeysError(
                f"{path} may be read by others (mode {stat.S_IMODE(status.st_mode):04o}), so it is no secret"
                f" any more if it was like that for long; type: chmod 600 {path}"
            )
        if secret and status.st_uid not in (os.geteuid(), 0):
            raise KeysError(f"{path} belongs to another user; type: sudo chown $USER {path}")
        content = file.read(MAX_BYTES + 1)
    if len(content) > MAX_BYTES:
        raise KeysError(f"{path} is larger than {MAX_BYTES} bytes; this is no key; {ANEW}")
    return content


def _said(error: Exception) -> str:
    return str(error).partition("\n")[0][:80] or type(error).__name__
