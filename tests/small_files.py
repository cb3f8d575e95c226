"""A limit on the size of files stands for a full disk."""

import resource
import signal
import sys
from contextlib import contextmanager


@contextmanager
def files_of_at_most(count_bytes):
    """Inside, no file of this process may grow beyond so many bytes: writing to it is an OSError, as on a full disk.

    Python keeps no bytecode meanwhile: that of a module first imported here would be cut off, and stay so.
    """
    limits, keeps_none = resource.getrlimit(resource.RLIMIT_FSIZE), sys.dont_write_bytecode
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    sys.dont_write_bytecode = True
    resource.setrlimit(resource.RLIMIT_FSIZE, (count_bytes, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        sys.dont_write_bytecode = keeps_none
        signal.signal(signal.SIGXFSZ, handler)
