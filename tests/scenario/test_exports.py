"""What a scenario says of an export: several columns, several files and blocks, no clock."""

import tomllib

import exports
import numpy as np
import synthetic
from click.testing import CliRunner
from numpy.testing import assert_allclose
from pytest import mark, raises, warns

import historysim as hs
from historysim.cli import main
from historysim.errors import InputError
from historysim.scenario.scenario import load
from historysim.tables import Format, describe, summarise_text
from historysim.tables.suggestion import suggest_loading

HEAD = """
[materials]
first = "silicon"
second = "float glass"
[surface]
kind = "sphere"
radius = "2.5 mm"
[friction]
coefficient = 0.2
[loading]
"""
STEPS = exports.step(1) + exports.step(2)
TWO = "time = 'Time'\nnormal_load = 'Fz'\ntangential_displacement = 'X'"


def scenario(folder, content, loading, columns):
    (folder / "a.txt").write_text(content, encoding="utf-8")
    path = folder / "s.toml"
    path.write_text(f"{HEAD}{loading}\n[loading.columns]\n{columns}\n", encoding="utf-8")
    return load(path)


@mark.parametrize(
    "load_of, expected",
    [
        ("{ sum = ['Fz', 'Fx'] }", np.add(exports.NORMAL, exports.FRICTION) * 1e-3),
        ("{ difference = ['Fz', 'Fx'] }", np.subtract(exports.NORMAL, exports.FRICTION) * 1e-3),
        (
            "{ sum = ['Fz', 'Fz'], unit = 'gf', scale = 0.5 }",
            np.multiply(exports.NORMAL, 9.80665e-3),
        ),
    ],
)
def test_a_load_of_several_columns(tmp_path, load_of, expected):
    columns = f"time = 'Time'\nnormal_load = {load_of}"
    measured = scenario(tmp_path, exports.step(1), "file = 'a.txt'", columns).measurement()
    assert_allclose(measured["normal_load"], expected, rtol=1e-13)


def test_without_a_clock_the_row_is_the_time(tmp_path):
    columns = "normal_load = 'Fz'\ntangential_displacement = 'X'"
    measured = scenario(tmp_path, STEPS, "file = 'a.txt'\nblock = 2", columns).measurement()
    assert measured.time.tolist() == [0.0, 1, 2, 3]
    assert_allclose(measured["tangential_displacement"], np.multiply(exports.STROKE, 1e-6))
    assert ("clock", "no column for time: the row number, from 0 s") in measured.remarks


def test_blocks_of_one_file_are_not_joined(tmp_path):
    with raises(InputError, match=r"loading.block: .*; expected the number of one block"):
        scenario(tmp_path, STEPS, "file = 'a.txt'\nblock = [1, 2]", TWO)


def test_files_follow_one_another(tmp_path):
    (tmp_path / "b.txt").write_text(exports.step(9), encoding="utf-8")
    loaded = scenario(tmp_path, exports.step(1), "file = ['a.txt', 'b.txt']", TWO)
    measured = loaded.measurement()
    assert measured.time.tolist() == [0.0, 0.5, 1, 1.5, 2, 2.5, 3, 3.5]
    restarted = "the clock starts again in 1 file, joined one sample after the previous file"
    assert ("file", restarted) in measured.remarks
    later = exports.step(9).replace(exports.rows("\t"), exports.rows("\t", shift=9.5))
    (tmp_path / "b.txt").write_text(later, encoding="utf-8")
    assert loaded.measurement().time.tolist() == [0.0, 0.5, 1, 1.5, 9.5, 10, 10.5, 11]
    (tmp_path / "b.txt").write_text(exports.step(9), encoding="utf-8")
    assert_allclose(measured["normal_load"], np.multiply(exports.NORMAL * 2, 1e-3))
    assert [path.name for path in loaded.measured_files] == ["a.txt", "b.txt"]
    with raises(InputError, match=r"loading.file: c.txt: there is no such file"):
        scenario(tmp_path, exports.step(1), "file = ['a.txt', 'c.txt']", TWO).measurement()
    with raises(InputError, match=r"loading.file: .*; expected the path of a file"):
        scenario(tmp_path, exports.step(1), "file = []", TWO)


