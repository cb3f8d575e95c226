"""`make golden`: flies the golden flights, says what has changed, and makes that the new golden.json."""

import json
import sys
from pathlib import Path

from tests.golden.flights import FLIGHTS
from tests.golden.record import differences, flown, machine

GOLDEN = Path(__file__).with_name("golden.json")


def main() -> None:
    """Renews the file; `--check` only says what has changed, with exit code 1 if anything has."""
    is_check = "--check" in sys.argv[1:]
    golden = json.loads(GOLDEN.read_text()) if GOLDEN.exists() else {"machine": machine(), "flights": {}}
    is_same_machine = golden["machine"] == machine()
    if not is_same_machine:
        print("this machine rounds otherwise than the one that flew last: only figures are compared")
    changes = 0
    for name, flight in FLIGHTS.items():
        record = flown(flight)
        old = golden["flights"].get(name)
        lines = ["is new"] if old is None else differences(old, record, is_same_machine=is_same_machine)
        print(f"{name}: {'as before' if not lines else ''}")
        for line in lines:
            print(f"  {line}")
        changes += len(lines)
        golden["flights"][name] = record
    if is_check:
        sys.exit(min(changes, 1))
    golden["machine"] = machine()
    GOLDEN.write_text(json.dumps(golden, indent=1, sort_keys=True) + "\n")


if __name__ == "__main__":
    main()
