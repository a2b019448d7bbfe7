"""Who gets an answer from the server of the page: requests that come from the page itself, with the token."""

import ipaddress
import secrets

from starlette.datastructures import MutableHeaders
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.requests import HTTPConnection
from starlette.responses import HTMLResponse, PlainTextResponse, RedirectResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

HEADERS = {
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' data:; "
        "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    ),
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
}
NO_TOKEN = "token: missing or wrong; open the address that palpate live printed in its terminal; each start prints a new one"
_NO_TOKEN_PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>palpate: this address is not valid</title>
<meta name="viewport" content="width=device-width, initial-scale=1">
<style>
:root { color-scheme: light dark; }
body { margin: 0; padding: 8vh 1.5rem; background: light-dark(#f3f4f6, #121517);
  color: light-dark(#1a1c1e, #eceff1); font: 1.13rem/1.45 system-ui, sans-serif; }
main { max-width: 38rem; margin: auto; padding: 1.2rem 1.6rem 1.6rem; border-radius: 6px;
  background: light-dark(#fff, #1d2125); border: 1px solid light-dark(#d5d9dd, #363c42); }
h1 { font-size: 1.2rem; margin: 0 0 1rem; }
h2 { font-size: 2.2rem; line-height: 1.15; margin: 0 0 1rem; }
p { margin: 0.6rem 0; }
code { font-size: 1.05em; padding: 0.1em 0.4em; border-radius: 4px;
  background: light-dark(#e6e8ea, #363c42); }
</style></head>
<body><main><h1>palpate</h1><h2>This address is not valid.</h2>
<p>Its token is missing, or is that of an earlier start.</p>
<p>Open the address in the terminal where <code>palpate live</code> runs. If it does not run any
more, start it: <code>palpate live</code> prints a new address, and opens it.</p>
</main></body></html>
"""
_NO_TOKEN_POLICY = (
    "default-src 'none'; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'"
)
ADMIT = "palpate.admit"
"""Key in the state of a request: the function to call once its connection has shown the token."""
# "[": Starlette before 1.9 cuts [::1]:8746 at its first colon
_LOOPBACK = ["localhost", "127.0.0.1", "[::1]", "["]
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


class Gatekeeper:
    """Refuses requests that do not come from the page."""

    # `Host` must be a name of the server: another name is a sign of DNS rebinding. `Origin` must be the page's own where
    # the browser sends it; a web socket always needs it. `Sec-Fetch-Site` of a browser names the page that asks: only the
    # page itself may, and a tab that opens it. The token is the first part of the path, and all addresses in the page are
    # relative: a cookie would also go to other servers of this machine, since it knows no port.

    def __init__(self, app: ASGIApp, host: str, port: int, token: str | None = None) -> None:
        self._app = app
        self._token = token
        # At every address any Host is valid: the names under which other computers reach it are not known, and a token is needed.
        names = [f"[{host}]" if ":" in host else host]
        if host in _ANYWHERE:
            names = ["*"]
        if is_loopback(host):
            names += _LOOPBACK
        self._hosts = TrustedHostMiddleware(self._enter, names, www_redirect=False)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Forward a request, or refuse it."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
        else:
            await self._hosts(scope, receive, _with_headers(send))

    async def _enter(self, scope: Scope, receive: Receive, send: Send) -> None:
        request = HTTPConnection(scope)
        refusal = _stranger(request, scope["type"])
        first, slash, _ = scope["path"].removeprefix("/").partition("/")
        if self._token and not _equal(first, self._token):
            refusal = refusal or NO_TOKEN
        answer: ASGIApp = self._app
        if refusal == NO_TOKEN and request.headers.get("sec-fetch-dest") == "document":
            answer = HTMLResponse(
                _NO_TOKEN_PAGE, 403, {"Content-Security-Policy": _NO_TOKEN_POLICY}
            )
        elif refusal:
            answer = PlainTextResponse(f"{refusal}\n", 403)
        elif self._token and not slash:
            answer = RedirectResponse(f"/{self._token}/", 303)
        elif self._token:
            scope = {**scope, "root_path": f"/{self._token}"}
        if not refusal and ADMIT in scope.get("state", {}):
            scope["state"][ADMIT]()
        await answer(scope, receive, send)


def _stranger(asked: HTTPConnection, kind: str) -> str:
    """Return why a request is not one of the page itself; "": it is."""
    origins = asked.headers.getlist("origin")
    if origins != [f"http://{asked.headers['host']}"] and (origins or kind == "websocket"):
        return "Origin: not this page's own"
    site = asked.headers.get("sec-fetch-site", "none")
    opens_a_tab = asked.headers.get("sec-fetch-dest") == "document"
    if kind == "http" and site not in ("none", "same-origin") and not opens_a_tab:
        return "Sec-Fetch-Site: another page asks; open the address in a tab of its own"
    return ""


def _equal(given: str, secret: str) -> bool:
    return secrets.compare_digest(given.encode("utf-8", "replace"), secret.encode())


def _with_headers(send: Send) -> Send:
    """Return a function that sends with `HEADERS`; one that the application has set itself stays as it is."""

    async def sending(message: Message) -> None:
        if message["type"].endswith("http.response.start"):  # of a web socket that is refused, too
            own = MutableHeaders(raw=list(message.get("headers", [])))
            for name, value in HEADERS.items():
                own.setdefault(name, value)
            message = {**message, "headers": own.raw}
        await send(message)

    return sending
