"""Histories that were transformed with xarray: each query and picture gives the same answer, or one clear message."""

import inspect
from contextlib import suppress
from functools import partial

import numpy as np
import xarray as xr
from golden import refused
from numpy.testing import assert_allclose
from pairs import GLASS as PAIR
from pytest import fixture, mark, raises

import historysim as hs
from historysim.errors import HistorySimError
from historysim.results.layout import report_missing_variables
from historysim.results.queries import all_queries

HEIGHTS = [-3e-8, 0.0, -1e-8, -5e-9, -2.5e-8]
EVENTS = [
    hs.NormalLoad(0.0, 2e-3),
    *(hs.TangentialDisplacement(float(t), -((-1.0) ** t) * 3e-8) for t in range(1, 6)),
]
HISTORY = hs.replay(
    hs.Ensemble(PAIR, HEIGHTS, 1e-5, friction=0.2, x=np.arange(5) * 1e-5, y=0.0), EVENTS, substeps=8
)
STEPS = HISTORY.sizes["step"]
GIVEN = {"asperity": 2, "step": 20, "steps": [5, 20], "first": 10, "second": 30}


def concat(parts, along):
    # as users call it, with the defaults of every version of xarray
    return xr.concat(parts, along, data_vars="all", coords="different", compat="equals")


# units with the number of them in the SI unit
MILLI = {
    "time": ("ms", 1e3),
    "total_tangential_load": ("mN", 1e3),
    "tangential_displacement": ("nm", 1e9),
}
MILLI |= {
    "total_normal_load": ("kN", 1e-3),
    "summit_height": ("µm", 1e6),
    "dissipated_energy": ("pJ", 1e12),
}
MILLI |= {
    "stick_radius": ("nm", 1e9),
    "tangential_stiffness": ("mN/µm", 1e-3),
    "real_contact_area": ("µm2", 1e12),
}
PINT = {
    "time": ("minute", 1 / 60),
    "normal_load": ("millinewton", 1e3),
    "real_contact_area": ("millimeter ** 2", 1e6),
}
PINT |= {"friction": ("dimensionless", 1.0), "contact_radius": ("nanometer", 1e9)}


def in_units(history, units):
    """Return a history with some variables in other units."""
    changed = {
        name: history[name].copy(data=history[name] * number).assign_attrs(units=unit)
        for name, (unit, number) in units.items()
    }
    return history.assign(changed).set_coords([name for name in changed if name in history.coords])


EQUIVALENT = {
    "unchanged": lambda history: history,
    "two halves joined": lambda h: concat(
        [h.isel(step=slice(0, 20)), h.isel(step=slice(20, None))], "step"
    ),
    "asperities joined": lambda h: concat(
        [h.isel(asperity=slice(0, 2)), h.isel(asperity=slice(2, None))], "asperity"
    ),
    "all joined": lambda h: xr.concat(
        [h.isel(step=slice(0, 9)), h.isel(step=slice(9, None))],
        "step",
        data_vars="all",
        coords="all",
        compat="equals",
    ),
    "time as dimension": lambda history: history.swap_dims(step="time"),
    "heights as dimension": lambda history: history.swap_dims(asperity="summit_height"),
    "transposed": lambda history: history.transpose(),
    "32 bits": lambda history: history.astype("float32", keep_attrs=True),
    "sorted by height": lambda history: history.sortby("summit_height"),
    "reversed asperities": lambda history: history.isel(asperity=slice(None, None, -1)),
    "chunked": lambda history: history.chunk(step=7, asperity=2),
    "coordinates as variables": lambda history: history.reset_coords(),
    "variables as coordinates": lambda history: history.set_coords([*history.data_vars]),
    "without index": lambda history: history.drop_indexes("asperity"),
    "with labels of steps": lambda history: history.assign_coords(step=10 * np.arange(STEPS)),
    "one more dimension": lambda history: history.expand_dims("run"),
    "other units": lambda history: in_units(history, MILLI),
    "units as pint writes them": lambda history: in_units(history, PINT),
    "time as timedelta": lambda h: h.assign_coords(
        time=("step", (h.time.values * 1e9).astype("timedelta64[ns]"))
    ),
    "floating-point flags": lambda history: history.assign(
        slip_state=history.slip_state.astype(float)
    ),
}
OTHER = {
    "steps renamed": lambda history: history.rename(step="i"),
    "asperities renamed": lambda history: history.rename(asperity="k"),
    "one asperity": lambda history: history.isel(asperity=3),
    "one step": lambda history: history.isel(step=20),
    "one step of one asperity": lambda history: history.isel(step=20, asperity=3),
    "16 bits": lambda history: history.astype("float16", keep_attrs=True),
    "integers": lambda history: history.astype("int64", keep_attrs=True),
    "strings": lambda history: history.astype(str),
    "complex": lambda history: history.astype(complex),
    "without attributes": lambda history: history.drop_attrs(),
    "backwards": lambda history: history.sortby("time", ascending=False),
    "later part": lambda history: history.isel(step=slice(20, None)),
    "every seventh step": lambda history: history.isel(step=slice(None, None, 7)),
    "no steps": lambda history: history.isel(step=[]),
    "no asperities": lambda history: history.isel(asperity=[]),
    "two asperities": lambda history: history.isel(asperity=[0, 3]),
    "some asperities masked": lambda history: history.where(history.asperity > 2),
    "some steps masked": lambda history: history.where(history.time > 2),
    "stacked": lambda history: history.stack(row=("step", "asperity")),
    "twice along steps": lambda history: concat([history, history], "step"),
    "twice along asperities": lambda history: concat([history, history], "asperity"),
    "two runs": lambda history: concat([history, 2 * history], "run"),
    "mean over steps": lambda history: history.mean("step", keep_attrs=True),
    "mean over asperities": lambda history: history.mean("asperity", keep_attrs=True),
    "labels that were not recorded": lambda history: history.reindex(asperity=np.arange(9)),
    "means of blocks": lambda history: history.coarsen(step=4, boundary="trim").mean(),
    "differences": lambda history: history.diff("step"),
    "padded": lambda history: history.pad(step=1),
    "rolled": lambda history: history.roll(step=3, roll_coords=True),
    "dates": lambda history: history.assign_coords(time=history.time.astype("timedelta64[s]")),
    "labels as strings": lambda history: history.assign_coords(
        asperity=history.asperity.astype(str)
    ),
    "table": lambda history: history.contact.time_series(),
    "table of rows": lambda history: history.contact.time_series(form="long"),
    "totals": lambda history: history.drop_dims("asperity"),
    **{
        f"without {name}": lambda history, name=name: history.drop_vars(name)
        for name in HISTORY.variables
    },
}


