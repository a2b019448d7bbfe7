"""Access control: requests from this machine by the page itself; from other machines only with the token."""

import ipaddress
import secrets
from http.cookies import CookieError, SimpleCookie
from urllib.parse import parse_qs

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
}
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
    """Return a random secret, for an address that other machines can reach."""
    return secrets.token_urlsafe(24)


class Gatekeeper:
    """Refuses requests that do not come from the page.

    Host must be the server's own address; another name for it is a sign of DNS rebinding. Origin must be that of the
    page, if the browser sends one; the web socket always needs it. A token must be in the query of the first request;
    then a cookie stores it.

    Parameters
    ----------
    app : ASGI application
    host : str
        Address at which the server listens.
    port : int
    token : str, optional
    """

    def __init__(self, app: ASGIApp, host: str, port: int, token: str | None = None) -> None:
        self._app, self._host, self._port, self._token = app, host, port, token
        self._cookie = f"palpate-{port}"

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Forward a request, or refuse it."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        if reason := self._refusal(scope):
            await _refuse(reason, scope, receive, send)
        elif self._token and scope["type"] == "http" and self._asked(scope):
            answer = RedirectResponse("/", 303, HEADERS)
            answer.set_cookie(self._cookie, self._token, httponly=True, samesite="strict")
            await answer(scope, receive, send)
        else:
            await self._app(scope, receive, _with_headers(send))

    def _refusal(self, scope: Scope) -> str:
        headers = Headers(scope=scope)
        host, origin = headers.getlist("host"), headers.getlist("origin")
        if len(host) != 1 or not self._is_own(host[0]):
            return "Host: not this page's own"
        if origin != [f"http://{host[0]}"] and (origin or scope["type"] == "websocket"):
            return "Origin: not this page's own"
        if self._token and not (self._asked(scope) or self._kept(headers)):
            return "token: missing or wrong; open the address that palpate printed"
        return ""

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
        query = parse_qs(scope["query_string"].decode("latin-1"), max_num_fields=None)
        return self._right(query.get("token", [""])[0])

    def _kept(self, headers: Headers) -> bool:
        try:
            morsel = SimpleCookie(headers.get("cookie", "")).get(self._cookie)
        except CookieError:
            return False
        return morsel is not None and self._right(morsel.value)

    def _right(self, given: str) -> bool:
        return secrets.compare_digest(given.encode("utf-8", "replace"), (self._token or "").encode())


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


async def _refuse(reason: str, scope: Scope, receive: Receive, send: Send) -> None:
    if scope["type"] == "websocket":
        await receive()
        await send({"type": "websocket.close", "code": 1008, "reason": reason})
    else:
        await PlainTextResponse(f"{reason}\n", 403, HEADERS)(scope, receive, send)


def _with_headers(send: Send) -> Send:
    async def sending(message: Message) -> None:
        if message["type"] == "http.response.start":
            given = [(name.lower().encode(), value.encode()) for name, value in HEADERS.items()]
            message = {**message, "headers": [*message.get("headers", []), *given]}
        await send(message)

    return sending
