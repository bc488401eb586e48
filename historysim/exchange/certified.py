"""Certified load histories for other contact laws: the files of a release, copied to a folder."""

import shutil
from pathlib import Path

from historysim.basics.files import write_reason
from historysim.errors import InputError

# In a wheel the files belong to the package; in a source tree they lie in its folder of data.
PACKAGED = Path(__file__).parents[1] / "certified"
SOURCE = Path(__file__).parents[2] / "data" / "certified"
CASES = "*.yaml"


def write_reference(folder: str | Path) -> list[Path]:
    """Copy the certified load histories, their scripts and results to a new or empty folder.

    Parameters
    ----------
    folder : path
        Name of the folder, which is created in an existing one.

    Returns
    -------
    list of Path
        The files that were written.

    Raises
    ------
    InputError
        The folder has content, is a file, or lies in a folder that does not exist; or the
        installation lacks the histories.
    """
    target = Path(folder)
    source = next((path for path in (PACKAGED, SOURCE) if any(path.glob(CASES))), None)
    if source is None:
        raise InputError(
            f"the certified histories are not installed in {PACKAGED}; expected them there: install historysim anew"
        )
    _check(target)
    try:
        shutil.copytree(
            source, target, dirs_exist_ok=True, ignore=shutil.ignore_patterns("__pycache__")
        )
    except shutil.Error as error:
        raise InputError(f"{target}: {error}") from error
    return sorted(path for path in target.rglob("*") if path.is_file())


def _check(target: Path) -> None:
    """Raise InputError unless a folder is new or empty, and can be created."""
    try:
        exists, has_place = target.exists() or target.is_symlink(), target.parent.is_dir()
        is_free = not exists or (target.is_dir() and not any(target.iterdir()))
    except (OSError, ValueError) as error:
        reason = write_reason(error) if isinstance(error, OSError) else error
        raise InputError(f"{str(target)!r}: cannot be the name of a folder ({reason})") from error
    if not is_free:
        raise InputError(f"{target}: exists already; expected the name of a new or empty folder")
    if not has_place:
        raise InputError(f"{target}: the folder {target.parent} does not exist; create it first")
