"""The project around the package: what it declares, what is built of it, and what checks it."""

import ast
import os
import re
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from importlib.metadata import PackageNotFoundError, files
from pathlib import Path
from typing import Any

import pytest

yaml = pytest.importorskip("yaml")
pytest.importorskip("hatchling")

ROOT = Path(__file__).parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]

NOT_OF_USERS = {"test", "docs", "oracles", "bench"}
"""Extras whose packages the package itself does not import."""


def read_yaml(name: str) -> Any:
    return yaml.safe_load((ROOT / name).read_text("utf-8"))


def canonical(requirement: str) -> str:
    name = re.match(r"[\w.-]+", requirement)
    assert name
    return re.sub(r"[-_.]+", "-", name[0]).lower()


def modules_of(name: str) -> set[str]:
    """What a package brings to be imported; of one that is not installed, its own name."""
    try:
        return {file.parts[0].removesuffix(".py") for file in files(name) or ()}
    except PackageNotFoundError:
        return {name.replace("-", "_")}


@pytest.mark.long
def test_the_package_imports_nothing_that_it_does_not_declare() -> None:
    extras = PROJECT["optional-dependencies"]
    groups = [extras[name] for name in extras.keys() - NOT_OF_USERS]
    declared = {canonical(each) for each in sum(groups, PROJECT["dependencies"])}
    known = {module for name in declared for module in modules_of(name)}
    known |= sys.stdlib_module_names | {"continuair", "amiri2026", "_signal"}
    known |= {"compression"}  # of Python 3.14
    missing = set()
    for path in (ROOT / "src").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            modules = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom) and node.module:
                modules = [node.module]
            tops = {module.split(".")[0] for module in modules}
            missing |= {f"{path.name} imports {top}" for top in tops - known}
    assert not missing


def test_every_python_that_is_said_to_do_is_tested_and_no_other() -> None:
    said = re.findall(r"Python :: (3\.\d+)", "\n".join(PROJECT["classifiers"]))
    jobs = read_yaml(".github/workflows/ci.yml")["jobs"]
    versions = [step.get("with", {}).get("python-version") for step in jobs["everything"]["steps"]]
    first = next(version for version in versions if version)
    assert [first, *jobs["tests"]["strategy"]["matrix"]["python"]] == said
    assert PROJECT["requires-python"] == f">={said[0]}"
    assert {"run": ".ci/run"} in jobs["everything"]["steps"]
    assert {"run": "make test"} in jobs["tests"]["steps"]


def test_what_is_asked_before_a_commit_is_what_make_test_asks_of_the_code() -> None:
    (repository,) = read_yaml(".pre-commit-config.yaml")["repos"]
    asked = [hook["entry"].removeprefix(".venv/bin/") for hook in repository["hooks"]]
    assert repository["repo"] == "local", "no network"
    lines = re.findall(r"^\t\$\(BIN\)/(.*)$", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE)
    assert asked == lines[1 : 1 + len(asked)]


def test_the_citation_is_of_this_project_and_of_the_paper() -> None:
    found = read_yaml("CITATION.cff")
    assert found["license"] == PROJECT["license"]
    assert found["title"].startswith(PROJECT["name"])
    assert found["version"] == PROJECT["version"]
    (paper,) = found["references"]
    assert paper["url"] in (ROOT / "README.md").read_text("utf-8")


def test_the_page_on_citing_names_what_the_citation_file_names() -> None:
    page = (ROOT / "docs" / "howto" / "cite.md").read_text("utf-8")
    words = " ".join(page.split())
    found = read_yaml("CITATION.cff")
    (paper,) = found["references"]
    for each in (
        found["title"],
        found["version"],
        found["license"],
        paper["title"],
        paper["url"],
        paper["year"],
    ):
        assert str(each) in words
    for author in paper["authors"]:
        assert f"{author['family-names']}, {author['given-names']}" in words


