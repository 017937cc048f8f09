"""Let other libraries learn on Roller as they come: `make clients`.

Every client is two files in scripts/client/: NAME.py, what a user of that library would write, and
NAME.txt, the versions it needs beside or instead of those of constraints.txt (NAME-VERSION.txt, if
one script is tried with several). Each gets an environment of its own in .venv-clients/, where it
meets Roller as pip installs it. A script prints a line of JSON for every training: what of the
library was ``used`` and the ``returns`` of its episodes, in order; they must rise. A client that
has rows in docs/results/clients.csv is not tried again.

Examples::

    python scripts/clients.py
    python scripts/clients.py torchrl_ppo skrl_ppo     # again, rows or not
    python scripts/clients.py --check skrl_ppo
    python scripts/clients.py --show
"""

from __future__ import annotations

import csv
import datetime
import json
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Sequence
from pathlib import Path
from statistics import fmean
from typing import Final

import tyro

from scripts import matrix

ROOT: Final = Path(__file__).resolve().parents[1]
SCRIPTS: Final = ROOT / "scripts" / "client"
PLACE: Final = ROOT / ".venv-clients"
ROLLER: Final = PLACE / "roller-env"
TABLE: Final = ROOT / "docs" / "results" / "clients.csv"
PAGE: Final = ROOT / "docs" / "clients.md"

MARGIN: Final = 4.0
"""By how much the mean return of an experiment's last fifth of episodes is over that of its first:
a finished game of flat pays 20, each of its coins 1."""

COLUMNS: Final = (
    "client",
    "versions",
    "used",
    "episodes",
    "return_first",
    "return_last",
    "run_s",
    "date",
)
MARKS: Final = ("<!-- clients -->\n", "<!-- end -->")


class ClientError(RuntimeError):
    """A client that does not do what it should; the message holds what it printed."""


def names() -> list[str]:
    """Return the clients that there are."""
    return sorted(file.stem for file in SCRIPTS.glob("*.txt"))


def pins(text: str) -> dict[str, str]:
    """Return the versions that a file of requirements pins, by the name in its normal form."""
    found = re.findall(r"^([\w.-]+)(?:\[[\w,-]+\])?==(\S+)", text, flags=re.M)
    return {re.sub(r"[-_.]+", "-", name).lower(): version for name, version in found}


def constraints(client: str) -> str:
    """Return constraints.txt without what a client pins itself."""
    own = pins((SCRIPTS / f"{client}.txt").read_text(encoding="utf-8"))
    general = pins((ROOT / "constraints.txt").read_text(encoding="utf-8"))
    return "".join(f"{name}=={version}\n" for name, version in general.items() if name not in own)


def install_roller() -> None:
    """Unpack the wheel where all clients find it, so that Numba compiles the rules once.

    Its entry of the index is with it: pip takes roller-env for installed, and looks after its
    dependencies and the client's together.
    """
    PLACE.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as directory:
        wheel = matrix.build_wheel(Path(directory))
        kept = PLACE / wheel.name
        if kept.exists() and kept.read_bytes() == wheel.read_bytes() and ROLLER.exists():
            return
        shutil.rmtree(ROLLER, ignore_errors=True)
        pip = (sys.executable, "-m", "pip", "install", "--quiet", "--no-deps")
        matrix.run(*pip, "--target", ROLLER, wheel, directory=PLACE)
        shutil.copyfile(wheel, kept)


def set_up(client: str) -> Path:
    """Make a client's environment and return its Python."""
    home = PLACE / client
    python = home / "bin" / "python"
    if not python.exists():
        matrix.run(sys.executable, "-m", "venv", home, directory=PLACE)
    version = f"python{sys.version_info.major}.{sys.version_info.minor}"
    site = home / "lib" / version / "site-packages"
    (site / "roller.pth").write_text(f"{ROLLER}\n", encoding="utf-8")
    limits = home / "constraints.txt"
    limits.write_text(constraints(client), encoding="utf-8")
    pip = (python, "-m", "pip", "install", "--quiet", "--constraint", limits)
    matrix.run(*pip, "--requirement", SCRIPTS / f"{client}.txt", "roller-env", directory=home)
    return python


def versions(python: Path, client: str) -> str:
    """Return the versions of what a client's file names first, of Gymnasium, and of Python."""
    own = pins((SCRIPTS / f"{client}.txt").read_text(encoding="utf-8"))
    wanted = dict.fromkeys([*list(own)[:1], "gymnasium"])
    code = (
        "import platform, sys; from importlib.metadata import version; "
        "print(*(f'{n} {version(n)}' for n in sys.argv[1:]), 'Python ' + platform.python_version(),"
        " sep=', ')"
    )
    return matrix.run(python, "-c", code, *wanted, directory=PLACE).strip()


