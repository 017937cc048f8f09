"""Give what is unreleased a version and a date, in all the places that name one.

It changes files only: look at the difference, commit it, and go on as it says. The changelog must
have something to tell, and the version must not be out by now.

Example::

    python scripts/release.py 0.2.0
"""

from __future__ import annotations

import datetime
import re
import sys
from pathlib import Path
from typing import Final

import tyro

ROOT: Final = Path(__file__).resolve().parents[1]
UNRELEASED: Final = "## Unreleased\n"


class ReleaseError(ValueError):
    """What cannot be released; the message says what would be right."""


def parts(version: str) -> tuple[int, ...]:
    """Return the numbers of a version.

    Raises:
        ReleaseError: it is not three of them.
    """
    if re.fullmatch(r"(0|[1-9]\d*)(\.(0|[1-9]\d*)){2}", version) is None:
        raise ReleaseError(f"version: found {version!r}; wanted three numbers, as in 0.2.0")
    return tuple(int(number) for number in version.split("."))


def released(texts: dict[str, str], version: str, day: datetime.date) -> dict[str, str]:
    """Return the files of a release.

    Args:
        texts: the files as they are, by their paths from the project's directory.
        version: the release's, as in 0.2.0.
        day: of the release.

    Raises:
        ReleaseError: the version is out by now, or the changelog has nothing unreleased.
    """
    (now,) = re.findall(r'^__version__ = "(.+)"$', texts["roller_env/__init__.py"], flags=re.M)
    before, _, rest = texts["CHANGELOG.md"].partition(UNRELEASED)
    # The first release of all has the version that the files have.
    if parts(version) < parts(now) or f"\n## {version} " in rest:
        raise ReleaseError(f"version: found {version}; wanted one that is released after {now}")
    news, _, _ = rest.partition("\n## ")
    if "\n- " not in news:
        raise ReleaseError("CHANGELOG.md: found nothing under Unreleased; wanted what has changed")
    cited = re.sub(r"^date-released: .*\n", "", texts["CITATION.cff"], flags=re.M)
    dated = f"version: {version}\ndate-released: {day.isoformat()}"
    return {
        "CHANGELOG.md": f"{before}{UNRELEASED}\n## {version} - {day.isoformat()}\n{rest}",
        "CITATION.cff": re.sub(r"^version: .+$", dated, cited, flags=re.M),
        "roller_env/__init__.py": texts["roller_env/__init__.py"].replace(
            f'__version__ = "{now}"', f'__version__ = "{version}"'
        ),
    }


def main(version: tyro.conf.Positional[str]) -> int:
    """Write the files of a release and say what is to be done next; return the exit status.

    Args:
        version: of the release, as in 0.2.0.
    """
    names = ("CHANGELOG.md", "CITATION.cff", "roller_env/__init__.py")
    texts = {name: (ROOT / name).read_text(encoding="utf-8") for name in names}
    try:
        written = released(texts, version, datetime.datetime.now(datetime.UTC).date())
    except ReleaseError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    for name, text in written.items():
        (ROOT / name).write_text(text, encoding="utf-8")
    print(f"git commit -am 'Release {version}' && git tag v{version}")
    print("make dist")
    print(".venv/bin/twine upload dist/*")
    return 0


if __name__ == "__main__":
    sys.exit(tyro.cli(main))
