"""What every test process needs."""

import signal

# A shell that starts the tests in the background has them ignore Ctrl-C, and so would the vehicles they start and stop.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
