"""A user's own laws, in Python and for arrays, give what those of the library give that say the same."""

import attrs
import numpy as np
from golden import refused
from pairs import PLAIN as PAIR
from pytest import approx, mark, raises

import historysim as hs
from historysim.asperities import laws, wear
from historysim.contact import hertz

HEIGHT, RADIUS = np.array([0.0, -0.004, -0.02]), np.array([1.0, 0.7, 1.4])
MOVES = [
    {"normal_displacement": 0.02},
    {"tangential_displacement": 0.004},
    {"normal_displacement": 0.03, "tangential_displacement": -0.002},
    {"tangential_displacement": 0.02},
    {"normal_displacement": 0.001},
]


@attrs.frozen
class OwnStrength(laws.FrictionLaw):
    """Shear strength on Hertz' area, by the package's own formulas of one contact."""

    strength: float
    kind, depends_on, text = "own strength", "own", "of a test"

    def coefficients(self, loaded):
        shape = {"summit_radius": loaded.summit_radius}
        approach = hertz.approach(
            loaded.normal_load, contact_modulus=loaded.pair.contact_modulus, **shape
        )
        return (
            self.strength
            * np.pi
            * hertz.contact_radius(approach, **shape) ** 2
            / loaded.normal_load
        )


@attrs.frozen
class OwnSlid(laws.FrictionLaw):
    kind, depends_on, text = "own slid", "slid", "of a test"

    def coefficients(self, loaded):
        return np.interp(loaded.slid_distance, [0.0, 0.01], [0.4, 0.3])


@attrs.frozen(kw_only=True)
class OwnWear(wear.WearLaw):
    kind, text = "own wear", "of a test"

    def volume(self, normal_load, slid_distance, dissipated_energy):  # noqa: ARG002 - other laws need it
        return 1e-3 * normal_load * slid_distance


def end(**options):
    ensemble = hs.Ensemble(PAIR, HEIGHT, RADIUS, **{"friction": 0.4} | options)
    state = ensemble.initial_state()
    for move in MOVES:
        state = ensemble.advance(state, **move)
    return [
        state.normal_load,
        state.tangential_load,
        state.dissipated_energy,
        *state.evolved.slid_distance,
    ]


@mark.parametrize(
    "own, built_in",
    [
        ({"friction": OwnStrength(0.05)}, {"friction": laws.ShearStrength(0.05)}),
        ({"friction": OwnSlid()}, {"friction": laws.SlidFriction([0.0, 0.01], [0.4, 0.3])}),
        ({"wear": OwnWear()}, {"wear": wear.ArchardWear(coefficient=1e-3, hardness=1.0)}),
    ],
)
def test_an_own_law_agrees_with_the_library(own, built_in):
    assert end(**own) == approx(end(**built_in), rel=1e-9, abs=1e-12)


def test_a_law_of_the_library_says_its_coefficients():
    loaded = laws.Loaded(
        PAIR, np.array([0.01, 0.02]), 0.03, np.array([1.0, 0.7]), np.array([0.0, 0.005])
    )
    assert laws.ShearStrength(0.05).coefficients(loaded) == approx(
        OwnStrength(0.05).coefficients(loaded)
    )
    assert laws.SlidFriction([0.0, 0.01], [0.4, 0.3]).coefficients(loaded) == approx([0.4, 0.35])
    assert laws.PowerLaw(0.2, 0.01, -0.3).coefficients(loaded) == approx(
        0.2 * np.array([1.0, 2.0]) ** -0.3
    )
    assert laws.PowerLaw(0.2, 0.01, -0.3, "total").coefficients(loaded) == approx(
        [0.2 * 3.0**-0.3] * 2
    )
    energy = wear.EnergyWear(volume_per_energy=2.0).volume(
        np.ones(2), np.ones(2), np.array([0.5, -0.1])
    )
    assert energy.tolist() == [1.0, 0.0]


def test_what_an_own_law_raises_comes_out():
    class Failing(OwnSlid):
        def coefficients(self, loaded):
            raise ZeroDivisionError(f"{loaded.normal_load.size} asperities")

    class Silent(laws.FrictionLaw):
        kind, depends_on, text = "silent", "own", "of a test"

    class Interrupted(OwnSlid):
        def coefficients(self, loaded):  # noqa: ARG002 - the arguments of a law
            raise KeyboardInterrupt

    where = (
        r"the law 'own slid' fails in test_own_laws\.py, line \d+: ZeroDivisionError: \d asperities"
    )
    with refused(where) as caught:
        end(friction=Failing())
    assert isinstance(caught.value.__cause__, ZeroDivisionError)
    with refused("Silent has no coefficients"):
        end(friction=Silent())
    with raises(KeyboardInterrupt):
        end(friction=Interrupted())


@mark.parametrize(
    "returned, message",
    [
        (
            np.full(7, 0.2),
            r"the coefficients are an array \(7,\); expected a number for each of \d asperities",
        ),
        (None, "one of the coefficients is nan; expected a finite number of 0 or more"),
        ("rough", "the coefficients are 'rough'; expected a number"),
        (-0.1, r"one of the coefficients is -0\.1; expected a finite number of 0 or more"),
        (np.inf, "one of the coefficients is inf"),
    ],
)
def test_what_an_own_law_returns_is_checked(returned, message):
    class Odd(OwnSlid):
        def coefficients(self, loaded):  # noqa: ARG002 - the arguments of a law
            return returned

    with refused(f"the law 'own slid': {message}"):
        end(friction=Odd())


def test_volumes_of_an_own_law_are_checked_where_they_are_lost():
    class Endless(OwnWear):
        def volume(self, normal_load, slid_distance, dissipated_energy):
            # what is asked for when the ensemble is made has another load
            lost = super().volume(normal_load, slid_distance, dissipated_energy)
            return lost if normal_load[0] == 1e-3 else np.full_like(lost, np.nan)

    with refused("the law 'own wear': one of the volumes is nan"):
        end(wear=Endless())


def test_a_wear_law_that_depends_on_the_parts_of_a_way_is_reported():
    class Squared(hs.wear.WearLaw):
        kind, text = "squared", "squared"

        def volume(self, normal_load, slid_distance, dissipated_energy):
            return normal_load * dissipated_energy * slid_distance

    message = r"(?s)Squared: volume of three asperities is .*, of half the distance .*; expected .* half as much"
    with refused(message):
        hs.Ensemble(PAIR, 0.0, 1e-5, 0.2, wear=Squared())
