"""The example of docs/first-test.md, as a team would have it beside its own master."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

from simulation import servobus

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "master"
FILES = ["conftest.py", "my_master.py", "test_my_master.py"]


def test_the_example_passes_by_itself(tmp_path):
    for name in FILES:
        shutil.copy(EXAMPLE / name, tmp_path)
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-q", "."]
    ended = subprocess.run(
        command,
        cwd=tmp_path,
        env={**os.environ, "SERVOBUS": servobus()},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert ended.returncode == 0, ended.stdout + ended.stderr
    assert ended.stdout.splitlines()[-1].startswith("6 passed"), ended.stdout


def test_its_page_shows_its_files():
    page = (EXAMPLE.parents[1] / "docs" / "first-test.md").read_text()
    for name in FILES:
        assert f"{{{{#include ../examples/master/{name}}}}}" in page
