"""What every test stands on."""

import signal

# A shell that starts the tests in the background has Ctrl-C ignored, here and in every process started from here.
signal.signal(signal.SIGINT, signal.default_int_handler)
