"""Conditioning as keys of a channel: what is told, what is refused, and the picture of it."""

import re

import numpy as np
from golden import refused
from pytest import approx, fixture, mark, warns
from records import scenario_text, write_columns

import historysim as hs
from historysim.measured.reduction import Measurement

RATE = 400.0
TIME = np.arange(4800) / RATE
CLEAN = 100 * np.abs((TIME + 1) % 4 - 2) - 100
HUM = 3 * np.sin(2 * np.pi * 50 * TIME)
NOISE = np.random.default_rng(0).normal(0, 0.1, TIME.size)
NOTCHED = {"tangential_displacement": '{ column = "u", unit = "nm", notch = "50 Hz" }'}


@fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    load = 0.01 * np.clip(CLEAN / 30, -1, 1)
    write_columns(
        tmp_path / "m.csv", t=TIME, N=np.full(TIME.size, 0.05), u=CLEAN + HUM + NOISE, T=load
    )
    return tmp_path


def written(folder, *args, **options):
    path = folder / "s.toml"
    path.write_text(scenario_text(*args, **options), encoding="utf-8")
    return path


def test_hum_is_reported_with_its_mend(folder):
    ((label, text),) = hs.load(written(folder)).measurement().remarks
    assert (label, text.partition("; ")[0]) == (
        "hum",
        "tangential displacement: 3 nm at 50 Hz, up to 1.5 % of its range",
    )
    assert text.partition("; ")[2] == "notch = 50 at this channel removes it"


def test_a_notch_takes_it_off_and_says_how_much(folder):
    found = hs.load(written(folder, NOTCHED)).measurement()
    assert [label for label, _ in found.remarks] == ["tangential displacement: filters removed"]
    moved = found["tangential_displacement"]
    # in the middle; at the ends it depends on the channel beyond them
    assert np.abs(moved - 1e-9 * (CLEAN + NOISE))[800:-800].max() < 0.1e-9
    np.testing.assert_allclose(
        moved + found.removed["tangential_displacement"], 1e-9 * (CLEAN + HUM + NOISE)
    )
    assert "hum" not in dict(found.remarks)


def test_a_run_says_that_noise_is_replayed(folder):
    """The dead band does not act in a run that is not reduced; with reduce it leaves the turns of the loops."""
    path = written(folder, dead_band={"tangential_displacement": "20e-9"})
    told = []
    _ = hs.load(path).events(told.append)
    assert any(
        "by 2e-08 m or more 6 times" in text and "reduce = true leaves out" in text for text in told
    )
    reduced = written(
        folder, dead_band={"tangential_displacement": "20e-9"}, loading="reduce = true"
    )
    told.clear()
    events = hs.load(reduced).events(told.append)
    assert not any("reduce = true" in text for text in told)
    assert len(events) < 30


def test_the_dead_bands_that_a_note_names_leave_noise_out(folder):
    """Noise of the normal load keeps all rows of a reduced record, until each channel has its dead band."""
    random = np.random.default_rng(0)
    time = np.arange(400.0)
    load = np.interp(time, [0, 100, 200, 300, 400], [0, 8, -8, 8, 8]) + random.normal(
        0, 0.05, time.size
    )
    rows = np.column_stack([time, load, 50 + random.normal(0, 0.1, time.size)])
    np.savetxt(folder / "held.csv", rows, delimiter=",", header="t,T,N", comments="")
    entries = {
        "tangential_displacement": None,
        "tangential_load": '{ column = "T", unit = "mN" }',
        "normal_load": '{ column = "N", unit = "mN" }',
    }

    def notes(loading, **dead_band):
        text = scenario_text(entries, file="held.csv", loading=loading, dead_band=dead_band)
        (folder / "held.toml").write_text(text, encoding="utf-8")
        told = []
        events = hs.load(folder / "held.toml").events(told.append)
        return [note for note in told if "turns" in note], events

    (raw,), _ = notes("")
    (reduced,), many = notes("reduce = true")
    assert "still replays" in reduced
    assert len(many) > 700
    keys = dict(re.findall(r'(\w+_load) = "(.*?)"', raw))
    assert set(keys) == {"normal_load", "tangential_load"}
    quiet, few = notes("reduce = true", **{name: f'"{band}"' for name, band in keys.items()})
    assert quiet == []
    assert len(few) < 30
    # a dead band within the noise does not silence it
    assert notes("reduce = true", normal_load="1e-6", tangential_load="1e-6")[0]


def test_a_dead_band_that_leaves_nothing_is_not_advised():
    """A displacement that rests turns by noise alone: that nothing moves is another note."""
    noise = np.random.default_rng(0).normal(0, 1e-9, 400)
    channels = {"normal_load": np.ones(400), "tangential_displacement": noise}
    resting = Measurement(np.arange(400.0), channels)
    assert resting.false_reversals() is None
    channels["tangential_displacement"] = noise + 50e-9 * np.sin(np.arange(400) / 20)
    assert "reduce = true leaves out" in Measurement(np.arange(400.0), channels).false_reversals()


