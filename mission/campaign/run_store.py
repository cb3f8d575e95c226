"""The folder of a campaign: its runs, one line each, written to the disk before the next is counted.

In: records as they come. Out: those that are there, after whatever end of the process; a last line that was torn is cut
off, and its run is flown again.
"""

import fcntl
import json
import os
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from common.files import write_durably
from mission.campaign.runs import Record
from mission.console.option_checks import UserError

RUNS_FILE, CAMPAIGN_FILE = "runs.jsonl", "campaign.json"


class RunStore:
    """A folder that is this process's alone while it is open.

    Args:
        folder: made if it is not there.
        identity: of the campaign, JSON values; the folder of another one is refused.
        must_exist: refuses a folder that holds no campaign.

    Raises:
        UserError: it cannot be used.
    """

    def __init__(self, folder: Path, identity: Any, *, must_exist: bool = False) -> None:
        self.folder, self.path = folder, folder / RUNS_FILE
        if must_exist and not (folder / CAMPAIGN_FILE).is_file():
            raise UserError(f"{folder}: holds no campaign to resume")
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._file = os.open(self.path, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o666)
        except OSError as error:
            raise UserError(f"{folder}: cannot write there: {error.strerror}") from error
        try:
            self._claim()
            self._identify(identity)
            self.records = {record.key: record for record in self._read()}
        except BaseException:
            os.close(self._file)
            raise

    def _claim(self) -> None:
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise UserError(f"{self.folder}: another campaign is writing there; name another --folder") from error

    def _identify(self, identity: Any) -> None:
        path = self.folder / CAMPAIGN_FILE
        text = (json.dumps(identity, indent=1, ensure_ascii=False) + "\n").encode()
        if path.is_file():
            if path.read_bytes() != text:
                raise UserError(f"{self.folder}: holds another campaign; name another --folder")
        elif self.path.stat().st_size:
            raise UserError(f"{self.folder}: holds {RUNS_FILE} but no {CAMPAIGN_FILE}; name another --folder")
        else:
            write_durably(path, text)

    def _read(self) -> list[Record]:
        text = self.path.read_bytes()
        whole = text[: text.rfind(b"\n") + 1]
        if len(whole) < len(text):
            os.ftruncate(self._file, len(whole))
        records = []
        for number, line in enumerate(whole.splitlines(), 1):
            try:
                records.append(Record.from_json(json.loads(line)))
            except (ValueError, TypeError, KeyError) as error:
                raise UserError(f"{self.path}:{number}: is no run of a campaign") from error
        return records

    def add(self, record: Record) -> None:
        """Keeps a run; returns when it would survive a loss of power.

        Raises:
            OSError: it cannot be written.
        """
        line = (json.dumps(record.as_json(), ensure_ascii=False, allow_nan=False) + "\n").encode()
        while line:
            line = line[os.write(self._file, line) :]
        os.fsync(self._file)
        self.records[record.key] = record

    def close(self) -> None:
        """Lets others have the folder."""
        os.close(self._file)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
