"""Which module of the package imports which, read from its source."""

import ast
import functools
from pathlib import Path

import historysim

ROOT = Path(historysim.__file__).parent


def modules(root):
    """Name each module, as in "memory.walk", with its file; the package itself is ""."""
    found = {}
    for path in sorted(root.rglob("*.py")):
        parts = path.relative_to(root).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def imported(node, name, path):
    """Full names that one import statement may import, modules and what stands in them alike."""
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    base = node.module or ""
    if node.level:
        here = ["historysim", *name.split(".")] if name else ["historysim"]
        package = here if path.name == "__init__.py" else here[:-1]
        base = ".".join([*package[: len(package) - node.level + 1], *filter(None, [node.module])])
    return [f"{base}.{alias.name}" for alias in node.names]


def inside(full, known):
    """The module of the package that a full name belongs to."""
    parts = full.split(".")[1:]
    while parts and ".".join(parts) not in known:
        parts.pop()
    return ".".join(parts)


def at_top_level(tree):
    """Nodes that run when the module is imported."""
    waiting = [tree]
    while waiting:
        node = waiting.pop()
        yield node
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            continue
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            waiting.extend(node.orelse)
        else:
            waiting.extend(ast.iter_child_nodes(node))


@functools.cache
def import_statements(source, *, top_level):
    """All of a module's imports, or those that run when it is imported."""
    tree = ast.parse(source)
    nodes = at_top_level(tree) if top_level else ast.walk(tree)
    return [node for node in nodes if isinstance(node, ast.Import | ast.ImportFrom)]


def imports(root, *, top_level=False):
    """For each module: the modules of the package that it imports, and the other packages."""
    known = modules(root)
    found = {}
    for name, path in known.items():
        statements = import_statements(path.read_text(encoding="utf-8"), top_level=top_level)
        full = [target for node in statements for target in imported(node, name, path)]
        own = {inside(target, known) for target in full if target.split(".")[0] == "historysim"}
        found[name] = (own, {target.split(".")[0] for target in full} - {"historysim"})
    return found
