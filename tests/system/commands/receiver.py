"""Somebody who watches a vehicle's video: FFmpeg, which knows the stream by its session description alone."""

from threading import Event, Thread

import av
import numpy as np

from mission.video.rtp_video import session_description

OPEN_S = 60.0  # wall clock


class Receiver:
    """Decodes what comes to a UDP port, on a thread of its own; a context manager.

    Attributes:
        size: width and height of the pictures.
        count: how many have come.
        latest: the last one, RGB.
    """

    def __init__(self, folder, port):
        self.size, self.count, self.latest = (0, 0), 0, None
        self._description = folder / "watched.sdp"
        self._description.write_text(session_description("127.0.0.1", port))
        self._is_over = Event()
        self._thread = Thread(target=self._watch, daemon=True)

    def _watch(self):
        options = {"protocol_whitelist": "file,udp,rtp", "fflags": "nobuffer"}
        with av.open(str(self._description), format="sdp", options=options, timeout=(OPEN_S, 2.0)) as stream:
            while not self._is_over.is_set():
                try:
                    for frame in stream.decode(video=0):
                        self.size = frame.width, frame.height
                        self.latest = frame.to_ndarray(format="rgb24").astype(np.int16)
                        self.count += 1
                        if self._is_over.is_set():
                            return
                except av.error.ExitError:  # nothing came for a while
                    continue

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._is_over.set()
        self._thread.join(10.0)
