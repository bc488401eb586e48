"""Run every command once with the packages of this environment, and read and write every file format of the extras.

``python tests/scripts/smoke.py [CHECK …]`` needs historysim and its extras, no test package.
It prints one line per failure and ends with code 1 if there is any. Extras that are
not installed are skipped and named.
"""

import contextlib
import importlib.metadata
import importlib.util
import os
import sys
import tempfile
import traceback
from pathlib import Path

import numpy as np
from click.testing import CliRunner

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from command_table import COMMANDS, READING, with_target, write_inputs

import historysim as hs
from historysim.cli import main

MAP = """
[materials]
contact_modulus = 1e10
shear_modulus = 2.5e9
[surface]
kind = "random"
shape = [16, 16]
pixel_size = "1 µm"
rms_height = "50 nm"
autocorrelation_length = "4 µm"
seed = 1
interaction = "full"
[friction]
coefficient = 0.5
[loading]
waypoints = [{ time = 0, normal_load = "1 mN" }, { time = 1, tangential_load = "0.1 mN" }]
"""


def check_command(arguments: list[str], output: Path | None = None) -> None:
    """Run a command in this process; AssertionError unless it succeeds and its output is not empty."""
    done = CliRunner().invoke(main, arguments)
    if done.exception is not None and not isinstance(done.exception, SystemExit):
        raise done.exception
    assert done.exit_code == 0, done.output.strip().splitlines()[-1]
    assert output is None or output.stat().st_size, f"{output} is empty"


def check_hdf5(folder: Path) -> None:
    """Extra hdf5: a record in HDF5."""
    import h5py

    with h5py.File(folder / "record.h5", "w") as file:
        file["time"], file["force"] = np.arange(3.0), np.arange(3.0)
    check_command(["columns", str(folder / "record.h5")])


def check_tdms(folder: Path) -> None:
    """Extra tdms: a record of LabVIEW."""
    from nptdms import ChannelObject, TdmsWriter

    with TdmsWriter(folder / "record.tdms") as writer:
        writer.write_segment(
            [ChannelObject("g", name, np.arange(3.0)) for name in ("time", "force")]
        )
    check_command(["columns", str(folder / "record.tdms")])


def check_excel(folder: Path) -> None:
    """Extra excel: a workbook, written without another package."""
    import zipfile

    office = "http://schemas.openxmlformats.org"
    main_name, package = f"{office}/spreadsheetml/2006/main", f"{office}/package/2006"
    link = f"{office}/officeDocument/2006/relationships"
    rows = "".join(
        f'<row><c t="n"><v>{value}</v></c><c t="n"><v>{2 * value}</v></c></row>'
        for value in range(3)
    )
    header = '<row><c t="inlineStr"><is><t>t [s]</t></is></c><c t="inlineStr"><is><t>F [N]</t></is></c></row>'
    parts = {
        "[Content_Types].xml": f'<Types xmlns="{package}/content-types">'
        '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
        '<Default Extension="xml" ContentType="application/xml"/></Types>',
        "_rels/.rels": f'<Relationships xmlns="{package}/relationships">'
        f'<Relationship Id="r1" Type="{link}/officeDocument" Target="xl/workbook.xml"/></Relationships>',
        "xl/_rels/workbook.xml.rels": f'<Relationships xmlns="{package}/relationships">'
        f'<Relationship Id="r1" Type="{link}/worksheet" Target="worksheets/sheet1.xml"/></Relationships>',
        "xl/workbook.xml": f'<workbook xmlns="{main_name}" xmlns:r="{link}"><sheets>'
        '<sheet name="one" sheetId="1" r:id="r1"/></sheets></workbook>',
        "xl/worksheets/sheet1.xml": f'<worksheet xmlns="{main_name}"><sheetData>{header}{rows}</sheetData></worksheet>',
    }
    with zipfile.ZipFile(folder / "record.xlsx", "w") as archive:
        for name, text in parts.items():
            archive.writestr(name, f'<?xml version="1.0" encoding="UTF-8"?>{text}')
    check_command(["columns", str(folder / "record.xlsx")])


def check_dask(folder: Path) -> None:
    """Extra dask: queries of a chunked result, and of a history computed from its log."""
    for name in ("r.nc", "r.history"):
        with hs.open(folder / name, chunks={"step": 10}) as history:
            shares = history.contact.slip_shares()
            assert np.isfinite(shares.compute().to_array()).all()


def check_zarr(folder: Path) -> None:
    """Extra zarr, with dask: a history computed from its log, written and read again."""
    if importlib.util.find_spec("dask") is None:
        return
    hs.open(folder / "r.history", chunks="auto").to_zarr(folder / "r.zarr", consolidated=False)
    assert hs.open(folder / "r.zarr").contact.summary()


def check_surfaces(folder: Path) -> None:
    """Extra surfaces: a height map in a format that SurfaceTopography reads."""
    from SurfaceTopography import Topography

    heights = np.random.default_rng(1).normal(size=(16, 16))
    Topography(heights, (16.0, 16.0), unit="µm").to_netcdf(str(folder / "heights.nc"))
    check_command(["show", str(folder / "heights.nc")])


def check_registration(folder: Path) -> None:  # noqa: ARG001 - signature of a check
    """Extra surfaces: the shift between two maps, by scikit-image."""
    surface = hs.random_surface((64, 64), 1.0, rms_height=0.1, autocorrelation_length=8.0, seed=1)
    moved = hs.Surface(np.roll(surface.heights, (3, 0), (0, 1))[8:-8], surface.pixel_size)
    shift = hs.register_maps(surface, moved).shift
    assert np.allclose(shift, (-3.0, 0.0), atol=1e-3), shift


EXTRAS = {
    "h5py": check_hdf5,
    "nptdms": check_tdms,
    "python_calamine": check_excel,
    "dask": check_dask,
    "zarr": check_zarr,
    "SurfaceTopography": check_surfaces,
    "skimage": check_registration,
}


def find_failures(folder: Path, names: list[str]) -> list[str]:
    """Run checks in a folder, all or those named, and describe the failures."""
    checks = {name: (check_command, (arguments,)) for name, arguments in READING.items()}
    for number, (name, (arguments, suffix)) in enumerate(COMMANDS.items()):
        target = folder / f"out{number}{suffix}"
        checks[name] = check_command, (with_target(arguments, target), target)
    checks |= {
        name: (check, (folder,)) for name, check in EXTRAS.items() if importlib.util.find_spec(name)
    }
    failures = []
    write_inputs(folder)
    with contextlib.chdir(folder):
        for name in names or checks:
            check, arguments = checks[name]
            try:
                check(*arguments)
            except Exception as error:  # noqa: BLE001 - every failure is reported
                where = traceback.extract_tb(error.__traceback__)[-1]
                failures.append(
                    f"{name}: {type(error).__name__}: {error} ({where.filename}:{where.lineno})"
                )
    return failures


def run_smoke_test(names: list[str]) -> int:
    """Print the versions, the extras that are missing and the failures; return the exit code."""
    missing = [name for name in EXTRAS if not importlib.util.find_spec(name)]
    print(
        f"Python {sys.version.split()[0]}",
        *(f"{name} is not installed: skipped" for name in missing),
        sep="\n",
    )
    with tempfile.TemporaryDirectory() as folder:
        failures = find_failures(Path(folder), names)
    print(*failures, f"{len(failures)} failures", sep="\n")
    return bool(failures)


if __name__ == "__main__":
    os.environ.setdefault("CFLAGS", "-O0")
    sys.exit(run_smoke_test(sys.argv[1:]))
