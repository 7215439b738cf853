"""TLS with a certificate made here: what listeners on the way and browsers get, and pairs that cannot be used."""

import datetime as dt
import ipaddress
import ssl
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest
from api_server import Server, serving
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import NameOID
from websockets.sync.client import connect

from gcs.__main__ import main
from gcs.api.listening import ListenError, Tls
from gcs.api.settings import ApiSettings
from gcs.store.keys import Role
from gcs.store.store import Store

DAY = dt.timedelta(days=1)


def self_signed(folder: Path, name: str = "server", password: bytes | None = None) -> Tls:
    """A pair for 127.0.0.1, good for two days."""
    key = ec.generate_private_key(ec.SECP256R1())
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "gcs test")])
    now = dt.datetime.now(dt.UTC)
    address = x509.SubjectAlternativeName([x509.IPAddress(ipaddress.ip_address("127.0.0.1"))])
    made = x509.CertificateBuilder().subject_name(subject).issuer_name(subject).public_key(key.public_key())
    made = made.serial_number(x509.random_serial_number()).not_valid_before(now - DAY).not_valid_after(now + DAY)
    certificate = made.add_extension(address, critical=False).sign(key, hashes.SHA256())
    hidden = serialization.BestAvailableEncryption(password) if password else serialization.NoEncryption()
    form = serialization.PrivateFormat.PKCS8
    pair = Tls(folder / f"{name}.pem", folder / f"{name}-key.pem")
    pair.certificate.write_bytes(certificate.public_bytes(serialization.Encoding.PEM))
    pair.key.write_bytes(key.private_bytes(serialization.Encoding.PEM, form, hidden))
    return pair


@pytest.fixture
def pair(tmp_path: Path) -> Tls:
    return self_signed(tmp_path)


@pytest.fixture
def encrypted(server_store: Store, tmp_path: Path, pair: Tls) -> Iterator[Server]:
    settings = ApiSettings(host="0.0.0.0", dashboard=tmp_path / "none")
    with serving(server_store, settings, pair) as server:
        yield server


def trusting(pair: Tls) -> ssl.SSLContext:
    """A client that trusts this certificate and no other."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.load_verify_locations(pair.certificate)
    return context


def test_requests_and_streams_are_encrypted_and_browsers_are_told_to_stay_so(encrypted: Server, pair: Tls) -> None:
    headers = {"authorization": f"Bearer {encrypted.keys[Role.VIEWER]}"}
    with httpx.Client(base_url=encrypted.url, headers=headers, verify=trusting(pair), trust_env=False) as client:
        for path in ("/healthz", "/api/v1/drones", "/nothing"):
            assert client.get(path).headers["strict-transport-security"] == "max-age=31536000"
    url = encrypted.stream_url
    assert url.startswith("wss://")
    with connect(url, additional_headers=headers, ssl=trusting(pair), proxy=None) as stream:
        assert '"hello"' in str(stream.recv(10.0))


def test_without_tls_nothing_is_promised(keyed: Server) -> None:
    with keyed.client() as client:
        assert "strict-transport-security" not in client.get("/healthz").headers


def test_who_trusts_somebody_else_or_speaks_no_tls_gets_nothing(encrypted: Server, tmp_path: Path) -> None:
    other = trusting(self_signed(tmp_path, "other"))
    with httpx.Client(verify=other, trust_env=False) as client, pytest.raises(httpx.ConnectError):
        client.get(f"{encrypted.url}/healthz")
    with httpx.Client(trust_env=False) as client, pytest.raises(httpx.TransportError):
        client.get(encrypted.url.replace("https", "http") + "/healthz")


def test_ciphers_without_forward_secrecy_are_refused(encrypted: Server, pair: Tls) -> None:
    old = trusting(pair)
    old.maximum_version = ssl.TLSVersion.TLSv1_2
    old.set_ciphers("AES128-GCM-SHA256")  # RSA key exchange
    with httpx.Client(verify=old, trust_env=False) as client, pytest.raises(httpx.ConnectError):
        client.get(f"{encrypted.url}/healthz")


def bad_pairs(folder: Path) -> dict[str, tuple[Tls, str]]:
    """By name: a pair that cannot be used, and what must be said of it."""
    good, other = self_signed(folder), self_signed(folder, "other")
    rubbish = folder / "rubbish.pem"
    rubbish.write_text("no certificate")
    return {
        "missing": (Tls(folder / "none.pem", good.key), "No such file"),
        "another key": (Tls(good.certificate, other.key), "KEY_VALUES_MISMATCH"),
        "rubbish": (Tls(rubbish, good.key), "cannot be used"),
        "password": (self_signed(folder, "hidden", b"secret words"), "without a password"),
    }


@pytest.mark.parametrize("name", ["missing", "another key", "rubbish", "password"])
def test_a_pair_that_cannot_be_used_is_told_in_one_line(tmp_path: Path, name: str) -> None:
    pair, said = bad_pairs(tmp_path)[name]
    with pytest.raises(ListenError) as caught:
        pair.check()
    words = str(caught.value)
    assert said in words
    assert str(pair.certificate) in words
    assert "\n" not in words


def test_the_server_does_not_start_with_a_bad_pair(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pair, said = bad_pairs(tmp_path)["another key"]
    config = tmp_path / "gcs.toml"
    config.write_text(f'[tls]\ncertificate = "{pair.certificate}"\nkey = "{pair.key}"\n', encoding="utf-8")
    words = ["serve", "--config", str(config), "--port", "0", "--store", f"sqlite:///{tmp_path / 'gcs.db'}"]
    assert main(words) == 2
    error = capsys.readouterr().err
    assert (said in error, error.count("\n")) == (True, 1)


def test_a_certificate_without_its_key_is_a_mistake(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    config = tmp_path / "gcs.toml"
    config.write_text('[tls]\ncertificate = "server.pem"\n', encoding="utf-8")
    assert main(["serve", "--config", str(config)]) == 2
    assert "certificate and key go together" in capsys.readouterr().err
