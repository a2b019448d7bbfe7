"""Access control: requests by the page itself, with the token."""

import ipaddress
import re
import secrets
from collections.abc import Callable, Mapping

from starlette.datastructures import Headers
from starlette.responses import PlainTextResponse, RedirectResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
    "img-src 'self' data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
    "Connection": "close",  # one request on a connection
}
NO_TOKEN = (
    "token: missing or wrong; open the address that palpate live printed in its terminal; each start prints a new one"
)
_LOOPBACK = ("localhost", "127.0.0.1", "::1")
_ANYWHERE = ("0.0.0.0", "::")


def is_loopback(host: str) -> bool:
    """Return whether only this machine can reach a host.

    Examples
    --------
    >>> is_loopback("127.0.0.1"), is_loopback("::1"), is_loopback("0.0.0.0")
    (True, True, False)
    """
    try:
        return host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def new_token() -> str:
    """Return a random secret for the address of the page."""
    return secrets.token_urlsafe(24)


def has_token(*tokens: str | None) -> Callable[[bytes], bool]:
    """Return a function that looks for a token in the beginning of a request; always true without a token.

    It finds what `Gatekeeper` would accept, and more: it decides what a request may cost, not what it may do.

    Examples
    --------
    >>> has_token("abc")(b"GET /?token=abc HTTP/1.1"), has_token("abc")(b"GET / HTTP/1.1")
    (True, False)
    """
    known = [token.encode() for token in tokens if token]
    if not known:
        return lambda _: True
    given = re.compile(rb"=([\w-]{%d})(?![\w-])" % len(known[0]))
    return lambda head: any(secrets.compare_digest(found, token) for found in given.findall(head) for token in known)


class Gatekeeper:
    """Refuses requests that do not come from the page.

    Host must be the server's own address; another name for it is a sign of DNS rebinding. Origin must be that of the
    page, if the browser sends one; the web socket always needs it. Sec-Fetch-Site, if the browser sends it, must say
    that the request comes from the page, or from the user. A token must be in the query of the first request; then a
    cookie stores it. All this takes a time in proportion to the length of the request.

    Parameters
    ----------
    app : ASGI application
    host : str
        Address at which the server listens.
    port : int
    token : str, optional
    ticket : str, optional
        Valid instead of the token, once: a browser gets it on its command line, which other users can see.
    """

    def __init__(self, app: ASGIApp, host: str, port: int, token: str | None = None, ticket: str | None = None) -> None:
        self._app, self._host, self._port, self._token, self._ticket = app, host, port, token, ticket
        self._cookie = f"palpate-{port}"

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Forward a request, or refuse it."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        reason = self._refusal(scope, headers)
        asked = not reason and self._asked(scope)
        if not reason and self._token and not (asked or self._kept(headers)):
            reason = NO_TOKEN
        if reason:
            await refuse(reason, scope, receive, send)
        elif self._token and asked and scope["type"] == "http":
            answer = RedirectResponse("/", 303, HEADERS)
            answer.set_cookie(self._cookie, self._token, httponly=True, samesite="strict")
            await answer(scope, receive, send)
        else:
            await self._app(scope, receive, with_headers(send))

    def _refusal(self, scope: Scope, headers: Headers) -> str:
        host, origin = headers.getlist("host"), headers.getlist("origin")
        if len(host) != 1 or not self._is_own(host[0]):
            return "Host: not this page's own"
        if origin != [f"http://{host[0]}"] and (origin or scope["type"] == "websocket"):
            return "Origin: not this page's own"
        if not self._may_ask(scope, headers):
            return "Sec-Fetch-Site: asked by another page; copy the address into the browser"
        return ""

    def _may_ask(self, _scope: Scope, headers: Headers) -> bool:
        return all(site in ("same-origin", "none") for site in headers.getlist("sec-fetch-site"))

    def _is_own(self, host: str) -> bool:
        name, colon, port = host.rpartition(":")
        if not colon or port.endswith("]"):
            name, port = host, "80"
        name = name.removeprefix("[").removesuffix("]").lower()
        if port != str(self._port):
            return False
        return name == self._host or (is_loopback(self._host) and name in _LOOPBACK) or self._reached_by(name)

    def _reached_by(self, name: str) -> bool:
        """If the server listens at every address, any IP address is valid; a name is not: anyone can register one."""
        return self._host in _ANYWHERE and (name == "localhost" or _is_address(name))

    def _asked(self, scope: Scope) -> bool:
        given = _values(scope["query_string"], b"&", b"token")
        if _has(given, self._ticket):
            self._ticket = None
            return True
        return _has(given, self._token)

    def _kept(self, headers: Headers) -> bool:
        cookies = headers.get("cookie", "").encode("latin-1")
        return _has(_values(cookies, b";", self._cookie.encode()), self._token)


def _values(text: bytes, between: bytes, name: bytes) -> list[bytes]:
    """Return the values of a name in a query or a cookie; each byte is looked at once."""
    return [value.strip() for value in re.findall(rb"(?:^|%b)\s*%b=([^%b]*)" % (between, name, between), text)]


def _has(values: list[bytes], secret: str | None) -> bool:
    return secret is not None and any(secrets.compare_digest(value, secret.encode()) for value in values)


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


async def refuse(reason: str, scope: Scope, receive: Receive, send: Send) -> None:
    """Answer that a request is refused, and why."""
    if scope["type"] == "websocket":
        await receive()
        await send({"type": "websocket.close", "code": 1008, "reason": reason})
    else:
        await PlainTextResponse(f"{reason}\n", 403, HEADERS)(scope, receive, send)


def with_headers(send: Send, headers: Mapping[str, str] = HEADERS) -> Send:
    """Return a function that sends, with these headers; one that the application has set itself stays as it is."""

    async def sending(message: Message) -> None:
        if message["type"] == "http.response.start":
            own = message.get("headers", [])
            known = {name for name, _ in own}
            given = [(name.lower().encode(), value.encode()) for name, value in headers.items()]
            message = {**message, "headers": [*own, *(each for each in given if each[0] not in known)]}
        await send(message)

    return sending
