"""Contents of the pictures of a history; their looks are covered by the reference pictures."""

import matplotlib as mpl
import numpy as np
from golden import refused
from overlapping import on_top_of_each_other
from pairs import COMPLIANT as PAIR
from pictured import friction_changes
from pytest import approx, fixture, mark, raises

import historysim as hs
from historysim.results import analysis, recompute
from historysim.results.plots.pictures import PICTURES, REPLACED
from historysim.scenario.kinds import kinds

pytestmark = mark.ci

ENSEMBLE = hs.Ensemble(
    PAIR, [0.0, -20e-9, -35e-9, -60e-9], [10e-6, 30e-6, 15e-6, 40e-6], [0.2, 0.12, 0.2, 0.2]
)


@fixture(scope="module")
def history():
    events = [hs.NormalLoad(0.0, 4e-3)]
    events += [
        hs.TangentialDisplacement(float(time), sign * 30e-9)
        for time, sign in ((1, 1), (2, -1), (3, 1))
    ]
    return hs.replay(ENSEMBLE, events, substeps=12)


@fixture(scope="module")
def planar():
    events = [hs.NormalLoad(0.0, 4e-3)]
    way = ((1, (30e-9, 0.0)), (2, (30e-9, 20e-9)), (3, (-10e-9, 20e-9)))
    events += [hs.TangentialDisplacement(float(time), both) for time, both in way]
    return hs.replay(ENSEMBLE, events, substeps=12)


# wear, yielding and pull-off are of what wears, yields or attracts alone
OF_ANY = tuple(
    name
    for name, kind in PICTURES.items()
    if "history" in kind.of and name not in {"wear", "yielding", "pull-off"}
)
OF_TWO_DIRECTIONS = {"hodograph", "slip-annulus"}


@mark.parametrize("picture", OF_ANY)
def test_every_picture_of_a_single_step_is_drawn_and_changes_nothing(history, planar, picture):
    history = planar if picture in OF_TWO_DIRECTIONS else history
    settings, before = dict(mpl.rcParams), history.copy(deep=True)
    options = {"asperity": 0} if picture == "cycles" else {}
    figure = hs.plot(history.isel(step=[-1]), picture=picture, size=(120, 100), **options)
    assert history.identical(before)
    assert dict(mpl.rcParams) == settings
    for axes in figure.axes:
        # each label of an axis has a unit
        assert "(" in axes.get_xlabel() or not axes.get_xlabel() or axes.get_label() == "<colorbar>"


def test_the_colour_of_the_loop_is_the_slipping_area(history):
    figure = hs.plot(history, picture="loops", colour="slip")
    (line,) = figure.axes[0].collections
    slipping = analysis.slip_shares(history)["slipping_area"].values
    # each piece has the share of the step that it leads to
    assert line.get_array().tolist() == slipping[1:].tolist()
    assert line.get_clim() == (0, 1)
    ends = np.array([segment[-1] for segment in line.get_segments()])
    assert ends[:, 0] == approx(history.tangential_displacement.values[1:])
    with refused("expected 'slip' or 'time'"):
        hs.plots.loops(history, colour="stick")
    with refused("the loop of one history"):
        hs.plots.loops([history] * 2, colour="slip")


def test_tractions_equal_the_profiles_of_the_asperity_at_each_step(history):
    figure = hs.plots.traction(history, asperity=1, steps=[3, 8, -1])
    lines = {line.get_label(): line for line in figure.axes[0].get_lines()}
    expected = recompute.profiles(history, 1, [3, 8, -1], 401)
    for row, step in enumerate((3, 8, 36)):
        line = lines[f"step {step}, {expected.time.values[row]:.4g} s"]
        # and where the contact ends
        assert line.get_ydata() == approx(np.append(expected.traction.values[row], 0.0))
    assert lines[r"$\pm\mu p$"].get_ydata() == approx(
        np.append(expected.friction_limit.values[-1], 0)
    )


def test_by_default_a_swing_is_drawn_until_the_asperity_slides(history):
    telling = history.contact.representative_step()
    heaviest = int(history.asperity[history.normal_load.values[telling].argmax()])
    axes = hs.plots.traction(history).axes[0]
    assert axes.get_title(loc="left") == f"Traction of asperity {heaviest}"
    steps = [
        int(text.split(",")[0][5:])
        for text in axes.get_legend_handles_labels()[1]
        if text.startswith("step")
    ]
    states = history.slip_state.sel(asperity=heaviest).values
    assert steps[0] <= telling
    # neither sooner nor later
    assert states[steps[-1]] == hs.SlipState.GROSS_SLIP
    assert (states[steps[0] + 1 : steps[-1]] != hs.SlipState.GROSS_SLIP).all()


def test_a_removed_picture_names_its_replacement(history, tmp_path):
    for name in REPLACED.keys() - {"loop"}:
        with refused(f"'{name}' was removed; expected"):
            hs.plot(history, picture=name)
        with raises(AttributeError, match="was removed; expected"):
            getattr(hs.plots, name.replace("-", "_"))
    (tmp_path / "s.toml").write_text('[picture]\nkind = "slip-map"\n', encoding="utf-8")
    with refused("kind: the picture 'slip-map' was removed"):
        hs.load(tmp_path / "s.toml")


