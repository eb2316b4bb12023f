"""Runs the Python blocks of pages, none knowing what another has named: python alone.py PAGE..."""

import re
import sys
import traceback
from pathlib import Path

_BLOCK = re.compile(r"^```python\n(.*?)^```", re.MULTILINE | re.DOTALL)


def main(pages: list[str]) -> None:
    failed = []
    for page in map(Path, pages):
        for number, block in enumerate(_BLOCK.findall(page.read_text(encoding="utf-8")), start=1):
            name = f"block {number} of {page.name}"
            try:
                exec(compile(block, name, "exec"), {"__name__": "__main__"})
            except Exception:
                traceback.print_exc()
                failed.append(name)
    if failed:
        sys.exit(f"failed: {', '.join(failed)}")


if __name__ == "__main__":
    main(sys.argv[1:])