def test_a_loading_is_suggested_that_is_valid_once_it_is_filled_in(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text(exports.step(1).replace("\t1", "\t-1") + exports.step(2), encoding="utf-8")
    _, blocks = summarise_text(path)
    text = suggest_loading(path, describe(path), Format(), blocks)
    assert blocks == 2
    assert "block = 1  # of 2" in text
    loading = tomllib.loads(text)["loading"]
    assert loading["columns"] == {
        "time": "Time",
        "normal_load": {"column": "Fz", "scale": -1},
        "tangential_displacement": "X",
    }
    assert loading["response"] == {"tangential_load": "Fx"}
    written = tmp_path / "s.toml"
    written.write_text(HEAD.replace("[loading]", text), encoding="utf-8")
    measured = load(written).measurement()
    assert measured["normal_load"].tolist() == [0.01, 0.0105, 0.011, 0.01]


@mark.parametrize(
    "loads, expected",
    [
        ("-0.04 20 80 -0.01 70", "Fn [mN]"),
        ("0.04 -20 -80 0.01 -70", {"column": "Fn [mN]", "scale": -1}),
    ],
)
def test_all_samples_tell_the_sign_of_the_normal_load_and_not_the_first(tmp_path, loads, expected):
    path = tmp_path / "a.csv"
    rows = "".join(f"{at};{load}\n" for at, load in enumerate(loads.replace(".", ",").split()))
    path.write_text(f"Zeit [s];Fn [mN]\n{rows}", encoding="utf-8")
    suggested = suggest_loading(path, describe(path), Format())
    assert tomllib.loads(suggested)["loading"]["columns"]["normal_load"] == expected
    assert ("below zero; if that is noise: negative_as_zero = true" in suggested) == (
        expected == "Fn [mN]" and not loads.startswith("-0 ")
    )


# -- what is proposed ------------------------------------------------------------------------------


MOVED = 50 * np.sin(2 * np.pi * np.arange(200) / 100)
FRICTION = np.clip(MOVED, -10, 10)
CHANNELS = {
    "t": np.arange(200) * 0.01,
    "u": MOVED,
    "T": FRICTION,
    "N": 50 + 0.05 * np.cos(np.arange(200)),
    "d": np.sqrt(np.arange(200)),
}
CONSTANT = {"constant": "50 N"}


@mark.filterwarnings("ignore:m.csv. normal load. .* Hz")
@mark.parametrize(
    "header, order, normal, stroke, friction",
    [
        ("t (s),F (N),x (µm)", "tTu", CONSTANT, 3, 2),
        ("Time (s),Force (N),Force (N),Displacement (µm)", "tTNu", (2, 2), 4, (1, 2)),
        ("Step Time (s),Ball Load (N),Traction Force (N),Wear (µm)", "tNTd", 2, None, 3),
        ("Temps (s),Charge (N),Course (mm),Effort tangentiel (N)", "tNuT", 2, 3, 4),
        ("時間(s),垂直荷重(N),押込深さ(μm),変位(μm),せん断力(N)", "tNduT", 2, 4, 5),
        ("时间(s),法向力(N),位移(μm),摩擦力(N),摩擦系数", "tNuTT", 2, 3, 4),
        ("Prüfzeit [s],Auflast [N],Hub [mm],Reibungskraft [N],Reibungszahl", "tNuTT", 2, 3, 4),
    ],
)
def test_the_proposed_scenario_runs(tmp_path, header, order, normal, stroke, friction):
    names = header.split(",")
    rows = zip(*(CHANNELS[key].tolist() for key in order), strict=True)
    path = tmp_path / "m.csv"
    path.write_text(
        "\n".join([header, *(",".join(f"{value:.6g}" for value in row) for row in rows)]), "utf-8"
    )
    text = suggest_loading(path, describe(path), Format())
    loading = tomllib.loads(text)["loading"]
    found = {**loading["columns"], **loading.get("response", {})}

    def column(key):
        value = found.get(key)
        if not isinstance(value, dict) or "constant" in value:
            return value if value is None or isinstance(value, dict) else 1 + names.index(value)
        place = 1 + names.index(value["column"])
        return (value["occurrence"], place) if "occurrence" in value else place

    assert column("time") == 1
    assert column("normal_load") == normal
    assert column("tangential_displacement") == stroke
    assert column("tangential_load") == friction
    (tmp_path / "s.toml").write_text(HEAD.replace("[loading]", text), encoding="utf-8")
    assert hs.run(tmp_path / "s.toml").sizes["step"] >= 200


X, F, T = (
    10 * np.sin(np.arange(400) / 10),
    0.2 * np.sign(np.cos(np.arange(400) / 10)),
    np.arange(400) * 5e-4,
)
SLOW, COF = np.arange(400.0), 0.11 + 0.002 * np.cos(np.arange(400))
INSTRUMENT = "Force [N],Position [um]"


@mark.parametrize(
    "header, columns, time, rate",
    [
        (
            "Time,Analog 1,Analog 2\nms," + INSTRUMENT,
            (1e3 * T, F, X),
            {"column": "ms", "unit": "ms"},
            None,
        ),
        (
            "Interval,0.0005\nChannel," + INSTRUMENT,
            (T, F, X),
            {"column": "Channel", "unit": "s"},
            None,
        ),
        (
            "Interval,0.5 ms\nsignal," + INSTRUMENT,
            (1e3 * T, F, X),
            {"column": "signal", "unit": "ms"},
            None,
        ),
        ("Time (s),Elapsed time (s)," + INSTRUMENT, (0 * T, T, F, X), "Elapsed time (s)", None),
        ("Delta_X,0.0005\n" + INSTRUMENT, (F, X), None, 2000.0),
        ("Abtastrate [kHz]: 2\nNr,Kraft [N],Weg [µm]", (SLOW, F, X), None, 2000.0),
        ("# Sample rate = 2 kHz\n" + INSTRUMENT, (F, X), None, 2000.0),
        ("Frequency [Hz],50\nindex," + INSTRUMENT, (SLOW, F, X), None, None),
    ],
)
def test_the_time_is_found_by_values_and_header(tmp_path, header, columns, time, rate):
    path = tmp_path / "m.csv"
    rows = [",".join(f"{value:.9g}" for value in row) for row in zip(*columns, strict=True)]
    path.write_text("\n".join([header, *rows, ""]), encoding="utf-8")
    text = suggest_loading(path, describe(path), Format())
    loading = tomllib.loads(text)["loading"]
    assert loading["columns"].get("time") == time
    (tmp_path / "s.toml").write_text(HEAD.replace("[loading]", text), encoding="utf-8")
    loaded = load(tmp_path / "s.toml")
    assert loaded.sections.loading.rate == rate
    measured = loaded.measurement()
    step = 1.0 if time is None and rate is None else 5e-4
    assert_allclose(measured.time, step * SLOW, rtol=1e-6, atol=1e-12)
    assert_allclose(measured["tangential_displacement"], 1e-6 * X, rtol=1e-7, atol=1e-14)


@mark.parametrize(
    "header, columns, load",
    [
        (
            "Time [s],Frequency [Hz],COF effective value,Load [N],Friction integral,COF,Stroke [mm]",
            (SLOW, 50 + 0 * T, COF, 180 + F, COF, COF, 0.998 + 0.001 * np.round(np.sin(SLOW**2))),
            {"column": "COF", "times": "normal_load"},
        ),
        (
            "Time [s],Fx (N),Fz (N),X Position (mm)",
            (SLOW, 1 + 0.01 * COF, 9 + COF, 0 * T),
            "Fx (N)",
        ),
        (
            "Zeit [s],Reibwert,Fn [N],Hub [mm],Frequenz [Hz]",
            (SLOW, COF, 9 + COF, X, 20 + 0 * T),
            None,
        ),
        ("时间(s),摩擦系数,载荷(N),行程(mm)", (SLOW, COF, 9 + COF, 2 + 0 * T), None),
    ],
)
def test_what_does_not_move_is_no_displacement_and_a_coefficient_no_load(
    tmp_path, header, columns, load
):
    path, names = tmp_path / "m.csv", header.split(",")
    rows = [",".join(f"{value:.6g}" for value in row) for row in zip(*columns, strict=True)]
    path.write_text("\n".join([header, *rows, ""]), encoding="utf-8")
    text = suggest_loading(path, describe(path), Format())
    found = tomllib.loads(text)["loading"]["columns"]
    assert "tangential_displacement" not in found
    assert found["tangential_load"] == load or (
        load is None and found["tangential_load"]["column"] == names[1]
    )
    (tmp_path / "s.toml").write_text(HEAD.replace("[loading]", text), encoding="utf-8")
    assert len(hs.load(tmp_path / "s.toml").events()) >= 400


def test_validate_states_that_nothing_moves_and_what_loops_need(tmp_path):
    rows = "".join(f"{at},{1 + 0.1 * (at % 3):g},{4 * (at % 9):g},5\n" for at in range(200))
    columns = (
        "tangential_displacement = {}\nnormal_load = 'N'\n[loading.response]\ntangential_load = 'T'"
    )
    for stroke, expected in (("'rest'", "nothing moves: "), ("'x'", "")):
        made = scenario(
            tmp_path,
            f"t,T,x,rest\n{rows}".replace("T", "T [N]"),
            "file = 'a.txt'",
            columns.format(stroke).replace("'N'", "{ constant = '9 N' }"),
        )
        notes = [
            text
            for label, text in hs.validate(made)
            if label == "note" and text.startswith("nothing moves")
        ]
        assert bool(notes) == bool(expected)
    without = made.path.read_text("utf-8").replace("[friction]\ncoefficient = 0.2\n", "")
    made.path.write_text(without, "utf-8")
    assert "no [friction]: loops and sliding need none" in str(hs.validate(made.path))
    made.path.write_text(
        without.replace("[loading.columns]", "run = 'each'\n[loading.columns]"), "utf-8"
    )
    assert "no [friction]" in str(hs.validate(made.path))


@mark.parametrize(
    "load_of, expected",
    [
        ("{ column = 'F', scale = '100 N/V' }", [10.0, 20.0]),
        ("{ column = 'F', scale = '-50 mN/mV', unit = 'mV' }", [-0.005, -0.01]),
        (
            "{ sum = [{ column = 'F', scale = '50 N/V' }, { column = 'G', scale = '5 mN/mV' }] }",
            [6.0, 12.0],
        ),
        ("{ column = 'F', scale = '2 MPa/V', area = '1 mm2' }", [0.2, 0.4]),
    ],
)
def test_a_scale_has_the_unit_of_its_channel_over_that_of_the_column(tmp_path, load_of, expected):
    content = "F [V],G [mV]\n0.1,200\n0.2,400\n"
    measured = scenario(
        tmp_path, content, "file = 'a.txt'", f"tangential_load = {load_of}"
    ).measurement()
    assert_allclose(measured["tangential_load"], expected, rtol=1e-13)
    for wrong in ("100 N", "20 mm/V", "fast"):
        with raises(
            InputError, match=r"tangential_load.scale: .*; expected a number, or one with the unit"
        ):
            scenario(
                tmp_path,
                content,
                "file = 'a.txt'",
                f"tangential_load = {{ column = 'F', scale = '{wrong}' }}",
            )


@mark.parametrize(
    "keys, named", [("coefficient = 3.0", "friction"), ("radius = 2.5", "summit_radius")]
)
def test_python_and_toml_warn_alike_of_implausible_values(tmp_path, keys, named):
    changed = (
        HEAD.replace("coefficient = 0.2", keys)
        if "coeff" in keys
        else HEAD.replace('radius = "2.5 mm"', keys)
    )
    (tmp_path / "s.toml").write_text(
        changed + "waypoints = [{ time = 0, normal_load = 1 }]\n", encoding="utf-8"
    )
    pair = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
    values = {"friction": 0.2, "summit_radius": 2.5e-3, named: float(keys.partition("= ")[2])}
    warned = []
    for call in (
        lambda: load(tmp_path / "s.toml").ensemble(),
        lambda: hs.Ensemble(pair, 0.0, **values),
    ):
        with warns(hs.UnlikelyValueWarning, match=f"^{named} is .* implausible") as caught:
            call()
        warned.append(str(caught[0].message))
    assert warned[0] == warned[1]


def test_a_whole_scenario_is_written_and_says_what_is_missing(tmp_path, monkeypatch):
    record = synthetic.measured("ball", 7, loads=(0.05,), loops=3)
    (tmp_path / "data").mkdir()
    moved = 1e6 * record["tangential_displacement"]
    rows = zip(record.time, record["normal_load"], moved, record["tangential_load"], strict=True)
    lines = [
        "t (s),Fn (N),x (µm),Ft (N)",
        *(",".join(f"{value:.9g}" for value in row) for row in rows),
    ]
    (tmp_path / "data" / "m.csv").write_text("\n".join(lines), "utf-8")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "work").mkdir()
    done = CliRunner().invoke(main, ["columns", "data/m.csv", "-o", "work/my.toml"])
    assert done.exit_code == 0, done.output
    refused = CliRunner().invoke(main, ["validate", "work/my.toml"])
    assert refused.exit_code == 2
    assert "my.toml: materials: nothing given" in refused.output
    assert "my.toml: surface.radius: missing" in refused.output
    path = tmp_path / "work" / "my.toml"
    text = path.read_text("utf-8")
    for line in ('first = "silicon"', 'second = "float glass"', 'radius = "2.5 mm"'):
        assert f"# {line}" in text
        text = text.replace(f"# {line}", line)
    path.write_text(text, "utf-8")
    for command in ("validate", "fit"):
        done = CliRunner().invoke(main, [command, "work/my.toml"])
        assert done.exit_code == 0, done.output
    again = CliRunner().invoke(main, ["columns", "data/m.csv", "-o", "work/my.toml"])
    assert again.exit_code == 2
    assert "exists already" in again.output


