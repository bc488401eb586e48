"""Scenarios that are swept: a ball, and a small rough surface."""

from pytest import fixture
from swept import BALL, ROUGH


@fixture
def ball(tmp_path):
    path = tmp_path / "ball.toml"
    path.write_text(BALL, encoding="utf-8")
    return path


@fixture
def rough(tmp_path):
    path = tmp_path / "rough.toml"
    path.write_text(ROUGH, encoding="utf-8")
    return path
