"""Open the page in a browser, beside the server, and without its token in a command line.

Every user of a machine can read the command lines of all programs. The browser therefore gets the name
of a file, which only the user can read, and the file leads to the page.
"""

import webbrowser
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Event, Thread, Timer

from palpate.cli.output import print_message

REMIND_S = 10.0
"""When a page that was not shown is reported, s."""


@contextmanager
def browser(address: str, was_shown: Event) -> Iterator[None]:
    """Open an address in the browser; if it is not shown in time, print it for the user to open."""
    with ExitStack() as end:
        try:
            folder = TemporaryDirectory(prefix="palpate-", ignore_cleanup_errors=True)
            file = Path(end.enter_context(folder)) / "open.html"  # the folder has mode 0700
            file.write_text(_redirect(address), encoding="utf-8")
        except OSError as error:
            print_message(f"no browser opened: {error.strerror}: open {address}")
        else:
            # A browser that stays in the foreground returns when it is closed.
            Thread(target=_open, args=(file.as_uri(),), daemon=True).start()
            reminder = Timer(REMIND_S, remind, (address, was_shown))
            reminder.daemon = True
            reminder.start()
            end.callback(reminder.cancel)
        yield


def remind(address: str, was_shown: Event) -> None:
    """Print the address, unless the page was shown."""
    if not was_shown.is_set():
        print_message(
            f"the browser has not shown the page: open {address} yourself. (A browser from snap "
            "or flatpak cannot read the file that leads to it.)"
        )


def _open(address: str) -> None:
    with suppress(webbrowser.Error):
        webbrowser.open(address)


def _redirect(address: str) -> str:
    """Return a page of HTML that leads to an address."""
    target = escape(address, quote=True)
    return (
        f'<!doctype html><meta charset="utf-8"><meta http-equiv="refresh" content="0;url={target}">'
        f'<title>palpate</title><a href="{target}">palpate</a>\n'
    )
