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
    """Full names that one import statement may import, modules and their members alike."""
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


@functools.cache
def parsed(path):
    """Return the syntax tree of a file."""
    return ast.parse(path.read_text(encoding="utf-8"))


def statements(tree):
    """Yield all statements; imports are among them, and expressions, most of the nodes, are not visited."""
    waiting = [tree]
    while waiting:
        node = waiting.pop()
        yield node
        for name in ("body", "orelse", "finalbody", "handlers", "cases"):
            waiting.extend(getattr(node, name, ()))


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
            waiting.extend(
                each for each in ast.iter_child_nodes(node) if not isinstance(each, ast.expr)
            )


def import_statements(tree, *, top_level):
    """All of a module's imports, or those that run when it is imported."""
    nodes = at_top_level(tree) if top_level else statements(tree)
    return [node for node in nodes if isinstance(node, ast.Import | ast.ImportFrom)]


@functools.cache
def package_imports(*, top_level=False):
    """Return `imports` of the installed package, read once."""
    return imports(ROOT, top_level=top_level)


def imports(root, *, top_level=False):
    """For each module: the modules of the package that it imports, and the other packages."""
    known = modules(root)
    found = {}
    for name, path in known.items():
        tree = parsed(path) if root == ROOT else ast.parse(path.read_text(encoding="utf-8"))
        found_in = import_statements(tree, top_level=top_level)
        full = [target for node in found_in for target in imported(node, name, path)]
        own = {inside(target, known) for target in full if target.split(".")[0] == "historysim"}
        found[name] = (own, {target.split(".")[0] for target in full} - {"historysim"})
    return found
