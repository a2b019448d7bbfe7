"""Limits of the live page: what is counted before it is parsed, and what a refused request costs."""

import asyncio
import time
from collections.abc import Callable
from typing import Any

import pytest
from effort import examples
from hypothesis import given
from hypothesis import strategies as st
from live_bench import HOST, OWN, PORT
from palpate.live.access.gatekeeper import Gatekeeper, has_token, new_token
from palpate.live.access.guarded import fault
from palpate.live.access.limits import HEAD, LINES, Bucket, Limit

TOKEN = "Q4h-Zk_0aBcDeFgHiJkLmNoPqRsTuVwX"
_WORK_S = 0.005


@given(st.lists(st.tuples(st.floats(0, 3), st.floats(0, 20)), max_size=60))
@examples(100)
def test_a_bucket_gives_no_more_than_its_limit(asked: list[tuple[float, float]]) -> None:
    now, given_ = 0.0, 0.0
    bucket = Bucket(Limit(per_s=7, at_once=11), clock=lambda: now)
    for wait, count in asked:
        now += wait
        given_ += count if bucket.take(count) else 0
        assert given_ <= 11 + 7 * now + 1e-9


def test_a_bucket_gives_its_limit() -> None:
    now = 0.0
    bucket = Bucket(Limit(per_s=10, at_once=2), clock=lambda: now)
    got = 0
    for tick in range(1000):
        now = tick / 100
        got += bucket.take()
    assert got == 2 + 99


@pytest.mark.parametrize(
    ("head", "part"),
    [
        (b"POST / HTTP/1.1\r\n", "GET and HEAD"),
        (b"\x16\x03\x01\x02\x00", "GET and HEAD"),
        (b"GET / HTTP/1.1\r\n" + b"a: b\r\n" * LINES, f"{LINES} lines"),
        (b"GET / HTTP/1.1\r\nCookie: " + b"x" * HEAD, f"{HEAD} in"),
        (b"GET / HTTP/1.1\r\n\r\nGET / HTTP/1.1\r\n\r\n", "one on a connection"),
        (b"GET / HTTP/1.1\r\nContent-Length: 5\r\n\r\nhello", "one on a connection"),
    ],
)
def test_requests_that_are_not_parsed(head: bytes, part: str) -> None:
    assert part in fault(head)


@given(st.integers(0, 200))
def test_a_request_in_parts_is_no_fault(size: int) -> None:
    assert fault(b"GET /recording/run.csv HTTP/1.1\r\nHost: 127.0.0.1:8746\r\n\r\n"[:size]) == ""


async def _page(_scope: Any, _receive: Any, send: Any) -> None:
    await send({"type": "http.response.start", "status": 200})


def _asked(app: Gatekeeper, query: bytes, *headers: tuple[bytes, bytes]) -> dict[str, Any]:
    """Ask for the page; return the beginning of the answer."""
    told: list[dict[str, Any]] = []

    async def send(message: Any) -> None:
        told.append(message)

    async def receive() -> dict[str, Any]:
        return {"type": "http.request"}

    scope = {"type": "http", "path": "/", "query_string": query, "headers": [(b"host", OWN.encode()), *headers]}
    asyncio.run(app(scope, receive, send))
    return told[0]


def _answer(token: str | None, query: bytes, *headers: tuple[bytes, bytes]) -> int:
    return int(_asked(Gatekeeper(_page, HOST, PORT, token), query, *headers)["status"])


def _cookie(value: str) -> tuple[bytes, bytes]:
    return (b"cookie", value.encode("latin-1"))


@pytest.mark.parametrize(
    ("cookie", "status"),
    [
        (f"palpate-{PORT}={TOKEN}", 200),
        (f"theme=dark; palpate-{PORT}={TOKEN}; _xsrf=2|a|b", 200),
        (f"palpate-{PORT}=old;palpate-{PORT}={TOKEN}", 200),
        (f'bad"name={{]; palpate-{PORT}={TOKEN}', 200),
        (f"palpate-{PORT + 1}={TOKEN}", 403),
        (f"palpate-{PORT}={TOKEN}x", 403),
        (f"palpate-{PORT}={TOKEN[:-1]}", 403),
        (f"xpalpate-{PORT}={TOKEN}", 403),
        (f"palpate-{PORT}", 403),
        ("\xff; =; ;;", 403),
    ],
)
def test_the_one_cookie_is_read(cookie: str, status: int) -> None:
    assert _answer(TOKEN, b"", _cookie(cookie)) == status
    assert has_token(TOKEN)(f"Cookie: {cookie}\r\n".encode("latin-1")) or status == 403


@pytest.mark.parametrize("site", ["cross-site", "same-site", "", "none, cross-site"])
def test_what_another_page_asks_is_refused(site: str) -> None:
    assert [_answer(None, b"", (b"sec-fetch-site", own)) for own in (b"same-origin", b"none")] == [200, 200]
    assert _answer(None, b"", (b"sec-fetch-site", site.encode())) == 403
    assert _answer(TOKEN, b"token=" + TOKEN.encode(), (b"sec-fetch-site", site.encode())) == 403


def test_a_ticket_is_valid_once() -> None:
    """And gives the cookie of the token; a second browser that has seen it gets nothing."""
    ticket = new_token()
    app = Gatekeeper(_page, HOST, PORT, TOKEN, ticket)
    first, second = (_asked(app, b"token=" + ticket.encode()) for _ in range(2))
    assert (first["status"], second["status"]) == (303, 403)
    assert f"palpate-{PORT}={TOKEN};".encode() in dict(first["headers"])[b"set-cookie"]
    assert _asked(app, b"token=" + ticket.encode(), _cookie(f"palpate-{PORT}={TOKEN}"))["status"] == 200
    assert has_token(TOKEN, ticket)(b"GET /?token=" + ticket.encode() + b" HTTP/1.1")


_LONGEST = {
    "backslashes": _cookie(f'palpate-{PORT}="' + "\\" * HEAD + '"'),
    "cookies": _cookie("; ".join([f"palpate-{PORT}=x"] * (HEAD // 15))),
    "semicolons": _cookie(";" * HEAD),
    "equal signs": _cookie("=" * HEAD),
}


def _least(work: Callable[[], object]) -> float:
    """Return the shortest of some times, s: the machine may be busy."""
    times = []
    for _ in range(10):
        begun = time.thread_time()
        work()
        times.append(time.thread_time() - begun)
    return min(times)


@pytest.mark.parametrize("kind", _LONGEST)
def test_the_work_before_the_token_is_short(kind: str) -> None:
    name, value = _LONGEST[kind]
    assert _least(lambda: _answer(TOKEN, b"", (name, value))) < _WORK_S
    assert _least(lambda: _answer(TOKEN, value)) < _WORK_S
    assert _least(lambda: has_token(TOKEN)(value)) < _WORK_S
    assert _least(lambda: fault(b"GET /" + value)) < _WORK_S
