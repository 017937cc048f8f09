"""Check, draw and begin levels, and watch one while it is written.

Where a LEVEL is asked for, the name of one that comes with Roller will do, or a level file.

Examples::

    roller level new mine.yaml
    roller level watch mine.yaml
    roller level check *.yaml
    roller level draw mine.yaml --view overview -o mine.png
    roller level solve mine.yaml --robust
    roller level generate --seed 7 --difficulty 0.6
    roller level import mine.map
    roller level export gate -o gate.map
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Annotated, Final, Literal

import tyro

from roller_env.game.actions import hardest_play
from roller_env.level import (
    Level,
    LevelError,
    examine_level,
    files_of,
    level_json_schema,
    levels_directory,
    load_level,
    parse_level,
)
from roller_env.level.expand import expand
from roller_env.level.generate import LATEST
from roller_env.level.maps import export_map, read_map
from roller_env.level.template import new_level
from roller_env.level.text import fields_text, level_text
from roller_env.physics.presets import physics_preset
from roller_env.problems import Problem, printable, shown
from roller_env.regular_files import LOOK_EVERY_S, SavedFile
from roller_env.yaml_tree import MAX_BYTES

Preset = Literal["fast", "default", "accurate", "rigid", "relaxed"]
"""The names of `PRESETS`; a test holds the two together."""
View = Literal["plan", "overview"]
Output = Annotated[Path | None, tyro.conf.arg(aliases=["-o"])]

OVERVIEW_SIZE: Final = (1280, 800)
"""Width and height in pixels."""

PICTURES: Final = (".png", ".jpg", ".jpeg", ".webp")


class CommandError(Exception):
    """What was asked for cannot be done; the text says why."""


def main(argv: Sequence[str] | None = None, prog: str | None = None) -> int:
    """Do what the command line says; return the exit status.

    Args:
        argv: the words after the command; by default those of this process.
        prog: what the help calls the command.
    """
    return _told(
        lambda: tyro.extras.subcommand_cli_from_dict(
            COMMANDS, args=argv, prog=prog, description=__doc__
        )
    )


def mjcf_main() -> int:
    """Do what ``scripts/compile_level.py`` is asked; return the exit status."""
    return _told(lambda: tyro.cli(mjcf))


def export_main() -> int:
    """Do what ``scripts/export_schema.py`` is asked; return the exit status.

    Without an output it writes to where the package keeps the schema.
    """
    return _told(lambda: tyro.cli(_export))


def _told(command: Callable[[], int]) -> int:
    """Return a command's exit status, and say why if it could not be carried out."""
    try:
        return command()
    except LevelError as error:
        print(printable(error), file=sys.stderr)
    except CommandError as error:
        print(f"error: {printable(error)}", file=sys.stderr)
    except OSError as error:
        print(f"error: {shown(error.filename)}: {error.strerror}", file=sys.stderr)
    except RuntimeError as error:
        print(f"error: {printable(error)}", file=sys.stderr)
    return 1


def check(
    files: Annotated[tuple[str, ...], tyro.conf.Positional, tyro.conf.arg(metavar="LEVEL")],
    physics: Preset = "default",
    strict: bool = False,
) -> int:
    """Say everything that is wrong with levels, as file:line:column: error or warning: what.

    The exit status is 1 if a level cannot be played.

    Args:
        files: names of levels, or level files.
        physics: physics preset that the floors must be thick enough for.
        strict: have a warning count as an error.
    """
    if not files:
        raise CommandError("no level is named; say which to check")
    errors = warnings = 0
    for file in files:
        level_errors, level_warnings = _report(file, physics)
        errors, warnings = errors + level_errors, warnings + level_warnings
    levels = f"{len(files)} level{'' if len(files) == 1 else 's'}"
    print(f"{levels}: {_number(errors, 'error')}, {_number(warnings, 'warning')}", file=sys.stderr)
    return 1 if errors or (strict and warnings) else 0


def _report(source: str, physics: Preset) -> tuple[int, int]:
    """Print what is wrong with a level; return how many errors and warnings that were."""
    try:
        _, warnings = examine_level(source, hardest_play(physics_preset(physics)))
    except LevelError as error:
        for problem in error.problems:
            print(_line(problem, "error"))
        return len(error.problems), 0
    for problem in warnings:
        print(_line(problem, "warning"))
    return 0, len(warnings)


def _line(problem: Problem, kind: str) -> str:
    return printable(": ".join(part for part in (problem.where, kind, problem.what) if part))


def _number(count: int, thing: str) -> str:
    return f"{count} {thing}{'' if count == 1 else 's'}"


def draw(
    level: Annotated[str, tyro.conf.Positional], output: Output = None, view: View = "plan"
) -> int:
    """Draw a level: a map from above, or a picture of all of it as on its box.

    Args:
        level: name of a level, or a level file.
        output: picture to write; by default the level's name and .png, in this directory.
        view: plan needs no OpenGL, overview does.
    """
    loaded = load_level(level)
    file = output or Path(f"{loaded.name}.png")
    _check_picture(file)
    _draw(loaded, file, view)
    print(f"wrote {shown(file)}")
    return 0