COEFFICIENTS = "x,COF,Fn\nmm,-,N\n0,0.20,10\n1,0.25,20\n2,0.30,40\n"
AFM = "x,trace,retrace\nµm,nN,nN\n0,-3,-5\n1,4,-5\n2,5,-5\n3,5,-4\n4,5,3\n"


@mark.parametrize(
    "keys, expected",
    [("", [2.0, 5.0, 12.0]), (", scale = -2", [-4.0, -10.0, -24.0]), (", offset = 1", [3, 6, 13])],
)
def test_friction_coefficients_are_multiplied_by_the_normal_load(tmp_path, keys, expected):
    columns = (
        "normal_load = 'Fn'\ntangential_displacement = 'x'\n[loading.response]\n"
        f"tangential_load = {{ column = 'COF', times = 'normal_load'{keys} }}"
    )
    measured = scenario(tmp_path, COEFFICIENTS, "file = 'a.txt'", columns).measurement()
    assert_allclose(measured["tangential_load"], expected, rtol=1e-13)
    constant = columns.replace("'Fn'", "{ constant = 10 }", 1)
    measured = scenario(tmp_path, COEFFICIENTS, "file = 'a.txt'", constant).measurement()
    first = (expected[0] - 1 if "offset" in keys else expected[0]) / 0.2
    ratio = np.array([0.2, 0.25, 0.3]) * first + ("offset" in keys)
    assert_allclose(measured["tangential_load"], ratio, rtol=1e-13)


