"""States given where they do not belong: refused with a sentence, whatever entry they are given to."""

import pickle
import struct
import subprocess
import sys
import threading

import attrs
import numpy as np
from foreign_states import ENTRIES, IDENTITY, PAIR, SOFT, Calls, ensembles, sealed
from golden import refused
from pytest import mark, raises

import historysim as hs
from historysim.asperities import laws, wear

HEIGHTS = (0.0, -1e-8, -2e-8)
THREE = hs.Ensemble(PAIR, HEIGHTS, 1e-5, 0.2)
MANY = hs.Ensemble(PAIR, np.append(0.0, np.linspace(-1e-7, 0.0, 4999)), 1e-5, 0.2)
YIELDING = hs.Ensemble(
    PAIR, HEIGHTS, 1e-5, 0.2, yielding=hs.yielding.Thornton(hardness=4e9, poissons_ratio=0.3)
)
OTHERS = {
    "materials": hs.Ensemble(SOFT, HEIGHTS, 1e-5, 0.2),
    "summits": hs.Ensemble(PAIR, (0.0, -1e-8, -3e-8), 1e-5, 0.2),
    "unit of length": hs.Ensemble(PAIR, np.multiply(HEIGHTS, 1e3), 1e-2, 0.2),
    "friction": hs.Ensemble(PAIR, HEIGHTS, 1e-5, 0.3),
    "law": hs.Ensemble(PAIR, HEIGHTS, 1e-5, laws.ShearStrength(3e8)),
    "wear": hs.Ensemble(
        PAIR, HEIGHTS, 1e-5, 0.2, wear=wear.ArchardWear(coefficient=1e-4, hardness=6e9)
    ),
    "yielding": YIELDING,
    "hardness": hs.Ensemble(
        PAIR, HEIGHTS, 1e-5, 0.2, yielding=hs.yielding.Thornton(hardness=5e9, poissons_ratio=0.3)
    ),
    "slid distances": hs.Ensemble(PAIR, HEIGHTS, 1e-5, 0.2, follow_sliding=True),
    "number": MANY,
}


def pressed(ensemble, load=1e-3):
    return ensemble.advance(ensemble.initial_state(), normal_load=load)


@mark.parametrize("entry", ENTRIES, ids=lambda entry: entry.__name__)
@mark.parametrize(
    "ensemble, state", [(MANY, THREE), (THREE, MANY), (YIELDING, MANY), (YIELDING, THREE)]
)
def test_a_state_of_another_ensemble_is_refused_by_every_entry(ensemble, state, entry):
    with refused(r"the state is of .* asperit.*expected one of this ensemble's"):
        entry(ensemble, pressed(state), np.random.default_rng(0))


@mark.parametrize("what", OTHERS)
def test_a_state_belongs_to_materials_summits_friction_and_laws(what, tmp_path):
    path = tmp_path / "one.state"
    for one, other in ((THREE, OTHERS[what]), (OTHERS[what], THREE)):
        pressed(one).save(path)
        with refused(r"one.state: the state is of .*; expected one of this ensemble's"):
            other.load_state(path)
        with refused("the state is of"):
            other.stepper(pressed(one))


def test_ensembles_that_are_built_alike_take_one_another_s_states():
    again = [
        hs.Ensemble(PAIR, HEIGHTS, 1e-5, 0.2, x=[1, 2, 3], tolerance=1e-4),
        pickle.loads(pickle.dumps(THREE)),
    ]
    for ensemble in again:
        assert ensemble.advance(pressed(THREE), normal_load=2e-3) == pressed(ensemble, 2e-3)
    changed = THREE.with_friction(
        THREE.with_geometry(pressed(THREE), summit_radius=2e-5, asperities=[0]), 0.1
    )
    assert again[0].advance(changed, normal_load=2e-3) == THREE.advance(changed, normal_load=2e-3)


def test_what_a_state_belongs_to_is_the_same_in_another_process():
    code = "import sys; sys.path.insert(0, sys.argv[1]); import numpy as np; from foreign_states import ensembles\n"
    code += "print(*(one.initial_state().memory.line.identity for one in ensembles(np.random.default_rng(0))))"
    folder = sys.modules["foreign_states"].__file__.rpartition("foreign_states")[0]
    done = subprocess.run(
        [sys.executable, "-c", code, folder], capture_output=True, text=True, check=True
    )
    here = [
        ensemble.initial_state().memory.line.identity
        for ensemble in ensembles(np.random.default_rng(0))
    ]
    assert len(set(here)) == len(here)
    assert [int(word) for word in done.stdout.split()] == here


def test_a_forged_identity_does_not_open_another_ensemble():
    content = bytearray(pressed(MANY).to_bytes())
    struct.pack_into("=Q", content, IDENTITY, THREE.initial_state().memory.line.identity)
    state = hs.State.from_bytes(sealed(content))
    with refused("the state is of 5,000 asperities"):
        THREE.advance(state, normal_load=1e-3)


def test_random_calls_with_foreign_and_forged_states_end():
    calls = Calls(0)
    for _ in range(300):
        calls.one()
    assert calls.counts["refused"] > 50


def test_a_law_of_one_s_own_gets_arrays_that_it_may_keep():
    kept = []

    @attrs.frozen
    class Keeps(laws.FrictionLaw):
        kind, depends_on = "keeps", "own"
        text = "keeps what it gets"

        def coefficients(self, loaded):
            kept.extend([loaded.normal_load, loaded.summit_radius, loaded.slid_distance])
            return np.full(loaded.normal_load.size, 0.2)

    pressed(hs.Ensemble(PAIR, HEIGHTS, 1e-5, Keeps()))
    assert kept
    assert all(array.flags.owndata for array in kept)


