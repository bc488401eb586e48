"""Counts of wording that readers have to decode, in docstrings, names and prose, compared with limits.

``python tests/scripts/language.py [--list]`` prints one line per measure and exits with 1 if a
measure exceeds its limit; ``--list`` also prints each occurrence. It needs the standard library
only.
"""

import argparse
import ast
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "historysim"
EVERYDAY_WORD = re.compile(
    r"after|alone|asked|before|begin|beside|drawn|each|end|first|found|given|here|kept|known|last|least|left|made|most"
    r"|next|now|one|others?|own|parts?|places?|said|several|shown|them|there|these|those|told|wanted|way|what|whole"
    r"|whose|why"
)
VAGUE_SUBJECT = re.compile(r"\b[Ww](hat|hatever|hoever)\b|\b(that|those) of\b")
QUESTION_WORDS = frozenset({"Whether", "How", "Where", "When"})
PARTICIPLE = re.compile(
    r"[a-z]+ed|taken|given|driven|drawn|known|shown|broken|kept|told|another|beside|under|called|at|of"
)
PREPOSITION = re.compile(
    r".*_(of|to|in|at|on|by|for|from|than|beside)|(of|in|on|one|its|what|who)_.*"
)
ACCEPTED_PREFIX = re.compile(r"(from|to|as|is|has|with|at_least|at_most|n)_")
HINGE = re.compile(r"\b(what|whatever|whether|how|that of|those of)\b", re.IGNORECASE)
C_TOKEN = re.compile(
    r'/\*(?P<comment>.*?)\*/|"(?:\\.|[^"\\\n])*"|(?P<name>\b[A-Za-z_]\w*\b)', re.DOTALL
)
IDIOM = re.compile(
    r"\b(beside|stands|lies|goes|at once|of its own|is there|what is left)\b", re.IGNORECASE
)
PROSE = ("*.py", "*.md")
PROSE_EXCLUDED = ("tests/scripts/language.py",)


class Measure(NamedTuple):
    """Value of a measure, its limit, and the occurrences that count."""

    text: str
    value: float
    limit: float
    unit: str
    occurrences: list[str]

    def exceeds(self) -> bool:
        """Return True if the value is above the limit."""
        return self.value > self.limit


def syntax_trees() -> Iterator[tuple[Path, ast.Module]]:
    """Parse each module of the package."""
    for path in sorted(PACKAGE.rglob("*.py")):
        yield path.relative_to(ROOT), ast.parse(path.read_text(encoding="utf-8"))


def is_vague(first_line: str) -> bool:
    """Return True if the first line of a docstring hinges on a pronoun or a question word in place of a noun."""
    return (
        bool(VAGUE_SUBJECT.search(first_line)) or first_line.split(maxsplit=1)[0] in QUESTION_WORDS
    )


def is_noun_function(name: str) -> bool:
    """Return True if a function is named by a bare participle, or starts or ends with a preposition."""
    stem = name.lstrip("_")
    if name.startswith("__") or ACCEPTED_PREFIX.match(stem):
        return False
    return bool(PARTICIPLE.fullmatch(stem) or PREPOSITION.fullmatch(stem))


def bound_names(node: ast.AST) -> list[str]:
    """Return the variable or parameter name that a syntax node binds."""
    if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
        return [node.id]
    return [node.arg] if isinstance(node, ast.arg) else []


def percentage(part: int, total: int) -> float:
    """Return 100 part/total, 0 if the total is 0."""
    return 100.0 * part / max(total, 1)


def measure_names() -> list[Measure]:
    """Measure docstrings, bound names and function names of the package."""
    docstrings, names = 0, 0
    vague: list[str] = []
    everyday: list[str] = []
    functions: list[str] = []
    for path, tree in syntax_trees():
        for node in ast.walk(tree):
            if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
                docstring = ast.get_docstring(node)
                if docstring and docstring.strip():
                    docstrings += 1
                    first_line = docstring.strip().splitlines()[0]
                    if is_vague(first_line):
                        vague.append(f"{path}:{getattr(node, 'lineno', 1)}: {first_line}")
            if isinstance(node, ast.FunctionDef) and is_noun_function(node.name):
                functions.append(f"{path}:{node.lineno}: {node.name}")
            for name in bound_names(node):
                names += 1
                if EVERYDAY_WORD.fullmatch(name):
                    everyday.append(f"{path}:{getattr(node, 'lineno', 1)}: {name}")
    return [
        Measure(
            "docstrings whose first line has a pronoun for its noun",
            percentage(len(vague), docstrings),
            4,
            "%",
            vague,
        ),
        Measure(
            "bound names that are everyday words",
            percentage(len(everyday), names),
            2,
            "%",
            everyday,
        ),
        Measure(
            "functions named by a participle or a preposition", len(functions), 40, "", functions
        ),
    ]


def measure_c() -> list[Measure]:
    """Measure identifiers (each once a file) and first clauses of comments of the C core."""
    names, comments = 0, 0
    everyday: list[str] = []
    hinging: list[str] = []
    for path in sorted((PACKAGE / "memory").glob("*.[ch]")):
        text = path.read_text(encoding="utf-8")
        seen: set[str] = set()
        for match in C_TOKEN.finditer(text):
            occurrence = f"{path.relative_to(ROOT)}:{text.count(chr(10), 0, match.start()) + 1}"
            comment, name = match["comment"], match["name"]
            if comment is not None:
                comments += 1
                clause = " ".join(re.split(r"[.;:,]", comment)[0].replace("*", " ").split())
                if HINGE.search(clause):
                    hinging.append(f"{occurrence}: {clause}")
            elif name is not None and name not in seen:
                seen.add(name)
                names += 1
                if EVERYDAY_WORD.fullmatch(name):
                    everyday.append(f"{occurrence}: {name}")
    return [
        Measure(
            "C identifiers that are everyday words",
            percentage(len(everyday), names),
            1.5,
            "%",
            everyday,
        ),
        Measure(
            "C comments that hinge on a question word",
            percentage(len(hinging), comments),
            2,
            "%",
            hinging,
        ),
    ]


def measure_idiom() -> Measure:
    """Count phrases of the idiom in the Python and Markdown files that git tracks."""
    files = subprocess.run(
        ["git", "ls-files", *PROSE],  # noqa: S607 # git of the caller
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    ).stdout.splitlines()
    occurrences = [
        f"{name}:{number}: {match.group()}"
        for name in files
        if name not in PROSE_EXCLUDED and (ROOT / name).is_file()
        for number, line in enumerate((ROOT / name).read_text(encoding="utf-8").splitlines(), 1)
        for match in IDIOM.finditer(line)
    ]
    return Measure(
        "phrases of the idiom in Python and Markdown", len(occurrences), 150, "", occurrences
    )


def main() -> int:
    """Print the measures; return 1 if one exceeds its limit."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--list", action="store_true", help="also print each occurrence")
    arguments = parser.parse_args()
    measures = [*measure_names(), *measure_c(), measure_idiom()]
    for measure in measures:
        verdict = "above the limit" if measure.exceeds() else "ok"
        print(
            f"{measure.text:56s} {measure.value:7.1f} {measure.unit:1s} (limit {measure.limit:g}) {verdict}"
        )
        if arguments.list:
            print(*(f"    {occurrence}" for occurrence in measure.occurrences), sep="\n")
    return any(measure.exceeds() for measure in measures)


if __name__ == "__main__":
    sys.exit(main())
