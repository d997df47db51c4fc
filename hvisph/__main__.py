"""Entry point of the command `hvisph` and of `python -m hvisph`, with handling of Ctrl-C during imports."""

import os
import signal
import sys
from types import FrameType

from hvisph.core.errors import INTERRUPTED


def main() -> None:
    """Import the command of the first argument, and run it."""
    # a parent that had it ignored, as `nohup` does, meant it
    ours = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if ours:
        signal.signal(signal.SIGINT, _leave)
    from hvisph.cli.main import HELP, app, function_of

    if not HELP & {*sys.argv[2:]}:
        function_of(*sys.argv[1:2] or [""])
    if ours:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        app(prog_name="hvisph")
    except KeyboardInterrupt:
        _leave(signal.SIGINT, None)


def _leave(number: int, frame: FrameType | None) -> None:
    """End at once: whatever is being imported would report an exception of ours as its own."""
    os.write(2, b"interrupted\n")
    os._exit(INTERRUPTED)


if __name__ == "__main__":
    main()
