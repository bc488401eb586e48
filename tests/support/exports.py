"""Exports in the style of instruments, written by the tests: the same few samples in each."""

TIME = [0.0, 0.5, 1.0, 1.5]
NORMAL = [10.0, 10.5, 11.0, 10.0]
FRICTION = [0.0, 1.5, -2.5, 0.25]
STROKE = [0.0, 4.0, -4.0, 1.0]
ROWS = list(zip(TIME, NORMAL, FRICTION, STROKE, strict=True))


def rows(delimiter, end="", shift=0.0, form="{:g}"):
    """Rows of numbers, with something at the end of each line."""
    return "".join(
        delimiter.join(form.format(value) for value in (row[0] + shift, *row[1:])) + end + "\n"
        for row in ROWS
    )


def step(number, delimiter="\t", above=""):
    """One step of a tribometer that writes preamble, names and units above each."""
    head = f"Step No. {number}\nDuration = 1.5\n{above}"
    names, units = (
        delimiter.join(["Time", "Fz", "Fx", "X"]),
        delimiter.join(["s", "mN", "mN", "µm"]),
    )
    return f"{head}{names}\n{units}\n{rows(delimiter)}"


_COLUMNS = {"time": "Time", "normal": "Fz", "friction": "Fx", "stroke": "X"}
_LONG = {
    "time": "Time",
    "normal": "Normal force",
    "friction": "Friction force",
    "stroke": "Displacement",
}

# the text of each, what its columns are called, and the keys that it needs
EXPORTS = {
    "steps, one chosen": ("Sequence No. 1\n" + step(1) + step(2), _COLUMNS, {"block": 2}),
    "steps in white space": (step(1, " ") + "TotalTime\n00:13:39\n", _COLUMNS, {}),
    "a footer": (step(1) + "TotalTime\n00:13:39\n", _COLUMNS, {}),
    "a footer of statistics": (step(1, ";") + "\nMean;10.4;0;0\nStd;0.4;1;1\n", _COLUMNS, {}),
    "keys and values": (
        "Time,12:30:01\nNormal force [mN],10\nRadius,3\n"
        "Time [s],Normal force [mN],Friction force [mN],Displacement [µm]\n" + rows(","),
        _LONG,
        {},
    ),
    "metadata as wide as the header": (
        "Ball on disc;run 7;steel;\nt;Fn;Ft;s\ns;mN;mN;µm\n" + rows(";"),
        {"time": "t", "normal": "Fn", "friction": "Ft", "stroke": "s"},
        {},
    ),
    "units in brackets below": (
        "Time\tNormal force\tFriction force\tDisplacement\n[s]\t[mN]\t[mN]\t[µm]\n" + rows("\t"),
        _LONG | {"normal": "Normal force [mN]"},
        {},
    ),
    "names with blanks in white space": (
        "Time (s) Normal force (mN) Friction force (mN) Displacement (µm)\n" + rows("   "),
        _LONG,
        {},
    ),
    "names two blanks apart": (
        "Time  Normal force  Friction force  Displacement\n(s)  (mN)  (mN)  (µm)\n" + rows("   "),
        _LONG,
        {},
    ),
    "a delimiter at the end": (
        "Time [s];Normal force [mN];Friction force [mN];Displacement [µm];\n" + rows(";", ";"),
        _LONG,
        {},
    ),
    "a comment with the names": (
        "# LabVIEW Measurement\n# Time [s]\tNormal force [mN]\tFriction force [mN]\tDisplacement [µm]\n"
        + rows("\t"),
        _LONG,
        {},
    ),
    "a summary table above": (
        "Channel;Min;Max;Unit\nFn;10;11;mN\nFt;-2.5;1.5;mN\n\nTime [s];Fn [mN];Ft [mN];x [µm]\n"
        + rows(";"),
        {"time": "Time", "normal": "Fn", "friction": "Ft", "stroke": "x"},
        {},
    ),
    "a decimal comma": (
        "Zeit [s];Fn [mN];Ft [mN];Weg [µm]\n" + rows(";").replace(".", ","),
        {"time": "Zeit", "normal": "Fn", "friction": "Ft", "stroke": "Weg"},
        {"decimal": ","},
    ),
}
