"""Experiments, and records that were measured or simulated with noise."""

import json
from pathlib import Path

import impacts
import numpy as np
import pytest
import synthetic
from records_shared import DAMPER, DAMPER_SCENARIO

import historysim as hs

MEASURED = {
    # angles of incidence [°], and what was measured there
    "tangential restitution": [
        (9.8, 0.675), (20.2, 0.599), (30.4, 0.690), (39.5, 0.774), (49.6, 0.848), (71.1, 0.937), (79.2, 0.970),
        (85.2, 0.979),
    ],
    "angle of the surface's rebound": [
        (9.7, -1.1), (20.3, -8.5), (30.2, -2.6), (39.1, 9.9), (49.5, 30.0), (59.9, 50.0), (70.5, 66.9), (78.9, 78.9),
        (84.8, 85.7),
    ],
    "spin": [
        (10.9, 261), (21.1, 574), (31.1, 612), (39.0, 595), (50.2, 450), (60.1, 376), (70.0, 243), (78.6, 142),
    ],
}  # fmt: skip


def test_oblique_impacts(page):
    """Measured oblique impacts

    Compared with **the experiment of Kharaz, Gorham and Salman** (*Powder Technol.* 120, 2001,
    281): spheres of aluminium oxide of 5 mm hit thick glass at 3.9 m/s under many angles. Their
    points are as read from the figures of Y. C. Chung and J. Y. Ooi (*Granular Matter* 13, 2011,
    643) by the authors of Kratos. The friction coefficient, 0.092, is theirs, and nothing is
    fitted. The impact is integrated with `ContactBatch` (`tests/scripts/impacts.py`).

    The model ends where the materials lose energy by themselves: the measured normal restitution is
    0.98, and here it is 1. Points below 9° are left out; there a few degrees of spin before the
    impact decide.
    """

    def rebounds(angles):
        import impacts

        impact, friction = impacts.TEST_4, 0.092
        found = impacts.rebound(impact, friction, np.radians(angles))
        restitution = found.tangential / (impact.speed * np.sin(np.radians(angles)))
        surface = np.degrees(np.arctan2(found.surface, -found.normal))
        spin = (found.tangential - found.surface) / impact.radius  # rad/s
        return restitution, surface, spin

    angles = np.linspace(3, 87, 85)
    curves = dict(zip(MEASURED, page.shows(rebounds, angles), strict=True))
    for name, bound, unit in (
        ("tangential restitution", 0.05, "1"), ("angle of the surface's rebound", 4.5, "1°"), ("spin", 75.0, "1 rad/s")
    ):  # fmt: skip
        at, measured = np.array(MEASURED[name]).T
        found = np.interp(at, angles, curves[name])
        page.row(name, measured, found, bound, "reading of a figure, e = 0.98", of=unit, scale=1)

    @page.picture
    def draw(axes):
        axes.plot(angles, curves["tangential restitution"], label="found")
        axes.plot(*np.array(MEASURED["tangential restitution"]).T, "k.", label="measured")
        axes.set(xlabel="angle to the normal (°)", ylabel="tangential restitution")


def test_impacts_along_the_normal(page):
    """Impacts along the normal

    Compared with **the closed forms of Hertz** for the greatest load and the duration, in tests 1
    and 2 of Chung and Ooi (2011): glass, limestone and two alloys.

    The model ends where the time step does: the leap-frog method is the reader's, in 2000 steps,
    and the contact itself has no step.
    """

    def hits():
        import impacts

        cases = [*impacts.TEST_1.values(), *impacts.TEST_2.values()]
        found = [impacts.rebound(impact) for impact in cases]
        return cases, found

    cases, found = page.shows(hits)
    loads, expected = (
        [each.greatest_load for each in found],
        np.array([each.greatest_load for each in cases]),
    )
    page.row("greatest load [N]", expected, loads, 3e-6, "leap-frog, 2000 steps", of="the largest")
    page.row(
        "duration [s]", [each.duration for each in cases], [each.duration for each in found], 2 / impacts.STEPS,
        "a step", of="the longest",
    )  # fmt: skip

    @page.picture
    def draw(axes):
        names = ["glass", "limestone", "Al alloy", "Mg alloy"]
        axes.bar(names, np.array(loads) / expected - 1, color="0.5")
        axes.set(ylabel="greatest load over Hertz, less 1")


