from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from roller_env.game.actions import DIRECTIONS, KEY_FORCE_N, KEYS, forces, held_keys
from roller_env.units import quants
from tests.builders import Game, make_level


def force_q(keys: str) -> list[float]:
    """Force of held keys in the original's quant/s^2 on its ball of mass 1."""
    return list(forces("keys", held_keys(keys)[None])[0] / 0.0254)


@pytest.mark.parametrize(
    ("key", "force"), [("w", [200, 0]), ("s", [-200, 0]), ("a", [0, 200]), ("d", [0, -200])]
)
def test_each_key_pushes_with_200_quants_along_its_world_axis(key: str, force: list[float]) -> None:
    assert force_q(key) == pytest.approx(force)
    assert pytest.approx(5.08) == KEY_FORCE_N


def test_two_keys_push_with_282_8_quants_on_the_diagonal() -> None:
    force = force_q("wa")
    assert force == pytest.approx([200.0, 200.0])
    assert np.linalg.norm(force) == pytest.approx(282.8, abs=0.05)


@given(st.sets(st.sampled_from(KEYS)))
def test_keys_add(held: set[str]) -> None:
    total = sum((np.array(force_q(key)) for key in held), np.zeros(2))
    np.testing.assert_allclose(force_q("".join(held)), total, atol=1e-12)


def test_opposite_keys_cancel() -> None:
    assert force_q("ws") == force_q("ad") == force_q("wasd") == [0.0, 0.0]


def test_the_nine_directions_go_round_from_forward_to_the_left() -> None:
    vectors = forces("directions", np.arange(9)) / KEY_FORCE_N
    np.testing.assert_array_equal(vectors[0], [0.0, 0.0])
    angles = np.degrees(np.arctan2(vectors[1:, 1], vectors[1:, 0])) % 360.0
    np.testing.assert_allclose(angles, np.arange(8) * 45.0)
    for index, held in enumerate(DIRECTIONS):
        np.testing.assert_allclose(vectors[index] * 200.0, force_q(held), atol=1e-12)


def test_a_force_action_is_in_key_forces() -> None:
    actions = [[0.5, -0.25], [1.0, -1.0], [0.0, 1.0]]
    np.testing.assert_allclose(forces("force", actions), np.array(actions) * KEY_FORCE_N)


@pytest.mark.parametrize(
    ("mode", "actions", "message"),
    [
        ("directions", [9], "takes 0 to 8"),
        ("directions", [-1], "takes 0 to 8"),
        ("directions", [1.0], "integers"),
        ("directions", [[1]], "integers"),
        ("keys", [[1, 0, 0]], r"takes \(N, 4\)"),
        ("keys", [1, 0, 0, 0], r"takes \(N, 4\)"),
        ("keys", [[np.nan, 0, 0, 7]], "found nan; 'keys' takes 0 and 1"),
        ("keys", [[1, 0, 0, 7]], "found 7; 'keys' takes 0 and 1"),
        ("keys", [[0.5, 0, 0, 0]], "found 0.5; 'keys' takes 0 and 1"),
        ("keys", [[-1, 0, 0, 0]], "found -1; 'keys' takes 0 and 1"),
        ("keys", [[1j, 0, 0, 0]], "of complex128; 'keys' takes"),
        ("keys", [["w", "", "", ""]], "of <U1; 'keys' takes"),
        ("force", [0.0, 0.0], r"takes \(N, 2\)"),
        ("force", [[np.nan, 0.0]], "found nan; 'force' takes -1 to 1"),
        ("force", [[0.0, np.inf]], "found inf; 'force' takes -1 to 1"),
        ("force", [[1.5, 0.0]], "found 1.5; 'force' takes -1 to 1"),
        ("force", [[0.0, 1.0 + 1e-9]], "'force' takes -1 to 1"),
        ("force", [[1j, 0.0]], "of complex128; 'force' takes"),
        ("force", [[True, False]], "of bool; 'force' takes"),
        ("force", [[None, 0.0]], "of object; 'force' takes"),
    ],
)
def test_an_action_outside_the_space_is_refused(
    mode: str, actions: list[object], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        forces(mode, actions)  # type: ignore[arg-type]


def test_keys_push_in_the_air_too() -> None:
    """The original has no ground check; without damping the ball gains F/m a second."""
    game = Game(make_level(start={"at": (0.0, 0.0, 50.0)}))
    game.play(1.0, "wd")
    velocity = game.observed("velocity")
    np.testing.assert_allclose(velocity[:2], [quants(200.0), -quants(200.0)], rtol=1e-5)


def test_nothing_slows_a_flying_ball_and_nothing_limits_its_speed() -> None:
    game = Game(make_level(start={"at": (0.0, 0.0, 300.0)}))
    game.place((0.0, 0.0, 300.0), (60.0, 0.0, 0.0))
    game.play(5.0)
    velocity = game.observed("velocity")
    np.testing.assert_allclose(velocity, [60.0, 0.0, -9.8044 * 5.0], rtol=1e-5)
