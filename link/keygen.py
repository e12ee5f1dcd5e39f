"""The lab's own certificate authority, and a folder of keys for each station."""

from __future__ import annotations

import os
import stat
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Final

from cryptography import x509
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from .credentials import AUTHORITY, CERTIFICATE, KEY, read_certificate, read_key
from .errors import KeysError
from .stations import Station

AUTHORITY_FOLDER: Final = "authority"
AUTHORITY_DAYS: Final = 3650
STATION_DAYS: Final = 365
EARLIER: Final = timedelta(hours=1)
"""Valid since before now: the clocks of two hosts differ."""


def keygen(
    folder: Path, stations: list[Station], days: int = STATION_DAYS, now: datetime | None = None
) -> list[Path]:
    """Make a folder of keys for each station, and the authority that signs them if there is none yet.

    Args:
        folder: of all of them; the authority's key stays there.
        stations: whose.
        days: how long the certificates hold, but no longer than the authority's own.
        now: since when; None: the time of day.

    Returns:
        The folders of the stations.

    Raises:
        KeysError: a folder exists, or the authority's files cannot be used.
        OSError: something cannot be written.
    """
    names = [station.name for station in stations]
    for name in names:
        if names.count(name) > 1 or name == AUTHORITY_FOLDER:
            raise KeysError(f"'{name}' is named twice, or is the authority's folder; choose another name")
        if os.path.lexists(folder / name):
            raise KeysError(
                f"{folder / name} exists already, and nothing is overwritten; name another station, or delete"
                " that folder if no station uses it any more"
            )
    now = now or datetime.now(UTC)
    _folder(folder, exist_ok=True)
    home = folder / AUTHORITY_FOLDER
    if not os.path.lexists(home):
        _make_authority(home, now)
    authority, key = read_certificate(home / AUTHORITY), read_key(home / KEY)
    if authority.public_key() != key.public_key():
        raise KeysError(f"{home / KEY} is not the key of {home / AUTHORITY}; begin anew in another folder")
    if now >= authority.not_valid_after_utc:
        end = f"{authority.not_valid_after_utc:%Y-%m-%d}"
        raise KeysError(f"{home / AUTHORITY} expired on {end}; begin anew in another folder")
    for station in stations:
        _make_station(folder / station.name, station, now, days, authority, key)
    return [folder / name for name in names]


def _make_authority(home: Path, now: datetime) -> None:
    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, f"hapticd authority {now:%Y-%m-%d}")])
    public = key.public_key()
    certificate = (
        _builder(name, name, public, now, now + timedelta(days=AUTHORITY_DAYS))
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .add_extension(_usage(key_cert_sign=True), critical=True)
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(public), critical=False)
        .sign(key, SHA256())
    )
    _folder(home)
    _write(home / KEY, _pem(key), 0o600)
    _write(home / AUTHORITY, certificate.public_bytes(Encoding.PEM), 0o644)


def _make_station(
    home: Path,
    station: Station,
    now: datetime,
    days: int,
    authority: x509.Certificate,
    signer: ec.EllipticCurvePrivateKey,
) -> None:
    key = ec.generate_private_key(ec.SECP256R1())
    purpose = ExtendedKeyUsageOID.SERVER_AUTH if station.role.waits else ExtendedKeyUsageOID.CLIENT_AUTH
    end = min(now + timedelta(days=days), authority.not_valid_after_utc)
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, station.name)])
    public, signing = key.public_key(), signer.public_key()
    certificate = (
        _builder(name, authority.subject, public, now, end)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(_usage(digital_signature=True), critical=True)
        .add_extension(x509.ExtendedKeyUsage([purpose]), critical=True)
        .add_extension(
            x509.SubjectAlternativeName([x509.UniformResourceIdentifier(station.uri)]), critical=False
        )
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(public), critical=False)
        .add_extension(x509.AuthorityKeyIdentifier.from_issuer_public_key(signing), critical=False)
        .sign(signer, SHA256())
    )
    _folder(home)
    _write(home / KEY, _pem(key), 0o600)
    _write(home / CERTIFICATE, certificate.public_bytes(Encoding.PEM), 0o644)
    _write(home / AUTHORITY, authority.public_bytes(Encoding.PEM), 0o644)


def _builder(
    subject: x509.Name, issuer: x509.Name, public: ec.EllipticCurvePublicKey, now: datetime, end: datetime
) -> x509.CertificateBuilder:
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(public)
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - EARLIER)
        .not_valid_after(end)
    )


def _usage(digital_signature: bool = False, key_cert_sign: bool = False) -> x509.KeyUsage:
    return x509.KeyUsage(
        digital_signature=digital_signature,
        key_cert_sign=key_cert_sign,
        crl_sign=False,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        encipher_only=False,
        decipher_only=False,
    )


def _pem(key: ec.EllipticCurvePrivateKey) -> bytes:
    return key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())


def _folder(path: Path, exist_ok: bool = False) -> None:
    try:
        path.mkdir(mode=0o700)
    except FileExistsError:
        if not (exist_ok and path.is_dir()):
            raise


def _write(path: Path, content: bytes, mode: int) -> None:
    """A new file with just this mode, whatever the umask: never one that was there, nor through a link."""
    descriptor = os.open(
        path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW, stat.S_IRUSR | stat.S_IWUSR
    )
    with os.fdopen(descriptor, "wb") as file:
        os.fchmod(descriptor, mode)
        file.write(content)
        file.flush()
        os.fsync(descriptor)
