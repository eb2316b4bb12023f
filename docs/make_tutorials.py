"""Draw the figures of docs/tutorials/, by doing what their pages say."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
FIGURES = {"your_drone": "ahead.png", "your_study": "study.png"}


def main() -> None:
    for page, figure in FIGURES.items():
        with tempfile.TemporaryDirectory() as folder:
            reader = ROOT / "tests" / "docs" / "session.py"
            subprocess.run(
                [sys.executable, reader, ROOT / "docs" / "tutorials" / f"{page}.md"],
                cwd=folder,
                env={**os.environ, "MPLBACKEND": "Agg"},
                check=True,
            )
            shutil.copy(Path(folder) / figure, ROOT / "docs" / "images" / f"{page}.png")


if __name__ == "__main__":
    main()
