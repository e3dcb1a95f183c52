"""Address of a daemon, and the identity that a client shows it."""

from __future__ import annotations

import ipaddress
import os
import re
import socket
import ssl
from dataclasses import dataclass
from pathlib import Path
from typing import Optional

import grpc

from hapticd.errors import BadArgument

#: Metadata of calls; a lease's token goes with each.
TOKEN_KEY = "hapticd-lease"
DEFAULT_ADDRESS = "127.0.0.1:50051"
_TOKEN = re.compile("[0-9a-f]{32}")


def lease_metadata(token: str) -> tuple[tuple[str, str], ...]:
    """The metadata of a call under the lease of `token`; none for an empty token. Raises BadArgument for a malformed one,
    which gRPC would take for a fault of this program."""
    if not token:
        return ()
    if not _TOKEN.fullmatch(token):
        raise BadArgument(
            "the lease token is malformed", where="lease_token", limit="32 digits 0 … 9, a … f", remedy="use what acquiring the lease returned"
        )
    return ((TOKEN_KEY, token),)

OPTIONS = (
    # A proxy for web traffic must not be used between a client and a device.
    ("grpc.enable_http_proxy", 0),
    ("grpc.use_local_subchannel_pool", 1),
    ("grpc.max_receive_message_length", 64 << 20),
    # A stream over a network that carries nothing any more ends within 15 s. The daemon takes a question each 5 s.
    ("grpc.keepalive_time_ms", 9_000),
    ("grpc.keepalive_timeout_ms", 5_000),
    ("grpc.http2.max_pings_without_data", 0),
)

_ACCEPTED = "host:port (port 1 … 65535), [v6]:port or unix:/path; tls: before a host of this machine"


@dataclass(frozen=True)
class Endpoint:
    """A daemon, and the files that a connection to it needs."""

    address: str
    target: str
    certificates: Optional[Path]

    @staticmethod
    def of(address: Optional[str], certificates: Optional[str]) -> Endpoint:
        """`address` None: $HAPTICD_SERVER, else this machine's default. `certificates`: folder; None: see find_certificates()."""
        address = address or os.environ.get("HAPTICD_SERVER") or DEFAULT_ADDRESS
        target = _target_of(address)
        folder = _find_certificates(address, certificates) if _needs_certificates(address) else None
        return Endpoint(address, target, folder)

    def credentials(self) -> Optional[grpc.ChannelCredentials]:
        """Credentials; None: plain, within this machine."""
        if self.certificates is None:
            return None
        authority, key, certificate = (
            (self.certificates / name).read_bytes() for name in ("authority.crt", "client.key", "client.crt")
        )
        return grpc.ssl_channel_credentials(authority, key, certificate)

    def open(self) -> grpc.Channel:
        credentials = self.credentials()
        if credentials is None:
            return grpc.insecure_channel(self.target, OPTIONS)
        return grpc.secure_channel(self.target, credentials, OPTIONS)

    def open_aio(self) -> grpc.aio.Channel:
        credentials = self.credentials()
        if credentials is None:
            return grpc.aio.insecure_channel(self.target, OPTIONS)
        return grpc.aio.secure_channel(self.target, credentials, OPTIONS)


def why_unreachable(address: str, timeout_s: float) -> tuple[str, str]:
    """What is wrong, and the remedy, if no connection comes about: also a port that speaks in another way than it was
    spoken to. Tries a separate connection."""
    remedy = "start hapticd, or name its address: connect(\"host:port\") or HAPTICD_SERVER"
    if address.startswith("unix:"):
        return "no daemon answers", remedy
    host, port = _split(address)
    try:
        with socket.create_connection((host.strip("[]"), int(port)), timeout_s) as plain:
            if _needs_certificates(address):
                if _speaks_plainly(plain):
                    advice = 'leave "tls:" out, or name' if address.startswith("tls:") else "name"
                    return "this port speaks without certificates", f"{advice} the port of the daemon's [network] listen_tls"
            elif _shows_certificate(plain):
                return "this port expects certificates", f'write "tls:{address}"; certificates: see docs/access.md'
    except OSError:
        pass
    return "no daemon answers", remedy


def _speaks_plainly(connection: socket.socket) -> bool:
    """A daemon answers the beginning of a plain connection (RFC 9113, 3.4) with a frame of settings."""
    connection.sendall(b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + b"\0\0\0\4\0\0\0\0\0")
    return connection.recv(9, socket.MSG_WAITALL)[3:4] == b"\4"


def _shows_certificate(connection: socket.socket) -> bool:
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname = False
    context.verify_mode = ssl.CERT_NONE
    with context.wrap_socket(connection) as encrypted:
        return encrypted.getpeercert(binary_form=True) is not None


def _refuse(address: str, what: str) -> BadArgument:
    return BadArgument(what, where="server address", value=repr(address), limit=_ACCEPTED)


def _split(address: str) -> tuple[str, str]:
    plain = address[4:] if address.startswith("tls:") else address
    host, colon, port = plain.rpartition(":")
    if not colon:
        raise _refuse(address, "the port is missing")
    return host, port


def _target_of(address: str) -> str:
    if address.startswith("unix:"):
        if address == "unix:":
            raise _refuse(address, "the path of the unix socket is missing")
        return address
    host, port = _split(address)
    if not re.fullmatch(r"[0-9]{1,5}", port) or not 1 <= int(port) <= 65535:
        raise _refuse(address, "the port is not a port number")
    if not host:
        raise _refuse(address, "the host is missing")
    bracketed = len(host) > 2 and host[0] == "[" and host[-1] == "]"
    if not bracketed and re.search(r"[:/\s]", host):
        raise _refuse(address, "the host is not a host name")
    return f"dns:///{host}:{port}"


def _needs_certificates(address: str) -> bool:
    """Plain are only connections within this machine."""
    if address.startswith("tls:"):
        return True
    if address.startswith("unix:"):
        return False
    host = _split(address)[0].strip("[]")
    if host == "localhost":
        return False
    try:
        return not ipaddress.ip_address(host).is_loopback
    except ValueError:
        return True


def _find_certificates(address: str, folder: Optional[str]) -> Path:
    """Certificates in `folder` if given, else in the first that exists: $HAPTICD_CERTIFICATES, certificates/HOST and
    certificates in ~/.config/hapticd."""
    if folder is not None:
        places = [Path(folder)]
    elif named := os.environ.get("HAPTICD_CERTIFICATES"):
        places = [Path(named)]
    else:
        base = Path(os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config") / "hapticd" / "certificates"
        places = [base / _split(address)[0].strip("[]"), base]
    chosen = next((place for place in places if (place / "client.crt").is_file()), places[-1])
    for name in ("client.crt", "client.key", "authority.crt"):
        if not (chosen / name).is_file():
            raise BadArgument(
                "there is no certificate for this daemon",
                where=str(chosen / name),
                value=address,
                limit="client.crt, client.key and authority.crt in " + ", ".join(map(str, places)),
                remedy="ask a maintainer of the rig for them, see docs/access.md",
            )
    return chosen
