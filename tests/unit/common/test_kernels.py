"""Warp starts wherever it may write, and whatever standard error is."""

import os
import subprocess
import sys
from pathlib import Path

REPOSITORY = Path(__file__).parents[3]
SHOW = (
    "import os; import common.kernels; import warp; print(warp.config.kernel_cache_dir, os.readlink('/proc/self/fd/2'))"
)


def started(shell="", **environment):
    """What a process prints that starts Warp, and its standard error."""
    command = ["sh", "-c", f'exec "$0" "$@" {shell}', sys.executable, "-c", SHOW]
    variables = os.environ | {"PYTHONPATH": str(REPOSITORY)} | environment
    process = subprocess.run(command, env=variables, capture_output=True, text=True, check=False)
    assert process.returncode == 0, process.stderr
    return process.stdout.split(), process.stderr


def test_a_cache_that_cannot_be_written_is_told_and_replaced_for_this_process():
    (folder, _), errors = started(WARP_CACHE_PATH="/dev/null/cache")
    assert errors == "the kernel cache /dev/null/cache cannot be written: kernels are compiled anew\n"
    assert "honeyguide-kernels-" in folder
    assert not Path(folder).exists()  # the process has taken it away again


def test_closed_standard_error_is_no_place_for_another_file():
    (_, place), _ = started("2>&-")
    assert place == os.devnull
