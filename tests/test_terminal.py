"""What commands show: in 80 columns, with an example, and what the Tab key offers."""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

import amiri2026.open_loop.study as study
import continuair.cli as cli
from amiri2026.commands.options import complete_letters, complete_tests
from amiri2026.open_loop_tests import OPEN_LOOP_TESTS
from continuair.cli import completion
from continuair.cli.terminal import print_markdown, print_table
from continuair.controllers.gain_files import load_gains
from continuair.scenario.letters import LETTERS
from continuair.studies.atlas import page, report
from continuair.studies.atlas.summary import CONTROLLED_SUMMARY, OPEN_SUMMARY, load
from continuair.studies.tables import as_markdown
from continuair.vehicle.vehicle import preset_names
from tests.synthetic import flight

ROOT = Path(__file__).parent.parent
GROUP: Any = typer.main.get_command(cli.app)
COMMANDS: dict[str, Any] = GROUP.commands
WIDTH = 80


@pytest.fixture(autouse=True)
def eighty_columns(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A narrow terminal in an empty folder, and no kernels."""
    monkeypatch.setenv("COLUMNS", str(WIDTH))
    monkeypatch.setattr(study, "simulate", flight)
    monkeypatch.chdir(tmp_path)


def run(*arguments: str) -> Any:
    return CliRunner().invoke(cli.app, list(arguments))


def wide(text: str) -> list[str]:
    return [line for line in text.splitlines() if len(line.rstrip()) > WIDTH]


@pytest.mark.parametrize("name", COMMANDS)
def test_help_fits_a_terminal_and_ends_with_an_example_that_can_be_typed(name: str) -> None:
    told = run(name, "--help").stdout
    assert wide(told) == []
    example = re.search(r"Example: continuair (.*)", told)
    assert example, f"@app.command(epilog='Example: continuair {name} ...')"
    called, *arguments = shlex.split(example[1])
    assert called == name
    # Words and options are those of the command; nothing is run.
    assert COMMANDS[name].make_context(name, arguments).args == []


@pytest.mark.parametrize("name", COMMANDS)
def test_the_page_of_the_commands_names_every_one_with_all_its_options(name: str) -> None:
    lines = (ROOT / "docs" / "reference" / "cli.md").read_text("utf-8").splitlines()
    rows = [line.split("|")[1:3] for line in lines if line.startswith("| `")]
    assert [row for row in rows if row[0].split()[0].strip("`") == name], f"{name} has no row"
    options = {name for option in COMMANDS[name].params for name in option.opts} - {"--help"}
    told = {
        option
        for names, of in rows
        if f"`{name}`" in of or "all" in of.split()
        for option in re.findall(r"`(--[\w-]+)", names)
    }
    assert {option for option in options if option.startswith("--")} <= told


def test_the_page_of_the_commands_names_no_option_that_is_not_there() -> None:
    known = {name for command in [GROUP, *COMMANDS.values()] for each in command.params
             for name in each.opts}  # fmt: skip
    text = (ROOT / "docs" / "reference" / "cli.md").read_text("utf-8")
    assert set(re.findall(r"`(--[\w-]+)", text)) <= known | {"--help"}


def test_help_shows_units_in_brackets() -> None:
    assert "[rad/s]" in run("advise", "--help").stdout
    assert "[Hz]" in run("region", "--help").stdout


@pytest.mark.parametrize(
    "arguments", [("vehicles",), ("check", "paper"), ("new", "my.toml"), ("open-loop",)]
)
def test_what_quick_commands_print_fits_a_terminal(arguments: tuple[str, ...]) -> None:
    result = run(*arguments)
    assert result.exit_code == 0, result.stderr
    tables = [line for line in wide(result.output) if "  " in line.strip()]
    assert tables == []


@pytest.mark.parametrize(
    "text",
    [report.as_table(load(shipped=OPEN_SUMMARY)), page.as_table(load(shipped=CONTROLLED_SUMMARY))],
)
def test_tables_of_the_atlas_are_whole_in_a_terminal(
    text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    print_markdown(text)
    shown = capsys.readouterr().err
    assert wide(shown) == [] and "…" not in shown
    assert {*re.findall(r"\d[\d.e-]*", text)} <= {*re.findall(r"\d[\d.e-]*", shown)}


def test_columns_that_do_not_fit_stand_below_beside_what_names_their_rows(
    capsys: pytest.CaptureFixture[str],
) -> None:
    headings = ["law", "start", *(f"direction{each}" for each in range(9))]
    rows = [["same", each, *9 * ["1.25"]] for each in ("near", "far")]
    print_markdown("\n".join(as_markdown(headings, rows, headings)))
    shown = capsys.readouterr().err
    assert wide(shown) == []
    parts = [line.split() for line in shown.splitlines() if "direction" in line]
    assert len(parts) == 2 and [part[:2] for part in parts] == 2 * [["law", "start"]]
    assert [name for part in parts for name in part[2:]] == headings[2:]


def test_lists_of_numbers_fold_between_their_numbers(capsys: pytest.CaptureFixture[str]) -> None:
    rates = [f"{1234.5 + each:g}" for each in range(16)]
    print_table(
        ["modes", "rad/s", "lowest Hz", "damping"], [["hovering", ", ".join(rates), "1", "0"]]
    )
    shown = capsys.readouterr().out
    assert wide(shown) == [] and set(rates) <= set(re.findall(r"[\d.]+", shown))


def test_the_tab_key_offers_names_letters_and_files() -> None:
    Path("mine.toml").touch()
    assert completion.vehicles("") == [*preset_names(), "mine.toml"]
    assert completion.vehicles("m") == ["mine.toml"]
    assert completion.preset_vehicles("") == list(preset_names())
    Path("results").mkdir()
    Path("flight.nc").touch()
    assert completion.flights("") == ["flight.nc", "results/", *completion.vehicles("")]
    for name in completion.complete_gains(""):
        assert name == "mine.toml" or load_gains(name)
    assert set(complete_letters("")) == set(LETTERS)
    assert set(complete_tests("")) == set(OPEN_LOOP_TESTS)
    assert complete_letters("MR") == ["MRA", "MRL"]


def offered(line: str) -> str:
    """What a process that bash starts at the Tab key answers, with all that it loads."""
    code = (
        "import atexit, sys; from continuair.__main__ import main\n"
        "heavy = {'numpy', 'scipy', 'warp', 'xarray', 'matplotlib'}\n"
        "atexit.register(lambda: print(*(heavy & set(sys.modules)), file=sys.stderr))\n"
        "sys.argv = ['continuair']; main()"
    )
    asked = {"_CONTINUAIR_COMPLETE": "complete_bash", "COMP_WORDS": line}
    environment = os.environ | asked | {"COMP_CWORD": str(len(line.split()) - 1)}
    environment |= {"PYTHONPATH": str(ROOT / "src")}
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, env=environment
    )
    assert done.stderr.strip() == "", done.stderr
    return done.stdout


def test_completion_answers_a_shell_without_heavy_modules_and_writes_nothing() -> None:
    assert "two_section" in offered("continuair check two")
    assert offered("continuair adv").split() == ["advise"]
    assert list(Path().iterdir()) == []


def test_installing_completion_writes_what_the_page_says_and_nothing_else() -> None:
    home = Path("home")
    home.mkdir()
    (home / ".bashrc").write_text("mine=1\n")
    environment = os.environ | {"HOME": str(home.absolute()), "PYTHONPATH": str(ROOT / "src")}
    # Which shell it is, typer asks of the process that called it; `true` keeps bash there.
    line = f"{shlex.quote(sys.executable)} -m continuair --install-completion && true"
    subprocess.run(["bash", "-c", line], env=environment, check=True, capture_output=True)
    written = {str(path.relative_to(home)) for path in home.rglob("*") if path.is_file()}
    assert written == {".bashrc", ".bash_completions/continuair.sh"}
    assert (home / ".bashrc").read_text().startswith("mine=1\n")
    page_of_commands = (ROOT / "docs" / "reference" / "cli.md").read_text("utf-8")
    assert all(f"`~/{name}`" in page_of_commands for name in written)


def test_a_heading_folds_before_it_is_cut_short(capsys: pytest.CaptureFixture[str]) -> None:
    columns = ["setting", "letter", "model", "RMS [px]", "max [px]", "tip RMS [m]", "DS > 2 s [px]"]
    row = ["nominal", "M", "independent", "0.08687", "0.5538", "0.003626", "0.05919"]
    print_table([*columns, "DS < 2 s [px]"], [[*row, "28.66"]])
    told = capsys.readouterr().out
    assert wide(told) == []
    assert sorted(told.replace("─", "").split()) == sorted(
        " ".join([*columns, "DS < 2 s [px]", *row, "28.66"]).split()
    )
