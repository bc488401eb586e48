"""`write_fmu`: export of a contact as a co-simulation unit (FMU) for other simulators."""

import hashlib
import math
import platform
import re
import sys
import tempfile
import uuid
import zipfile
from collections.abc import Mapping, Sequence
from html import escape
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from historysim.asperities.convex import ROUNDING
from historysim.asperities.curves import NormalCurves
from historysim.asperities.patches import Patches
from historysim.asperities.state import State
from historysim.basics.arguments import scalar
from historysim.basics.compiler import ZIG, compile_shared, compiler, options
from historysim.basics.files import replacing
from historysim.basics.limits import LARGEST
from historysim.basics.targets import Output, check_outputs, signed_format
from historysim.basics.units import duration_text, seconds
from historysim.basics.wording import Notify, join_words, progress_bar, silent
from historysim.errors import InputError, InstallationError
from historysim.exchange import CONSTANT, EVOLVES, Exportable, Exported, resolve_export
from historysim.exchange.fmu.unit_description import (
    OUTPUTS,
    Unit,
    build_description,
    model_description,
    variables,
)
from historysim.loads.event_sequence import is_planar
from historysim.memory import get_include
from historysim.replaying import Replay

FMU = signed_format("a unit of historysim", ".fmu")
HERE = Path(__file__).parent

# Names of the platforms in zig, by their names in FMI 3.0.
TARGETS = {
    "x86_64-linux": "x86_64-linux-gnu.2.17",
    "aarch64-linux": "aarch64-linux-gnu.2.17",
    "x86_64-windows": "x86_64-windows-gnu",
    "x86_64-darwin": "x86_64-macos-none",
    "aarch64-darwin": "aarch64-macos-none",
}
# Names in FMI 2.0, which has none for ARM: the name of FMI 3.0 is used there.
FOLDERS_OF_2 = {"x86_64-linux": "linux64", "x86_64-windows": "win64", "x86_64-darwin": "darwin64"}
ENDINGS = {"linux": ".so", "windows": ".dll", "darwin": ".dylib"}

PREFACE = """/* In a unit of co-simulation nothing of the memory is seen from outside, and there is one thread. */
#define HS_ONE_THREAD
#define HS_API
#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#endif
"""
LONG_AGO = (
    1980,
    1,
    1,
    0,
    0,
    0,
)  # time stamp of all files in the archive, so that a contact always gives the same bytes


class Controls(NamedTuple):
    """Control of the channels of a unit, and whether loads beyond the friction limit are held at the limit."""

    normal: str  #: "load" or "displacement"
    tangential: str  #: "load" or "displacement"
    saturate: bool
    directions: int  #: number of tangential directions