def test_the_record_is_drawn_as_read_and_as_used(folder):
    path = written(folder, NOTCHED, {"tangential_load": '"T"'})
    figure = hs.plot(path, picture="record")
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert titles == [
        "Tangential displacement",
        "Detail",
        "Amplitude",
        "Tangential load",
        "Detail",
        "Amplitude",
    ]
    read, used = figure.axes[1].get_lines()
    assert np.ptp(read.get_ydata()) > np.ptp(used.get_ydata()) + 4e-9
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["as read", "as used"]


def test_the_rounding_of_printed_digits_is_no_hum(tmp_path):
    """A ramp of 0.37 digits a sample, printed with these digits: its rounding is a line in the spectrum."""
    time = np.arange(4000) / 100
    moved = np.round(0.0037 * np.arange(4000), 2)
    write_columns(tmp_path / "m.csv", t=time, N=np.ones(4000), u=moved, T=0.2 + 0 * time)
    (tmp_path / "s.toml").write_text(
        scenario_text(response={"tangential_load": '"T"'}), encoding="utf-8"
    )
    assert not [
        text for label, text in hs.load(tmp_path / "s.toml").measurement().remarks if label == "hum"
    ]
    hum = 0.05 * np.sin(2 * np.pi * 12.3 * time)
    write_columns(
        tmp_path / "m.csv", t=time, N=np.ones(4000), u=np.round(moved + hum, 2), T=0.2 + 0 * time
    )
    assert any(
        "12.3 Hz" in text
        for label, text in hs.load(tmp_path / "s.toml").measurement().remarks
        if label == "hum"
    )


# ---------------------------------------------------------------- a rounded clock, or none


@fixture
def rounded(folder):
    """The clock of the record to 10 ms, which four samples share, and the scenario with and without it."""
    load = 0.01 * np.clip(CLEAN / 30, -1, 1)
    write_columns(
        folder / "m.csv",
        t=np.floor(TIME * 100 + 1e-9) / 100,
        N=np.full(TIME.size, 0.05),
        u=CLEAN + HUM,
        T=load,
    )
    text = scenario_text(NOTCHED)
    path = folder / "s.toml"

    def write(text=text, rate=""):
        path.write_text(text.replace('file = "m.csv"', f'file = "m.csv"\n{rate}'), encoding="utf-8")
        return path

    return write, text


def without_clock(text):
    return "\n".join(line for line in text.splitlines() if not line.startswith("time"))


def test_a_filter_on_a_rounded_clock_names_the_rate(rounded):
    write, _ = rounded
    with refused(r'samples are 0.01 s apart after .* as in rate = "400.3 Hz"'):
        hs.load(write()).measurement()


@mark.filterwarnings("ignore:.*the tangential displacement turns")
def test_a_rate_in_place_of_the_clock_filters_and_keeps_every_sample(rounded):
    write, text = rounded
    path = write(without_clock(text), 'rate = "400 Hz"')
    found = hs.load(path).measurement()
    assert found.time == approx(TIME, abs=1e-9)
    assert np.abs(found["tangential_displacement"] - 1e-9 * CLEAN)[800:-800].max() < 0.1e-9
    assert dict(found.remarks)["clock"] == "400 Hz, from 0 s"
    assert hs.run(path).sizes["step"] == TIME.size


@mark.parametrize(
    "rate, expected",
    [
        ("", "notch: needs the times of the record; .* as in loading.rate"),
    ],
)
def test_a_missing_clock_and_a_wrong_rate_are_errors(rounded, rate, expected):
    write, text = rounded
    with refused(expected):
        hs.load(write(without_clock(text), rate))


@mark.filterwarnings("ignore:.*the tangential displacement turns")
def test_repeated_times_are_counted_and_the_rate_is_named(rounded):
    write, text = rounded
    plain = text.replace(', notch = "50 Hz"', "")
    remark = dict(hs.load(write(plain)).measurement().remarks)["file"]
    assert remark.startswith(
        "3,600 of 4,800 samples have the time of the sample before, the first one at line 3"
    )
    assert "rate =" in remark
    with warns(UserWarning, match="3,600 of 4,800 samples have the time of the sample before"):
        assert hs.run(write(plain)).sizes["step"] == 1200
    with refused("rise from sample to sample; if the clock was rounded, give the constant"):
        hs.load(write(plain, 'interval = "20 ms"')).measurement()


def test_several_filters_act_in_turn(folder):
    keys = "median = 3, notch = [50, 100], low_pass = '120 Hz'"
    found = hs.load(
        written(folder, {"tangential_displacement": f'{{ column = "u", unit = "nm", {keys} }}'})
    ).measurement()
    assert np.abs(found["tangential_displacement"] - 1e-9 * CLEAN)[800:-800].max() < 0.6e-9
