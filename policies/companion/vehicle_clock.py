"""The vehicle's clock in full: messages carry 32 bits of its milliseconds since boot, which are over after 49.7 days.

Images carry all of it: who connects to a vehicle that has been up for long learns it from them.
"""

SPAN_MS = 1 << 32
REORDERED_MS = 10_000  # messages that overtook each other
SILENT_MS = 3_600_000  # over the end of 32 bits; more is a restart
_NEVER_UP_US = 10**15  # thirty years: no vehicle has been up for so long


class VehicleClock:
    """Widens what the messages say."""

    def __init__(self) -> None:
        self._wide_ms: int | None = None

    def time_us(self, boot_ms: int) -> int:
        """Since boot [us], of a message that has come in."""
        if self._wide_ms is None:
            self._wide_ms = boot_ms
            return boot_ms * 1000
        last_ms = self._wide_ms % SPAN_MS
        step_ms = (boot_ms - last_ms + SPAN_MS // 2) % SPAN_MS - SPAN_MS // 2
        if -REORDERED_MS <= step_ms <= SILENT_MS:
            self._wide_ms = max(self._wide_ms + step_ms, 0)
        elif boot_ms > last_ms:
            self._wide_ms += boot_ms - last_ms
        else:  # it has restarted
            self._wide_ms = boot_ms
        return self._wide_ms * 1000

    def pictured(self, image_us: int) -> None:
        """Takes the span that an image is from; one that is not of about now in any span tells nothing."""
        if self._wide_ms is None:
            return
        ahead_ms = image_us // 1000 - self._wide_ms
        spans = round(ahead_ms / SPAN_MS)
        if abs(ahead_ms - spans * SPAN_MS) <= REORDERED_MS and image_us < _NEVER_UP_US:
            self._wide_ms = max(self._wide_ms + spans * SPAN_MS, self._wide_ms % SPAN_MS)
