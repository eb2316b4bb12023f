"""Scripts of the validation pages: they say that they skip where measured data are absent."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def test_the_tentacle_is_skipped_without_its_data(tmp_path: Path) -> None:
    script = ROOT / "validation" / "tentacle.py"
    found = subprocess.run(
        [sys.executable, script, tmp_path, "--out", tmp_path / "out"],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert found.stdout.startswith("Skipped: ")
    assert not (tmp_path / "out").exists()
