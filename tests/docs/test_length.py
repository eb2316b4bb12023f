"""Pages of the documentation are short enough to be read."""

import re
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"
PAGES = [
    page
    for page in sorted(DOCS.rglob("*.md"))
    if not {"_build", "gallery"} & set(page.relative_to(DOCS).parts)
]
MOST_WORDS = 1500
_CODE = re.compile(r"^(`{3,})(?!\{glossary\}).*?^\1\s*$", re.MULTILINE | re.DOTALL)
_COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)


def words(text: str) -> int:
    """Count what spaces separate, outside blocks of code, tables and comments."""
    prose = _COMMENT.sub("", _CODE.sub("", text))
    return sum(len(line.split()) for line in prose.splitlines() if not line.startswith("|"))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(DOCS)))
def test_a_page_has_at_most_1500_words(page: Path) -> None:
    count = words(page.read_text(encoding="utf-8"))
    assert count <= MOST_WORDS


def test_tables_and_code_are_not_counted() -> None:
    text = (
        "Two words.\n\n```python\na = 1\n```\n\n| a | b |\n| - | - |\n\n<!-- none -->\nTwo more.\n"
    )
    assert words(text) == 4
    assert words("```{glossary}\nterm\n    Its meaning.\n```\n") == 5  # with both fences
