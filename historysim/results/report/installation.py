"""How to install the version that made a result again: from an index, or from the repository that it is from."""

import json
import shutil
import subprocess
from importlib import metadata
from pathlib import Path
from urllib.parse import urlsplit
from urllib.request import url2pathname

from historysim._version import __version__

PACKAGE = "historysim"
OWN = Path(__file__).resolve().parents[3]
"""The folder in which the package lies."""


def installing(version: str) -> tuple[str, str]:
    """Return a sentence, and the commands that install a version.

    Parameters
    ----------
    version : str
        That made the result.

    Returns
    -------
    (str, str)
        Where this version is installed from a repository (PEP 610 tells it), or runs from one, its commit is named.
    """
    if version != __version__:
        told = f"The result was made with version {version or 'unknown'}, and this page with {__version__}."
        return f"{told} From a copy of the repository that has that version:", "pip install ."
    origin = _origin()
    if "vcs_info" in origin:
        found = origin["vcs_info"]
        at = f"{found['vcs']}+{origin['url']}@{found['commit_id']}"
        return f"With the same version, {version}:", f'pip install "{PACKAGE} @ {at}"'
    folder = _folder(origin)
    if folder is None:
        return "With the same version:", f"pip install {PACKAGE}=={version}"
    commit, source = _git(folder, "rev-parse", "HEAD"), _git(folder, "remote", "get-url", "origin")
    if not commit:
        return f"With the same version, {version}, which was installed from a folder:", f'pip install "{folder}"'
    changed = " (changed since)" if _git(folder, "status", "--porcelain", "--untracked-files=no") else ""
    # what was not pushed is in the copy here alone
    copy = source if source and _git(folder, "branch", "-r", "--contains", commit) else str(folder)
    new = f"{PACKAGE}-{commit[:12]}"
    commands = [f'git clone "{copy}" {new}', f"git -C {new} checkout {commit}", f"pip install ./{new}"]
    told = f"With the same version, {version}, from commit {commit[:12]} of its repository{changed}:"
    return told, "\n".join(commands)


def _origin() -> dict[str, dict[str, str]]:
    """Return what the installer has told of where the package is from; empty of one from an index."""
    try:
        told = metadata.distribution(PACKAGE).read_text("direct_url.json")
    except metadata.PackageNotFoundError:
        return {}
    found: dict[str, dict[str, str]] = json.loads(told) if told else {}
    return found


def _folder(origin: dict[str, dict[str, str]]) -> Path | None:
    """Return the folder that the package was installed from, or runs in; None of one from an index."""
    if (OWN / ".git").exists():
        return OWN
    return Path(url2pathname(urlsplit(str(origin["url"])).path)) if "dir_info" in origin else None


def _git(folder: Path, *command: str) -> str:
    """Return what git says of a folder; empty where it says nothing, or there is none."""
    program = shutil.which("git")
    if program is None:
        return ""
    done = subprocess.run([program, "-C", str(folder), *command], capture_output=True, text=True, check=False)  # noqa: S603 - no shell, and words of ours
    return done.stdout.strip() if done.returncode == 0 else ""
