"""Pages of the documentation, typed as they stand: files are saved, commands run, Python is carried out."""

import contextlib
import io
import re
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any

from click.testing import CliRunner

from historysim.cli import main

BLOCK = re.compile(r"^(<!-- not run: .+ -->\n)?```(\w+)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
# first words of commands that are no commands of this program
LEFT = {"pip", "python", "pytest", "mpiexec"}


def blocks(text: str) -> list[tuple[bool, str, str]]:
    """Return the blocks of code of a page: whether each is left out, its language, and its text."""
    return [(bool(left), kind, body) for left, kind, body in BLOCK.findall(text)]


def invoked(line: str) -> str:
    """Carry out a command, and return what it prints."""
    done = CliRunner().invoke(main, shlex.split(line, comments=True)[1:])
    assert done.exit_code == 0, f"{line}\n{done.output}"
    return done.output


def type_in(
    text: str, expect: Callable[[str, str], None] | None = None
) -> tuple[dict[str, Any], dict[str, str]]:
    """Type a page into the working directory.

    Parameters
    ----------
    text : str
        The page.
    expect : callable, optional
        Takes what was printed, and the block of text below it.

    Returns
    -------
    names : dict
        What Python has in the end.
    outputs : dict
        What each command printed, by the command without its first word.
    """
    names: dict[str, Any] = {"__name__": "page"}
    outputs: dict[str, str] = {}
    printed = ""
    for left, kind, body in blocks(text):
        if left:
            continue
        if kind == "toml":
            name = body.split("\n", 1)[0].removeprefix("# ")
            assert name.endswith(".toml"), (
                f"{body}\nhas no name; expected # name.toml in its first line"
            )
            Path(name).write_text(body, encoding="utf-8")
        elif kind == "sh":
            for line in body.splitlines():
                # text after a pipe is another program
                for command in line.split(" | ")[0].split(" && "):
                    words = shlex.split(command, comments=True)
                    if not words or words[0] in LEFT or "=" in words[0]:
                        continue
                    assert words[0] == "historysim", command
                    outputs[shlex.join(words[1:])] = printed = invoked(command)
        elif kind == "python":
            with contextlib.redirect_stdout(io.StringIO()) as stream:
                exec(compile(body, "page", "exec"), names)  # noqa: S102 - it is what a reader would type
            printed = stream.getvalue()
        elif kind == "text" and expect is not None:
            expect(printed, body)
    return names, outputs
