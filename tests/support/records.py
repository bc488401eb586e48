"""Small measured records in files, and scenarios that read them."""

import numpy as np

BALL = """
title = "a ball"  # as measured
[materials]
contact_modulus = "100 GPa"
shear_modulus = "20 GPa"
[surface]
kind = "sphere"
radius = "1 mm"
[friction]
coefficient = 0.2  # as in the last test
"""
CHANNELS = {
    "time": '"t"',
    "normal_load": '"N"',
    "tangential_displacement": '{ column = "u", unit = "nm" }',
}


def write_columns(path, **columns):
    """Write columns to a CSV file; a NaN is an empty cell."""
    rows = zip(
        *(np.asarray(values, dtype=float).tolist() for values in columns.values()), strict=True
    )
    cells = [",".join("" if value != value else repr(value) for value in row) for row in rows]  # noqa: PLR0124 - NaN
    path.write_text("\n".join([",".join(columns), *cells, ""]), encoding="utf-8")


def scenario_text(
    columns=None, response=None, *, file="m.csv", loading="", dead_band=None, more="", base=BALL
):
    """Give a scenario that replays columns of a file; `columns` changes or leaves out (None) those of CHANNELS."""
    channels = {
        key: value for key, value in {**CHANNELS, **(columns or {})}.items() if value is not None
    }
    tables = {"columns": channels, "response": response or {}, "dead_band": dead_band or {}}
    lines = [base, "[loading]", f'file = "{file}"', loading]
    for name, keys in tables.items():
        lines += [f"[loading.{name}]", *(f"{key} = {value}" for key, value in keys.items())]
    return "\n".join([*lines, more, ""])