@pytest.mark.slow
def test_intervals(page):
    """Intervals of a fit hold the truth as often as they say

    Compared with **100 simulated records** of a ball whose friction and stiffness are known, with
    the noise of an instrument (seeds 0 to 99): how many intervals of 95 % hold the truth.

    The model ends where the record does not come from the model: then the fit says so in a note.
    The page of the tests has more kinds of noise and scatter.
    """

    def intervals():
        import synthetic

        fits, loops, _, reach = synthetic.held("white_noise", range(100))
        friction, stiffness = np.sum(fits, axis=0)
        return friction, stiffness, np.sum(loops), reach

    friction, stiffness, loops, reach = page.shows(intervals)
    for name, held in (
        ("friction", friction),
        ("stiffness in series", stiffness),
        ("friction of loops", loops),
    ):
        page.row(f"{name}: intervals of 100", 95, held, 6, "binomial, once in 200", of="1", scale=1)

    @page.picture
    def draw(axes):
        axes.set_xscale("log")
        axes.hist(
            100 * np.array(reach),
            bins=np.geomspace(0.01, 3, 40),
            label=["friction", "stiffness"],
            color=["0.3", "0.7"],
        )
        axes.set(xlabel="half width of the interval (%)", ylabel="records")


def test_recovered_parameters(page):
    """A fit finds what a record was made with

    Compared with **the truth of a simulated record** without noise: 16 loops of a ball at two
    loads, from a start that is 30 % off.

    The model ends where two parameters do the same to a loop: then the interval is wide, and the
    fit says so.
    """

    def recovered():
        import synthetic

        from historysim.measured.fitting import fit_parameters
        from historysim.measured.observation import observe

        record = synthetic.measured("ball", 0, noise=0.0)
        start = {name: 1.3 * value for name, value in synthetic.TRUTHS["ball"].items()}
        found = fit_parameters(synthetic.model("ball"), start, observe(record))
        return record, found

    record, found = page.shows(recovered)
    for name, truth in synthetic.TRUTHS["ball"].items():
        page.row(name, truth, found.values[name], 5e-5, "turns are sought beyond the samples")

    @page.picture
    def draw(axes):
        axes.plot(1e9 * record["tangential_displacement"], 1e3 * record["tangential_load"], lw=0.7)
        axes.set(xlabel="displacement (nm)", ylabel="tangential load (mN)")


@pytest.mark.slow
@pytest.mark.skipif(
    not DAMPER.is_file(), reason="the measured record of a friction damper is not there"
)
def test_damper(page):
    """Loops of a measured friction damper

    Compared with **sums over the rows of the record** by quadrature, and the plateaus one reads off
    its picture: a banded rotary friction device, 14 s at 0.5 Hz (A. Downey and others, *Eng.
    Struct.* 113, 2016; data of the ARTS Laboratory, CC BY-SA 4.0). A ball behind a spring is fitted
    to it.

    The model ends here: one sphere does not know the backlash of the device, and its misfit is 204
    times the noise. The fit says so in its notes, names a free play of 3 mm, and its energy per
    loop is 10 % off.
    """

    def damper(scenario):
        loops = hs.loops(scenario)
        model = hs.fit(scenario).comparison.model  # its loops
        return loops, model

    Path("damper.toml").write_text(DAMPER_SCENARIO, encoding="utf-8")
    loops, model = page.shows(damper, "damper.toml")
    rows = np.array(json.loads(DAMPER.read_text(encoding="utf-8"))["data"])
    displacement, load = rows[:, 1] * 0.0254, rows[:, 2] * 4448.2216152605
    page.row("whole loops", 6, len(loops), 0, "one in 2 s", of="1", scale=1)
    pieces = sum(np.trapezoid(load[a : b + 1], displacement[a : b + 1]) for a, b in loops.left_out)
    ends = loops.ends[:, [0, 2]]
    closing = (
        (displacement[ends[:, 0]] - displacement[ends[:, 1]]) * load[ends].mean(axis=1)
    ).sum()
    work = np.trapezoid(load, displacement)
    # loops are closed by straight lines
    page.row(
        "work on the damper [J]",
        work,
        loops.dissipated_energy.sum() - closing + pieces,
        1e-6,
        "the same rows",
    )
    plateaus = 4448.2216 * np.array([3.15, 4.1])
    sides = [loops.statistics("friction_force", side).mean for side in ("forward", "backward")]
    page.row(
        "friction force forward and backward [N]",
        plateaus,
        sides,
        0.03,
        "reading of a picture",
        of="the larger",
    )
    measured, found = loops.dissipated_energy[1:].mean(), model.dissipated_energy[1:].mean()
    page.row(
        "energy per loop of the fitted ball [J]", measured, found, 0.2, "known: not the right model"
    )

    @page.picture
    def draw(axes):
        axes.plot(1e3 * displacement[::8], 1e-3 * load[::8], "0.6", lw=0.6)
        trace = model.trace
        axes.plot(1e3 * trace.displacement, 1e-3 * trace.tangential_load, "k", lw=0.8)
        axes.set(xlabel="displacement (mm)", ylabel="force (kN); grey: measured")