def _check_picture(file: Path) -> None:
    if file.suffix.lower() not in PICTURES:
        raise CommandError(f"{file}: the name must end in {' or '.join(PICTURES)}")


def _draw(level: Level, file: Path, view: View) -> None:
    # Imported here: checking a level needs neither matplotlib nor MuJoCo.
    if view == "plan":
        from roller_env.drawing.topdown import draw_paths

        draw_paths(level, [], [], file)
        return
    from PIL import Image

    from roller_env.drawing.opengl import DrawingUnavailable
    from roller_env.drawing.overview import render_overview

    try:
        picture = render_overview(level, *OVERVIEW_SIZE)
    except DrawingUnavailable as error:
        raise CommandError(str(error)) from None
    file.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(picture).save(file)


def new(file: Annotated[Path, tyro.conf.Positional]) -> int:
    """Write a small level with comments, to begin with.

    Args:
        file: level file to write; there must be none of this name.
    """
    if file.suffix not in (".yaml", ".yml"):
        raise CommandError(f"{file}: the name of a level file must end in .yaml")
    text = new_level(file.stem)
    parse_level(text, str(file))  # the file's name is the level's, if it can be one
    try:
        with file.open("x", encoding="utf-8") as opened:
            opened.write(text)
    except FileExistsError:
        raise CommandError(f"{file}: there is such a file, which is not overwritten") from None
    print(f"wrote {shown(file)}; 'roller level watch {shown(file)}' shows it while you edit it")
    return 0


def schema(output: Output = None) -> int:
    """Write the JSON Schema of level files, from which editors complete and check them.

    Args:
        output: file to write; by default it is printed.
    """
    return _write(json.dumps(level_json_schema(), indent=2), output)


def _export(output: Output = None) -> int:
    """Write the JSON Schema of level files, from which editors complete and check them.

    Run it after changing ``roller_env.level.schema``; a test fails while the written file is out of
    date.

    Args:
        output: file to write; by default where the package keeps it.
    """
    return schema(output or levels_directory() / "level.schema.json")


def solve(
    level: Annotated[str, tyro.conf.Positional],
    output: Output = None,
    all_coins: bool = False,
    robust: bool = False,
    budget: int = 5_000_000,
    seed: int = 0,
    physics: Preset = "rigid",
) -> int:
    """Search for a play that ends at the finish, and write it as a replay.

    It needs no route. The exit status is 1 if none was found in the budget, which does not say that
    there is none.

    Args:
        level: name of a level, or a level file.
        output: replay to write; by default the level's name and .replay, in this directory.
        all_coins: search on until every coin is collected.
        robust: search on until a play is found that is followed to the finish from 90 of 100 other
            starts, on the rigid engine and on MuJoCo's default.
        budget: environment steps to search for; a million take some seconds.
        seed: of the search.
        physics: preset to search on; MuJoCo's take thirty times as long. Robust plays are searched
            on the rigid engine.
    """
    if budget < 1:
        raise CommandError(f"--budget: found {budget}; must be 1 or more")
    loaded = load_level(level)
    # Imported here: the other commands play nothing.
    from roller_env.replay.file import save_replay
    from roller_env.solver import Search, prove

    file = output or Path(f"{loaded.name}.replay")
    if robust:
        proof = prove(loaded, budget, all_coins, seed)
        replay, steps = (None, budget) if proof is None else (proof.replay, proof.steps)
    else:
        proof, search = None, Search(loaded, seed, physics)
        solution = search.run(budget, all_coins)
        replay = None if solution is None else search.replay(solution)
        steps = search.steps
    if replay is None:
        print(f"not found in {steps:,} steps; there may be a way all the same", file=sys.stderr)
        return 1
    result, coins = replay.result, len(expand(loaded).coins)
    print(f"finish after {result.time_s:.1f} s, coins {result.coins} of {coins}; {steps:,} steps")
    for one in proof.robustness if proof else ():
        print(
            f"followed on {one.physics} from {one.games} starts: {one.finished:.0%} at the finish, "
            f"{one.coins:.0%} of the coins"
        )
    save_replay(replay, file)
    print(f"wrote {shown(file)}; 'roller replay {shown(file)}' shows it")
    return 0


def generate(
    seed: int = 0,
    difficulty: float = 0.5,
    output: Output = None,
    view: View = "overview",
    version: int = LATEST,
) -> int:
    """Write a level that the generator makes and the solver has won, and a picture of it.

    Args:
        seed: which level; the same seed, difficulty and version give the same one for ever.
        difficulty: 0 to 1.
        output: level file to write; by default the level's name and .yaml, in this directory.
        view: of the picture, which lies beside it: plan needs no OpenGL, overview does.
        version: of the generator, 1 or 2.
    """
    # Imported here: the other commands play nothing.
    from roller_env.solver import won_level

    try:
        won = won_level(seed, difficulty, version=version)
    except (RuntimeError, ValueError) as error:
        raise CommandError(str(error)) from None
    file = output or Path(f"{won.level.name}.yaml")
    if file.suffix not in (".yaml", ".yml"):
        raise CommandError(f"{file}: the name of a level file must end in .yaml")
    _write(level_text(won.level), file)
    _draw(won.level, file.with_suffix(".png"), view)
    time_s, coins = won.replay.result.time_s, len(expand(won.level).coins)
    print(
        f"won in {time_s:.1f} s, {won.replay.result.coins} of {coins} coins; "
        f"attempt {won.attempts}, {won.steps:,} steps of search"
    )
    return 0


