"""A package of a test, installed: its module and what its pyproject.toml says of it, in a folder on the path."""

import tomllib


def install(project, folder):
    """Put a project of one module into a folder, as an installer does; what has the folder on its path has it."""
    told = tomllib.loads((project / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    name, version = told["name"], told["version"]
    (folder / f"{name}.py").write_bytes((project / f"{name}.py").read_bytes())
    info = folder / f"{name}-{version}.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(
        f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n", encoding="utf-8"
    )
    groups = [
        f"[{group}]\n" + "".join(f"{key} = {value}\n" for key, value in points.items())
        for group, points in told["entry-points"].items()
    ]
    (info / "entry_points.txt").write_text("\n".join(groups), encoding="utf-8")
    return info
