"""The package is built in layers, and so are its rooms: imports point one way."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

import continuair
import continuair.errors

PACKAGE = Path(continuair.errors.__file__).parent
# Kernels that sections are written with; all other kernels are built on the sections.
NUMBERS_AND_STATES = [
    {"options"},
    {"single"},
    {"packs", "duals"},
    {"numbers"},
    {"elementary", "arguments"},
    {"types", "probe"},
]
# Folder -> layers of what is in it, by name. A module may import from earlier layers only, and from
# what it is in itself: a folder counts as one, but for a file in it that is named with it.
ROOMS = {
    "": [
        {"errors"},
        {"files", "checks", "progress", "warning", "immutable", "signals"},
        {"vehicle"},
        {"equations"},
        *({f"kernels.{name}" for name in layer} for layer in NUMBERS_AND_STATES),
        {"sections"},
        {"kernels"},
        {"terms"},
        {"controllers"},
        {"scenario"},
        {"engine"},
        {"flight"},
        {"analysis"},
        {"sweeps"},
        {"studies", "figures"},
        {"identification"},
        {"report", "interfaces"},
        {"viewer"},
        {"cli"},
    ],
    "vehicle": [
        {"effect", "arc"},
        {"fields", "runs", "layout", "poles", "allocation"},
        {"inertia", "replacing", "rotors"},
        {"disk", "camera", "uav", "coordinates"},
        {"section", "following"},
        {"arms", "changes"},
        {"vehicle"},
        {"vehicle_file", "template", "bending"},
    ],
    "kernels": [
        *NUMBERS_AND_STATES,
        {"arm"},
        {"flight", "elimination"},
        {"load", "wind"},
        {"device"},
        {"term_sum"},
        {"dynamics"},
        {"sensing.eye", "sensing.guidance"},
        {"sensing.belief"},
        {"sensing.sense"},
        {"laws", "sensing.pilot"},
        {"sensing.guided"},
        {"step"},
        {"implicit"},
        {"integrators", "logs"},
        {"signals", "embedded"},
        {"step_control"},
        {"adaptive"},
        {"rollout", "observe", "energies", "deviations", "turning", "slopes"},
    ],
    "sections": [{"kind", "symbolic"}, {"arc"}],
    "sections.arc": [{"moments", "bend"}, {"element", "place", "symbolic"}, {"joint"}],
    "terms": [
        {"term"},
        {"push", "paper_torques", "rotors", "uav_drag", "arm_drag", "tip_wrench"},
    ],
    "engine": [
        {"compiling", "lanes", "rows", "law_names", "law_reading"},
        {"law_numbers"},
        {"law_parts"},
        {"law_made", "term_checks"},
        {"factory", "packs"},
        {"pack"},
        {"engine", "tangents"},
        {"loop", "slopes", "adaptive"},
        {"pairs"},
    ],
    "flight": [
        {"time_grid", "inputs", "resolution", "turns", "provenance", "labels"},
        {"reading", "frequencies"},
        {"guiding", "holding"},
        {"camera_timing", "rotors"},
        {"steps"},
        {"cohorts"},
        {"prepare"},
        {"trajectory"},
        {"limits", "signals"},
        {"adaptive"},
        {"rollout", "called"},
        {"simulate", "live", "fleet"},
    ],
    "studies": [
        {
            "tables",
            "timing",
            "ladder",
            "extremes",
            "standard_laws",
            "standard_loops",
            "sentences",
            "verdicts",
            "still_rotors",
        },
        {"results", "standard_excitations", "overstated_angles"},
        {"excited_flights"},
        {"atlas"},
        {
            "open_loop",
            "sensitivity",
            "table",
            "tracking",
            "advise",
            "region",
            "robustness",
            "check",
            "cost",
            "sections",
        },
        {"paper"},
    ],
    "studies.open_loop": [{"study"}, {"report"}],
    "studies.sensitivity": [
        {"task", "swing"},
        {"findings", "measures"},
        {"claims"},
        {"study"},
        {"once", "report"},
    ],
    "studies.tracking": [{"candidates"}, {"law_variants", "tuning", "study"}, {"report"}],
    "studies.region": [{"flights", "starts"}, {"study"}, {"report"}],
    "studies.robustness": [{"mistakes"}, {"flights"}, {"study"}, {"report"}],
    "studies.advise": [
        {"frequencies"},
        {"excitations", "tracking", "verdicts", "notes"},
        {"study"},
        {"report"},
    ],
    "studies.paper": [
        {"drawn", "recorded", "theorem", "proof"},
        {"drawn_sweeps"},
        {"evidence"},
        {"judges"},
        {"judging"},
        {"study", "overview"},
        {"report"},
    ],
    "studies.table": [
        {"reading", "points", "expressions"},
        {"printed"},
        {"kernel", "metrics"},
        {"compiled"},
        {"study"},
        {"report"},
    ],
    "studies.paper.judges": [
        {"words", "agreement", "as_printed"},
        {
            "errors",
            "image",
            "letter",
            "loops",
            "regularised",
            "settled",
            "kept",
            "straight",
            "strokes",
            "times",
            "disks",
            "complexity",
            "coupling_elements",
        },
        {"near_straight", "disk_effects", "rate_of_v", "goals", "sweep_cases"},
        {"conclusions"},
        {
            "kinematics",
            "dynamics",
            "law",
            "open_loop",
            "open_loop_errors",
            "parameters",
            "closed_loop",
            "summary",
        },
    ],
    "interfaces": [
        {"chain", "outline", "meshes", "foxglove", "frames", "wash"},
        {"casadi_arm", "glb", "acting", "logged", "log_topics", "hovering"},
        {"casadi_dynamics", "log_signals", "gym"},
        {"casadi_model", "mjcf", "gltf", "mcap_log", "csv_table", "log_recording"},
        {"export", "ulog", "rosbag"},
        {"flights"},
    ],
    "viewer": [
        {"bodies", "player", "server", "colours", "flying"},
        {"forces", "sight"},
        {"scene"},
        {"reading", "vehicles", "live", "drawing"},
        {"stage", "video"},
        {"panel"},
        {"export", "view"},
    ],
    "report": [{"contents", "keeping", "verdicts"}, {"page"}],
    "studies.atlas": [
        {"flights", "loops"},
        {"summary", "collapse"},
        {"kept"},
        {"controlled"},
        {"rule"},
        {"explaining"},
        {"judging"},
        {"study", "answers"},
        {"report", "page"},
    ],
}
# The readable form is the oracle of the fast one, so that form must not be built on it.
INDEPENDENT_OF_EQUATIONS = (
    "kernels",
    "sections",
    "terms",
    "engine",
    "flight",
    "analysis.linear",
    "analysis.trim",
    "analysis.balance",
)


def imports(path: Path) -> set[str]:
    """What a file imports of the package, by dotted names inside it."""
    names = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path.name} uses a relative import; write continuair.<module>"
            names += [f"{node.module}.{alias.name}" for alias in node.names]
    return {name.removeprefix("continuair.") for name in names if name.startswith("continuair.")}


def files() -> Iterator[tuple[str, Path]]:
    """Every file with its dotted name, but for those that open a folder, which are in no layer."""
    for path in PACKAGE.rglob("*.py"):
        if path.stem not in ("__init__", "__main__"):
            yield ".".join(path.relative_to(PACKAGE).with_suffix("").parts), path


def inside(folder: str, name: str) -> str | None:
    """The rest of a dotted name in a folder, None for a name elsewhere."""
    if not folder:
        return name
    return name.removeprefix(f"{folder}.") if name.startswith(f"{folder}.") else None


def place(layers: list[set[str]], name: str) -> tuple[int, str] | None:
    """Layer and name of the longest entry that a dotted name is, or is in."""
    found = [
        (rank, entry)
        for rank, layer in enumerate(layers)
        for entry in layer
        if f"{name}.".startswith(f"{entry}.")
    ]
    return max(found, key=lambda match: len(match[1]), default=None)


def test_every_public_name_can_be_reached() -> None:
    missing = [name for name in continuair.__all__ if not hasattr(continuair, name)]
    assert not missing
    assert set(continuair.__all__) <= set(dir(continuair))


@pytest.mark.parametrize("folder", ROOMS)
def test_imports_point_from_later_layers_to_earlier_ones(folder: str) -> None:
    wrong = []
    for name, path in files():
        own = inside(folder, name)
        if own is None:
            continue
        here = place(ROOMS[folder], own)
        assert here, f"give {name} its place in ROOMS"
        for other in imports(path):
            rest = inside(folder, other)
            there = None if rest is None else place(ROOMS[folder], rest)
            if there and there[1] != here[1] and there[0] >= here[0]:
                wrong.append(f"{name} imports {other}")
    assert not wrong, wrong


def test_the_fast_form_is_not_built_on_the_readable_one() -> None:
    wrong = [
        name
        for name, path in files()
        if any(f"{name}.".startswith(f"{room}.") for room in INDEPENDENT_OF_EQUATIONS)
        and any(f"{other}.".startswith("equations.") for other in imports(path))
    ]
    assert not wrong, wrong


def test_one_module_uses_what_is_private_in_warp() -> None:
    using = [name for name, path in files() if "warp._src" in path.read_text(encoding="utf-8")]
    assert using == ["engine.law_reading"]


def test_what_is_static_in_device_code_is_so_when_it_is_defined() -> None:
    """Warp takes the value of wp.static(…) into a module's name in the cache only where it is known
    at once: one of a loop's variable is not, so that another process would compile the module anew,
    and a changed value might not be noticed."""
    late = []
    device = (PACKAGE / room for room in ("kernels", "sections", "terms"))
    for path in sorted(path for room in device for path in room.rglob("*.py")):
        for function in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(function, ast.FunctionDef):
                loops = set(names_of_loops(function))
                late += [
                    f"{path.name}:{call.lineno}"
                    for call in static_calls(function)
                    if any(isinstance(n, ast.Name) and n.id in loops for n in ast.walk(call))
                ]
    assert not late, f"wp.static of a loop's variable in {', '.join(late)}"


def names_of_loops(function: ast.FunctionDef) -> Iterator[str]:
    """Variables of the loops of a function of the device."""
    decorated = {ast.unparse(each) for each in function.decorator_list}
    if any(name.startswith(("wp.func", "wp.kernel")) for name in decorated):
        for node in ast.walk(function):
            if isinstance(node, ast.For):
                yield from (name.id for name in ast.walk(node.target) if isinstance(name, ast.Name))


def static_calls(function: ast.FunctionDef) -> Iterator[ast.Call]:
    """Calls wp.static(…) in it."""
    for node in ast.walk(function):
        if isinstance(node, ast.Call) and ast.unparse(node.func) == "wp.static":
            yield node
