"""Some of the damaged files of others that `python -m tests.fuzz.swarm` reads by the thousand."""

from collections import Counter
from pathlib import Path

import pytest

pytest.importorskip("rosbags")
pytest.importorskip("pyulog")
pytest.importorskip("zarr")

from tests.fuzz.foreign import KINDS  # noqa: E402
from tests.fuzz.swarm import swarm  # noqa: E402
from tests.fuzz.trial import REFUSED, USED  # noqa: E402


@pytest.mark.soak
def test_damaged_files_of_others_are_read_or_refused(tmp_path: Path) -> None:
    """Within 10 s and 1 GiB each, with no traceback and nothing of other files."""
    counts: Counter[tuple[str, str]] = Counter()
    for name, seed, outcome, said in swarm(50 * len(KINDS), 1_000_000, tmp_path):
        counts[name, outcome] += 1
        assert outcome in (USED, REFUSED), f"{name}, seed {seed}: {outcome}\n{said}"
    for kind in KINDS:
        assert counts[kind.name, REFUSED] > 0, kind.name
    assert sum(counts[kind.name, USED] for kind in KINDS) > 50
