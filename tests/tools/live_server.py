"""A running `palpate live`."""

import json
import os
import signal
import subprocess
import sys
from contextlib import closing
from http.client import HTTPConnection
from pathlib import Path
from typing import Self
from urllib.parse import urlsplit

SOURCE = "sim:four-specimens?seed=1"
PATIENCE_S = 90  # long, since a busy machine is slow


class Live:
    """A server in a separate process."""

    def __init__(
        self,
        *options: str,
        source: str = SOURCE,
        port: int = 0,
        told: int = subprocess.DEVNULL,
        browser: Path | None = None,
    ) -> None:
        command = [sys.executable, "-m", "palpate", "live", source, "--json", "--port", str(port)]
        environment = dict(os.environ)
        if browser:
            environment |= {"BROWSER": str(browser), "DISPLAY": ":none"}
        else:
            command.append("--no-open")
        self.process = subprocess.Popen(
            [*command, *options],
            stdout=subprocess.PIPE,
            stderr=told,
            text=True,
            env=environment,
        )
        assert self.process.stdout
        self.address: str = json.loads(self.process.stdout.readline())["address"]

    @property
    def port(self) -> int:
        """Port of the server."""
        return urlsplit(self.address).port or 80

    @property
    def lab(self) -> str:
        """Address of the third depth of the page."""
        return f"{self.address}#lab"

    @property
    def origin(self) -> str:
        """Address without the token."""
        return f"http://{urlsplit(self.address).netloc}/"

    def __enter__(self) -> Self:
        """Return the server."""
        return self

    def __exit__(self, *_: object) -> None:
        """End the server, also after an error."""
        if self.process.poll() is None:
            self.end(signal.SIGKILL)

    def end(self, how: int = signal.SIGINT) -> int:
        """End the server; return its exit code."""
        self.process.send_signal(how)
        if self.process.stdout:
            self.process.stdout.close()
        return self.process.wait(PATIENCE_S)

    @property
    def token(self) -> str:
        """Token of the address."""
        return urlsplit(self.address).path.strip("/")

    def asks(self, path: str, token: str = "") -> int:
        """Ask with this token; return the status."""
        connection = HTTPConnection(urlsplit(self.address).netloc, timeout=PATIENCE_S)
        connection.request("GET", f"/{token}{path}" if token else path)
        with closing(connection):
            return connection.getresponse().status
