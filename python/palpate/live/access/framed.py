"""Access control of a page in a frame of another page, as in the cell of a notebook.

Browsers keep no strict cookie for a frame, so each request has the token in its path. That path is also what permits the
frame: a page that does not know it can show nothing of this server. What is given up against `Gatekeeper`: the token
stays in the address, where the page around it and the saved notebook have it, until the server ends.
"""

import secrets

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

from palpate.live.access.gatekeeper import HEADERS, Gatekeeper, refuse, with_headers

FRAMED_HEADERS = HEADERS | {
    "Content-Security-Policy": HEADERS["Content-Security-Policy"].partition("; frame-ancestors")[0]
}
"""Any page that knows the path may frame it: what Jupyter runs at cannot be known, as in an editor."""
ENDED = "token: missing or wrong; this page has ended: run the cell again"


def begin(token: str) -> str:
    """Return the begin of all paths: `has_token` finds the token there.

    Examples
    --------
    >>> begin("abc")
    '/token=abc/'
    """
    return f"/token={token}/"


class Framed(Gatekeeper):
    """Refuses requests that do not have the token in their path, and all that `Gatekeeper` refuses.

    But for one: the page itself may be asked for by another page, as a frame in it.

    Parameters
    ----------
    app : ASGI application
        Gets the path behind the token.
    host : str
    port : int
    token : str
    """

    def __init__(self, app: ASGIApp, host: str, port: int, token: str) -> None:
        super().__init__(app, host, port)
        self._begin = begin(token).encode()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Forward a request, or refuse it."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        given, size = scope["path"].encode(), len(self._begin)
        inner = {**scope, "path": "/" + given[size:].decode(), "raw_path": b"/" + given[size:]}
        known = secrets.compare_digest(given[:size], self._begin)
        reason = self._refusal(inner, Headers(scope=scope)) if known else ENDED
        if reason:
            await refuse(reason, scope, receive, send)
        else:
            await self._app(inner, receive, with_headers(send, FRAMED_HEADERS))

    def _may_ask(self, scope: Scope, headers: Headers) -> bool:
        opened = scope["path"] == "/" and headers.getlist("sec-fetch-dest") == ["iframe"]
        return opened or super()._may_ask(scope, headers)
