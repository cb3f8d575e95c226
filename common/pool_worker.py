"""Worker processes of a pool that end with the process that began them, however that ends."""

import multiprocessing
import os
import threading


def end_with_parent() -> None:
    """An initializer of a pool's workers: one whose pool was killed would fly on for nobody."""
    threading.Thread(target=_wait_and_end, daemon=True).start()


def _wait_and_end() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
    os._exit(1)
