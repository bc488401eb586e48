# The pictures, each with the place where it stands.

from historysim.results.plots.adhesion_branch import plot_adhesion_branch as plot_adhesion_branch
from historysim.results.plots.adhesion_map import plot_adhesion_map as plot_adhesion_map
from historysim.results.plots.animation import animate_contact_map as animate_contact_map
from historysim.results.plots.animation import save_animation as save_animation
from historysim.results.plots.contact_map import plot_contact_map as plot_contact_map
from historysim.results.plots.load_history import plot_history as plot_history
from historysim.results.plots.loop import plot_loop as plot_loop
from historysim.results.plots.loop_curves import plot_loops as plot_loops
from historysim.results.plots.measured_and_model import plot_comparison as plot_comparison
from historysim.results.plots.single_asperity import plot_asperity as plot_asperity
from historysim.results.plots.slip_map import plot_slip_map as plot_slip_map
from historysim.results.plots.stiffness_curve import plot_stiffness as plot_stiffness
from historysim.results.plots.summit_scatter import plot_heights as plot_heights
from historysim.results.plots.summit_scatter import plot_summit_scatter as plot_summit_scatter
from historysim.results.plots.surface import plot_distribution as plot_distribution
from historysim.results.plots.surface import plot_surface as plot_surface
from historysim.results.plots.swept import plot_bars as plot_bars
from historysim.results.plots.swept import plot_swept as plot_swept
from historysim.results.plots.together import LoopMarks as LoopMarks
from historysim.results.plots.together import plot_together as plot_together
from historysim.results.plots.traction_profile import plot_slip_fronts as plot_slip_fronts
from historysim.results.plots.traction_profile import plot_traction as plot_traction
from historysim.results.plots.worn_summits import plot_wear as plot_wear
