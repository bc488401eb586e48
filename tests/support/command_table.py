"""Every command of the shell with inputs that it can process, for tests of outputs, environments and full disks.

`write_inputs` writes the inputs; `COMMANDS` has the commands that write files, `READING` those that
only print.
"""

import numpy as np

import historysim as hs

SCENARIO = """
[materials]
contact_modulus = 1e10
shear_modulus = 2.5e9
[surface]
kind = "sphere"
radius = "1 mm"
[friction]
coefficient = 0.5
[loading]
file = "m.csv"
[loading.columns]
time = "t"
normal_load = { column = "Fn", unit = "mN" }
tangential_displacement = { column = "x", unit = "nm" }
[loading.response]
tangential_load = { column = "Ft", unit = "mN" }
[fit]
parameters = ["friction"]
[sweep.over]
friction.coefficient = [0.4, 0.5]
[design]
key = "friction.coefficient"
between = [0.1, 1.0]
target = "10 nm"
output = "preliminary_displacement"
"""
# Arguments of each command that writes a file, and a suffix that it knows.
COMMANDS = {
    "run": (["run", "s.toml", "-o", "TARGET"], ".nc"),
    "run with picture": (["run", "s.toml", "-o", "new.nc", "-o", "TARGET"], ".png"),
    "sweep": (["sweep", "s.toml", "-o", "TARGET", "--workers", "1"], ".nc"),
    "sweep to CSV": (["sweep", "s.toml", "-o", "TARGET", "--workers", "1"], ".csv"),
    "design": (["design", "s.toml", "-o", "TARGET", "--workers", "1"], ".csv"),
    "state": (["state", "r.history", "-o", "TARGET"], ".nc"),
    "state of one": (["state", "r.history", "--asperity", "0", "-o", "TARGET"], ".png"),
    "table": (["table", "r.nc", "slip-onset", "-o", "TARGET"], ".csv"),
    "cycles": (["cycles", "r.nc", "-o", "TARGET"], ".csv"),
    "shorten": (["shorten", "r.history", "-o", "TARGET"], ".inp"),
    "table to netCDF": (["table", "r.nc", "time-series", "-o", "TARGET"], ".nc"),
    "loops": (["loops", "s.toml", "-o", "TARGET"], ".csv"),
    "loops --levels": (["loops", "s.toml", "--levels", "TARGET"], ".nc"),
    "loops as picture": (["loops", "s.toml", "-o", "TARGET"], ".svg"),
    "compare": (["compare", "s.toml", "-o", "TARGET"], ".png"),
    "fit": (["fit", "s.toml", "-o", "TARGET"], ".toml"),
    "fit with picture": (["fit", "s.toml", "-o", "new.toml", "-o", "TARGET"], ".pdf"),
    "sliding": (["sliding", "one_way.toml", "-o", "TARGET"], ".csv"),
    "creep": (["creep", "h.toml", "-o", "TARGET"], ".png"),
    "plot": (["plot", "r.nc", "-o", "TARGET"], ".pdf"),
    "report": (["report", "r.nc", "-o", "TARGET"], ".html"),
    "explore": (["explore", "r.nc", "-o", "TARGET"], ".html"),
    "gallery": (["gallery", ".", "-o", "TARGET", "--workers", "1"], ".html"),
    "fmu": (["fmu", "s.toml", "-o", "TARGET"], ".fmu"),
    "reduce": (["reduce", "s.toml", "--elements", "4", "-o", "TARGET"], ".json"),
    "reduce with picture": (
        ["reduce", "s.toml", "--elements", "4", "-o", "new.json", "-o", "TARGET"],
        ".png",
    ),
}

# Arguments of each command that writes no file, or a new folder.
READING = {
    "columns": ["columns", "m.csv"],
    "validate": ["validate", "s.toml"],
    "show": ["show", "r.nc"],
    "verify": ["verify", "r.nc"],
    "log": ["log", "r.history"],
    "kinds": ["kinds", "laws"],
    "reference": ["reference", "certified"],
}


def write_inputs(folder):
    """Write scenarios, records and one result with its log into a folder."""
    turns = np.array([0, 60, -60, 60, -60, 60, -60, 60])
    times = np.arange(0, 71, 2)
    x = np.interp(times, np.arange(0, 80, 10.0), turns)
    load = np.clip(np.cumsum(np.diff(x, prepend=0)) * 0.05, -5, 5)
    rows = [f"{t},10,{xi},{force}" for t, xi, force in zip(times, x, load, strict=True)]
    (folder / "m.csv").write_text("\n".join(["t,Fn,x,Ft", *rows]) + "\n", encoding="utf-8")
    (folder / "s.toml").write_text(SCENARIO, encoding="utf-8")
    # strokes with holds at their ends
    strokes = [
        np.append(np.linspace(-end, end, 10), np.full(40, end)) for end in np.tile([60.0, -60.0], 4)
    ]
    x = np.concatenate([[0.0], *strokes])
    rows = [f"{t},10,{xi},{np.clip(xi * 0.05, -3, 3)}" for t, xi in enumerate(x)]
    (folder / "h.csv").write_text("\n".join(["t,Fn,x,Ft", *rows]) + "\n", encoding="utf-8")
    rows = [f"{t},10,{t},{min(0.05 * t, 3)}" for t in range(100)]
    (folder / "o.csv").write_text("\n".join(["t,Fn,x,Ft", *rows]) + "\n", encoding="utf-8")
    (folder / "one_way.toml").write_text(SCENARIO.replace("m.csv", "o.csv"), encoding="utf-8")
    held = SCENARIO.partition("[sweep.over]")[0].replace("m.csv", "h.csv")
    (folder / "h.toml").write_text(held, encoding="utf-8")
    hs.run(folder / "s.toml", folder / "r.nc").close()


def with_target(arguments, target):
    """Put the path of an output in the place of TARGET."""
    return [str(target) if argument == "TARGET" else argument for argument in arguments]