def test_every_extra_stands_on_the_page_on_installing() -> None:
    page = ROOT / "docs" / "tutorials" / "install.md"
    told = re.findall(r"^\| `(\w+)` \|", page.read_text("utf-8"), re.MULTILINE)
    assert told == list(PROJECT["optional-dependencies"])


def test_versions_of_all_that_is_declared_are_pinned_in_order() -> None:
    lines = (ROOT / "constraints.txt").read_text("utf-8").splitlines()[1:]
    pinned = [line.partition("==")[0] for line in lines]
    assert pinned == sorted(pinned)
    extras = PROJECT["optional-dependencies"]
    groups = [extras[name] for name in extras.keys() - (NOT_OF_USERS - {"test"})]
    declared = {canonical(each) for each in sum(groups, PROJECT["dependencies"])}
    assert declared <= {*pinned, PROJECT["name"]}


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The wheel and the source archive."""
    folder = tmp_path_factory.mktemp("dist")
    subprocess.run([sys.executable, "-m", "hatchling", "build", "-d", folder], cwd=ROOT, check=True)
    return {path.suffix: path for path in folder.iterdir()}


@pytest.mark.slow
def test_the_wheel_holds_the_package_with_its_data_and_nothing_else(
    built: dict[str, Path],
) -> None:
    names = set(zipfile.ZipFile(built[".whl"]).namelist())
    source = ROOT / "src"
    ours = {
        path.relative_to(source).as_posix()
        for package in ("continuair", "amiri2026")
        for path in (source / package).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    assert {name for name in names if ".dist-info/" not in name} == ours
    for kind in ("toml", "css", "js", "npz", "json", "typed"):
        assert any(name.endswith(kind) for name in ours)


@pytest.mark.slow
def test_the_source_archive_holds_what_its_tests_and_pages_need(built: dict[str, Path]) -> None:
    with tarfile.open(built[".gz"]) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    tracked = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True)
    if tracked.returncode:
        pytest.skip("no Git repository to compare with")
    assert set(tracked.stdout.split()) - names <= {".gitignore"}


@pytest.mark.slow
def test_the_wheel_works_where_nothing_of_the_checkout_is(
    built: dict[str, Path], tmp_path: Path
) -> None:
    """Installed alone into a fresh environment, which finds what the package needs in this one."""
    home = tmp_path / "venv"
    subprocess.run([sys.executable, "-m", "venv", str(home)], check=True)
    python = str(home / "bin" / "python")
    quiet = ["install", "--quiet", "--no-deps", "--no-index", str(built[".whl"])]
    subprocess.run([python, "-m", "pip", *quiet], check=True)
    asked = [python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))"]
    own = Path(subprocess.run(asked, capture_output=True, text=True, check=True).stdout.strip())
    others = [path for path in sys.path if path.endswith("-packages")]
    (own / "beside.pth").write_text("\n".join(others))
    environment = {name: text for name, text in os.environ.items() if name != "PYTHONPATH"}

    def run(*arguments: str) -> str:
        done = subprocess.run(
            arguments, cwd=tmp_path, env=environment, capture_output=True, text=True
        )
        assert done.returncode == 0, done.stderr
        return done.stdout

    command = str(home / "bin" / "continuair")
    assert run(command, "--version").strip() == f"continuair {PROJECT['version']}"
    assert "advise" in run(command, "--help")
    assert "two_section" in run(command, "vehicles")
    run(command, "new", "mine.toml")
    told = run(
        python,
        "-c",
        "import continuair as ca, continuair.errors as errors\n"
        "from amiri2026.sentences import sentences\n"
        "from continuair.studies.atlas.summary import CONTROLLED_SUMMARY, load\n"
        "load(), load(shipped=CONTROLLED_SUMMARY), sentences()\n"
        "[getattr(ca, name) for name in ca.__all__]\n"
        "print(errors.__file__)",
    )
    assert Path(told.strip()).is_relative_to(own)