def answer(history, name):
    """Return the answer to a query as arrays by name, along the labels of the asperities in ascending order."""
    parameters = all_queries()[name].parameters.values()
    arguments = {
        one.name: GIVEN[one.name]
        for one in parameters
        if one.default is one.empty and one.name in GIVEN
    }
    if "second" in arguments and name == "run_drift":
        arguments["second"] = HISTORY
    found = getattr(history.contact, name)(**arguments)
    if name == "asperity":
        found = found.reversal_points.displacement
    if hasattr(found, "to_dataset"):
        found = (
            found.to_dataset(name="answer")
            if isinstance(found, xr.DataArray)
            else found.to_dataset()
        )
    if not isinstance(found, xr.Dataset):
        return {
            "answer": np.asarray(found, dtype=None if inspect.isclass(found) else object).astype(
                str
            )
        }
    found = found.load()
    found = found.sortby("asperity") if "asperity" in found.dims else found
    return {str(key): values.values for key, values in found.data_vars.items()}


@fixture(scope="module")
def expected():
    answers = {}
    for name in all_queries():
        with suppress(HistorySimError):
            answers[name] = answer(HISTORY, name)
    return answers


@mark.ci
def test_most_queries_have_an_answer(expected):
    assert len(expected) > 0.7 * len(all_queries())


@mark.ci
@mark.filterwarnings("ignore::FutureWarning")
@mark.parametrize(
    "transformation, name",
    [
        # every transformation with a seventh of the queries and every query with a seventh of the
        # transformations
        (transformation, name)
        for row, transformation in enumerate(EQUIVALENT)
        for column, name in enumerate(all_queries())
        if (row + column) % 7 == 0
    ],
)
def test_an_equivalent_history_gives_the_same_answer(expected, transformation, name):
    history = EQUIVALENT[transformation](HISTORY)
    # astype drops the encoding, and with it the origin of the history
    if name not in expected or (name, transformation) == ("load_curve", "32 bits"):
        with raises(HistorySimError):
            answer(history, name)
        return
    found = answer(history, name)
    assert found.keys() == expected[name].keys()
    for key, values in expected[name].items():
        if values.dtype.kind in "fiu":
            assert_allclose(found[key], values, rtol=1e-4, atol=0)
        elif transformation != "32 bits":
            assert found[key].tolist() == values.tolist()


@mark.ci
@mark.filterwarnings("ignore::FutureWarning", "ignore:overflow:RuntimeWarning")
@mark.parametrize("row", range(len(OTHER)), ids=OTHER)
def test_another_history_gives_an_answer_or_a_message(row):
    history = [*OTHER.values()][row](HISTORY)
    # every query with a third of the histories
    for name in [*all_queries()][row % 3 :: 3]:
        with suppress(HistorySimError):
            answer(history, name)


