"""Errors of hvisph and their exit codes."""

from collections.abc import Iterator
from contextlib import contextmanager
from difflib import get_close_matches

FEW = 6  # names that a message lists even where one of them looks like what was meant
INTERRUPTED = 130  # exit code of what a signal ended: 128 + SIGINT, as shells have it


class HvisphError(Exception):
    """Base of every error that hvisph raises on purpose."""

    exit_code = 3


class CaseError(HvisphError):
    """Bad input at the dotted path `where`, `file` and `line`: the fault, the allowed values and the nearest."""

    exit_code = 2

    def __init__(self, message: str, where: str = "", file: str = "", line: int | None = None):
        self.message, self.where, self.file, self.line = message, where, file, line
        super().__init__(str(self))

    def __str__(self) -> str:
        text = f"{self.where}: {self.message}" if self.where else self.message
        if self.file and self.line is not None:
            return f"{text} ({self.file}, line {self.line})"
        return f"{text} ({self.file})" if self.file else text


class OutputError(HvisphError):
    """A file or folder could not be written or read: disk full, no permission, damaged, foreign."""

    exit_code = 3


class RunError(HvisphError):
    """A run failed while computing: value that is not finite, excessive speed, too short a time step."""

    exit_code = 3


@contextmanager
def computable() -> Iterator[None]:
    """Raise `CaseError` where arithmetic fails in this block: the numbers of the case are too extreme."""
    try:
        yield
    except ArithmeticError as error:
        detail = str(error.args[-1] if error.args else error).lower()
        fault = f"numbers of the case lead beyond what can be computed ({detail}); look for one that is far too large"
        raise CaseError(f"{fault} or too small") from error


@contextmanager
def locate(where: str, file: str = "") -> Iterator[None]:
    """Put `where` before the path of the field that a `CaseError` of this block names, and `file` where it has none."""
    try:
        yield
    except CaseError as error:
        path = ".".join(filter(None, (where, error.where)))
        raise CaseError(error.message, path, error.file or file, error.line) from error


def suggest_nearest(word: str, allowed: list[str] | tuple[str, ...]) -> str:
    """Return ``"; did you mean 'x'?"`` for the closest of `allowed`; the list of them if short or none is close."""
    close = get_close_matches(str(word), list(allowed), n=1, cutoff=0.5)
    if close:
        listing = f" (allowed: {', '.join(allowed)})" if 1 < len(allowed) <= FEW else ""
        return f"; did you mean '{close[0]}'?{listing}"
    return "; allowed: " + ", ".join(allowed) if allowed else ""
