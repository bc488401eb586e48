"""Fig. 4.8: traction over the diameter of the contact, one ellipse for each load, Si (a) and SiO₂ (b) on glass.

The maximum is 3F/2πa² (Eq. 4.4 prints a³) on the contact area of Hertz. The source takes the
measured F, which it has in a picture alone, and as F ∝ N^0.7 (4.4.1): the maximum then rises with
the load, and more slowly at a high load, as 4.4.3 says. F = τ₀A on the area of adhesive contact
(JKR) gives the opposite order, high at low load and then level, as 4.6 says; constant μ lets it
rise as N^(1/3). Assumed: all three have the μ of Fig. 4.1 at 50 mN.
"""

# historysim gallery: example

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

import historysim as hs

LOADS = np.array([10e-3, 30e-3, 50e-3, 70e-3, 90e-3])
BALLS = {"a  Si": ("silicon", 0.12), "b  SiO₂": ("silica", 0.1)}
LAWS = ("F ∝ N^0.7, as measured", "F = τ₀A of JKR", "F = μN")
RADIUS, REFERENCE = 2.5e-3, 50e-3


def _law(name: str, pair: hs.MaterialPair, friction: float) -> float | hs.laws.FrictionLaw:
    if name == LAWS[0]:
        return hs.laws.PowerLaw(friction, reference_load=REFERENCE, exponent=-0.3)
    if name == LAWS[2]:
        return friction
    work = pair.work_of_adhesion
    # τ₀ that gives the told μ on the area of JKR
    area = (
        np.pi
        * hs.theory.adhesion.jkr_contact_radius(
            REFERENCE,
            summit_radius=RADIUS,
            contact_modulus=pair.contact_modulus,
            work_of_adhesion=work,
        )
        ** 2
    )
    strength = friction * REFERENCE / area
    return hs.laws.ShearStrength(strength, area="jkr", work_of_adhesion=work)


def _slid(ball: str, law: str) -> xr.Dataset:
    """Return a ball that slides at each load, one after the other: at every second step."""
    material, friction = BALLS[ball]
    pair = hs.MaterialPair(hs.material(material), hs.material("float glass"))
    ensemble = hs.Ensemble(pair, 0.0, RADIUS, friction=_law(law, pair, friction))
    events: list[hs.events.Event] = []
    for number, load in enumerate(LOADS):
        held = hs.TangentialDisplacement(2.0 * number, 40e-9 * number)
        events += [hs.NormalLoad(2.0 * number, float(load)), held]
        events += [hs.NormalLoad(2.0 * number + 1, float(load))]
        events += [hs.TangentialDisplacement(2.0 * number + 1, 40e-9 * (number + 1))]
    return hs.replay(ensemble, events)


def calculated() -> xr.Dataset:
    """Return the greatest traction [Pa] over ball, law and normal load [N]."""
    values = np.empty((len(BALLS), len(LAWS), LOADS.size))
    for row, ball in enumerate(BALLS):
        for column, law in enumerate(LAWS):
            history = _slid(ball, law).isel(step=slice(1, None, 2), asperity=0)
            values[row, column] = (
                1.5 * history.tangential_load / (np.pi * history.contact_radius**2)
            )
    return xr.Dataset(
        {"greatest_traction": (("ball", "law", "normal_load"), values, {"units": "Pa"})},
        {
            "ball": list(BALLS),
            "law": list(LAWS),
            "normal_load": ("normal_load", LOADS, {"units": "N"}),
        },
    )


def drawn(found: xr.Dataset) -> list[Figure]:
    """Return a figure for each ball, with the three laws side by side on the same axes."""
    figures = []
    for ball in BALLS:
        figure = Figure(figsize=(11, 3.8), layout="constrained")
        figure.suptitle(f"Fig. 4.8 {ball}: traction over the diameter of the contact")
        for axes, law in zip(figure.subplots(1, 3, sharey=True), LAWS, strict=True):
            steps = tuple(range(1, 2 * LOADS.size, 2))
            labels = tuple(f"{load * 1e3:g} mN" for load in LOADS)
            looks = {
                "across": "diameter",
                "limit": False,
                "steps": steps,
                "labels": labels,
                "title": law,
            }
            hs.plots.traction(_slid(ball, law), ax=axes, **looks)
            axes.get_legend().set_loc("lower center")
        figure.axes[0].set_ylim(0, 1.05 * float(found.greatest_traction.sel(ball=ball).max()))
        figures.append(figure)
    return figures


if __name__ == "__main__":
    result = calculated()
    for name in BALLS:
        print((result.greatest_traction.sel(ball=name).to_pandas() / 1e6).round(2), "MPa")
    for letter, figure in zip("ab", drawn(result), strict=True):
        figure.savefig(f"fig_4_08{letter}_traction.png")