def test_pictures_of_one_type_are_not_listed():
    listed = dict(kinds())["plots"].split(", ")
    assert {"history", "loops", "traction", "surface", "curve"} <= {*listed}
    assert not {"comparison", "table", "measured-loops", "asperity"} & {*listed}


def test_pictures_of_asperities_need_recorded_asperities(history):
    totals = history.drop_dims("asperity")
    for picture, options in (
        ("loops", {"colour": "slip"}),
        ("history", {"panels": ["states"]}),
        ("traction", {}),
    ):
        with refused("expected one recorded with asperities"):
            hs.plot(totals, picture=picture, **options)
    hs.plot(totals, picture="stiffness")


def test_asperity_pictures_of_separated_bodies_are_refused():
    apart = hs.replay(ENSEMBLE, [hs.NormalDisplacement(0.0, -1e-9)])
    for options in ({"panels": ["states"]}, {"picture": "traction"}):
        with refused("no asperity ever touches"):
            hs.plot(apart, **options)
    for picture in ("history", "contact-map"):
        hs.plot(apart, picture=picture).draw_without_rendering()


def test_pictures_without_patch_data_are_refused():
    approach = np.linspace(0, 1e-7, 20)
    load = np.stack([approach**1.5, np.clip(approach - 2e-8, 0, None) ** 1.5], axis=1)
    area = np.stack([approach, np.clip(approach - 2e-8, 0, None)], axis=1) * 3e-5
    moves = [hs.NormalDisplacement(0.0, 8e-8), hs.TangentialDisplacement(1.0, 1e-8)]
    for areas in (area, None):
        patches = hs.replay(
            hs.Patches.from_normal_curves(PAIR, approach, load, area=areas, friction=0.2), moves
        )
        with refused("is of patches of an interacting contact, which have no"):
            hs.plot(patches, picture="traction")
        hs.plot(patches, panels=["states"]).draw_without_rendering()


def test_a_path_in_the_plane_fits_its_size(planar):
    both = hs.plot(planar, picture="hodograph")
    assert [axes.get_xlabel() for axes in both.axes] == [
        "displacement $U_x$ (nm)",
        "tangential load $T_x$ (mN)",
    ]
    assert both.notices == ()
    for size, panels in (((90, 120), 2), ((180, 120), 2), ((90, 70), 1)):
        figure = hs.plot(planar, picture="hodograph", size=size)
        assert on_top_of_each_other(figure) == []
        assert len(figure.axes) == panels
    assert figure.notices == ("at 90 × 70 mm there is no room for the tangential load",)


def test_the_friction_limit_of_each_state_uses_its_friction():
    changing = friction_changes()
    (axes,) = hs.plot(changing, picture="traction", steps=["A", "D"]).axes
    # Hertz
    modulus, load = changing.attrs["contact_modulus"], 50e-3
    peak = (6 * load * modulus**2 / (np.pi**3 * 2.5e-3**2)) ** (1 / 3)
    limits = {
        line.get_label(): line.get_ydata().max()
        for line in axes.get_lines()
        if "mu p" in line.get_label()
    }
    assert limits == {
        r"$\pm\mu p$, $\mu$ = 0.2": approx(0.2 * peak),
        r"$\pm\mu p$, $\mu$ = 0.4": approx(0.4 * peak),
    }


def test_a_picture_is_drawn_into_a_figure_or_a_part_of_it_and_returns_it(history):
    from matplotlib import pyplot as plt

    given = plt.figure(figsize=(7, 5))
    assert hs.plot(history, figure=given) is given
    assert given.axes
    left, right = plt.figure(figsize=(10, 5), layout="constrained").subfigures(1, 2)
    assert hs.plot(history, picture="contact-map", figure=right) is right
    assert right.axes
    assert not left.axes
    plt.close("all")


def test_a_picture_of_one_panel_is_drawn_into_axes_and_returns_them(history):
    from matplotlib import pyplot as plt

    _, (first, second) = plt.subplots(1, 2)
    assert hs.plot(history, picture="loop", ax=second) is second
    assert second.has_data()
    assert not first.has_data()
    # names of lines do not cover the adjacent axes
    assert not first.figure.legends
    plt.close("all")


def test_pictures_of_several_panels_need_a_figure(history):
    from matplotlib import pyplot as plt

    _, ax = plt.subplots()
    with refused("ax: this picture has 2 panels"):
        hs.plot(history, picture="stiffness", ax=ax)
    assert hs.plots.history(history, panels=["loop"], ax=ax) is ax
    with refused("expected one of them"):
        hs.plots.loops(history, ax=ax, size=(90, 70))
    with refused("ax is a Figure"):
        hs.plots.loops(history, ax=ax.figure)
    plt.close("all")


def test_a_size_in_which_nothing_can_be_read_is_refused(history):
    with refused("size is 30 × 25 mm"):
        hs.plot(history, size=(30, 25))
