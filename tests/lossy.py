"""A bad radio: loses, repeats and reorders what goes through it, the same way each time for a seed."""

import numpy as np

LOSS, REPEAT, LATE = 0.10, 0.05, 0.10
LATE_FRAMES_MAX = 3


class LossyLink:
    """A client's end of a link, made bad in both directions; `receive` is called once per frame."""

    def __init__(self, link, seed):
        self._link = link
        self._rng = np.random.default_rng(seed)
        self._frame = 0
        self._late_in, self._late_out = [], []  # (frame, piece)
        self.lost = 0

    def send(self, data):
        for delay in self._fate():
            if delay:
                self._late_out.append((self._frame + delay, data))
            else:
                self._link.send(data)

    def receive(self):
        self._frame += 1
        for data in self._due(self._late_out):
            self._link.send(data)
        pieces = self._due(self._late_in)
        for data in self._link.receive():
            for delay in self._fate():
                if delay:
                    self._late_in.append((self._frame + delay, data))
                else:
                    pieces.append(data)
        return pieces

    def _fate(self):
        """Delays of the copies that arrive."""
        chance = self._rng.random()
        if chance < LOSS:
            self.lost += 1
            return ()
        delay = int(self._rng.integers(1, LATE_FRAMES_MAX + 1)) if self._rng.random() < LATE else 0
        return (delay, 0) if chance < LOSS + REPEAT else (delay,)

    def _due(self, late):
        pieces = [data for frame, data in late if frame <= self._frame]
        late[:] = [entry for entry in late if entry[0] > self._frame]
        return pieces

    def close(self):
        self._link.close()
