"""States that belong elsewhere, of other versions, and forged with a right checksum, given to every entry.

What is asked of the library: an answer, or one of its errors; never an endless run, nor anything
that a sanitizer sees.
"""

import pickle
import struct

import numpy as np
import pytest

import historysim as hs
from historysim.basics.library import ffi, lib
from historysim.memory.paths import Goals, straight_paths

PAIR = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
SOFT = hs.MaterialPair.from_moduli(contact_modulus=1e6, shear_modulus=3e5)
FORMAT, IDENTITY = 8, 64  # where these stand in the bytes of a state
ODD = (0.0, -0.0, 1.0, -1.0, 5e-324, 1e-300, 1e300, -1e300, np.inf, np.nan)
OURS = (hs.InputError, hs.FrictionLimitError, hs.LoadError)


def ensembles(rng):
    """Return ensembles of every kind, none of which is the same as another one."""

    def rough(count, friction=0.2, pair=PAIR, **options):
        heights = np.append(0.0, -np.abs(rng.normal(0.0, 1e-7, count - 1)))
        return hs.Ensemble(pair, heights, rng.uniform(0.5, 1.0, count) * 1e-5, friction, **options)

    approach = np.linspace(1e-9, 3e-7, 6)
    return [
        rough(1),
        rough(3),
        rough(3),
        rough(3, pair=SOFT),
        rough(9, rng.choice([0.1, 0.2, 0.3], 9)),
        rough(300),
        rough(4, follow_sliding=True),
        rough(4, hs.laws.ShearStrength(3e8)),
        rough(3, wear=hs.wear.ArchardWear(coefficient=1e-4, hardness=6e9)),
        rough(3, wear=hs.wear.ArchardWear(coefficient=1e-4, hardness=6e9, shape="blunted")),
        rough(5, yielding=hs.yielding.Thornton(hardness=4e9, poissons_ratio=0.3)),
        rough(6, yielding=hs.yielding.JacksonGreen(hardness=4e9, poissons_ratio=0.3)),
        hs.Patches.from_normal_curves(PAIR, approach, 1e6 * approach**1.6, friction=0.2),
    ]


def places(ensemble, rng):
    """Return an approach and a displacement that the contact can be moved to [m]."""
    reach = 0.5 * ensemble.pair.displacement_ratio * 0.2 * 2e-7
    return rng.uniform(-0.1, 1.0) * 2.5e-7, rng.uniform(-1.0, 1.0) * reach


def moved(ensemble, state, rng):
    """Return the state after a random path."""
    normal, tangential = places(ensemble, rng)
    return ensemble.advance(state, normal_displacement=normal, tangential_displacement=tangential)


def pressed(ensemble, state, rng):
    """Return the state after a ramp of loads, saturated."""
    load = ensemble.pair.contact_modulus * 1e-5**0.5 * (1e-7) ** 1.5 * rng.uniform(0.0, 2.0)
    return ensemble.advance(
        state, normal_load=load, tangential_load=rng.uniform(-0.3, 0.3) * load, saturate=True
    )


def stepped(ensemble, state, rng):
    """Return the state after a step of a stepper that continues from a state."""
    stepper = ensemble.stepper()
    stepper.restore(state)
    stepper.step(tangential_displacement=places(ensemble, rng)[1])
    stepper.slopes()
    return stepper.save()


def many(ensemble, state, rng):
    """Return the state after several paths."""
    return ensemble.advance_many(
        state, tangential_displacement=[places(ensemble, rng)[1] for _ in range(3)]
    )[0]


def walked(ensemble, state, rng):
    """Return the state after a path of which rows are recorded."""
    from historysim.memory.paths import blank_rows

    paths = straight_paths(Goals(1, places(ensemble, rng)[0]), Goals(1, places(ensemble, rng)[1]))
    return ensemble.advance_along(
        state, paths, rows=blank_rows(1, 1), asperities=[len(ensemble) - 1]
    )


def rubbed(ensemble, state, rng):
    """Return the state with other friction."""
    chosen = {"asperities": [len(ensemble) - 1]} if ensemble.has_radii else {}
    return ensemble.with_friction(state, rng.uniform(0.05, 0.4), **chosen)


def reshaped(ensemble, state, rng):
    """Return the state with another summit."""
    if not ensemble.has_radii:
        return asked(ensemble, state, rng)
    height, last = rng.uniform(-1e-7, 0.0), [len(ensemble) - 1]
    return ensemble.with_geometry(state, summit_height=height, asperities=last, saturate=True)