@mark.filterwarnings("ignore:overflow:RuntimeWarning")
@mark.parametrize(
    "transformation, message",
    [
        ("steps renamed", "varies along i, not step"),
        ("without attributes", "no attribute contact_modulus"),
        ("backwards", r"time decreases after step 0 .*sortby"),
        ("no steps", "no steps"),
        ("some asperities masked", "has missing values along asperity"),
        ("twice along asperities", "asperities of the history have the same label"),
        ("two runs", "differs along run"),
        ("without asperity", "no labels of its asperities"),
        ("table", "this Dataset is not a history"),
    ],
)
def test_the_message_has_the_remedy(transformation, message):
    with refused(message):
        OTHER[transformation](HISTORY).contact.slip_shares()


def test_a_query_names_the_missing_variables_that_it_needs():
    history = HISTORY.drop_vars(["contact_count", "friction_limit"])
    xr.testing.assert_identical(history.contact.slip_shares(), HISTORY.contact.slip_shares())
    with refused("the history has no variable contact_count"):
        history.contact.summary()


def test_an_unrelated_key_error_is_not_blamed_on_missing_variables():
    with (
        raises(KeyError, match="attribute"),
        report_missing_variables(HISTORY.drop_vars("separation")),
    ):
        raise KeyError("attribute")


@mark.hides_data
def test_pictures_and_pages_name_a_missing_variable():
    history = HISTORY.drop_vars("tangential_displacement")
    for name in ("history", "stiffness", "traction"):
        with refused("the history has no variable tangential_displacement"):
            hs.plot(history, picture=name)
    assert (
        "No picture history: the history has no variable tangential_displacement; expected"
        in hs.report(history)
    )


def test_first_slips_before_the_first_step_are_not_made_up():
    # all asperities slide forward between 0 and 1 s
    with refused(r"asperities slid before the first step of the history, at 2\.5 s"):
        HISTORY.isel(step=slice(20, None)).contact.slip_onset()


def test_a_history_along_time_is_drawn_shown_and_written(tmp_path):
    history = EQUIVALENT["time as dimension"](HISTORY)
    for name in ("loop", "traction"):
        assert hs.plot(history, picture=name).axes
    assert "dissipated energy" in str(hs.show(history))
    hs.write_csv(history.contact.time_series(), tmp_path / "series.csv")
    hs.write_csv(history, tmp_path / "history.csv")


WRONG_UNITS = {
    "missing": ("time", {}),
    "unknown": ("total_tangential_load", {"units": "mNn"}),
    "of another dimension": ("tangential_displacement", {"units": "mN"}),
    "without meaning": ("total_tangential_load", {"units": 1}),
    "dates": (
        "time",
        {"units": "milliseconds since 2020-01-01", "calendar": "proleptic_gregorian"},
    ),
}


@mark.parametrize("name, attributes", WRONG_UNITS.values(), ids=WRONG_UNITS)
def test_units_that_do_not_convert_are_refused_by_command_and_python(tmp_path, name, attributes):
    history = HISTORY.copy()
    history[name].attrs = attributes
    history.to_netcdf(tmp_path / "x.nc")
    if "calendar" not in attributes:
        history.drop_vars("slip_state").to_zarr(tmp_path / "x.zarr", consolidated=False)
    calls = [
        lambda: hs.show(history),
        lambda: hs.plot(history),
        lambda: hs.loops(history),
        lambda: hs.sliding(history),
    ]
    for path in tmp_path.iterdir():
        calls += [partial(call, path) for call in (hs.open, hs.show, hs.report, hs.loops)]
    said = {1: "units holds", None: "units is missing"}.get(
        attributes.get("units"), "(units|dates)"
    )
    for call in calls:
        with refused(rf"{name}.*{said}.*expected"):
            call()


def test_a_file_in_other_units_or_packed_is_read_in_si(tmp_path):
    in_units(HISTORY, MILLI).to_netcdf(tmp_path / "units.nc")
    step = float(HISTORY.total_tangential_load.max()) / 3e4
    packing = {
        "total_tangential_load": {"dtype": "int16", "scale_factor": step, "_FillValue": -32768}
    }
    HISTORY.to_netcdf(tmp_path / "packed.nc", encoding=packing)
    for name in ("units.nc", "packed.nc"):
        assert str(hs.show(tmp_path / name)) == str(hs.show(HISTORY))
        with hs.open(tmp_path / name) as history:
            for variable, values in HISTORY.variables.items():
                error = (
                    step / 2 if name == "packed.nc" and variable == "total_tangential_load" else 0
                )
                assert_allclose(history[variable].values, values.values, rtol=1e-15 * 4, atol=error)
                assert history[variable].attrs.get("units") == values.attrs.get("units")
        assert_allclose(
            hs.loops(tmp_path / name).to_dataset().dissipated_energy,
            hs.loops(HISTORY).to_dataset().dissipated_energy,
            rtol=1e-4,
        )
