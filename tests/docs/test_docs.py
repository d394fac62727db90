"""What the README and the pages say: commands, code, links and dependencies."""

from __future__ import annotations

import re
import runpy
import tomllib
from pathlib import Path

import pytest

import teamsight

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").rglob("*.md"))]
SET_UP = "python3 -m venv .venv && .venv/bin/pip install -e"
COMMANDS = [f"{SET_UP} . && .venv/bin/teamsight reproduce", f"{SET_UP} '.[test]' && .venv/bin/pytest"]


def blocks(page: Path, language: str = "python") -> list[str]:
    """Return the blocks of a page in a language."""
    return re.findall(rf"```{language}\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)


def run(code: str, folder: Path) -> None:
    # A file, because kernels are looked up by their source.
    script = folder / "page.py"
    script.write_text(code, encoding="utf-8")
    runpy.run_path(str(script))


def test_the_readme_has_the_two_commands_literally() -> None:
    lines = (ROOT / "README.md").read_text(encoding="utf-8").splitlines()
    assert [line for line in lines if line in COMMANDS] == COMMANDS


def test_the_first_example_of_the_readme_prints_what_it_says(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run(blocks(ROOT / "README.md")[0], tmp_path)
    assert capsys.readouterr().out == blocks(ROOT / "README.md", "text")[0]


def test_what_the_readme_says_to_write_works_in_a_clone() -> None:
    written = re.findall(r"^\| [^|]+ \| `(teamsight[^`]+)` \|", (ROOT / "README.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert len(written) == 6
    pytest.importorskip("teamsight.env")
    for line in written:
        if line.startswith("teamsight."):
            assert eval(line, {"teamsight": teamsight}) is not None
        files = [word.partition(":")[0] for word in line.split() if "/" in word]
        assert [file for file in files if not (ROOT / file).is_file()] == []


@pytest.mark.filterwarnings("ignore:run\\(\\) makes its steps one by one")
def test_the_readme_composes_a_robot_in_ten_lines(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code = blocks(ROOT / "README.md")[1]
    assert sum(bool(line.strip()) for line in code.splitlines()) == 10
    run(code, tmp_path)
    assert re.match(r"\d+% of the targets observed", capsys.readouterr().out)


def test_the_readme_is_short() -> None:
    assert len((ROOT / "README.md").read_text(encoding="utf-8").split()) <= 700


def test_results_on_learned_awareness_are_those_of_the_ledger() -> None:
    pages = [ROOT / "README.md", *(ROOT / "docs" / name for name in ("results.md", "claims.md"))]
    readme, results, ledger = (" ".join(page.read_text(encoding="utf-8").split()) for page in pages)
    found = re.search(r"adds nothing to it \((−[\d.]+) points over all cells, (−[\d.]+) to (\+[\d.]+)\)", ledger)
    assert found is not None
    mean, low, high = found.groups()
    assert f"gains nothing, {mean} points ({low} to {high})" in readme
    assert f"gains nothing from awareness: {mean} percentage points ({low} to {high})" in results
    row = re.search(r"\| slopes \| ([\d.| ]+) \|", ledger)
    assert row is not None
    *gains, last = row[1].split(" | ")
    assert f"{', '.join(gains)} and {last} points for R = 1 to 9" in results


@pytest.mark.parametrize(
    "word",
    ["ROS", "Gazebo", "real robots", "heterogeneous", "GPU", "3D", "drones", "licence", "license", "rosbag", "Windows", "macOS", "motion capture"],
)
def test_the_questions_have_the_words_that_people_search(word: str) -> None:
    assert word in (ROOT / "docs" / "faq.md").read_text(encoding="utf-8")


def test_every_extra_is_on_the_page_of_the_installation() -> None:
    with (ROOT / "pyproject.toml").open("rb") as file:
        extras = tomllib.load(file)["project"]["optional-dependencies"]
    page = (ROOT / "docs" / "install.md").read_text(encoding="utf-8")
    assert [extra for extra in extras if f"`{extra}`" not in page] == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_links_lead_somewhere(page: Path) -> None:
    for link in re.findall(r"\]\(([^)]+)\)", page.read_text(encoding="utf-8")):
        if link.startswith("http"):
            continue
        name, _, anchor = link.partition("#")
        place = (page.parent / name).resolve() if name else page
        assert place.exists(), link
        if place.parent.name == "reference" and anchor.startswith("teamsight."):
            continue  # An anchor of a class or function, which the site makes and .ci/check_site.py checks.
        headings = re.findall(r"^#+ (.*)$", place.read_text(encoding="utf-8"), re.MULTILINE) if anchor else []
        assert not anchor or anchor in [heading.lower().replace(" ", "-") for heading in headings], link


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_code_fits_on_a_narrow_page(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    for block in re.findall(r"^```\w*\n(.*?)^```$", text, re.DOTALL | re.MULTILINE):
        assert [line for line in block.splitlines() if len(line) > 88] == []


# The moving picture of the README.
MOVING = "two-teams.webp"


def test_pictures_are_small() -> None:
    pictures = list((ROOT / "docs" / "images").iterdir())
    assert pictures
    for picture in pictures:
        assert picture.stat().st_size < (2_500_000 if picture.name == MOVING else 200_000)


def test_every_dependency_is_explained_with_its_range() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    extras = project["project"]["optional-dependencies"].values()
    required = [
        *project["project"]["dependencies"],
        *(requirement.partition(";")[0] for extra in extras for requirement in extra),
        *project["build-system"]["requires"],
    ]
    page = (ROOT / "docs" / "dependencies.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (?!package)([a-z\[\]-]+) \| (\S*) ?\| \w", page, re.MULTILINE)
    listed = {name: ranges.strip("`") for name, ranges in rows}
    wanted = dict(re.fullmatch(r"([a-z\[\]-]+)(.*)", requirement).groups() for requirement in required)  # type: ignore[union-attr]
    assert listed == wanted