def test_an_onset_of_yield_that_is_no_number_for_each_summit_is_refused():
    @attrs.frozen
    class Short(hs.yielding.YieldingLaw):
        kind, text = "short", "of one summit"

        def critical_approach(self, summit_radius, pair):
            return np.full(min(summit_radius.size, 2), 1e-9 * bool(pair))

        def first_loading(self, approach, summit_radius, pair):
            load = 4 / 3 * pair.contact_modulus * np.sqrt(summit_radius * 1e-9) * 1e-9
            return load * (approach / 1e-9), np.sqrt(summit_radius * approach)

    ensemble = hs.Ensemble(PAIR, HEIGHTS, 1e-5, 0.2, yielding=Short())
    with refused("critical approaches"):
        ensemble.advance(ensemble.initial_state(), normal_load=1e-3)


def at_once(work, threads=4):
    """Do work in several threads, and return what was raised there."""
    raised = []

    def run():
        try:
            work()
        except hs.InputError as error:
            raised.append(str(error))

    runners = [threading.Thread(target=run) for _ in range(threads)]
    for runner in runners:
        runner.start()
    for runner in runners:
        runner.join()
    return raised


def test_one_batch_in_several_threads_says_so_or_works():
    batch, rng = hs.ContactBatch(PAIR, 1e-3, 0.3, 5000), np.random.default_rng(0)
    displacements = rng.uniform(-1e-9, 1e-9, (40, 5000))

    def work():
        for displacement in displacements:
            batch.step(np.full(5000, 5e-9), displacement)

    raised = at_once(work)
    assert all("is in use, by another thread" in text for text in raised)
    batch.step(np.full(5000, 5e-9), displacements[0])
    assert np.isfinite(batch.tangential_load).all()


@mark.filterwarnings("ignore:the stepper")
def test_one_stepper_in_several_threads_says_so_or_works():
    stepper = MANY.stepper(pressed(MANY, 1.0))

    def work():
        for size in np.geomspace(1e-8, 1e-10, 300):
            stepper.step(tangential_displacement=size)
            stepper.step(tangential_displacement=-size)
            stepper.save()

    raised = at_once(work)
    assert all("is in use, by another thread" in text for text in raised)
    assert np.isfinite(stepper.save().tangential_load)


def test_a_place_that_is_taken_is_given_back_after_an_error():
    stepper = THREE.stepper(pressed(THREE))
    for _ in range(2):
        with raises(hs.FrictionLimitError):
            stepper.step(tangential_load=1.0)
    with (
        stepper._guard,
        refused(r"the stepper is in use.*expected a stepper for each thread"),
    ):
        stepper.step(tangential_displacement=1e-9)
    stepper.step(tangential_displacement=1e-9)


def test_a_batch_is_restored_from_its_own_kind_alone():
    batch = hs.ContactBatch(PAIR, 1e-3, 0.3, 2)
    for other in (
        hs.ContactBatch(PAIR, 1e-3, 0.2, 2),
        hs.ContactBatch(PAIR, 2e-3, 0.3, 2),
        hs.ContactBatch(SOFT, 1e-3, 0.3, 2),
    ):
        with refused("other radii, friction or materials"):
            batch.restore(other.save())


OWN_LAWS = {
    "constant": None,
    "power": laws.PowerLaw(0.3, 1e-5, -0.2),
    "total": laws.PowerLaw(0.3, 1e-5, -0.2, load="total"),
    "slid": laws.SlidFriction([0.0, 1e-8, 1e-7], [0.35, 0.25, 0.2]),
}
CHANGES = {
    "no change": {},
    "truncated": {"wear": wear.ArchardWear(coefficient=1e-1, hardness=1e10)},
    "blunted": {"wear": wear.ArchardWear(coefficient=1e-2, hardness=1e10, shape="blunted")},
    "yielding": {"yielding": hs.yielding.Thornton(hardness=4e9, poissons_ratio=0.3)},
}


@mark.parametrize("law", OWN_LAWS)
@mark.parametrize("change", CHANGES)
@mark.parametrize("seed", range(3))
def test_a_state_with_equal_heights_is_read_from_its_own_bytes(law, change, seed):
    rng = np.random.default_rng(seed)
    count = int(rng.integers(2, 6))
    height, radius = -rng.choice([0.0, 0.0, 5e-9, 1e-8], count), rng.choice([1e-6, 2e-6], count)
    friction = rng.choice([0.0, 0.05, 0.2, 0.7], count) if OWN_LAWS[law] is None else OWN_LAWS[law]
    ensemble = hs.Ensemble(PAIR, height, radius, friction, **CHANGES[change])
    state = ensemble.initial_state()
    for displacement in rng.choice([-1, 1], 5) * 10.0 ** rng.uniform(-9, -6.5, 5):
        approach = float(rng.uniform(2e-9, 3e-8))
        state = ensemble.advance(
            state, normal_displacement=approach, tangential_displacement=float(displacement)
        )
        read = ensemble.state_from_bytes(state.to_bytes())
        assert read == pickle.loads(pickle.dumps(state)) == state
        onwards = [
            ensemble.advance(s, normal_displacement=2e-8, tangential_displacement=1e-8)
            for s in (state, read)
        ]
        assert onwards[0].to_bytes() == onwards[1].to_bytes()
