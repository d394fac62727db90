"""Who may talk to the server: addresses, names of hosts, origins and the token."""

from __future__ import annotations

import hmac
import ipaddress
import re
import secrets
import socket
from dataclasses import dataclass
from urllib.parse import parse_qs, urlsplit

from teamsight.core import checks

_LEAST_TOKEN, _MOST_TOKEN = 8, 200
_HOST = re.compile(r"(?P<name>\[[0-9a-fA-F:.]+\]|[A-Za-z0-9._-]+)(:(?P<port>[0-9]{1,5}))?")
_TOKEN = re.compile(r"[A-Za-z0-9_-]+")


@dataclass(frozen=True)
class Access:
    """What a request must have to be answered.

    Attributes
    ----------
    host : str
        The address at which the server listens.
    token : str or None
        What the address of the page must carry as ``?token=…``; None if nothing is asked for.
    """

    host: str
    token: str | None

    @property
    def address(self) -> str:
        """The address to listen at: "localhost" may be two, each with a port of its own."""
        return "127.0.0.1" if self.host == "localhost" else self.host

    def refusal(self, path: str, host: str | None, origin: str | None, site: str | None, *, is_socket: bool) -> str:
        """Return why a request is refused; an empty text if it is not.

        Parameters
        ----------
        path : str
            Path and query of the request.
        host, origin, site : str or None
            The headers Host, Origin and Sec-Fetch-Site.
        is_socket : bool
            Whether the request opens the socket, which must come from a page of this server.
        """
        if host is None or not self._is_known(host):
            # A name of somebody else that leads here (DNS rebinding) would make a foreign page one of ours.
            return "the Host header is not a name of this server"
        if origin is not None and origin not in (f"http://{host}", f"https://{host}"):
            return "the Origin header is that of another site"
        if is_socket and origin is None:
            return "the Origin header is missing"
        if is_socket and site not in (None, "same-origin"):
            return "the request comes from another site"
        if self.token is not None and not self._is_token(path):
            return "the token is wrong or missing; open the address that teamsight printed"
        return ""

    def _is_known(self, host: str) -> bool:
        found = _HOST.fullmatch(host)
        if not found:
            return False
        name = found["name"].strip("[]").lower()
        if is_loopback(self.host):
            return is_loopback(name)
        return is_address(name) or name in ("localhost", self.host.lower(), socket.gethostname().lower())

    def _is_token(self, path: str) -> bool:
        given = parse_qs(urlsplit(path).query, max_num_fields=16).get("token", [""])[-1]
        return hmac.compare_digest(given.encode(), str(self.token).encode())


def access_to(host: str, token: str | None) -> Access:
    """Return what requests must have if the server listens at `host`.

    Parameters
    ----------
    host : str
        An address or a name of this computer.
    token : str or None
        The token; an empty text for a new one. An address that other computers can reach needs one.

    Raises
    ------
    TypeError, ValueError
        If the address can be reached from elsewhere and there is no token, or the token is too short or has other
        characters than letters, digits, ``-`` and ``_``.
    """
    if not isinstance(host, str) or not host:
        raise TypeError(f"host={checks.shown(host)}: must be an address, such as '127.0.0.1'")
    if token is None:
        if not is_loopback(host):
            raise ValueError(
                f"host={checks.shown(host)}: can be reached from other computers, which needs a token; give --token "
                "with a word of your own, or --token '' for a new one"
            )
        return Access(host, None)
    if token == "":
        return Access(host, secrets.token_urlsafe(16))
    if not isinstance(token, str) or not _TOKEN.fullmatch(token) or not _LEAST_TOKEN <= len(token) <= _MOST_TOKEN:
        raise ValueError(
            f"token: must have {_LEAST_TOKEN} to {_MOST_TOKEN} letters, digits, '-' and '_'; give '' for a new one"
        )
    return Access(host, token)


def is_address(name: str) -> bool:
    """Return whether a text is an IP address."""
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def is_loopback(name: str) -> bool:
    """Return whether an address, or a name, is that of this computer only."""
    return name == "localhost" or (is_address(name) and ipaddress.ip_address(name).is_loopback)
