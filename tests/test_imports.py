"""The package is built in layers, and imports point one way."""

import ast
from pathlib import Path

import continuair
import continuair.errors

PACKAGE = Path(continuair.errors.__file__).parent
# A module may import from earlier layers only; a folder counts as one module.
LAYERS = [
    {"errors"},
    {"files", "checks"},
    {"vehicle"},
    {"equations"},
    {"kernels"},
    {"controllers"},
    {"scenario"},
    {"engine"},
    {"flight"},
    {"analysis"},
    {"sweeps"},
    {"studies", "figures"},
    {"identification"},
    {"cli"},
]
RANK = {name: rank for rank, layer in enumerate(LAYERS) for name in layer}
# The readable form is the oracle of the fast one, so that form must not be built on it.
INDEPENDENT_OF_EQUATIONS = {"kernels", "linear", "simulation"}


def imported_modules(path: Path) -> set[str]:
    names = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path.name} uses a relative import; write continuair.<module>"
            names += [f"{node.module}.{alias.name}" for alias in node.names]
    return {name.split(".")[1] for name in names if name.startswith("continuair.")} & set(RANK)


def test_every_public_name_can_be_reached() -> None:
    missing = [name for name in continuair.__all__ if not hasattr(continuair, name)]
    assert not missing
    assert set(continuair.__all__) <= set(dir(continuair))


def test_imports_point_from_later_layers_to_earlier_ones() -> None:
    wrong = []
    for path in PACKAGE.rglob("*.py"):
        module = path.relative_to(PACKAGE).with_suffix("").parts[0]
        if module in ("__init__", "__main__"):
            continue
        assert module in RANK, f"give {module} its place in LAYERS"
        for other in imported_modules(path) - {module}:
            skips_oracle = other == "equations" and module in INDEPENDENT_OF_EQUATIONS
            if RANK[other] >= RANK[module] or skips_oracle:
                wrong.append(f"{path.relative_to(PACKAGE)} imports {other}")
    assert not wrong, wrong
