"""How the version that made a result is installed again."""

import json
import subprocess
from importlib import metadata

import pytest

from historysim._version import __version__
from historysim.results.report import installation


@pytest.fixture
def installed(monkeypatch, tmp_path):
    """Make the package one of the installer's, with what this tells of its origin."""

    def told(origin):
        class Found:
            @staticmethod
            def read_text(_):
                return origin and json.dumps(origin)

        monkeypatch.setattr(metadata, "distribution", lambda _: Found)
        monkeypatch.setattr(installation, "OWN", tmp_path / "site-packages")

    return told


def test_from_an_index_it_is_a_version(installed):
    installed(None)
    assert installation.installing(__version__)[1] == f"pip install historysim=={__version__}"


def test_from_a_repository_it_is_a_commit(installed):
    vcs = {"vcs": "git", "commit_id": "0123abc", "requested_revision": "main"}
    installed({"url": "https://example.org/h.git", "vcs_info": vcs})
    told, commands = installation.installing(__version__)
    assert commands == 'pip install "historysim @ git+https://example.org/h.git@0123abc"'
    assert __version__ in told


def test_from_a_folder_with_a_history_the_commands_get_its_commit(installed, tmp_path):
    folder = tmp_path / "copy"
    folder.mkdir()
    (folder / "a").write_text("1", encoding="utf-8")
    identity = ["-c", "user.name=n", "-c", "user.email=e@example.org"]
    for command in (["init", "-q"], ["add", "a"], [*identity, "commit", "-qm", "first"]):
        subprocess.run(["git", "-C", str(folder), *command], check=True)  # noqa: S607 - git of the path
    (folder / "a").write_text("2", encoding="utf-8")
    installed({"url": folder.as_uri(), "dir_info": {}})
    told, commands = installation.installing(__version__)
    assert "(changed since)" in told
    *getting, installing = commands.splitlines()
    for line in getting:
        subprocess.run(line, shell=True, check=True, cwd=tmp_path)  # noqa: S602 - as it is printed
    assert installing.startswith("pip install ./historysim-")
    new = tmp_path / installing.removeprefix("pip install ./")
    assert (new / "a").read_text(encoding="utf-8") == "1"


def test_a_result_of_another_version_says_so(installed):
    installed(None)
    told, _ = installation.installing("0.0.1")
    assert told.startswith(f"The result was made with version 0.0.1, and this page with {__version__}.")