def try_client(client: str) -> list[dict[str, str]]:
    """Install a client, let it learn, and return its rows.

    Raises:
        ClientError: it failed, or its returns did not rise by `MARGIN`.
    """
    try:
        python = set_up(client)
        begun = time.perf_counter()
        with tempfile.TemporaryDirectory() as directory:
            script = SCRIPTS / f"{client.partition('-')[0]}.py"
            said = matrix.run(python, "-P", script, directory=Path(directory))
        ended = time.perf_counter()
        version = versions(python, client)
    except subprocess.CalledProcessError as failure:
        raise ClientError(f"{client}: failed\n{failure.stdout}") from None
    rows = []
    for used, returns in reports(said):
        first, last = first_and_last_fifth(returns)
        if last < first + MARGIN:
            means = f"the mean return went from {first:.2f} to {last:.2f}"
            raise ClientError(f"{client}: {used}: {means}; wanted {MARGIN} more")
        rows.append(
            {
                "client": client,
                "versions": version,
                "used": used,
                "episodes": str(len(returns)),
                "return_first": f"{first:.2f}",
                "return_last": f"{last:.2f}",
                "run_s": f"{ended - begun:.0f}",
                "date": datetime.datetime.now(datetime.UTC).date().isoformat(),
            }
        )
    return rows


def reports(said: str) -> list[tuple[str, list[float]]]:
    """Return what a script used and its returns, for every training that it reports.

    Raises:
        ClientError: it reports none.
    """
    lines = [json.loads(line) for line in said.splitlines() if line.startswith('{"used"')]
    if not lines:
        raise ClientError(f"found no report; wanted a line of JSON a training\n{said}")
    return [(line["used"], line["returns"]) for line in lines]


def first_and_last_fifth(returns: Sequence[float]) -> tuple[float, float]:
    """Return the mean return of the first and of the last fifth of all episodes.

    Raises:
        ClientError: there are fewer than ten, which say nothing.
    """
    if len(returns) < 10:
        raise ClientError(f"found {len(returns)} episodes; wanted 10 or more")
    fifth = len(returns) // 5
    return fmean(returns[:fifth]), fmean(returns[-fifth:])


def read_rows() -> list[dict[str, str]]:
    """Return the rows that there are."""
    if not TABLE.exists():
        return []
    with TABLE.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def write_rows(rows: list[dict[str, str]]) -> None:
    """Write the table, and what docs/clients.md shows of it."""
    with TABLE.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.DictWriter(stream, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    page = PAGE.read_text(encoding="utf-8")
    before, _, rest = page.partition(MARKS[0])
    _, _, after = rest.partition(MARKS[1])
    PAGE.write_text(f"{before}{MARKS[0]}{markdown(rows)}{MARKS[1]}{after}", encoding="utf-8")


def markdown(rows: Iterable[dict[str, str]]) -> str:
    """Return the rows as a table of Markdown."""
    lines = [
        "| script | with | what is used | mean return, first and last fifth | seconds | date |",
        "|---|---|---|---|---|---|",
    ]
    lines += [
        f"| `{row['client']}` | {row['versions']} | {row['used']} "
        f"| {row['return_first']} → {row['return_last']} ({row['episodes']} episodes) "
        f"| {row['run_s']} | {row['date']} |"
        for row in rows
    ]
    return "\n".join(lines) + "\n"


def main(
    clients: tyro.conf.Positional[tuple[str, ...]] = (),
    show: bool = False,
    keep: bool = False,
    check: bool = False,
) -> int:
    """Try clients and write their rows; return the exit status.

    Args:
        clients: to try whether or not they have rows; none: all that have none.
        show: only print the table that there is.
        keep: keep the environments, hundreds of megabytes each, for the next time.
        check: only see that they learn; write nothing.
    """
    rows = read_rows()
    if unknown := sorted(set(clients) - set(names())):
        print(f"error: found {', '.join(unknown)}; there are {', '.join(names())}", file=sys.stderr)
        return 2
    failed = []
    there = {row["client"] for row in rows}
    todo = [] if show else list(clients) or [name for name in names() if name not in there]
    if todo:
        install_roller()
    for client in todo:
        print(f"{client} ...", flush=True)
        try:
            others = [row for row in rows if row["client"] != client]
            rows = sorted(others + try_client(client), key=lambda row: row["client"])
            if not check:
                write_rows(rows)
        except ClientError as error:
            failed.append(client)
            print(error, file=sys.stderr)
        if not keep:
            shutil.rmtree(PLACE / client, ignore_errors=True)
    print(markdown(rows), end="")
    for client in failed:
        print(f"{client}: FAILED, see above")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(tyro.cli(main))
