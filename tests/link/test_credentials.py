"""Keys and certificates as files."""

from __future__ import annotations

import os
import shutil
import stat
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.hazmat.primitives.asymmetric import rsa
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat
from hapticd.link.credentials import MAX_BYTES, load, read_certificate
from hapticd.link.errors import KeysError
from hapticd.link.keygen import keygen
from hapticd.link.stations import Role, Station, station_of

ALICE = Station("alice", Role.OPERATOR)


@pytest.fixture
def alice(lab: Path, tmp_path: Path) -> Path:
    """A copy of an operator's folder."""
    return Path(shutil.copytree(lab / "alice", tmp_path / "alice"))


def test_a_folder_tells_whose_it_is(lab: Path) -> None:
    found = load(lab / "alice")
    assert found.station == ALICE
    assert 364 < (found.end - datetime.now(UTC)).days + 1 <= 365


def test_keys_are_for_nobody_elses_eyes_whatever_the_umask(tmp_path: Path) -> None:
    before = os.umask(0)
    try:
        keygen(tmp_path / "keys", [ALICE])
    finally:
        os.umask(before)
    modes = {
        str(path.relative_to(tmp_path)): stat.S_IMODE(path.stat().st_mode)
        for path in sorted((tmp_path / "keys").rglob("*"))
    }
    assert modes == {
        "keys/alice": 0o700,
        "keys/alice/authority.pem": 0o644,
        "keys/alice/certificate.pem": 0o644,
        "keys/alice/key.pem": 0o600,
        "keys/authority": 0o700,
        "keys/authority/authority.pem": 0o644,
        "keys/authority/key.pem": 0o600,
    }


def test_nothing_is_overwritten_and_the_authority_is_used_again(tmp_path: Path) -> None:
    folder = tmp_path / "keys"
    keygen(folder, [ALICE])
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    with pytest.raises(KeysError, match=r"alice exists already, and nothing is overwritten"):
        keygen(folder, [Station("bob", Role.OPERATOR), ALICE])
    keygen(folder, [Station("carol", Role.OBSERVER)])
    assert not (folder / "bob").exists()
    for path, content in before.items():
        assert path.read_bytes() == content
    assert load(folder / "carol").station.role is Role.OBSERVER


@pytest.mark.parametrize("names", [["authority"], ["alice", "alice"]])
def test_two_stations_have_two_names_and_none_is_the_authoritys(tmp_path: Path, names: list[str]) -> None:
    with pytest.raises(KeysError, match="choose another name"):
        keygen(tmp_path / "keys", [Station(name, Role.OPERATOR) for name in names])
    assert not (tmp_path / "keys").exists()


def test_no_certificate_outlives_its_authority(tmp_path: Path) -> None:
    folder = tmp_path / "keys"
    keygen(folder, [ALICE], days=36500)
    own, authority = (
        read_certificate(folder / "alice" / f"{name}.pem") for name in ("certificate", "authority")
    )
    assert own.not_valid_after_utc == authority.not_valid_after_utc
    with pytest.raises(KeysError, match="expired"):
        keygen(folder, [Station("bob", Role.OPERATOR)], now=datetime.now(UTC) + timedelta(days=4000))


@pytest.mark.parametrize("mode", [0o640, 0o604, 0o660, 0o611, 0o777])
def test_a_key_that_others_may_read_is_refused_with_the_command_that_mends_it(alice: Path, mode: int) -> None:
    (alice / "key.pem").chmod(mode)
    with pytest.raises(KeysError, match=rf"mode 0{mode:03o}.*chmod 600 {alice}/key.pem"):
        load(alice)


@pytest.mark.parametrize("name", ["key.pem", "certificate.pem", "authority.pem"])
@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"\0" * 100,
        b"-----BEGIN CERTIFICATE-----\nQUJD\n-----END CERTIFICATE-----\n",
        b"x" * (MAX_BYTES + 1),
    ],
)
def test_a_file_that_is_not_what_it_should_be_is_named(alice: Path, name: str, content: bytes) -> None:
    (alice / name).write_bytes(content)
    with pytest.raises(KeysError, match=f"{alice}/{name} is .*keygen"):
        load(alice)


@pytest.mark.parametrize("name", ["key.pem", "certificate.pem", "authority.pem"])
def test_a_file_that_is_missing_or_no_file_is_named(alice: Path, name: str) -> None:
    (alice / name).unlink()
    with pytest.raises(KeysError, match=rf"{alice}/{name}: No such file.*copy the station's folder here"):
        load(alice)
    os.mkfifo(alice / name, 0o600)
    with pytest.raises(KeysError, match="is not a file"):
        load(alice)


def test_files_of_different_stations_and_authorities_do_not_go_together(alice: Path, lab: Path) -> None:
    shutil.copy(lab / "bob" / "key.pem", alice / "key.pem")
    with pytest.raises(KeysError, match=r"key.pem is not the key of .*certificate.pem"):
        load(alice)
    shutil.copy(lab / "alice" / "key.pem", alice / "key.pem")
    shutil.copy(lab / "strangers" / "alice" / "authority.pem", alice / "authority.pem")
    with pytest.raises(KeysError, match=r"certificate.pem is not signed by .*authority.pem"):
        load(alice)


def test_a_key_of_another_kind_or_with_a_password_is_refused(alice: Path) -> None:
    pem = rsa.generate_private_key(65537, 2048).private_bytes(
        Encoding.PEM, PrivateFormat.PKCS8, NoEncryption()
    )
    (alice / "key.pem").write_bytes(pem)
    with pytest.raises(KeysError, match="is not a key of an elliptic curve"):
        load(alice)


def test_a_certificate_out_of_its_time_is_refused_with_the_time(lab: Path) -> None:
    with pytest.raises(KeysError, match=r"late/certificate.pem expired on \d{4}-\d\d-\d\d .*keygen"):
        load(lab / "late")
    with pytest.raises(KeysError, match=r"early/certificate.pem is not valid before .*clock right"):
        load(lab / "early")


def test_a_certificate_without_a_station_is_refused(lab: Path) -> None:
    with pytest.raises(KeysError, match="names no station and role"):
        station_of(read_certificate(lab / "alice" / "authority.pem"))


@pytest.mark.parametrize(
    "uri",
    [
        "hapticd:operator",
        "hapticd:king:alice",
        "other:operator:alice",
        "hapticd:operator:../x",
        "hapticd:operator:",
    ],
)
def test_a_station_that_is_none_is_refused(uri: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(Station, "uri", property(lambda _: uri))
    keygen(tmp_path / "keys", [ALICE])
    with pytest.raises(KeysError, match="names no station and role"):
        load(tmp_path / "keys" / "alice")


def test_certificates_say_what_they_are_for(lab: Path) -> None:
    for name, purpose in (("alice", "clientAuth"), ("robot", "serverAuth")):
        found = read_certificate(lab / name / "certificate.pem").extensions
        (only,) = found.get_extension_for_class(x509.ExtendedKeyUsage).value
        assert only._name == purpose
        assert not found.get_extension_for_class(x509.BasicConstraints).value.ca
    authority = read_certificate(lab / "alice" / "authority.pem").extensions
    limits = authority.get_extension_for_class(x509.BasicConstraints).value
    assert limits.ca and limits.path_length == 0