def write_fmu(  # noqa: PLR0913 - options by name, as the command has them
    source: Exportable,
    output: str | Path,
    *,
    at: float | None = None,
    normal: str = "load",
    tangential: str = "displacement",
    saturate: bool | None = None,
    directions: int | None = None,
    fmi: int = 2,
    platforms: Sequence[str] | None = None,
    force: bool = False,
    progress: bool = False,
    notify: Notify = silent,
) -> None:
    """Write a contact as a co-simulation unit (FMU): plain C with the exact memory, independent of Python.

    Each ``doStep`` moves the contact along a straight path from its state to the inputs, in one
    exact update for any step size; if the path turns in two tangential directions, the accuracy is
    set by ``rings``. States can be saved, restored and serialised, bit for bit.

    Parameters
    ----------
    source : Exportable
        A scenario or its file, a log, a result, or a replay.
    output : path
        The file (.fmu).
    at : float, optional
        Start from the state at this time [s]; by default without contact.
    normal, tangential : {"load", "displacement"}
        Input that controls this channel. The normal displacement is the approach from first touch;
        with an instrument the tangential displacement is the displacement of its drive.
    saturate : bool, optional
        Hold a tangential load beyond the friction limit at the limit; by default as in the
        scenario. Otherwise such a step is discarded with a message, and the state is unchanged.
    directions : {1, 2}, optional
        Tangential directions; by default as many as the events have. With two, inputs and outputs
        of the tangential channel end in ``_x`` and ``_y``, and there are no directional
        derivatives.
    fmi : {2, 3}
        Version of the standard: 2.0 or 3.0.
    platforms : sequence of str, optional
        Platforms to compile for, by the names of FMI 3.0, such as ``"x86_64-windows"``; for those
        other than this one the package ``ziglang`` has to be installed. By default this one.
    force : bool
        Also replace a file that is not a unit of historysim.
    progress : bool
        Show the platform being compiled on standard error, if it is a terminal.
    notify : callable, optional
        Receives notices for the user.

    Raises
    ------
    InputError
        If the source cannot be used, its asperities evolve, or an argument is invalid.
    LoadError
        If the contact cannot support a load before the time ``at``.
    InstallationError
        If no compiler is available.
    OSError
        If the file cannot be written.
    """
    output = Path(output)
    if fmi not in {2, 3} or isinstance(fmi, bool):
        raise InputError(f"fmi is {fmi!r}; expected 2 or 3")
    for name, control in (("normal", normal), ("tangential", tangential)):
        if control not in {"load", "displacement"}:
            raise InputError(f"{name} is {control!r}; expected 'load' or 'displacement'")
    chosen = _check_platforms(platforms)
    resolved = resolve_export(source, notify)
    check_outputs([Output(output, (FMU,))], resolved.files, force=force)
    at = None if at is None else scalar("at", seconds(at))
    events = resolved.replay.events
    if at is not None and len(events) and at > events[-1].time:
        last_time = duration_text(events[-1].time)
        notify(
            f"{resolved.name}: its last event is at {last_time}; the unit starts from the state after it"
        )
    saturate = resolved.replay.saturate if saturate is None else saturate
    controls = Controls(
        normal, tangential, saturate, _resolve_directions(resolved.replay, directions)
    )
    with replacing(output) as unfinished:
        # the compiler's temporary files may meet the same limit: the error then names the unit
        files = unit_files(resolved, controls, at=at, fmi=fmi, platforms=chosen, progress=progress)
        with zipfile.ZipFile(unfinished, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, content in sorted(files.items()):
                archive.writestr(zipfile.ZipInfo(name, LONG_AGO), content, zipfile.ZIP_DEFLATED)


def _resolve_directions(job: Replay, requested: int | None) -> int:
    """Return the number of tangential directions of a unit; InputError if the contact does not support it."""
    planar = is_planar(job.events)
    if requested not in {None, 1, 2} or isinstance(requested, bool):
        raise InputError(
            f"directions is {requested!r}; expected 1 or 2, or None for the number in the events"
        )
    if requested == 1 and planar:
        raise InputError(
            "directions is 1, and the events move in two tangential directions; expected 2, or None"
        )
    if requested == 2 and job.ensemble.direction_limit:
        raise InputError(
            f"directions is 2, and {job.ensemble.direction_limit} supports one tangential direction only; expected 1"
        )
    return requested or 1 + planar


def unit_files(
    source: Exported,
    controls: Controls,
    *,
    at: float | None,
    fmi: int,
    platforms: Sequence[str],
    progress: bool = False,
) -> dict[str, bytes]:
    """Return the contents of all files of a unit by name; parameters and errors as for `write_fmu`."""
    job, ensemble = source.replay, source.ensemble
    if job.instrument.parallel_stiffness:
        raise InputError(
            "the instrument has a parallel_stiffness, which a unit of co-simulation does not have; expected none: give "
            "that spring to the model which the unit becomes a part of"
        )
    if ensemble.attracts:
        raise InputError("a co-simulation unit has no attraction; expected an ensemble without it")
    state: Any = ensemble.initial_state() if at is None else job.state(until=at)
    if controls.directions == 2:
        state = ensemble.enter_plane(state)
    elif state.memory.line.evolved:
        raise InputError(f"{EVOLVES}, which a co-simulation unit does not support; {CONSTANT}")
    curves = ensemble.curves if isinstance(ensemble, Patches) else None
    resources = {"contact.bin": state.to_bytes()} | (
        {} if curves is None else {"curve.bin": _serialise_curve(curves)}
    )
    identifier = re.sub(r"\W", "_", source.name, flags=re.ASCII)
    identifier = identifier if identifier[:1].isalpha() else f"contact_{identifier}"
    table = variables(
        controls.normal,
        controls.tangential,
        driven=not job.instrument.rigid,
        areas=ensemble.has_areas,
        directions=controls.directions,
    )
    keys = {variable.key for variable in table}
    inputs = [variable.name for variable in table if variable.causality == "input"]
    code = {path.name: path.read_text("utf-8") for path in _list_sources(fmi)}
    code["historysim.h"] = PREFACE + code["historysim.h"]
    # the C code names the variables of all units
    others = variables(controls.normal, controls.tangential, driven=True, areas=True, directions=2)
    absent = sorted({variable.key for variable in (*OUTPUTS, *others)} - keys)
    numbered = [*enumerate(variable.key for variable in table), *enumerate(absent, start=1000)]
    settings = _settings(job, controls, curves) | {
        f"V_{key}": str(number) for number, key in numbered
    }
    token = _digest({**code, **resources, "settings": repr(settings), "fmi": str(fmi)})
    defines = "".join(
        f"#define {name} {value}\n"
        for name, value in {**settings, "MODEL_TOKEN": f'"{token}"'}.items()
    )
    code["model.h"] = f"/* What is particular to this contact. */\n{defines}"
    unit = Unit(
        identifier=identifier,
        name=source.name,
        text=source.title or "a rough frictional contact with its exact memory",
        token=token,
        variables=table,
        starts=dict(
            zip(
                (*inputs, "friction_factor"),
                (*_start_values(job, state, controls), 1.0),
                strict=True,
            )
        ),
        sources=sorted(name for name in code if name.endswith(".c")),
        directions=controls.directions,
    )
    files = {f"resources/{name}": content for name, content in resources.items()}
    files |= {f"sources/{name}": text.encode() for name, text in code.items()}
    files["modelDescription.xml"] = model_description(unit, fmi)
    files["documentation/index.html"] = _render_page(unit, controls, at)
    if fmi == 3:
        files["sources/buildDescription.xml"] = build_description(unit)
    with progress_bar(
        progress, "platform", len(platforms), desc="compiling", leave=False
    ) as advance:
        for name in platforms:
            folder = FOLDERS_OF_2.get(name, name) if fmi == 2 else name
            ending = ENDINGS[name.partition("-")[2]]
            files[f"binaries/{folder}/{identifier}{ending}"] = compile_unit(code, name)
            advance()
    return files


def this_platform() -> str:
    """Return the name of the current platform in FMI 3.0."""
    machine = {"amd64": "x86_64", "arm64": "aarch64"}.get(
        platform.machine().lower(), platform.machine().lower()
    )
    return f"{machine}-{ {'win32': 'windows', 'darwin': 'darwin'}.get(sys.platform, 'linux') }"


def _check_platforms(platforms: Sequence[str] | None) -> list[str]:
    native = this_platform()
    if platforms is None:
        return [native]
    chosen = [platforms] if isinstance(platforms, str) else list(platforms)
    for name in chosen:
        if name not in TARGETS and name != native:
            raise InputError(f"platform {name!r} is unknown; expected {join_words(TARGETS)}")
    return list(dict.fromkeys(chosen))


def compile_unit(code: Mapping[str, str], target: str) -> bytes:
    """Compile C files to a shared library for a platform; InstallationError if there is no compiler or it fails."""
    is_native = target == this_platform()
    native_compiler = compiler() if is_native else []
    command = native_compiler or [*ZIG, "-target", TARGETS.get(target, target)]
    if not native_compiler and find_spec("ziglang") is None:
        alternatives = "cc, gcc or clang, or " if is_native else ""
        raise InstallationError(
            f"no C compiler for {target} is available; expected {alternatives}the package ziglang, which contains one: "
            "pip install ziglang"
        )
    with tempfile.TemporaryDirectory() as folder:
        for name, text in code.items():
            Path(folder, name).write_text(text, encoding="utf-8")
        library = Path(folder, "unit")
        sources = [str(Path(folder, name)) for name in code if name.endswith(".c")]
        try:
            compile_shared(
                [*command, *options()], sources, library, windows=target.endswith("windows")
            )
        except RuntimeError as error:
            raise InstallationError(f"the unit cannot be compiled for {target}: {error}") from None
        return library.read_bytes()


def _list_sources(fmi: int) -> list[Path]:
    """List the C files of a unit."""
    memory = Path(get_include())
    unit_sources = [
        HERE / "unit.c",
        HERE / "unit.h",
        HERE / "calls.h",
        HERE / f"fmi{fmi}.c",
        *sorted(HERE.glob(f"fmi{fmi}*.h")),
    ]
    return [*sorted(memory.glob("*.[ch]")), *unit_sources]


def _settings(job: Replay, controls: Controls, curves: NormalCurves | None) -> dict[str, str]:
    """Return the macro definitions of a contact for its C code."""
    kind = {"load": "HS_LOAD", "displacement": "HS_DISPLACED"}
    limits = () if curves is None else (float(curves.load[-1].sum()), float(curves.approach[-1]))
    largest = [(limit * (1.0 + ROUNDING)).hex() for limit in limits] or ["HUGE_VAL", "HUGE_VAL"]
    x, y = job.instrument.directional_compliances(controls.directions)
    return {
        "NORMAL_CONTROL": kind[controls.normal],
        "TANGENTIAL_CONTROL": kind[controls.tangential],
        "COMPLIANCE": x.hex(),
        "COMPLIANCE_Y": y.hex(),
        "TOLERANCE": job.ensemble.tolerance.hex(),
        "SATURATE": str(int(controls.saturate)),
        "LARGEST_SIZE": LARGEST.hex(),
        "LARGEST_LOAD": largest[0],
        "LARGEST_APPROACH": largest[1],
        "PATCHES": str(int(curves is not None)),
    }


def _digest(contents: Mapping[str, str | bytes]) -> str:
    """Return the identifier of a contact, equal in description and binary: a digest of its contents."""
    digest = hashlib.sha256()
    for name, content in sorted(contents.items()):
        digest.update(f"{name}\0".encode())
        digest.update(content if isinstance(content, bytes) else content.encode())
    return f"{{{uuid.UUID(bytes=digest.digest()[:16], version=4)}}}"


def _serialise_curve(curves: NormalCurves) -> bytes:
    """Serialise a normal curve as ``resources/curve.bin``; see `unit.c`."""
    area = np.zeros(curves.approach.size) if curves.area is None else curves.area.sum(axis=1)
    first_touch = np.sort(curves.first_touch)
    arrays = [
        [curves.approach.size, first_touch.size],
        [0.0],
        curves.approach,
        [0.0],
        area,
        first_touch,
    ]
    return np.concatenate([np.asarray(array, dtype="<f8") for array in arrays]).tobytes()


def _start_values(job: Replay, state: State, controls: Controls) -> list[float]:
    """Return the start values of the normal input and of the one or two tangential inputs."""
    normal = state.normal_load if controls.normal == "load" else state.approach
    tangential: Any = state.tangential_load
    if controls.tangential == "displacement":
        tangential = job.instrument.drive_displacement(state.tangential_displacement, tangential)
    return [normal, *np.atleast_1d(tangential)]


def _render_page(unit: Unit, controls: Controls, at: float | None) -> bytes:
    """Return the documentation of a unit (HTML)."""
    rows = "".join(
        f"<tr><td>{escape(variable.name)}</td><td>{variable.causality}</td><td>{escape(variable.unit)}</td>"
        f"<td>{escape(variable.text)}</td></tr>"
        for variable in unit.variables
    )
    beyond = (
        "is held at the limit: output <code>saturated</code>"
        if controls.saturate
        else "discards the step"
    )
    start = (
        "nothing has touched yet" if at is None or math.isinf(-at) else f"the state at t = {at:g} s"
    )
    return f"""<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{escape(unit.name)}</title></head><body>
<h1>{escape(unit.name)}</h1><p>{escape(unit.text)}</p>
<p>A rough frictional contact before it slides, with its exact memory, made by historysim. It starts from: {start}. Each
step carries it straight from where it is to its inputs, in one update, whatever its length. The inputs are where the
contact is at the end of the step: a simulator that holds its inputs during a step lags by one step, unless it gives
their first derivatives (FMI 2.0), or repeats the step. A tangential load beyond the friction limit
{beyond}.</p>
<p>Compile the sources with <code>-std=c11 -ffp-contract=off</code> for the same bits.</p>
<table border="1"><tr><th>variable</th><th>causality</th><th>unit</th><th>meaning</th></tr>{rows}</table>
</body></html>
""".encode()
