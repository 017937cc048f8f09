"""What `make clients` tries is pinned, written down, and shown as it was measured."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from scripts import clients, matrix


def test_every_client_has_a_script_and_pins_the_library_it_is_about() -> None:
    assert len(clients.names()) >= 8
    for name in clients.names():
        assert (clients.SCRIPTS / f"{name.partition('-')[0]}.py").is_file(), name
        assert clients.pins((clients.SCRIPTS / f"{name}.txt").read_text(encoding="utf-8")), name


def test_what_a_client_pins_itself_does_not_come_from_the_general_list() -> None:
    general = clients.pins((clients.ROOT / "constraints.txt").read_text(encoding="utf-8"))
    for name in clients.names():
        own = clients.pins((clients.SCRIPTS / f"{name}.txt").read_text(encoding="utf-8"))
        assert clients.pins(clients.constraints(name)) == {
            package: version for package, version in general.items() if package not in own
        }
        assert own.get("torch", general["torch"]) == general["torch"], name


def test_the_page_shows_the_table_as_it_was_measured() -> None:
    rows = clients.read_rows()
    assert {row["client"] for row in rows} == set(clients.names())
    assert clients.markdown(rows) in clients.PAGE.read_text(encoding="utf-8")
    for row in rows:
        assert float(row["return_last"]) >= float(row["return_first"]) + clients.MARGIN


@pytest.fixture
def installed(monkeypatch: pytest.MonkeyPatch) -> list[list[float]]:
    """Let a client be there already; what its trainings returned is to be put into the list."""
    returns: list[list[float]] = []

    def run(*command: str | Path, directory: Path) -> str:
        if command[1] == "-c":
            return "torchrl 1.2.3, Python 3.11.1\n"
        told = [json.dumps({"used": "a collector", "returns": one}) for one in returns]
        return "\n".join(["a warning", *told, "another"])

    monkeypatch.setattr(matrix, "run", run)
    monkeypatch.setattr(clients, "set_up", lambda _: Path("python"))
    return returns


def test_a_client_whose_return_rises_is_a_row_a_training(installed: list[list[float]]) -> None:
    installed += [[0.0] * 8 + [3.0, 7.0], [1.0] * 5 + [9.0] * 5]
    first, second = clients.try_client("torchrl_ppo")
    assert (first["return_first"], first["return_last"], first["episodes"]) == (
        "0.00",
        "5.00",
        "10",
    )
    assert (second["return_first"], second["return_last"]) == ("1.00", "9.00")
    assert set(first) == set(clients.COLUMNS)


@pytest.mark.parametrize(
    ("returns", "told"),
    [
        ([[0.0] * 8 + [3.9, 3.9]], "from 0.00 to 3.90; wanted 4.0 more"),
        ([[9.0] * 9], "found 9 episodes; wanted 10 or more"),
        ([], "found no report"),
    ],
)
def test_a_client_that_does_not_learn_is_no_row(
    installed: list[list[float]], returns: list[list[float]], told: str
) -> None:
    installed += returns
    with pytest.raises(clients.ClientError, match=told):
        clients.try_client("torchrl_ppo")


def test_an_unknown_client_is_refused_before_anything_is_installed(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(clients, "install_roller", lambda: pytest.fail("it began to install"))
    assert clients.main(("acme",)) == 2
    assert "found acme; there are cleanrl_style_ppo, " in capsys.readouterr().err