def asked(ensemble, state, _rng):
    """Ask for everything that a state says, and return it."""
    if not ensemble.has_radii:
        ensemble.superposition(state)
    else:
        asperity = ensemble.asperity(len(ensemble) - 1, state)
        asperity.traction(np.linspace(0.0, 1e-6, 5))
        repr(asperity)
    for name in (
        "stored_energy",
        "slip_share",
        "friction",
        "group",
        "evolved",
        "yielded",
        "contact_count",
    ):
        getattr(state, name)
    state.stiffness(1)
    state.vertices()
    return pickle.loads(pickle.dumps(state))


ENTRIES = (moved, pressed, stepped, many, walked, rubbed, reshaped, asked)


def sealed(content):
    """Return bytes with the checksum that belongs to them."""
    body = bytes(content[:-8])
    return body + struct.pack("=Q", lib.hs_digest(0, ffi.from_buffer(body), len(body)))


def forged(content, rng):
    """Return the bytes of a state with some numbers changed, and a right checksum."""
    made = bytearray(content)
    for _ in range(rng.choice([1, 1, 2, 3])):
        at = 8 * int(rng.integers(2, (len(made) - 8) // 8))
        (number,) = struct.unpack_from("=d", made, at)
        kind = rng.integers(6)
        with np.errstate(all="ignore"):
            if kind == 0:
                number = rng.choice(ODD)
            elif kind < 4:
                number *= 1.0 + rng.choice([-1.0, 1.0]) * 10.0 ** rng.integers(-12, 4)
        if kind == 4:
            made[at : at + 8] = made[
                (other := 8 * int(rng.integers(2, (len(made) - 8) // 8))) : other + 8
            ]
        elif kind == 5:
            made[at] ^= 1 << int(rng.integers(8))
        else:
            struct.pack_into("=d", made, at, number)
    return sealed(made)


class Calls:
    """Random calls, and what came of them.

    Attributes
    ----------
    counts : dict of str to int
        Calls by their kind, and forged states that were refused as they were read.
    """

    def __init__(self, seed):
        self.rng = np.random.default_rng(seed)
        self.ensembles = ensembles(self.rng)
        self.states = [ensemble.initial_state() for ensemble in self.ensembles]
        self.counts = dict.fromkeys(
            ("own", "foreign", "other version", "forged", "forged identity", "refused"), 0
        )

    def one(self):
        """Make one call, and see that it ends as it has to."""
        which, entry = (
            self.rng.integers(len(self.ensembles)),
            ENTRIES[self.rng.integers(len(ENTRIES))],
        )
        kind = self.rng.choice(
            ["own", "own", "foreign", "other version", "forged", "forged", "forged identity"]
        )
        self.counts[kind] += 1
        getattr(self, "_" + kind.replace(" ", "_"))(which, entry)

    def _own(self, which, entry):
        try:
            after = entry(self.ensembles[which], self.states[which], self.rng)
        except OURS:
            return
        # what is alike from the start on is worn out at last
        self.states[which] = (
            after if self.rng.random() < 0.98 else self.ensembles[which].initial_state()
        )

    def _foreign(self, which, entry):
        other = (which + self.rng.integers(1, len(self.ensembles))) % len(self.ensembles)
        self._is_refused(
            lambda: entry(self.ensembles[which], self.states[other], self.rng),
            "expected one of this",
        )

    def _other_version(self, which, _entry):
        content = bytearray(self.states[which].to_bytes())
        struct.pack_into("=I", content, FORMAT, int(self.rng.choice([0, 1, 2, 99])))
        self._is_refused(lambda: hs.State.from_bytes(sealed(content)), "another version")

    def _forged_identity(self, which, entry):
        other = (which + self.rng.integers(1, len(self.ensembles))) % len(self.ensembles)
        content = bytearray(self.states[other].to_bytes())
        struct.pack_into("=Q", content, IDENTITY, self.states[which].memory.line.identity)
        state = hs.State.from_bytes(sealed(content))
        try:
            entry(self.ensembles[which], state, self.rng)
        except OURS:
            self.counts["refused"] += 1

    def _forged(self, which, entry):
        ensemble = self.ensembles[which]
        like = self.states[which] if self.rng.random() < 0.5 else None
        try:
            state = hs.State.from_bytes(forged(self.states[which].to_bytes(), self.rng), like)
        except hs.InputError:
            self.counts["refused"] += 1
            return
        try:
            entry(ensemble, entry(ensemble, state, self.rng), self.rng)
        except OURS:
            return

    def _is_refused(self, call, said):
        with pytest.raises(hs.InputError, match=said):
            call()
