"""What an ordinary replay compiles, compiled ahead of it: ``python -m historysim.ahead``.

An installation does it, so that the first run need not. It is of use after numba was replaced by another version, too.
"""

from historysim.asperities.ensemble import Ensemble
from historysim.contact.materials import MaterialPair, material
from historysim.loads.events import NormalLoad, TangentialDisplacement, TangentialLoad
from historysim.loads.schedule import stretches
from historysim.memory.rows import blank_rows


def compile_ahead() -> None:
    """Have all compiled that replays, and steps by hand, need where nothing wears."""
    contact = Ensemble(MaterialPair(material("silicon"), material("float glass")), [0.0, -30e-9], 10e-6, 0.2)
    events = [NormalLoad(0.0, 4e-3), TangentialDisplacement(1.0, 1e-8), TangentialLoad(2.0, 1e-5)]
    state = contact.initial_state()
    for stretch in stretches(events, 1, len(events)):
        rows = blank_rows(stretch.row_time.size, len(contact))
        state = contact.walk(state, stretch.paths, rows=rows, asperities=range(len(contact)))
    contact.approach_at(state.normal_load)
    contact.stepper(state).slopes()
    state = contact.advance(contact.with_friction(state, 0.3), tangential_displacement=0.0)
    for quantity in ("tangential_stiffness", "slip_share"):
        getattr(state, quantity)


if __name__ == "__main__":
    compile_ahead()