def test_trace_and_retrace_are_one_loop(tmp_path):
    columns = (
        "normal_load = { constant = '50 nN' }\ntangential_displacement = 'x'\n[loading.response]\n"
        "tangential_load = { column = 'trace', retrace = 'retrace' }"
    )
    made = scenario(tmp_path, AFM, "file = 'a.txt'", columns)
    measured = made.measurement()
    assert_allclose(
        measured["tangential_displacement"] * 1e6, [0, 1, 2, 3, 4, 4, 3, 2, 1, 0], atol=1e-12
    )
    assert_allclose(
        measured["tangential_load"] * 1e9, [-3, 4, 5, 5, 5, 3, -4, -5, -5, -5], atol=1e-12
    )
    assert (np.diff(measured.time) > 0).all()
    assert dict(measured.remarks)["retrace"] == "5 samples after the trace, in reverse order"
    loops = hs.loops(made)
    assert len(loops) == 1
    assert_allclose(loops.friction_coefficient, 0.1, rtol=1e-9)
    # by the trapezoidal rule, trace less retrace: 5.5 + 9.5 + 9.5 + 5.5
    assert_allclose(loops.dissipated_energy, [30e-15], rtol=1e-9)


@mark.parametrize(
    "heading, expected",
    [
        (
            "Time (s),Normal Load (N),COF,Displacement (um)",
            {"response": {"tangential_load": {"column": "COF", "times": "normal_load"}}},
        ),
        (
            "Time (s),Load (N),Friction coefficient (-)",
            {
                "columns": {
                    "tangential_load": {
                        "column": "Friction coefficient (-)",
                        "times": "normal_load",
                    }
                }
            },
        ),
        (
            "Distance (nm),Friction trace (nN),Friction retrace (nN)",
            {
                "columns": {"tangential_displacement": "Distance (nm)"},
                "response": {
                    "tangential_load": {
                        "column": "Friction trace (nN)",
                        "retrace": "Friction retrace (nN)",
                    },
                },
            },
        ),
    ],
)
def test_coefficients_and_retraces_are_suggested_as_such(tmp_path, heading, expected):
    path = tmp_path / "m.csv"
    rows = [
        ",".join(f"{value:g}" for value in (0.1 * row, 5.0, 0.2, row % 4)[: heading.count(",") + 1])
        for row in range(9)
    ]
    path.write_text("\n".join([heading, *rows, ""]), encoding="utf-8")
    loading = tomllib.loads(suggest_loading(path, describe(path), Format()))["loading"]
    for group, entries in expected.items():
        for name, entry in entries.items():
            assert loading[group][name] == entry
