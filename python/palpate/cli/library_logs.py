"""What the libraries of the page's server log: one line in the terminal, the whole with --debug."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager

import click

LIBRARIES = ("asyncio", "starlette", "uvicorn", "websockets")
_MOST = 20


class OneLine(logging.Handler):
    """Prints an error as one line, without its traceback, and each only once: a client could cause it again and again."""

    def __init__(self) -> None:
        super().__init__(logging.ERROR)
        self._printed: set[str] = set()

    def emit(self, record: logging.LogRecord) -> None:
        """Print a record, unless it is about what a client has sent."""
        if record.getMessage().startswith("Invalid "):
            return
        error = record.exc_info[1] if record.exc_info else None
        said = f"{type(error).__name__}: {error}" if error else record.getMessage()
        if said.startswith("Traceback "):
            said = said.splitlines()[-1]
        line = f"page: {record.name}: {' '.join(said.split())[:200]}; --debug shows more"
        if line not in self._printed and len(self._printed) < _MOST:
            self._printed.add(line)
            click.echo(line, err=True)


@contextmanager
def library_logs(*, debug: bool) -> Iterator[None]:
    """Print what the libraries log: errors as one line, or everything from warnings on with its traceback."""
    handler = logging.StreamHandler() if debug else OneLine()
    handlers = {}
    for name in LIBRARIES:
        logger = logging.getLogger(name)
        handlers[logger] = logger.propagate
        logger.propagate = False
        logger.addHandler(handler)
    try:
        yield
    finally:
        for logger, propagate in handlers.items():
            logger.removeHandler(handler)
            logger.propagate = propagate
