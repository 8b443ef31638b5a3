"""Where the service is, and the headers that every request carries."""

from __future__ import annotations

from dataclasses import dataclass, field
from urllib.parse import quote, urlencode, urlsplit

from rayvox_client.errors import InvalidInputError
from rayvox_client.validation import map_name, path_name

USER_AGENT = "rayvox-client/0.1"


@dataclass(frozen=True)
class Endpoint:
    """The service's address.

    Attributes:
        host, port, tls: where to connect.
        base_path: prefix of every path, for a service behind a proxy.
        api_key: sent as a bearer token.
    """

    host: str
    port: int
    tls: bool
    base_path: str = ""
    api_key: str | None = field(default=None, repr=False)

    @classmethod
    def parse(cls, url: str, api_key: str | None) -> Endpoint:
        """Read `http://host:port/prefix` or `https://...`; InvalidInputError for anything else."""
        if not (url.isascii() and url.isprintable() and " " not in url):
            raise InvalidInputError(f"url = {url!r} must be printable ASCII without spaces")
        try:
            parts = urlsplit(url)
            port = parts.port
        except ValueError as error:
            raise InvalidInputError(f"url = {url!r}: {error}") from error
        if parts.scheme not in ("http", "https") or not parts.hostname or parts.query or parts.fragment:
            raise InvalidInputError(f"url = {url!r} is not of the form http://host:port or https://host:port")
        if parts.username is not None:
            raise InvalidInputError("credentials do not belong into the url; give api_key")
        if api_key is not None and not (api_key and api_key.isascii() and api_key.isprintable() and " " not in api_key):
            raise InvalidInputError("api_key must be printable ASCII without spaces")
        tls = parts.scheme == "https"
        return cls(parts.hostname, port or (443 if tls else 80), tls, parts.path.rstrip("/"), api_key)

    @property
    def authority(self) -> str:
        """The Host header."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{host}:{self.port}"

    @property
    def url(self) -> str:
        """The address as a URL."""
        return f"{'https' if self.tls else 'http'}://{self.authority}{self.base_path}"

    def target(self, path: str, **query: object) -> str:
        """Request target for an API path; query values that are None are left out, booleans become true or false."""
        given = {k: str(v).lower() if isinstance(v, bool) else str(v) for k, v in query.items() if v is not None}
        return f"{self.base_path}/v1/{path}" + (f"?{urlencode(given)}" if given else "")

    def map_target(self, name: str, path: str = "", **query: object) -> str:
        """Request target below one map."""
        escaped = quote(map_name(name), safe="")
        return self.target(f"maps/{escaped}{'/' if path else ''}{path}", **query)

    def robot_target(self, name: str, **query: object) -> str:
        """Request target of one robot."""
        return self.target(f"robots/{quote(path_name(name, 'robot'), safe='')}", **query)

    def websocket_url(self, target: str) -> str:
        """The same service's WebSocket URL of a request target."""
        return f"{'wss' if self.tls else 'ws'}://{self.authority}{target}"

    @property
    def headers(self) -> list[tuple[str, str]]:
        """Headers of every request and handshake."""
        authorization = [("Authorization", f"Bearer {self.api_key}")] if self.api_key is not None else []
        return [("User-Agent", USER_AGENT), *authorization]