def mjcf(
    level: Annotated[str, tyro.conf.Positional],
    output: Output = None,
    physics: Preset = "default",
) -> int:
    """Write a level as MJCF text that MuJoCo loads without this package.

    Args:
        level: name of a level, or a level file.
        output: file to write; by default it is printed.
        physics: physics preset of the model.
    """
    loaded = load_level(level)
    # Imported here: the other commands need no MuJoCo.
    from roller_env.compile.compiled import level_mjcf

    return _write(level_mjcf(loaded, physics), output)


def import_map(
    file: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="FILE.map")],
    output: Output = None,
) -> int:
    """Write a level file from a map of TrenchBroom or another editor for Quake.

    What it did not understand, and what is wrong with the level, it says with the lines of the map.
    The exit status is 1 if the level cannot be played; it is written all the same.

    Args:
        file: map, of the format Standard or Valve 220.
        output: level file to write; by default the map's name and .yaml, in this directory.
    """
    found = read_map(file)
    output = output or Path(f"{file.stem}.yaml")
    if output.suffix not in (".yaml", ".yml"):
        raise CommandError(f"{output}: the name of a level file must end in .yaml")
    text = fields_text(found.fields)
    if len(text.encode()) > MAX_BYTES:
        raise CommandError(f"{file}: the level is too large for a file of {MAX_BYTES} bytes")
    _write(text, output)
    for note in found.notes:
        print(_line(note, "note"))
    try:
        _, doubts = found.level()
    except LevelError as error:
        for problem in error.problems:
            print(_line(problem, "error"))
        return 1
    for doubt in doubts:
        print(_line(doubt, "warning"))
    return 0


def export(level: Annotated[str, tyro.conf.Positional], output: Output = None) -> int:
    """Write a level as a map that TrenchBroom edits and 'roller level import' reads back.

    Args:
        level: name of a level, or a level file.
        output: map to write; by default the level's name and .map, in this directory.
    """
    loaded = load_level(level)
    exported = export_map(loaded)
    _write(exported.text, output or Path(f"{loaded.name}.map"))
    for note in exported.notes:
        print(_line(note, "note"))
    return 0


def _write(text: str, output: Path | None) -> int:
    if output is None:
        print(text)
    else:
        output.write_text(text if text.endswith("\n") else f"{text}\n", encoding="utf-8")
        print(f"wrote {shown(output)}")
    return 0


def watch(
    file: Annotated[Path, tyro.conf.Positional],
    output: Output = None,
    view: View = "plan",
    physics: Preset = "default",
    port: int = 0,
) -> int:
    """Play a level in the browser while it is written: it is loaded anew on every save.

    What is wrong with it is shown there, too. With an output, a picture of it is drawn instead, for
    a viewer that notices when its file changes. Ctrl-C ends it.

    Args:
        file: level file.
        output: picture to write, in place of the page.
        view: of the picture: plan needs no OpenGL, overview does.
        physics: physics preset to play with, and that the floors must be thick enough for.
        port: where the page is served, to this machine only; 0 takes the first free one from 8080.
    """
    if output is None:
        # Imported here: the rest needs no server.
        from roller_env.play.workbench import watch_level

        watch_level(file, physics, port)
        return 0
    _check_picture(output)
    try:
        for _ in saves(file):
            look(file, output, view, physics)
    except KeyboardInterrupt:
        print()
    return 0


def look(file: Path, picture: Path, view: View, physics: Preset) -> None:
    """Check a level file and, if it can be played, draw it."""
    print(time.strftime("%H:%M:%S"), end=" ")
    try:
        level, warnings = examine_level(file, hardest_play(physics_preset(physics)))
    except LevelError as error:
        print(_number(len(error.problems), "error"))
        print("\n".join(_line(problem, "error") for problem in error.problems), flush=True)
        return
    _draw(level, picture, view)
    print(f"wrote {shown(picture)}, {_number(len(warnings), 'warning')}")
    print("".join(f"{_line(problem, 'warning')}\n" for problem in warnings), end="", flush=True)


def saves(file: Path) -> Iterator[None]:
    """Yield at once, and then whenever a file, or one that it includes, is saved; never ends."""
    saved = SavedFile(file, files_of)
    while True:
        if saved.is_new():
            yield
        time.sleep(LOOK_EVERY_S)


COMMANDS: Final[dict[str, Callable[..., int]]] = {
    "check": check,
    "draw": draw,
    "new": new,
    "watch": watch,
    "solve": solve,
    "generate": generate,
    "schema": schema,
    "mjcf": mjcf,
    "import": import_map,
    "export": export,
}
"""By name."""
